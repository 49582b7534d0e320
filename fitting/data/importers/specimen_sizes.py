"""The gauge length and the cross-section of a specimen, from the user or the file; and contradictions of a
file."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..recordings import schema
from ..recordings.kinds import TUBE
from ..recordings.nominal import nominal_geometry
from ..recordings.sidecar import implausible_size
from ..recordings.table import unusable
from .making import Making
from .rounding import shortest
from .size_names import names_the_first, names_the_mean
from .sizes import SAME, Size

AREAS = (("area_mm2",), ("diameter_mm",), ("width_mm", "thickness_mm"))
"""Dimensions that make a cross-section; the first set that is known is taken."""

ROUNDING = 1e-3
"""Maximum relative difference of one size that is stated twice, in two units for example."""
_OF_THE_FILE = {
    "gauge_length_mm": ("gauge_length_mm", "length"),
    "length_mm": ("length_mm", "free_length_mm", "length", "gauge_length_mm"),
    "free_length_mm": ("free_length_mm", "length"), "wire_diameter_mm": ("wire_diameter_mm", "diameter_mm"),
    "outer_diameter_mm": ("outer_diameter_mm", "diameter_mm"),
    "wall_thickness_mm": ("wall_thickness_mm", "thickness_mm"),
}  # fmt: skip
"""Sizes that a file may state in place of one of the user's."""

_WIRES_ACROSS = {
    "coil_diameter_mm": 1.0, "coil_outer_diameter_mm": 2.0, "outer_diameter_mm": 2.0,
    "inner_diameter_mm": 0.0,
}  # fmt: skip
"""Number of wire diameters by which a diameter of a coil exceeds its mandrel's."""


def gauge_length_mm(making: Making, quiet: bool = False) -> float | None:
    """Length between the grips, stated by the user or by the file (with a notice); None if unknown."""
    stated = making.options.dimensions.get("gauge_length_mm")
    if stated is not None:
        making.use("--dimension", "gauge_length_mm")
        return stated
    for key in ("gauge_length_mm", "length", "free_length_mm"):
        if key in making.sizes:
            _notice_dimension(making, key, "the gauge length", quiet, "gauge_length_mm")
            return making.sizes[key].value
    return None


def area_mm2(making: Making, quiet: bool = False) -> float | None:
    """Cross-section, stated by the user or by the file (with a notice); None if unknown."""
    sizes = dict(making.options.dimensions)
    if making.kind == "wire" and "wire_diameter_mm" in sizes:
        sizes.setdefault("diameter_mm", sizes["wire_diameter_mm"])
        making.use("--dimension", "wire_diameter_mm")
    by_user = area_of(sizes)
    if by_user:
        for name in by_user[0]:
            making.use("--dimension", name)
        return by_user[1]
    found = {key: size.value for key, size in making.sizes.items()} | sizes
    if not quiet:
        _compare_areas(making, found)
    known = area_of(found)
    if known is None:
        return None
    for name in known[0]:
        if name in sizes:
            making.use("--dimension", name)
        else:
            _notice_dimension(making, name, "the " + name.rpartition("_")[0], quiet)
    return known[1]


def say_other_sizes(making: Making) -> None:
    """Warn of sizes that the user states and that contradict the file's own, with both values."""
    used = {name for option, name in making.options.used.names if option == "--dimension"}
    stated = {name: size for name, size in making.options.dimensions.items() if name in used}
    compared = set()
    for name, size in stated.items():
        key = next((key for key in _OF_THE_FILE.get(name, (name,)) if key in making.sizes), None)
        if key is not None:
            compared.add(key)
            _say_other(making, (name,), size, making.sizes[key].value, (key,))
    by_user = area_of(stated)
    by_file = area_of({key: size.value for key, size in making.sizes.items()})
    if by_user and by_file and not compared & {*by_file[0]}:
        _say_other(making, by_user[0], by_user[1], by_file[1], by_file[0], "mm2")


def _say_other(
    making: Making, names: tuple[str, ...], size: float, of_file: float, keys: tuple[str, ...], unit: str = ""
) -> None:
    """Warn of a size of the user and one of the file, if they differ."""
    if abs(size - of_file) <= ROUNDING * abs(size):
        return
    unit = unit or names[0].rpartition("_")[2]
    said = ", ".join(repr(making.sizes[key].said) for key in keys)
    options = " ".join(f"--dimension {name}={making.options.dimensions[name]:.6g}" for name in names)
    making.warn(
        f"the file states {of_file:.6g} {unit} ({said}), and {options} another size: {size:.6g} {unit} was"
        " used"
    )


