"""TOML documents that state their schema, such as chains and studies, and checks of their fields."""

import difflib
import math
import re
import tomllib
from collections.abc import Collection, Iterator, Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from .errors import InputError, nearest

LARGEST = 2**63
"""TOML's integers have 64 bits; Python's parser takes any, and arithmetic ends with those."""
MOST_NESTED = 100
"""Maximum number of arrays and tables inside of each other. Documents of this project have up to 4. Python's
parser takes some 400. Then it exhausts the stack, of which the interpreter may print lines of its own."""
_NO_BRACKETS = re.compile(
    r'"""[\s\S]*?(?:"""|\Z)' r"|'{3}[\s\S]*?(?:'{3}|\Z)"  # texts of several lines
    r'|"(?:[^"\\\n]|\\.)*+"?' r"|'[^'\n]*+'?"  # texts of one line
    r"""|#[^\n]*|[^\[\]{}"'#]+"""
)
"""Parts of a document between brackets: texts, comments and all else. A text without end ends where it must,
so that the search takes a time in proportion to the document."""


def parse_toml(text: str, path: Path | str) -> dict[str, Any]:
    """Parse TOML that anybody may have written.

    Args:
        text: text of the file; a byte-order mark at its beginning is left out.
        path: path of the file, for messages.

    Raises:
        InputError: if it is not TOML, or is nested more deeply than any document of ours.
    """
    deep = InputError(f"{path}: not a TOML file of ours: it is nested too deeply")
    if _depth(text) > MOST_NESTED:
        raise deep
    try:
        document = tomllib.loads(text.removeprefix("\ufeff"))
    except ValueError as error:  # also of an integer with thousands of digits
        raise InputError(f"{path}: not a TOML file: {error}{_decimal_comma(text, error)}") from None
    for key, number, depth in _entries(document):
        if depth > MOST_NESTED:  # dotted keys nest without brackets
            raise deep
        if isinstance(number, int) and not -LARGEST <= number < LARGEST:
            raise InputError(
                f"{path}: key {key!r}: an integer of {len(str(abs(number)))} digits is none of TOML's"
            )
    return document


def _decimal_comma(text: str, error: ValueError) -> str:
    """What would be right where the error is in a line whose number has a decimal comma; else nothing."""
    place = re.search(r"at line (\d+)", str(error))
    line = text.split("\n")[int(place[1]) - 1] if place else ""
    found = re.search(r"=\s*([-+]?\d+),(\d+)\s*(?:#.*)?$", line.rstrip())
    return f"; a number has a decimal point: {found[1]}.{found[2]}" if found else ""


def _depth(text: str) -> int:
    """Largest number of brackets that are open at any place of a document."""
    deepest = open_ = 0
    for mark in _NO_BRACKETS.sub("", text):
        open_ = max(0, open_ + (mark in "[{") - (mark in "]}"))
        deepest = max(deepest, open_)
    return deepest


def _entries(document: dict[str, Any]) -> Iterator[tuple[str, Any, int]]:
    """Entries of a document at any depth, each with the key that it stands at and its depth."""
    left = [(key, value, 1) for key, value in document.items()]
    while left:
        key, value, depth = left.pop()
        yield key, value, depth
        if isinstance(value, dict):
            left += [(inner, entry, depth + 1) for inner, entry in value.items()]
        elif isinstance(value, list):
            left += [(key, entry, depth + 1) for entry in value]


def read_document(
    place: Path | Traversable, path: Path, what: str, schema: str, top: tuple[str, ...]
) -> dict[str, Any]:
    """Read a document of one schema.

    Args:
        place: file to read; one on disk, or one that ships with the package.
        path: the same for messages.
        what: such a document in words, `"a chain"`.
        schema: schema that the file must state.
        top: keys that it may have.

    Raises:
        InputError: if it cannot be read, is no TOML, states another schema or has a key that is unknown.
    """
    document = parse_toml(read_text(place, path), path)
    if "schema" not in document:
        alike = difflib.get_close_matches("schema", document.keys() - set(top), n=1)
        wrong = f"unknown key {alike[0]!r}, did you mean 'schema'?" if alike else "key 'schema' is missing;"
        raise InputError(f'{path}: {wrong} {what} has schema = "{schema}"')
    if document.get("schema") != schema:
        raise InputError(f"{path}: schema is {document.get('schema')!r}, but {what} has {schema!r}")
    check_keys(document, top, path)
    return document


def read_text(place: Path | Traversable, path: Path | str) -> str:
    """Text of a file.

    Raises:
        InputError: if it cannot be read as text; names `path`.
    """
    try:
        return place.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: this is a folder, and a file is needed") from None
    except (OSError, UnicodeDecodeError) as error:
        why = (error.strerror or "no text") if isinstance(error, OSError) else f"not UTF-8: {error.reason}"
        raise InputError(f"{path}: cannot be read as a text file ({why})") from None


def shipped_names(folder: Traversable) -> list[str]:
    """Names of the TOML files of a folder that comes with the package, sorted and without their ending."""
    names = (entry.name for entry in folder.iterdir())
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def check_keys(table: Mapping[str, Any], known: Collection[str], where: Path | str) -> None:
    """Refuse keys that are not known.

    Raises:
        InputError: naming the key and the nearest known one.
    """
    for key in table:
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}, {nearest(key, known)}")


def word_of(value: Any, words: Collection[str], where: str) -> str:
    """One of several words.

    Raises:
        InputError: for another one; names the nearest.
    """
    if not isinstance(value, str) or value not in words:
        raise InputError(f"{where} is {value!r}, {nearest(str(value), words)}")
    return value


def finite_number(value: Any, where: str) -> float:
    """A finite number; true and false are none.

    Raises:
        InputError: for anything else.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{where} must be a finite number, but it is {value!r}")
    return float(value)
