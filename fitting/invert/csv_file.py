"""CSV files of targets and lumens: rows, and numbers that name their place when they are none."""

import csv
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from pneusma_jax.errors import InputError


def records(path: Path, reader: Callable[[Iterable[str]], Iterable[Any]] = csv.reader) -> list[Any]:
    """Every row of a file, as a reader of the standard library gives it.

    Raises:
        InputError: if the file cannot be read, or is no text.
    """
    try:
        with open(path, newline="", encoding="utf-8") as file:
            return list(reader(file))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()})") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read as a text file") from None


def number(text: str | None, where: str) -> float:
    """A finite number.

    Args:
        text: text of the field; None where the row is too short.
        where: file, row and column.

    Raises:
        InputError: if it is no number, or not finite.
    """
    try:
        value = float(text)
    except (TypeError, ValueError):
        raise InputError(f"{where} must be a number, but it is {text!r}") from None
    if not np.isfinite(value):
        raise InputError(f"{where} must be finite, but it is {text!r}")
    return value