def _compare_areas(making: Making, found: Mapping[str, float]) -> None:
    """Report two cross-sections of a file, by its area, diameter, or width and thickness, that differ."""
    known = [names for names in AREAS if set(names) <= found.keys()]
    areas = {names: _area(names, [found[n] for n in names]) for names in known}
    for names, area in list(areas.items())[1:]:
        first, taken = next(iter(areas.items()))
        if abs(area / taken - 1.0) > SAME:
            said = [making.sizes[name].said for name in names if name in making.sizes]
            making.warn(
                f"the cross-section is {taken:.6g} mm2 by its {_worded(first)}, which was taken, but"
                f" {area:.6g} mm2 by its {_worded(names)}"
                + (f" ({', '.join(map(repr, said))})" if said else "")
                + "; --dimension area_mm2=... decides"
            )


def _worded(names: tuple[str, ...]) -> str:
    return " and ".join(name.rpartition("_")[0] for name in names)


def area_of(sizes: Mapping[str, float]) -> tuple[tuple[str, ...], float] | None:
    """The first set of `AREAS` that is known, and the cross-section that it makes [mm2]; None without one."""
    names = next((names for names in AREAS if set(names) <= sizes.keys()), None)
    return None if names is None else (names, _area(names, [sizes[name] for name in names]))


def _area(names: tuple[str, ...], values: list[float]) -> float:
    """Cross-section of a set of `AREAS` [mm2], from its sizes [mm, or mm2]."""
    if names == ("diameter_mm",):
        return math.pi * values[0] ** 2 / 4.0
    return math.prod(values)


def geometry_of_file(making: Making) -> dict[str, float]:
    """Sizes of a spring or a tube that the file states and the user does not, by key of `[geometry]`.

    Each is told in a notice. A mandrel follows from a coil's diameter less the wire's.
    """
    geometry = {}
    for key in schema.KINDS[making.kind].sizes:
        if key in making.options.dimensions:
            continue
        if key in making.sizes:
            geometry[key] = making.sizes[key].value
            _notice_dimension(making, key, "the " + worded(key), quiet=False)
    if making.kind == "spring" and "mandrel_diameter_mm" not in making.options.dimensions:
        geometry |= _mandrel(making, {**geometry, **making.options.dimensions})
    known = {**geometry, **making.options.dimensions}
    if making.kind == "tube" and "length_mm" not in known and (key := _at_rest(making)):
        geometry["length_mm"] = making.sizes[key].value
        known["length_mm"] = making.sizes[key].value
        _notice_dimension(making, key, "the length at rest", quiet=False, named="length_mm")
    if making.kind == "tube" and "length" in making.sizes and "length_mm" not in known:
        size = making.sizes["length"]
        making.warn(
            f"the length is {size.value:.6g} mm, as the file states ({size.said!r}): right if that is the"
            " tube's at rest (--dimension length_mm=... corrects it)"
            + _doubts(size, "mm", "--dimension length_mm=...")
        )
        geometry["length_mm"] = size.value
    if making.kind == "tube" and "inner_diameter_mm" in making.sizes:
        geometry |= _by_bore(making, known)
    return geometry


def say_sizes_of_the_source(
    geometry: Mapping[str, Any], columns: Mapping[str, np.ndarray], making: Making
) -> None:
    """Warn of sizes of a tube that nobody states, beside some that are stated: those of the source count.

    The length at rest stands beside that of the first row. A line that may state a size is asked about
    instead.

    Args:
        geometry: what is stated, by key of `[geometry]`.
        columns: columns of the recording, in canonical units.
        making: what is known of the recording.
    """
    sizes = TUBE.sizes
    missing = [key for key in sizes if key not in geometry]
    if making.kind != "tube" or not missing or len(missing) == len(sizes) or making.unread:
        return
    nominal = nominal_geometry(making.kind, dict(geometry))
    said = ", ".join(f"{key} = {nominal[key]:.6g}" for key in missing)
    options = " ".join(f"--dimension {key}=..." for key in missing)
    length, pressure = columns["length_mm"][0], columns["pressure_kPa"][0]
    if "length_mm" in missing and np.isfinite([length, pressure]).all():
        said += f" (the first row has {length:.4g} mm at {pressure:.3g} kPa)"
    making.warn(f"nobody states all sizes, so some are the source's: {said}. State yours: {options}")


