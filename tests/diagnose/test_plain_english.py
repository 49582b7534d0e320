"""Sentences of the diagnosis, of its manual and of the pages that a newcomer reads have at most 25 words."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LONGEST = 25
MODULES = sorted((ROOT / "fitting" / "diagnose").rglob("*.py"))
PAGES = ("diagnosis", "index", "own_data", "commands", "files", "import", "characterise", "reliability")
BREAK = re.compile(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) |\n\s*(?=[\w, ]+: )")
"""Between paragraphs, entries of a list, and described arguments."""


def texts_of_module(source: str) -> Iterator[str]:
    """Docstrings and comments."""
    for node in ast.walk(ast.parse(source)):
        for inner in node.body if isinstance(getattr(node, "body", None), list) else ():
            if isinstance(inner, ast.Expr) and isinstance(inner.value, ast.Constant) and isinstance(inner.value.value, str):
                yield inner.value.value
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and "fmt:" not in token.string:
            yield token.string.lstrip("# ")


def text_of_page(source: str) -> str:
    """A page without code, tables and comments."""
    source = re.sub(r"```.*?```|<!--.*?-->", "", source, flags=re.DOTALL)
    return "\n".join("" if line.startswith("|") else line for line in source.splitlines())


def long_sentences(text: str) -> list[str]:
    found = []
    for paragraph in BREAK.split("\n" + text):
        words = re.sub(r"^(?:Args|Attributes|Returns|Raises): ", "", " ".join(paragraph.split()))
        for sentence in re.split(r"(?<=[.!?:;])\s+(?=[A-Z`(*])|(?<=\.\))\s+|(?<=\.\*\*)\s+", words):
            if len(sentence.split()) > LONGEST and ">>>" not in sentence:
                found.append(sentence)
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_sentence_of_a_module_is_long(path):
    source = path.read_text(encoding="utf-8")
    assert [sentence for text in texts_of_module(source) for sentence in long_sentences(text)] == []


@pytest.mark.parametrize("page", PAGES)
def test_no_sentence_of_a_page_is_long(page):
    assert long_sentences(text_of_page((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8"))) == []


def test_a_long_sentence_is_seen():
    long = "word " * (LONGEST + 1) + "end."
    assert len(long_sentences(f"Short. {long}\n\nShort.")) == 1
    assert long_sentences("word " * LONGEST) == []
    assert list(texts_of_module('"""A."""\nx = 1  # B\n')) == ["A.", "B"]
    assert text_of_page("a\n```\nb\n```\n| c |\n").split() == ["a"]
