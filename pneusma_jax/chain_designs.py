"""Chains of segments from a file: which designs follow each other, how each is mounted, what lies between.

schema = "pneusma-chain/1"
name = "catheter"

[[segment]]
design = "pneusma2"          # name of a table of kind actuator, or its path from this file's folder
count = 2                    # that many, one after the other; 1 by default
angle = {value = 90.0, unit = "deg", status = "assumed", source = "..."}      # mounted turned; 0 by default
connector = {value = 4.0, unit = "mm", status = "assumed", source = "..."}    # rigid, after each; none
"""

import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from .actuator import Actuator
from .calibration import load_calibration
from .calibration_toml import read_quantity
from .designs import make_actuator
from .documents import read_document
from .errors import InputError, nearest
from .segments import SegmentChain, chain_of

SCHEMA = "pneusma-chain/1"
TOP = ("schema", "name", "description", "segment")
KEYS = {"angle": "angle", "connector": "length"}  # numbers of a segment and their dimensions
MOST = 100  # segments of a chain: more is a slip
_EXAMPLES = resources.files("calibration_data").joinpath("examples", "chains")


@dataclass(frozen=True)
class ChainDesign:
    """A chain as its file describes it; one entry per segment, from base to tip.

    Attributes:
        name, description: for people.
        path: of the file.
        designs: name or path of each segment's table of kind actuator.
        angles: by which each is mounted turned about z, against the base [rad].
        connectors: length of the rigid connector between each segment and the next [m]; one fewer.
    """

    name: str
    description: str
    path: Path
    designs: tuple[str, ...]
    angles: tuple[float, ...]
    connectors: tuple[float, ...]


def chain_examples() -> list[str]:
    """Names of the chains that come with the package, sorted."""
    return sorted(e.name.removesuffix(".toml") for e in _EXAMPLES.iterdir() if e.name.endswith(".toml"))


def describes_chain(name_or_path: str | Path) -> bool:
    """Whether a design is a chain, by name or by the schema of its file; False where none can be read."""
    if str(name_or_path) in chain_examples():
        return True
    if not str(name_or_path).endswith(".toml"):
        return False
    try:
        return tomllib.loads(Path(name_or_path).read_text(encoding="utf-8")).get("schema") == SCHEMA
    except (OSError, ValueError):
        return False  # whoever reads it as a table says what is wrong with it


def load_chain(name_or_path: str | Path) -> ChainDesign:
    """Read and check a chain.

    Args:
        name_or_path: name of a shipped chain, or a path.

    Raises:
        InputError: one line with file, key and remedy, for anything unknown, missing or impossible.
    """
    shipped = str(name_or_path) in chain_examples()
    path = Path("calibration_data", "examples", "chains", f"{name_or_path}.toml") if shipped else None
    place = _EXAMPLES.joinpath(f"{name_or_path}.toml") if shipped else Path(name_or_path)
    path = path or Path(name_or_path)
    return _chain(read_document(place, path, "a chain", SCHEMA, TOP), path)


def _chain(document: dict[str, Any], path: Path) -> ChainDesign:
    entries = document.get("segment")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{path}: a chain needs at least one segment, a table [[segment]] with a design")
    rows = [row for number, entry in enumerate(entries, 1) for row in _segments(entry, number, path)]
    if len(rows) > MOST:
        raise InputError(f"{path}: a chain of {len(rows)} segments: at most {MOST} are taken")
    designs, angles, connectors = zip(*rows, strict=True)
    name, description = (
        str(document.get(key, usual)) for key, usual in (("name", path.stem), ("description", ""))
    )
    return ChainDesign(name, description, path, designs, angles, connectors[:-1])


def _segments(entry: Any, number: int, path: Path) -> Iterable[tuple[str, float, float]]:
    where = f"{path}: segment {number}"
    known = ("design", "count", *KEYS)
    for key in entry if isinstance(entry, dict) else ():
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}, {nearest(key, known)}")
    design = entry.get("design") if isinstance(entry, dict) else None
    if not isinstance(design, str) or not design.strip():
        raise InputError(f"{where}: design must be the name or path of an actuator, but it is {design!r}")
    design = str(path.parent / design) if design.endswith(".toml") else design
    try:
        load_calibration(design, "actuator")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    count = entry.get("count", 1)
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError(f"{where}: count must be a whole number from 1, but it is {count!r}")
    numbers = {
        key: read_quantity(key, entry[key], dimension, f"{where}: {key}").value
        for key, dimension in KEYS.items()
        if key in entry
    }
    if numbers.get("connector", 0.0) < 0.0:
        raise InputError(f"{where}: connector must not be negative, but it is {entry['connector']['value']}")
    return [(design, numbers.get("angle", 0.0), numbers.get("connector", 0.0))] * count


def make_chain(
    design: ChainDesign | str | Path, build: Callable[[str], Actuator] = make_actuator
) -> SegmentChain:
    """The chain that a file describes.

    Args:
        design: loaded, the name of a shipped chain, or a path.
        build: makes a segment from the name or path of its table.

    Raises:
        InputError: if the file cannot be used, or segments cannot follow each other.
    """
    design = design if isinstance(design, ChainDesign) else load_chain(design)
    built = {name: build(name) for name in dict.fromkeys(design.designs)}
    try:
        return chain_of(
            [built[name] for name in design.designs], angles=design.angles, connectors=design.connectors
        )
    except ValueError as error:
        raise InputError(f"{design.path}: {error}") from None
