"""Pieces of a self-contained HTML page: text, tables and figures, with nothing to fetch."""

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape

from matplotlib import rc_context
from matplotlib.figure import Figure

from .figures import style

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.55 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; color: #1d2433;
  background: #f4f5f7; margin: 0; }
main { max-width: 70rem; margin: 2rem auto; background: #fff; padding: 2rem 3rem 3rem; border-radius: 8px;
  box-shadow: 0 1px 4px rgba(0,0,0,.12); }
h1 { font-size: 1.6rem; margin: 0 0 .25rem; }
h2 { font-size: 1.2rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid #dfe3ea; padding-bottom: .25rem; }
p, li { max-width: 54rem; }
.subtitle { color: #5b6475; margin: 0 0 1.2rem; }
.verdict { background: #eef4ff; border-left: 5px solid #2f6fde; padding: .9rem 1.2rem; border-radius: 4px;
  max-width: none; }
.verdict p { max-width: none; margin: .5rem 0; }
.verdict p:first-child { font-weight: 600; font-size: 1.06rem; }
.warning { background: #fff6e5; border-left: 5px solid #e09b1a; padding: .6rem 1.2rem; border-radius: 4px; }
.label { display: inline-block; background: #7a3db8; color: #fff; border-radius: 4px; padding: .1rem .6rem;
  font-size: .85rem; margin-bottom: .6rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .86rem; margin: .6rem 0; }
th, td { padding: .28rem .7rem; text-align: right; border-bottom: 1px solid #e6e9ef; white-space: nowrap; }
th { color: #445; font-weight: 600; border-bottom: 2px solid #c9cfda; white-space: normal;
  vertical-align: bottom; }
td:first-child, th:first-child { text-align: left; }
tr.chosen td { background: #eef4ff; font-weight: 600; }
caption { caption-side: bottom; text-align: left; color: #5b6475; font-size: .88rem; padding-top: .4rem;
  max-width: 54rem; }
figure { margin: 1rem 0; }
figure img { max-width: 100%; height: auto; }
figcaption { color: #5b6475; font-size: .9rem; max-width: 54rem; }
footer { margin-top: 2.5rem; color: #7b8494; font-size: .85rem; }
@media print { body { background: #fff; } main { box-shadow: none; margin: 0; } }
"""


def page(title: str, parts: Iterable[str], footer: str = "") -> str:
    """A whole document.

    Args:
        title: of the window.
        parts: HTML made by the functions below.
        footer: plain text at the end.
    """
    body = "\n".join(parts)
    end = f"<footer>{escape(footer)}</footer>" if footer else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n"
        f"{body}\n{end}\n</main>\n</body>\n</html>\n"
    )


def heading(text: str, level: int = 2) -> str:
    """A heading."""
    return f"<h{level}>{escape(text)}</h{level}>"


def paragraph(text: str, css: str = "") -> str:
    """A paragraph; `css` is a class of the style (`warning`, `subtitle`, `label`)."""
    return f'<p class="{css}">{escape(text)}</p>' if css else f"<p>{escape(text)}</p>"


def verdict(sentences: Sequence[str]) -> str:
    """The box at the top, its first sentence emphasised."""
    return '<div class="verdict">' + "".join(paragraph(sentence) for sentence in sentences) + "</div>"


def bullets(items: Sequence[str]) -> str:
    """A list; nothing where there are no items."""
    if not items:
        return ""
    return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>"


def table(
    header: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "", chosen: int | None = None
) -> str:
    """A table of texts.

    Args:
        header: names of the columns.
        rows: cells, already formatted.
        caption: below the table.
        chosen: row to emphasise.
    """
    head = "".join(f"<th>{escape(name)}</th>" for name in header)
    lines = []
    for k, row in enumerate(rows):
        css = ' class="chosen"' if k == chosen else ""
        lines.append(f"<tr{css}>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>")
    note = f"<caption>{escape(caption)}</caption>" if caption else ""
    body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody>"
    return f'<div class="scroll"><table>{note}{body}</table></div>'


def figure(drawing: Figure, caption: str) -> str:
    """A matplotlib figure, embedded as a vector image."""
    data = base64.b64encode(svg(drawing)).decode("ascii")
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/svg+xml;base64,{data}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def svg(drawing: Figure) -> bytes:
    """A figure as SVG, the same bytes for the same figure."""
    stream = io.BytesIO()
    with style(), rc_context({"svg.hashsalt": "pneusma"}):
        drawing.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()
