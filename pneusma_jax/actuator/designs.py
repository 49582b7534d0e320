"""Actuators from tables: the designs of Table 3.3 and the triad by name, any other from a file."""

import dataclasses
import math
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..calibration import Calibration, load_calibration, named_table
from ..calibration.keys import SECTIONS, SIDES
from ..errors import InputError, nearest
from ..nitinol import Alloy, load_alloy
from ..numerics.safe import is_concrete
from ..section import Section, annulus
from ..section.kinds import polygon, rectangle, semicircle
from ..section.placement import Layout
from ..silicone import SiliconeLaw, load_silicone
from . import Actuator, Geometry, build_actuator
from .loads import Load, TipForce, gravity_vector
from .weight import weight

GEOMETRY_KEYS = tuple(field.name for field in dataclasses.fields(Geometry))
SECTION_KEYS = tuple(sorted({key for keys in SECTIONS.values() for key in keys}))

OPPOSITE = (90.0, 270.0)  # deg, of sides 1 and 2
TRIAD = (90.0, 210.0, 330.0)  # deg, of sides 1 to 3
USUAL_ORIENTATION = "vertical_base_down"  # clamped below, tip up
Design = str | Path | Calibration  # name of a shipped table of kind actuator, path of one, or a loaded one


def layout(design: Design) -> Layout:
    """Places of a design's springs and fibre, from the `side_K` entries of its table.

    Two sides face each other at 90 and 270 degrees; three sit at 90, 210 and 330; `angle_K`, or `x_K` and
    `y_K`, override. Bending is held in the plane of sides 1 and 2 where everything lies in it, unless
    `bending` or `bending_plane` says otherwise.

    Raises:
        InputError: if there is no such design; names the nearest.
    """
    table = _table_of(design)
    values = table.values()
    usual = OPPOSITE if "side_3" not in table.text else TRIAD
    springs, angles, places = [], [], []
    fibre_angle = fibre_place = None
    for k, side in enumerate(SIDES, 1):
        word = table.text.get(side, "none")
        if word == "none":
            continue
        place = (values[f"x_{k}"], values[f"y_{k}"]) if f"x_{k}" in values else None
        angle = values.get(f"angle_{k}")
        angle = usual[k - 1] if angle is None and place is None else _degrees(angle)
        if word == "fibre":
            fibre_angle, fibre_place = angle, None if place is None else np.asarray(place)
            continue
        springs.append(k)
        angles.append(angle)
        places.append(None if place is None else np.asarray(place))
    return Layout(
        spring_numbers=tuple(springs),
        spring_angles=tuple(angles),
        fibre_angle=fibre_angle,
        bending_plane=_bending_plane(table, [*angles, fibre_angle], [*places, fibre_place]),
        spring_places=tuple(places),
        fibre_place=fibre_place,
    )


def _table_of(design: Design) -> Calibration:
    if isinstance(design, Calibration) and design.kind == "actuator":
        return design
    return load_calibration(design, kind="actuator")


def _degrees(angle: float | None) -> float | None:
    """Degrees of an angle in radians, to the digits that a file states."""
    return None if angle is None else round(math.degrees(angle), 9)


def _bending_plane(table: Calibration, angles: list, places: list) -> float | None:
    """Direction of side 1 in the plane to which bending is held [deg], None if it is free."""
    if "bending_plane" in table.values():
        return _degrees(table.values()["bending_plane"])
    if "bending" in table.text:
        return 90.0 if table.text["bending"] == "planar" else None
    level = all(a is None or a % 180.0 == 90.0 for a in angles)
    level = level and all(p is None or p[0] == 0.0 for p in places)
    aside = any(table.values().get(key, 0.0) != 0.0 for key in ("gravity_x", "tip_force_x", "tip_x"))
    symmetric = table.text.get("section", "annulus") != "polygon"
    return 90.0 if level and symmetric and not aside else None


def design_geometry(design: Design, **changes: float) -> Geometry:
    """Dimensions of a design, some of them changed [SI].

    Args:
        design: name or path of a table of kind actuator, or a loaded one.
        **changes: any field of `Geometry`. As in recordings, `attached_length` follows `length` if only the
            latter is given. Coils, pitch and free length depend on each other, see `_wound`.

    Raises:
        InputError: for an unknown design or dimension; names the nearest.
        ValueError: for coils, pitch and free length that contradict each other.
    """
    _check_changes(changes, GEOMETRY_KEYS)
    table = _table_of(design).values()
    values = {key: table[key] for key in GEOMETRY_KEYS if key in table}
    return Geometry(**(values | _followed(values, changes)))


