"""Links between files of the repository as links between pages of the site."""

import os.path
import posixpath
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COPIED = {
    "architecture.md": "ARCHITECTURE.md",
    "changelog.md": "CHANGELOG.md",
    "contributing.md": "CONTRIBUTING.md",
    "benchmarks.md": "benchmarks/README.md",
    "benchmarks/commands.md": "benchmarks/commands.md",
    "benchmarks/core.md": "benchmarks/core.md",
    "benchmarks/design.md": "benchmarks/design.md",
    "benchmarks/diagnosis.md": "benchmarks/diagnosis.md",
    "benchmarks/diagnosis_speed.md": "benchmarks/diagnosis_speed.md",
    "benchmarks/intervals.md": "benchmarks/intervals.md",
    "benchmarks/samplers.md": "benchmarks/samplers.md",
    "benchmarks/springs.md": "benchmarks/springs.md",
}
"""Pages that are files of the repository, by their place in the site."""
SHOWN = "benchmarks/runs"
"""Folder whose files the site holds at the same place."""
LINK = re.compile(r"(\]\()([^)\s#]+)((?:#[^)\s]*)?\))")


def source_of(page: str) -> str:
    """File of the repository from which a page is made."""
    if page.startswith("tutorials/"):
        return f"notebooks/{Path(page).stem}.ipynb"
    return COPIED.get(page, f"docs/{page}")


def page_of(source: str) -> str | None:
    """Place in the site of a file of the repository; None where the site does not have it."""
    folder, _, name = source.partition("/")
    for page, copied in COPIED.items():
        if copied == source:
            return page
    if folder == "docs":
        return name
    if folder == "notebooks" and name.endswith(".ipynb"):
        return f"tutorials/{Path(name).stem}.md"
    return source if source.startswith(f"{SHOWN}/") else None


def moved(markdown: str, page: str) -> str:
    """The text of a page with links that lead from page to page.

    Args:
        markdown: text as it stands in the repository.
        page: place of the page in the site.
    """
    here = posixpath.dirname(source_of(page))

    def link(found: re.Match) -> str:
        source = posixpath.normpath(posixpath.join(here, found[2]))
        place = page_of(source) if (ROOT / source).exists() else None
        if place is None:
            return found[0]
        return found[1] + os.path.relpath(place, posixpath.dirname(page) or ".") + found[3]

    return LINK.sub(link, markdown)
