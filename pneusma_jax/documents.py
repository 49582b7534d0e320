"""TOML documents that say their schema: chains, protocols, models."""

import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from .errors import InputError, nearest


def read_document(
    place: Path | Traversable, path: Path, what: str, schema: str, top: tuple[str, ...]
) -> dict[str, Any]:
    """Read a document of one schema.

    Args:
        place: where it is read from; a file, or one that ships with the package.
        path: the same for messages.
        what: such a document in words, `"a chain"`.
        schema: that it must state.
        top: keys that it may have.

    Raises:
        InputError: if it cannot be read, is no TOML, states another schema or has a key that is unknown.
    """
    try:
        document = tomllib.loads(place.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a text file ({error})") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not a TOML file: {error}") from None
    if document.get("schema") != schema:
        raise InputError(f"{path}: schema is {document.get('schema')!r}, but {what} has {schema!r}")
    for key in document:
        if key not in top:
            raise InputError(f"{path}: unknown key {key!r}, {nearest(key, top)}")
    return document