WINDING = 0.05
"""Maximum part of the free length by which coils times pitch may differ from it; the source's own differ by
0.001."""


def _followed(values: dict[str, float], changes: dict[str, float]) -> dict[str, float]:
    """Changes of dimensions with all that follows from them; see `design_geometry`."""
    if "length" in changes:
        changes = {"attached_length": changes["length"]} | changes
    return _wound(values, changes)


def _wound(values: dict[str, float], changes: dict[str, float]) -> dict[str, float]:
    """Changes with what follows from them: the free length is that of the coils, one pitch each.

    Changed coils or pitch change the free length; a changed free length alone changes the coils.
    """
    keys = ("active_coils", "initial_pitch", "free_length")
    if not any(key in changes for key in keys) or not all(key in values for key in keys):
        return changes
    coils, pitch, free = (changes.get(key, values[key]) for key in keys)
    turns = (coils / values["active_coils"]) * (pitch / values["initial_pitch"])
    if "free_length" not in changes:
        return changes | {"free_length": values["free_length"] * turns}
    if "active_coils" not in changes and "initial_pitch" not in changes:
        return changes | {"active_coils": values["active_coils"] * free / values["free_length"]}
    if is_concrete(coils, pitch, free) and abs(float(coils * pitch / free) - 1.0) > WINDING:
        raise ValueError(
            f"The free length of a spring must be coils times pitch, {float(coils * pitch) * 1e3:.4g} mm, "
            f"but it is {float(free) * 1e3:.4g} mm; leave one of them out."
        )
    return changes


def design_section(design: Design, **changes: float) -> Section:
    """Cross-section of a design, some of its dimensions changed [SI].

    Args:
        design: name or path of a table of kind actuator, or a loaded one.
        **changes: `outer_diameter`, `wall_thickness`, `width` or `height`, as the section has them.

    Raises:
        InputError: for an unknown design or dimension; names the nearest.
        ValueError: for impossible dimensions.
    """
    table = _table_of(design)
    kind = table.text.get("section", "annulus")
    values = table.values()
    known = [key for key in SECTION_KEYS if key in values]
    _check_changes(changes, known)
    values = {key: values[key] for key in known} | changes
    if kind == "polygon":
        lines = {key: np.asarray(line.points) for key, line in table.lines.items()}
        return polygon(lines["outer_line"], values.get("wall_thickness"), lines.get("bore_line"))
    build = {"annulus": annulus, "semicircle": semicircle, "rectangle": rectangle}[kind]
    return build(*(values[key] for key in SECTIONS[kind]))  # type: ignore[operator]


def _check_changes(changes: dict[str, float], known: tuple[str, ...] | list[str]) -> None:
    for key in changes:
        if key not in known:
            raise InputError(f"{key!r} is not a dimension of this actuator: {nearest(key, known)}")


def _check_fibre(changes: dict[str, float], arrangement: Layout, inextensible: bool) -> None:
    """Refuse a stiffness of the fibre that would not act.

    Raises:
        InputError: saying why.
    """
    fibre = arrangement.fibre_angle is not None or arrangement.fibre_place is not None
    if "fibre_stiffness" in changes and (inextensible or not fibre):
        why = "its fibre is taken as inextensible; see `inextensible`" if fibre else "there is no fibre"
        raise InputError(f"'fibre_stiffness' changes nothing in this actuator: {why}")


def design_loads(
    design: Design, actuator: Actuator, silicone_density: float | None = None
) -> tuple[Load, ...]:
    """Weight and tip force that a design's table describes.

    Args:
        design: name or path of a table of kind actuator, or a loaded one.
        actuator: its body, whose mass is taken.
        silicone_density: [kg/m3]; that of the design's material if None.

    Raises:
        InputError: if the actuator is weighed and its material has no density.
    """
    table = _table_of(design)
    values = table.values()
    place = np.asarray([values["tip_x"], values["tip_y"]]) if "tip_x" in values else None
    loads: list[Load] = []
    fall = _stated_gravity(table)
    if fall is not None and np.any(fall):
        if silicone_density is None:
            material = load_calibration(named_table(table, "material"), kind="silicone")
            silicone_density = material.require(["density"])["density"]
        loads.append(weight(actuator, silicone_density, fall, values.get("tip_mass", 0.0), place))
    force = [values.get(f"tip_force_{axis}", 0.0) for axis in "xyz"]
    if any(force):
        centroid = actuator.section.enclosed_centroid
        loads.append(TipForce(np.asarray(force), centroid if place is None else place))
    return tuple(loads)


