"""Chains of segments from a file: order of the designs, mounting angles, connectors and loads.

schema = "pneusma-chain/1" name = "catheter"

[[segment]] design = "pneusma2"          # name of a table of kind actuator, or its path from this file's
folder count = 2                    # that many, one after the other; 1 by default angle = {value = 90.0, unit
= "deg", status = "assumed", source = "..."}      # mounted turned; 0 by default connector = {value = 4.0,
unit = "mm", status = "assumed", source = "..."}    # rigid, after each; none connector_mass = {value = 0.5,
unit = "g", status = "assumed", source = "..."}

Loads on the chain stand above its segments, under the names of an actuator's table. They are `orientation` or
`gravity_x`, `gravity_y`, `gravity_z`; `tip_mass`; `tip_force_x`, ...; `tip_x`, `tip_y`. A chain also takes
`tip_moment_x`, ..., `line_load_x`, ..., and `tip_follows = true` for a force and a moment that turn with the
tip.
"""

import dataclasses
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..actuator import Actuator
from ..actuator.designs import make_actuator
from ..actuator.loads import Gravity, gravity_vector
from ..calibration import load_calibration, named_table
from ..calibration.keys import ORIENTATIONS
from ..calibration.toml import read_quantity
from ..documents import check_keys, read_document
from ..errors import InputError, nearest
from .chain_files import EXAMPLES, SCHEMA, chain_examples
from .loads import ChainLoad, LineLoad, PointLoad
from .segments import SegmentChain, chain_of
from .weight import chain_weight, with_bodies

KEYS = {"angle": "angle", "connector": "length", "connector_mass": "mass"}
"""Numbers of a segment with their dimensions."""
AXES = ("x", "y", "z")
VECTORS = {"gravity": "acceleration", "tip_force": "force", "tip_moment": "moment", "line_load": "stiffness"}
NUMBERS = {  # Numbers of the whole chain with their dimensions; a force per length has that of a stiffness
    "tip_mass": "mass", "tip_x": "length", "tip_y": "length",
    **{f"{stem}_{axis}": dimension for stem, dimension in VECTORS.items() for axis in AXES},
}  # fmt: skip
TOP = ("schema", "name", "description", "segment", "orientation", "tip_follows", *NUMBERS)
IN_PLANE = 1e-9
"""Maximum component of a load in a plane, relative or in radians; a larger one bends out of the plane."""
MOST = 100  # Maximum number of segments of a chain; more is a typing error


@dataclass(frozen=True)
class ChainDesign:
    """A chain as its file describes it, with one entry per segment from base to tip.

    Attributes:
        name, description: texts for people.
        path: path of the file.
        designs: name or path of each segment's table of kind actuator.
        angles: mounting angle of each segment about z, against the base [rad].
        connectors: length of the rigid connector between each segment and the next [m]; one fewer.
        connector_masses: mass of each connector [kg].
        gravity: acceleration of gravity in the base's frame [m/s2], or None where the file does not state it.
        numbers: stated loads by key, SI.
        tip_follows: true if force and moment on the tip turn with it.
    """

    name: str
    description: str
    path: Path
    designs: tuple[str, ...]
    angles: tuple[float, ...]
    connectors: tuple[float, ...]
    connector_masses: tuple[float, ...] = ()
    gravity: tuple[float, float, float] | None = None
    numbers: dict[str, float] = field(default_factory=dict)
    tip_follows: bool = False

    def vector(self, stem: str) -> np.ndarray:
        """A load's vector by the stem of its keys, such as `tip_force`; zero where nothing is stated."""
        return np.asarray([self.numbers.get(f"{stem}_{axis}", 0.0) for axis in AXES])


def load_chain(name_or_path: str | Path) -> ChainDesign:
    """Read and check a chain.

    Args:
        name_or_path: name of a shipped chain, or a path.

    Raises:
        InputError: one line with file, key and remedy, for anything unknown, missing or impossible.
    """
    shipped = str(name_or_path) in chain_examples()
    path = Path("calibration_data", "examples", "chains", f"{name_or_path}.toml") if shipped else None
    place = EXAMPLES.joinpath(f"{name_or_path}.toml") if shipped else Path(name_or_path)
    path = path or Path(name_or_path)
    return _chain(read_document(place, path, "a chain", SCHEMA, TOP), path)


