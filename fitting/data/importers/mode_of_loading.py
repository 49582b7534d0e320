"""Mode of loading that the lines above a table state: compression, or the word with another meaning."""

import re
from collections.abc import Iterable, Sequence

from .words import COMPRESS

# The loading of the specimen: `Compression test`, `uniaxial compression`, `Druckversuch`.
_TESTED = re.compile(
    r"\bcompress\w*[\s-]*(?:tests?|testing|loading|cycl\w*|experiments?|mode|platens?|plates?|relaxation|creep|"
    r"of|to|up to|at|until|set)\b(?!\s*(?:machine|frame|rig|system|stand|device|bench))"
    r"|\b(?:in|under|uniaxial|uni-axial|unconfined|confined|cyclic|static|quasi-?static|essai de)\s+compress"
    r"|\bdruckversuch|\bdruckprüfung|\bstauch",
    re.IGNORECASE,
)
_KEYS = re.compile(
    r"^[#%\s]*(?:test|type|mode|method|loading|load case|direction|deformation|procedure|experiment|"
    r"versuch|prüf|art\b|norm|standard|essai|name|title|comment|notes?|description|remark|sample|specimen|protocol|program|kind|project)",
    re.IGNORECASE,
)
_PULLED = re.compile(r"\btens|\btract|\bpull|\bzug", re.IGNORECASE)
_MACHINE = re.compile(
    r"cell|sensor|machine|maschine|frame|grips?\b|capacity|transducer|kraftaufnehmer|actuator|spring|fixture|rig\b|"
    r"range|limit|serial|model\b|calibrat",
    re.IGNORECASE,
)
_ELSE = re.compile(
    r"compressed\s+(?:air|gas|nitrogen)|\b(?:air|gas|file|image|video|data|zip|lossless)\b.*compress|compress\w*\s+"
    r"(?:file|data|ratio|air)|compressor|\b(?:no|none|off|not|without|disabled|false|keine|ohne|aus|aucune?)\b",
    re.IGNORECASE,
)
_LONGEST_TITLE = 6  # words


def compression_in(lines: Iterable[Sequence[str]]) -> tuple[list[str], str]:
    """Lines that say that the specimen was in compression, and one that may say so.

    A line says so if it is a title (`Compression test of foam`), or if its first words ask for the kind of
    test (`Test type: compression`). The capacity of a load cell, the name of a machine, compressed air and
    compressed files do not tell how a specimen was loaded.

    Args:
        lines: cells of each line above the table, of titles and of the sheet's name.

    Returns:
        Lines that say so as text, and the first doubtful one; empty if there is none, or if the file states
        that the specimen was pulled.
    """
    said, doubtful, pulled = [], "", False
    for cells in lines:
        text = " ".join(cell for cell in cells if cell)
        pulled = pulled or bool(_KEYS.match(text) and _PULLED.search(text) and not COMPRESS.search(text))
        if not COMPRESS.search(text) or _ELSE.search(text) and not _TESTED.search(text):
            continue
        if _states(text, len([cell for cell in cells if cell])):
            said.append(text)
        else:
            doubtful = doubtful or text
    return said, "" if pulled or said else doubtful


def _states(text: str, cells: int) -> bool:
    """True if a line that speaks of compression states it as the loading of the specimen."""
    if _PULLED.search(text):
        return False
    if _TESTED.search(text):
        return True
    if _MACHINE.search(text):
        return False
    return bool(_KEYS.match(text)) or cells == 1 and len(text.split()) <= _LONGEST_TITLE
