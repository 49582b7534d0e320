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
PAGES = ("diagnosis", "thresholds", "index", "own_data", "commands", "files", "import", "characterise", "reliability")
BENCHMARKS = sorted((ROOT / "benchmarks").glob("*.md"))
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


@pytest.mark.parametrize("path", BENCHMARKS, ids=lambda path: path.stem)
def test_no_sentence_of_a_benchmark_is_long(path):
    assert long_sentences(text_of_page(path.read_text(encoding="utf-8"))) == []


MOST = 32
"""Maximum number of words between two full stops, wherever a user reads: colons and semicolons part no sentences here."""
ALL_PAGES = sorted(path for path in (ROOT / "docs").glob("*.md") if path.stem != "corrections" and not path.stem.startswith("proof"))
SAID = sorted(path for package in ("fitting", "pneusma_jax") for path in (ROOT / package).rglob("*.py"))


def too_long(text: str) -> list[str]:
    """Sentences of more than `MOST` words, told apart by full stops alone."""
    found = []
    for paragraph in re.split(r"\n\s*\n|\n\s*(?:[-*>]|\d+\.) ", "\n" + text):
        for sentence in re.split(r"(?<=[.!?])\s+|(?<=\.X)\s+|(?<=\.\))\s+|(?<=\.\*\*)\s+", " ".join(paragraph.split())):
            found += [sentence] if len(sentence.split()) > MOST and "$$" not in sentence else []
    return found


def strings_of_module(source: str) -> Iterator[str]:
    """Strings that are no docstrings; what an f-string fills in counts as one word."""
    nodes = list(ast.walk(ast.parse(source)))
    beside = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    beside |= {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "X" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in beside:
            yield node.value


@pytest.mark.parametrize("path", ALL_PAGES + BENCHMARKS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_no_page_has_a_sentence_that_only_semicolons_part(path):
    assert too_long(text_of_page(path.read_text(encoding="utf-8"))) == []


def test_no_message_has_a_sentence_that_only_semicolons_part():
    found = {path.name: said for path in SAID for text in strings_of_module(path.read_text(encoding="utf-8")) if (said := too_long(text))}
    assert found == {}


def test_a_long_sentence_is_seen():
    assert len(too_long("word; " * (MOST + 1))) == 1 and too_long("word " * (MOST - 1) + "end. Word.") == []
    assert list(strings_of_module('"""A."""\nx = "B", f"C {y} D"\n')) == ["B", "C X D"]
    long = "word " * (LONGEST + 1) + "end."
    assert len(long_sentences(f"Short. {long}\n\nShort.")) == 1
    assert long_sentences("word " * LONGEST) == []
    assert list(texts_of_module('"""A."""\nx = 1  # B\n')) == ["A.", "B"]
    assert text_of_page("a\n```\nb\n```\n| c |\n").split() == ["a"]