def _stated_gravity(table: Calibration) -> np.ndarray | None:
    """Acceleration of gravity that a table states [m/s2]; None where it states none."""
    if "orientation" in table.text:
        return gravity_vector(table.text["orientation"])
    keys = [f"gravity_{axis}" for axis in "xyz"]
    if not any(key in table.quantities for key in keys):
        return None
    return np.asarray([table.values().get(key, 0.0) for key in keys])


def design_gravity(design: Design) -> Float[np.ndarray, "3"]:
    """Acceleration of gravity in the base frame of a design [m/s2], for effects.

    It is the one that the design's table states, which weighs the actuator itself. Without one, the actuator
    is clamped below, tip up.

    Raises:
        InputError: if there is no such design; names the nearest.
    """
    stated = _stated_gravity(_table_of(design))
    return gravity_vector(USUAL_ORIENTATION) if stated is None else stated


def make_actuator(
    design: Design = "pneusma2",
    alloy: Alloy | str | Calibration | None = None,
    silicone: SiliconeLaw | str | Calibration | None = None,
    geometry: Geometry | None = None,
    inextensible: bool = True,
    **changes: float,
) -> Actuator:
    """Actuator of a design, with the loads that its table describes.

    Args:
        design: `"pneusma1"`, `"pneusma2"`, `"pneuflex_s"`, `"pneuflex_t"`, `"pneuflex_w"`, `"triad"`, one of
            the shipped examples, the path of a table of kind actuator, or a loaded one.
        alloy: an `Alloy`, the name of a shipped one, a path, or a loaded table; the design's own if None.
        silicone: a law, or a silicone in any of these forms; the design's own if None.
        geometry: dimensions; the design's own if None.
        inextensible: see `build_actuator`.
        **changes: dimensions to change [SI], as for `design_geometry` and `design_section`.

    Raises:
        InputError: for an unknown name, where it names the nearest, and for a `fibre_stiffness` on which
            nothing depends.
        ValueError: for impossible dimensions, and springs that overlap or lie away from the wall.
    """
    table = _table_of(design)
    as_described = geometry is None and not changes and table.path is not None
    shape = [key for key in SECTION_KEYS if key in table.quantities]
    _check_changes(changes, [*GEOMETRY_KEYS, *shape])
    of_geometry = {key: value for key, value in changes.items() if key in GEOMETRY_KEYS}
    if geometry is None:
        geometry = design_geometry(table, **of_geometry)
    else:
        stated = {key: getattr(geometry, key) for key in GEOMETRY_KEYS}
        geometry = dataclasses.replace(geometry, **_followed(stated, of_geometry))
    sized = {key: getattr(geometry, key) for key in shape if key in GEOMETRY_KEYS}
    sized |= {key: value for key, value in changes.items() if key in shape}
    arrangement = layout(table)
    _check_fibre(changes, arrangement, inextensible)
    if alloy is None and arrangement.spring_numbers:
        alloy = named_table(table, "alloy")
    silicone = named_table(table, "material") if silicone is None else silicone
    density = None
    if isinstance(silicone, str | Calibration):
        silicone = load_calibration(silicone, kind="silicone")
        density = silicone.values().get("density")
        silicone = load_silicone(silicone)
    alloy = load_alloy(alloy) if isinstance(alloy, str | Calibration) else alloy
    try:
        section = design_section(table, **sized)
        body = build_actuator(section, arrangement, geometry, alloy, silicone, inextensible)
    except ValueError as error:
        if not as_described or isinstance(error, InputError):
            raise
        raise InputError(f"{table.path}: {error}") from None
    return body.with_loads(*design_loads(table, body, density))


def fresh_states(actuator: Actuator, geometry: Geometry) -> tuple:
    """A newly attached spring's memory, one per spring: stretched cold to the geometry's pre-strain."""
    return dataclasses.replace(actuator, prestrain=geometry.prestrain).fresh_states()
