"""What the site adds to the pages of this folder: tutorials, reference pages, and formulas as MathML.

MkDocs calls these functions (`hooks` in mkdocs.yml). Pages that other files hold, or that the code states,
are made here, so that nothing is written down twice.
"""

import importlib
import pkgutil
import re
import sys
from pathlib import Path

import click
from latex2mathml.converter import convert
from mkdocs.structure.files import File
from mkdocs.utils import get_relative_url
from nbconvert import MarkdownExporter

from fitting.cli import COMMANDS, main

sys.path.insert(0, str(Path(__file__).parent))  # MkDocs loads a hook by its path
from _links import COPIED, SHOWN, moved  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
EXECUTED = ROOT / "out" / "notebooks"  # `make docs` leaves executed notebooks there
PACKAGES = ("pneusma_jax", "fitting")
# commands have a page of their own; former names repeat what stands elsewhere
HIDDEN = (
    "pneusma_jax.chain", "pneusma_jax.outline", "fitting.cli", "fitting.augmented", "fitting.diagnosis",
    "fitting.own_base", "fitting.parameters", "fitting.recordings",
)  # fmt: skip


def on_files(files, config):
    """Add tutorials, copied pages and reference pages, before other plugins look at the files."""
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        executed = EXECUTED / notebook.name
        for name, content in tutorial(executed if executed.exists() else notebook).items():
            files.append(File.generated(config, f"tutorials/{name}", content=content))
    for name, source in COPIED.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text()))
    for shown in sorted((ROOT / SHOWN).iterdir()):
        files.append(File.generated(config, f"{SHOWN}/{shown.name}", content=shown.read_bytes()))
    packages = list(api_packages())
    files.append(File.generated(config, "api.md", content=api_index(packages)))
    for package in packages:
        files.append(File.generated(config, f"api/{package}.md", content=api_page(package)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Turn links between files of the repository into links between pages; add options to the commands."""
    markdown = moved(markdown, page.file.src_uri)
    if page.file.src_uri == "commands.md":
        markdown += "\n" + "\n".join(options_of(name) for name in COMMANDS)
    return markdown


def on_page_content(html, page, config, files):
    """Formulas as MathML, which browsers draw without a script."""
    html = re.sub(
        r'<span class="arithmatex">\\\((.*?)\\\)</span>', lambda m: mathml(m[1], "inline"), html, flags=re.S
    )
    return re.sub(
        r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>',
        lambda m: formulas(m[1]),
        html,
        flags=re.S,
    )


def on_post_page(output, page, config):
    """The search finds its worker in the site itself, where the theme would load one from another host."""
    here = get_relative_url("assets/worker.js", page.url)
    return output.replace("https://unpkg.com/iframe-worker/shim", here)


def tutorial(notebook: Path) -> dict[str, str | bytes]:
    """A notebook as a page, and its figures as files, by name."""
    resources = {"output_files_dir": f"{notebook.stem}_files"}
    text, found = MarkdownExporter().from_filename(str(notebook), resources)
    return {f"{notebook.stem}.md": text, **found.get("outputs", {})}


def mathml(formula: str, display: str) -> str:
    """A formula of TeX as MathML."""
    plain = formula.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    return convert(plain.strip(), display=display)


def formulas(block: str) -> str:
    """Formulas of a block, which `\\qquad` separates: beside each other where the window is wide enough."""
    parts = "".join(mathml(part, "block") for part in block.split(r"\qquad"))
    return f'<div class="formulas">{parts}</div>'


def api_packages():
    """Names of the packages whose public functions have a reference page."""
    for top in PACKAGES:
        yield top
        for found in pkgutil.iter_modules(importlib.import_module(top).__path__, f"{top}."):
            if not found.name.split(".")[-1].startswith("_") and found.name not in HIDDEN:
                yield found.name


def api_index(packages: list[str]) -> str:
    """The page that lists the packages, each with the first line of its docstring."""
    rows = []
    for package in packages:
        text = (importlib.import_module(package).__doc__ or "").strip().splitlines()
        rows.append(f"| [`{package}`](api/{package}.md) | {text[0] if text else ''} |")
    return "\n".join(["# Python", "", "| package | what it holds |", "|---|---|", *rows, ""])


def api_page(package: str) -> str:
    """The page of a package; that of a whole distribution has its public names only."""
    whole = "\n    options:\n      show_submodules: false" if package in PACKAGES else ""
    return f"# {package}\n\n::: {package}{whole}\n"


def options_of(name: str) -> str:
    """Usage and options of a command, as `--help` prints them."""
    context = click.Context(main)
    command = main.get_command(context, name)
    text = command.get_help(click.Context(command, info_name=f"pneusma {name}", max_content_width=88))
    return f"## All options of {name} {{#options-{name}}}\n\n```text\n{text}\n```\n"