def length_at_rest_mm(making: Making) -> float | None:
    """Length of a tube or an actuator at rest, stated by the user or by the file; None if unknown."""
    stated = making.options.dimensions.get("length_mm")
    keys = ("length_mm", _at_rest(making), "length")
    of_file = [making.sizes[key].value for key in keys if key in making.sizes]
    return stated if stated is not None else next(iter(of_file), None)


def _at_rest(making: Making) -> str:
    """Key of the size that the file names a tube's length at rest; empty without one."""
    if making.kind != "tube":
        return ""  # an actuator's springs have lengths of their own
    if "free_length_mm" in making.sizes:
        return "free_length_mm"
    first = making.sizes.get("gauge_length_mm")
    return "gauge_length_mm" if first is not None and names_the_first(first.said) else ""


def repeats_an_option(key: str, size: Size, making: Making) -> bool:
    """True if `--dimension` states the same number for a size of the file."""
    return any(
        key in _OF_THE_FILE.get(name, (name,)) and abs(stated - size.value) <= ROUNDING * abs(stated)
        for name, stated in making.options.dimensions.items()
    )


def _by_bore(making: Making, known: Mapping[str, float]) -> dict[str, float]:
    """Wall thickness or outer diameter of a tube [mm] by its bore; nothing where both are known.

    A bore that contradicts them is asked about.
    """
    bore, outer, wall = making.sizes["inner_diameter_mm"], *map(known.get, TUBE.sizes[:2])
    said = f"the bore that the file states ({bore.said!r})"
    if outer is not None and bore.value >= outer:
        raise unusable(
            making.place, f"{said} is {bore.value:.6g} mm, no less than the outer diameter of {outer:.6g} mm;"
            " --dimension outer_diameter_mm=... and wall_thickness_mm=... correct them"
        )
    if outer is not None and wall is not None:
        if abs(outer - 2.0 * wall - bore.value) > SAME * bore.value:
            making.warn(
                f"{said} was not used: outer diameter and wall thickness make {outer - 2.0 * wall:.6g} mm;"
                " --dimension outer_diameter_mm=... or wall_thickness_mm=... decides"
            )
        else:
            _tell(making, f"outer diameter and wall thickness agree with {said}", bore, "wall_thickness_mm")
        return {}
    if outer is None and wall is None:
        making.warn(f"{said} was not used: state --dimension outer_diameter_mm=... or wall_thickness_mm=...")
        return {}
    key = "outer_diameter_mm" if outer is None else "wall_thickness_mm"
    value = bore.value + 2.0 * wall if outer is None else (outer - bore.value) / 2.0
    by = "the wall thickness" if outer is None else "the outer diameter"
    size = float(shortest(value, bore.value))
    _tell(making, f"the {worded(key)} is {size:.6g} mm, by {by} and {said}", bore, key)
    return {key: size}


def worded(key: str) -> str:
    """A key of `[geometry]` in words: `wire diameter`."""
    return key.removesuffix("_mm").replace("_", " ")


def _mandrel(making: Making, known: Mapping[str, float]) -> dict[str, float]:
    """Diameter of the mandrel [mm] by a diameter of the coil; nothing where the file states it itself.

    Diameters that contradict a stated mandrel, or each other, are asked about.
    """
    wire, mandrel, taken = known.get("wire_diameter_mm"), known.get("mandrel_diameter_mm"), ""
    option = "--dimension mandrel_diameter_mm=..."
    for key in (key for key in _WIRES_ACROSS if key in making.sizes):
        said = f"the file states {making.sizes[key].said!r}"
        if wire is None and _WIRES_ACROSS[key]:
            making.warn(f"{said}, but no wire diameter, so no mandrel follows from it; state {option}")
            continue
        found = _mandrel_by(making, key, wire or 0.0)
        if mandrel is None:
            mandrel, taken = found, key
            _say_mandrel(making, key, found, wire or 0.0)
        elif abs(mandrel - found) > SAME * found:
            also = f"by {making.sizes[taken].said!r}, " if taken else ""
            making.warn(
                f"{said}, which with a wire of {wire or 0.0:.6g} mm makes a mandrel of {found:.6g} mm, but"
                f" also a mandrel of {mandrel:.6g} mm, {also}which was taken; {option} decides"
            )
        else:
            agrees = f"{said}, which agrees with a mandrel of {mandrel:.6g} mm"
            _tell(making, agrees, making.sizes[key], "mandrel_diameter_mm")
    return {"mandrel_diameter_mm": mandrel} if taken else {}


