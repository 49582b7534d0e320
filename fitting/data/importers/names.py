"""Names of recordings, specimens and files that are made of those of a raw file."""

from pathlib import Path


def slug(text: str) -> str:
    """A valid name for files and specimens: letters, digits, points, dashes and underscores."""
    cleaned = "".join(c if c.isalnum() or c in ".-" else "_" for c in text)
    return "_".join(part for part in cleaned.split("_") if part) or "recording"


def name_of(path: Path, title: str) -> str:
    """Name of the recording of a test: that of its file, and its title where the file holds several tests."""
    return slug(f"{slug(path.stem)}_{title}") if title else slug(path.stem)