def _chain(document: dict[str, Any], path: Path) -> ChainDesign:
    entries = document.get("segment")
    if not isinstance(entries, list) or not entries:
        raise InputError(f"{path}: a chain needs at least one segment, a table [[segment]] with a design")
    rows = [row for number, entry in enumerate(entries, 1) for row in _segments(entry, number, path)]
    if len(rows) > MOST:
        raise InputError(f"{path}: a chain of {len(rows)} segments: at most {MOST} are taken")
    designs, angles, connectors, masses = zip(*rows, strict=True)
    name, description = (
        str(document.get(key, usual)) for key, usual in (("name", path.stem), ("description", ""))
    )
    numbers = {
        key: read_quantity(key, document[key], dimension, f"{path}: key {key!r}").value
        for key, dimension in NUMBERS.items()
        if key in document
    }
    follows = document.get("tip_follows", False)
    _check_loads(document, numbers, follows, path)
    return ChainDesign(
        name, description, path, designs, angles, connectors[:-1], masses[:-1],
        _gravity(document, numbers, path), numbers, follows,
    )  # fmt: skip


def _gravity(document: dict[str, Any], numbers: dict[str, float], path: Path) -> tuple | None:
    """Acceleration that a chain's file states, or None."""
    if "orientation" in document:
        word = document["orientation"]
        if word not in ORIENTATIONS:
            raise InputError(f"{path}: orientation is {word!r}, {nearest(str(word), ORIENTATIONS)}")
        return tuple(float(x) for x in gravity_vector(word))
    if any(f"gravity_{axis}" in numbers for axis in AXES):
        return tuple(numbers.get(f"gravity_{axis}", 0.0) for axis in AXES)
    return None


def _check_loads(document: dict[str, Any], numbers: dict[str, float], follows: Any, path: Path) -> None:
    """Refuse loads that contradict each other or do nothing."""
    components = [f"gravity_{axis}" for axis in AXES if f"gravity_{axis}" in numbers]
    if "orientation" in document and components:
        raise InputError(f"{path}: 'orientation' and {components[0]!r} both say how gravity acts: keep one")
    if ("tip_x" in numbers) != ("tip_y" in numbers):
        raise InputError(f"{path}: a place on the tip needs both 'tip_x' and 'tip_y'")
    if not isinstance(follows, bool):
        raise InputError(f"{path}: tip_follows must be true or false, but it is {follows!r}")
    tip = [key for key in numbers if key.startswith(("tip_force", "tip_moment"))]
    if "tip_follows" in document and not tip:
        raise InputError(
            f"{path}: 'tip_follows' says how a load on the tip turns: add 'tip_force_x' or another"
        )


def _segments(entry: Any, number: int, path: Path) -> Iterable[tuple[str, float, float, float]]:
    where = f"{path}: segment {number}"
    check_keys(entry if isinstance(entry, dict) else {}, ("design", "count", *KEYS), where)
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
    for key in ("connector", "connector_mass"):
        if numbers.get(key, 0.0) < 0.0:
            raise InputError(f"{where}: {key} must not be negative, but it is {entry[key]['value']}")
    if "connector_mass" in numbers and "connector" not in numbers:
        raise InputError(f"{where}: 'connector_mass' is of a connector, but there is no 'connector'")
    return [(design, *(numbers.get(key, 0.0) for key in KEYS))] * count  # type: ignore[list-item]


def make_chain(
    design: ChainDesign | str | Path,
    build: Callable[[str], Actuator] = make_actuator,
    density: Callable[[str], float | None] | None = None,
) -> SegmentChain:
    """The chain of a file, with its loads.

    Gravity is common to the whole chain and weighs all segments. The chain's file states it, or the tables of
    its segments do. A segment with a symmetric layout is held in a plane. It is freed where a load may push
    it out of that plane, unless its table states `bending` or `bending_plane`.

    Args:
        design: loaded chain, the name of a shipped chain, or a path.
        build: function that makes a segment from the name or path of its table.
        density: function to the density of such a segment's silicone [kg/m3]; that of its table's material if
            None.

    Raises:
        InputError: if the file cannot be used, segments cannot follow each other, or loads contradict each
            other.
    """
    design = design if isinstance(design, ChainDesign) else load_chain(design)
    names = tuple(dict.fromkeys(design.designs))
    built = {name: build(name) for name in names}
    fall = _one_gravity(design, built)
    loads = _loads(design, built, fall, density or _density)
    if fall is not None:  # bodies on single segments are in the chain's weight
        built = {
            name: body.with_loads(*(load for load in body.loads if not isinstance(load, Gravity)))
            for name, body in built.items()
        }
    if loads or any(body.loads for body in built.values()):
        vectors = [load.force for body in built.values() for load in body.loads]  # type: ignore[attr-defined]
        built = _freed_actuators(design, built, fall, vectors)
    bodies = [built[name] for name in design.designs]
    try:
        return chain_of(bodies, angles=design.angles, connectors=design.connectors).with_loads(*loads)
    except ValueError as error:
        raise InputError(f"{design.path}: {error}") from None


def _density(name: str) -> float | None:
    """Density of the silicone that a design's table names [kg/m3]."""
    return (
        load_calibration(named_table(load_calibration(name, "actuator"), "material"), "silicone")
        .values()
        .get("density")
    )


