"""TOML documents that say their schema: chains, protocols, models."""

import tomllib
from collections.abc import Iterator
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from .errors import InputError, nearest

LARGEST = 2**63
"""TOML's integers have 64 bits; Python's parser takes any, and arithmetic ends with those."""


def parse_toml(text: str, path: Path | str) -> dict[str, Any]:
    """Parse TOML that anybody may have written.

    Args:
        text: text of the file; a byte-order mark at its beginning is left out.
        path: path of the file, for messages.

    Raises:
        InputError: if it is not TOML, or is nested more deeply than any document of ours.
    """
    try:
        document = tomllib.loads(text.removeprefix("\ufeff"))
    except ValueError as error:  # also of an integer with thousands of digits
        raise InputError(f"{path}: not a TOML file: {error}") from None
    except RecursionError:
        raise InputError(f"{path}: not a TOML file of ours: it is nested too deeply") from None
    for key, number in _integers(document):
        if not -LARGEST <= number < LARGEST:
            raise InputError(
                f"{path}: key {key!r}: an integer of {len(str(abs(number)))} digits is none of TOML's"
            )
    return document


def _integers(value: Any, key: str = "") -> Iterator[tuple[str, int]]:
    """Integers of a document, each with the key that it stands at."""
    if isinstance(value, dict):
        for inner, entry in value.items():
            yield from _integers(entry, inner)
    elif isinstance(value, list):
        for entry in value:
            yield from _integers(entry, key)
    elif isinstance(value, int):
        yield key, value


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
    try:
        text = place.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a text file ({error})") from None
    document = parse_toml(text, path)
    if document.get("schema") != schema:
        raise InputError(f"{path}: schema is {document.get('schema')!r}, but {what} has {schema!r}")
    for key in document:
        if key not in top:
            raise InputError(f"{path}: unknown key {key!r}, {nearest(key, top)}")
    return document
