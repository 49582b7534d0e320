"""Citation and licence of a raw file: stated by the user, in the file, or beside it."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

# A phrase that identifies a licence text, and the name to state.
_LICENCES = (
    ("creative commons attribution 4.0", "CC BY 4.0"),
    ("creative commons attribution-sharealike 4.0", "CC BY-SA 4.0"),
    ("cc0 1.0", "CC0 1.0"),
    ("odc open database license", "ODbL 1.0"),
    ("apache license", "Apache-2.0"),
    ("mit license", "MIT"),
    ("redistribution and use in source and binary forms", "BSD (see its text)"),
    ("gnu general public license", "GPL (see its text)"),
)
_LICENCE_FILE = re.compile(r"^(data[_-]?)?licen[cs]e(\.(md|txt))?$", re.IGNORECASE)
_LEVELS = 4  # Number of searched folders: the file's own and three above it


@dataclass(frozen=True)
class Provenance:
    """Citation and licence of a raw file, empty where unknown, and their origin."""

    citation: str = ""
    licence: str = ""
    notices: tuple[str, ...] = ()


def find_provenance(
    path: Path, citation: str | None, licence: str | None, known: Provenance | None
) -> Provenance:
    """Citation and licence: the user's statement, else the file's own, else one found beside the file.

    Args:
        path: raw file. Its folder and those above are searched, up to the root of a repository. The search
            looks for `PROVENANCE.md`, a licence, `CITATION.cff` or a text with a BibTeX entry.
        citation: citation stated by the user.
        licence: licence stated by the user.
        known: provenance that the file's own preamble identifies, if any.
    """
    beside = _search(path)
    notices = []
    texts = {"citation": citation, "licence": licence}
    for key in texts:
        if texts[key]:
            continue
        if known is not None and getattr(known, key):
            texts[key] = getattr(known, key)
            notices.append(f"{key} known from the file's preamble: {texts[key]}")
        elif key in beside:
            texts[key], where = beside[key]
            neighbour = Path(os.path.relpath(where, path.resolve().parent)).as_posix()
            notices.append(f"{key} taken from {neighbour}; check that it covers these numbers")
    return Provenance(texts["citation"] or "", texts["licence"] or "", tuple(notices))


def _search(path: Path) -> dict[str, tuple[str, Path]]:
    found: dict[str, tuple[str, Path]] = {}
    folders = list(path.resolve().parents)[:_LEVELS]
    for folder in folders:
        program = (folder / "pyproject.toml").exists()
        if program and folder != folders[0]:
            break  # the licence of a program is not that of the data in its folders
        try:
            files = sorted((p for p in folder.iterdir() if p.is_file()), key=_provenance_first)
        except OSError:
            break
        for file in files:
            for key, text in _statements(file).items():
                found.setdefault(key, (text, file))
        if len(found) == 2 or program or (folder / ".git").exists():
            break
    return found


def _provenance_first(file: Path) -> tuple[bool, str]:
    """Order of trust: a note on where the data come from, then the licence of data, then any licence."""
    return not file.name.lower().startswith("provenance"), file.name.lower()


def _statements(file: Path) -> dict[str, str]:
    """Statements of one neighbouring file about citation and licence."""
    name = file.name.lower()
    if _LICENCE_FILE.match(name):
        return {"licence": _licence_name(_text(file))}
    if name == "citation.cff":
        return _from_cff(_text(file))
    if name.startswith("provenance"):
        return _from_provenance(_text(file))
    if name.endswith((".bib", "source.txt", "citation.txt")):
        return _from_bibtex(_text(file))
    return {}


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _licence_name(text: str) -> str:
    folded = " ".join(text.lower().split())
    for phrase, name in _LICENCES:
        if phrase in folded:
            return name
    return next((line.strip("# ") for line in text.splitlines() if line.strip("# ")), "")


def _from_provenance(text: str) -> dict[str, str]:
    found = {}
    for key, words in (("licence", "Licen[cs]e"), ("citation", "Cite|Citation")):
        match = re.search(rf"^[-*\s]*(?:{words}):\s*(.+)$", text, re.MULTILINE)
        if match:
            found[key] = match[1].strip()
    return found


def _from_cff(text: str) -> dict[str, str]:
    """Title, date and address of a CITATION.cff. Only its top level is read, which needs no YAML reader."""
    keys = ("title", "version", "date-released", "doi", "url")
    return _cited(keys, r"^(KEYS):\s*[\"']?(.+?)[\"']?\s*$", text)


def _from_bibtex(text: str) -> dict[str, str]:
    keys = ("author", "title", "journal", "year", "doi")
    return _cited(keys, r"^\s*(KEYS)\s*=\s*[{\"](.+?)[}\"],?\s*$", text)


def _cited(keys: Sequence[str], pattern: str, text: str) -> dict[str, str]:
    """Citation of a text that states some keys, each in a line of this pattern; none without a title."""
    values = dict(re.findall(pattern.replace("KEYS", "|".join(keys)), text, re.MULTILINE))
    return {"citation": ", ".join(values[key] for key in keys if key in values)} if "title" in values else {}