def _one_gravity(design: ChainDesign, built: dict[str, Actuator]) -> np.ndarray | None:
    """Acceleration of gravity [m/s2], None where unstated.

    Raises:
        InputError: if it is stated twice, and not the same.
    """
    stated = {} if design.gravity is None else {"the chain": np.asarray(design.gravity)}
    for name, body in built.items():
        stated |= {
            f"segment {name!r}": np.asarray(g.acceleration) for g in body.loads if isinstance(g, Gravity)
        }
    if not stated:
        if "tip_mass" in design.numbers or any(design.connector_masses):
            raise InputError(f"{design.path}: a mass weighs nothing without gravity: add an 'orientation'")
        return None
    (first, fall), *others = stated.items()
    for where, other in others:
        if not np.allclose(fall, other, rtol=1e-9, atol=1e-9):
            raise InputError(
                f"{design.path}: gravity is one for the whole chain, but that of {first} is {_listed(fall)} "
                "and that"
                f" of {where} {_listed(other)} m/s2 in the base's frame: leave one out"
            )
    return fall


def _listed(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{x + 0.0:.4g}" for x in vector) + ")"


def _loads(
    design: ChainDesign,
    built: dict[str, Actuator],
    fall: np.ndarray | None,
    density: Callable[[str], float | None],
) -> tuple[ChainLoad, ...]:
    """Loads of a chain without those that single segments keep."""
    numbers, loads = design.numbers, []
    bodies = [built[name] for name in design.designs]
    place = np.asarray([numbers["tip_x"], numbers["tip_y"]]) if "tip_x" in numbers else None
    if fall is not None:
        own = [next((g for g in body.loads if isinstance(g, Gravity)), None) for body in bodies]
        densities = {
            name: density(name) for name, body in zip(design.designs, own, strict=True) if body is None
        }
        for name, value in densities.items():
            if value is None:
                raise InputError(
                    f"{design.path}: segment {name!r} is to be weighed, but its material has no density"
                )
        whole = chain_weight(
            bodies, [densities.get(name, 0.0) for name in design.designs], fall,  # type: ignore[misc]
            numbers.get("tip_mass", 0.0), place,
            np.asarray(design.connectors), np.asarray(design.connector_masses),
        )  # fmt: skip
        mass = [m if g is None else g.mass for m, g in zip(whole.masses, own, strict=True)]
        centre = [p if g is None else g.place for p, g in zip(whole.places, own, strict=True)]
        whole = dataclasses.replace(whole, masses=jnp.stack(mass), places=jnp.stack(centre))
        hung = np.asarray([0.0 if g is None else float(g.tip_mass) for g in own])
        at = np.asarray([np.zeros(2) if g is None else np.asarray(g.tip_place) for g in own])
        loads.append(with_bodies(whole, hung, at))
    force, moment = design.vector("tip_force"), design.vector("tip_moment")
    if force.any() or moment.any():
        place = jnp.asarray(bodies[-1].section.enclosed_centroid) if place is None else place
        loads.append(PointLoad(force, moment, place, follows=design.tip_follows))
    if design.vector("line_load").any():
        loads.append(LineLoad(design.vector("line_load")))
    return tuple(loads)


def _freed_actuators(
    design: ChainDesign, built: dict[str, Actuator], fall: np.ndarray | None, forces: list
) -> dict[str, Actuator]:
    """Actuators that may bend in any direction, where a load may push them out of their plane."""
    turned = zip(design.designs, design.angles, strict=True)
    planes = [(built[name].bending_plane, angle) for name, angle in turned]
    pushes = [np.asarray(x) for x in forces] + [design.vector(s) for s in ("tip_force", "line_load")]
    pushes += [] if fall is None else [fall]
    if all(plane is not None for plane, _ in planes):
        across = [math.radians(plane) + angle + 0.5 * math.pi for plane, angle in planes]
        aside = np.asarray([math.cos(across[0]), math.sin(across[0]), 0.0])
        moment = design.vector("tip_moment")
        level = all(abs(math.sin(a - across[0])) < IN_PLANE for a in across)
        level = level and all(abs(push @ aside) <= IN_PLANE * np.linalg.norm(push) for push in pushes)
        level = level and np.linalg.norm(np.cross(moment, aside)) <= IN_PLANE * np.linalg.norm(moment)
        if level and not (design.numbers.get("tip_x") or design.numbers.get("tip_y")):
            return built
    return {name: _freed(name, body) for name, body in built.items()}


def _freed(name: str, body: Actuator) -> Actuator:
    """The actuator free to bend in any direction, unless its table states the direction."""
    table = load_calibration(name, "actuator")
    stated = "bending" in table.text or "bending_plane" in table.quantities
    return body if stated else dataclasses.replace(body, bending_plane=None)
