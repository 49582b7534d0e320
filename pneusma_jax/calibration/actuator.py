"""Checks of relations between the parts of an actuator's table, one sentence each."""

from collections.abc import Collection, Mapping
from pathlib import Path

from ..errors import InputError
from . import keys

_PLACE_KEYS = ("angle", "x", "y")


def check_actuator(
    text: Mapping[str, str], numbers: Collection[str], lines: Collection[str], path: str | Path
) -> None:
    """Refuse an actuator whose parts contradict each other.

    Args:
        text: the strings of the table, each already one of the words that it may be.
        numbers: names of the quantities that are there.
        lines: names of the outlines that are there.
        path: path of the table, for messages.

    Raises:
        InputError: one line with the file, the key and what would be right.
    """
    _check_section(text.get("section", "annulus"), numbers, lines, path)
    _check_places(text, numbers, path)
    _check_loads(text, numbers, path)
    if text.get("bending") == "free" and "bending_plane" in numbers:
        raise InputError(f"{path}: bending is 'free', so there can be no 'bending_plane': keep one")


def _check_section(kind: str, numbers: Collection[str], lines: Collection[str], path: str | Path) -> None:
    for other, dimensions in keys.SECTIONS.items():
        for key in dimensions:
            if key in numbers and key not in (*keys.SECTIONS[kind], "wall_thickness"):
                raise InputError(f"{path}: key {key!r} is of section {other!r}, but section is {kind!r}")
    if kind != "polygon":
        for key in lines:
            raise InputError(f"{path}: key {key!r} is of a section 'polygon', but section is {kind!r}")
        return
    if "outer_line" not in lines:
        raise InputError(f"{path}: key 'outer_line' is missing, and a polygon cannot do without it")
    if ("bore_line" in lines) == ("wall_thickness" in numbers):
        raise InputError(f"{path}: a polygon needs either 'wall_thickness' or 'bore_line', and not both")


def _check_places(text: Mapping[str, str], numbers: Collection[str], path: str | Path) -> None:
    for k, side in enumerate(keys.SIDES, 1):
        given = [stem for stem in _PLACE_KEYS if f"{stem}_{k}" in numbers]
        word = text.get(side, "none")
        if given and word == "none":
            raise InputError(f"{path}: key '{given[0]}_{k}' places {side!r}, where nothing is: set {side!r}")
        if given not in ([], ["angle"], ["x", "y"]):
            raise InputError(f"{path}: {side} needs either 'angle_{k}', or both 'x_{k}' and 'y_{k}'")
        if k > 3 and word != "none" and not given:
            raise InputError(
                f"{path}: {side} needs 'angle_{k}', or 'x_{k}' and 'y_{k}': only sides 1 to 3 have usual ones"
            )
    if sum(text.get(side) == "fibre" for side in keys.SIDES) > 1:
        raise InputError(f"{path}: more than one side is a 'fibre', but only one fibre is modelled")


def _check_loads(text: Mapping[str, str], numbers: Collection[str], path: str | Path) -> None:
    components = [key for key in ("gravity_x", "gravity_y", "gravity_z") if key in numbers]
    if "orientation" in text and components:
        raise InputError(f"{path}: 'orientation' and {components[0]!r} both say how gravity acts: keep one")
    weighed = "orientation" in text or components
    if "tip_mass" in numbers and not weighed:
        raise InputError(f"{path}: 'tip_mass' weighs nothing without gravity: add an 'orientation'")
    if ("tip_x" in numbers) != ("tip_y" in numbers):
        raise InputError(f"{path}: a place on the tip needs both 'tip_x' and 'tip_y'")