def _mandrel_by(making: Making, key: str, wire: float) -> float:
    """Diameter of the mandrel [mm] by one of `_WIRES_ACROSS` that the file states, with a notice.

    Raises:
        InputError: if the wire does not fit into the coil.
    """
    size, option = making.sizes[key], "--dimension mandrel_diameter_mm=..."
    mandrel = float(shortest(size.value - _WIRES_ACROSS[key] * wire, size.value))
    if mandrel <= 0.0:
        raise unusable(
            making.place, f"the file states {size.said!r}, which a wire of {wire:.6g} mm does not fit into;"
            f" {option} corrects it"
        )
    return mandrel


def _say_mandrel(making: Making, key: str, mandrel: float, wire: float) -> None:
    """Tell the mandrel that a diameter of the coil makes; ask where that may be the outer one."""
    size, said = making.sizes[key], making.sizes[key].said
    text = f"the mandrel diameter is {mandrel:.6g} mm, by the coil that the file states ({said!r})"
    if key != "coil_diameter_mm" or names_the_mean(said):
        _tell(making, f"{text} and its wire" if _WIRES_ACROSS[key] else text, size, "mandrel_diameter_mm")
        return
    outer = f" ({mandrel - wire:.6g} mm if it is the outer one)" if mandrel > wire else ""
    making.warn(
        f"{text}, taken as the mean one, and its wire{outer}; --dimension mandrel_diameter_mm=... corrects it"
        + _doubts(size, "mm", "--dimension mandrel_diameter_mm=...", "that size's")
    )


def _tell(making: Making, text: str, size: Size, key: str) -> None:
    """Tell what follows from a size that the file states; ask if that size is in doubt.

    Args:
        making: state of the import.
        text: what follows.
        size: size that the file states [mm].
        key: name in `--dimension` of what follows.
    """
    doubts = _doubts(size, "mm", f"--dimension {key}=...", "that size's")
    (making.warn if doubts else making.say)(text + doubts)


def _doubts(size: Size, unit: str, option: str, whose: str = "its") -> str:
    """What is in doubt about a size that a file states, as the end of a sentence; empty without a doubt."""
    said = ""
    if size.others:
        said += f"; but it also states {', '.join(map(repr, size.others))} ({option} to decide)"
    if size.grouped:
        said += f"; or {size.grouped:.6g} {unit}, if {whose} mark groups thousands ({option} decides)"
    if size.divided:
        said += f"; {whose} comma was taken as a decimal mark ({option} to correct)"
    if size.assumed:
        said += f"; {whose} unit is not stated and was taken as {unit} ({option} to correct)"
    return said


def _notice_dimension(making: Making, key: str, what: str, quiet: bool, named: str = "") -> None:
    """Report a dimension that was read from the file, with a warning if its unit was assumed.

    Args:
        making: state of the import.
        key: name of the size.
        what: the size in words.
        quiet: true to report nothing.
        named: name in `--dimension`, where it is not that of the size.

    Raises:
        InputError: if no specimen has that size.
    """
    size = making.sizes[key]
    unit = "mm2" if key == "area_mm2" else "" if key == "active_coils" else "mm"
    amount = f"{size.value:.6g} {unit}".rstrip()
    verb = "are" if key == "active_coils" else "is"
    text = f"{what} {verb} {amount}, as the file states ({size.said!r})"
    named = named or ("gauge_length_mm" if key == "length" else key)
    option = f"--dimension {named}=..."
    if quiet:
        return
    if wrong := implausible_size(named, size.value, unit or "1"):
        raise unusable(
            making.place, f"{what}, as the file states it ({size.said!r}): {wrong}; {option} corrects it"
        )
    if doubts := _doubts(size, unit, option):
        making.warn(text + doubts)
    elif key in ("length", "free_length_mm") and named == "gauge_length_mm":
        making.warn(f"{text}: right if that is the length between the grips ({option} to correct)")
    else:
        making.say(text)
