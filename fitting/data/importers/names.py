"""Names of recordings, specimens and files that are made of those of a raw file, and short lists of names."""

from collections.abc import Iterable
from itertools import islice
from pathlib import Path


def slug(text: str) -> str:
    """A valid name for files and specimens: letters, digits, points, dashes and underscores."""
    cleaned = "".join(c if c.isalnum() or c in ".-" else "_" for c in text)
    return "_".join(part for part in cleaned.split("_") if part) or "recording"


def name_of(path: Path, title: str) -> str:
    """Name of the recording of a test: that of its file, and its title where the file holds several tests."""
    return slug(f"{slug(path.stem)}_{title}") if title else slug(path.stem)


def first_few(names: Iterable[object], most: int) -> str:
    """The first names in words, and dots for those beyond: `a, b, ...`."""
    shown = list(map(str, islice(names, most + 1)))
    return ", ".join(shown if len(shown) <= most else [*shown[:most], "..."])
