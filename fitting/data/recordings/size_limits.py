"""Limits that the stated sizes of a specimen set to its resistance, current, force and length."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pneusma_jax.errors import counted

from . import schema
from .impossible import refuse_beyond, refuse_first
from .named_tables import load_named
from .questions import ask
from .recording import Recording
from .table import unusable

CURRENT_LIMIT_A = 100.0
"""Maximum current of a spring [A]. By Preece's rule a wire of 1 mm melts in still air at 80 A if it is
of copper, and at 25 A if it is of iron. More is a current in the wrong unit, such as mA."""


def check_tube(recording: Recording, where: Path | str) -> None:
    """Refuse a wall that leaves no bore."""
    geometry = recording.full_geometry()
    outer, wall = geometry.get("outer_diameter_mm"), geometry.get("wall_thickness_mm")
    if outer is not None and wall is not None and 2.0 * wall >= outer:
        raise unusable(
            where, f"[geometry] wall_thickness_mm = {wall:g} leaves no bore in outer_diameter_mm = {outer:g};"
            f" the wall must be less than {outer / 2.0:g}",
        )  # fmt: skip


def wire_length(geometry: dict) -> float:
    """Length of wire in the active coils [m]: n sqrt((pi D)^2 + p^2), D = mandrel + wire (Eqs. 2.1-2.2).

    Args:
        geometry: full geometry, canonical keys in mm.
    """
    diameter = geometry["mandrel_diameter_mm"] + geometry["wire_diameter_mm"]
    return 1e-3 * geometry["active_coils"] * math.hypot(math.pi * diameter, geometry["initial_pitch_mm"])


def resistance_range(recording: Recording) -> tuple[float, float] | None:
    """Possible resistances of a spring of the recording's alloy [ohm]: half the least to twice the most.

    None if unbounded: for no coil geometry (a straight wire), an alloy to be identified, or a table without
    resistivity.

    Raises:
        InputError: if the alloy cannot be found.
    """
    geometry = recording.full_geometry()
    if "active_coils" not in geometry or geometry.get("alloy", "fit") == "fit":
        return None
    alloy = load_named(recording.table("alloy"), "alloy").values()
    if not {"rho_mean", "rho_span", "alpha_1", "alpha_2"} <= alloy.keys():
        return None
    martensite = [alloy["rho_mean"] + sign * alloy["rho_span"] / 2.0 for sign in (-1.0, 1.0)]
    austenite = [alloy["alpha_1"], alloy["alpha_1"] + alloy["alpha_2"]]
    # Which phase resists more differs between alloys, so both ends look at both.
    least, most = min(martensite + austenite), max(martensite + austenite)
    length = wire_length(geometry)
    return 0.5 * least * length, 2.0 * most * length


def check_resistance(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    """Refuse resistances that the alloy and the sizes of a spring exclude."""
    resistances = [
        name for name in recording.known_columns if schema.quantity_and_unit(name)[0].startswith("resistance")
    ]
    bounds = resistance_range(recording) if resistances else None
    if bounds is None:
        _check_resistivity(recording, resistances, place, rows)
        return
    geometry = recording.full_geometry()
    right = (
        f"half to twice the range of alloy {geometry['alloy']!r} on {geometry['active_coils']:g} coils is"
        f' {bounds[0]:.3g} to {bounds[1]:.3g} ohm. State the spring in [geometry], with '
        '--dimension where it is imported, or alloy = "fit"'
    )
    for name in resistances:
        values = recording.columns[name]
        refuse_first((values < bounds[0]) | (values > bounds[1]), recording, right, place, rows, name)


RESISTIVITY = (3e-8, 2e-5)
"""Resistivities of a wire of unknown alloy [ohm m]. Nitinol has 5e-7 to 1.1e-6."""


def _check_resistivity(
    recording: Recording, resistances: Sequence[str], place: Path | str, rows: Sequence[int]
) -> None:
    """Refuse resistances that no metal has, of a spring whose sizes are stated."""
    sizes = ("wire_diameter_mm", "active_coils")
    geometry = recording.full_geometry()
    if not set(sizes) <= recording.geometry.keys() or not {"mandrel_diameter_mm", *sizes} <= geometry.keys():
        return
    area = math.pi / 4.0 * (1e-3 * geometry["wire_diameter_mm"]) ** 2
    least, most = (resistivity * wire_length(geometry) / area for resistivity in RESISTIVITY)
    right = (
        f"a spring of {geometry['active_coils']:g} coils of a wire of {geometry['wire_diameter_mm']:g} mm has"
        f" {least:.3g} to {most:.3g} ohm"
    )
    for name in resistances:
        refuse_beyond(recording, name, (least, most), right, place, rows)


STRONGEST_MPA = 3000.0
"""Maximum tension of a wire [MPa]. Drawn nitinol breaks at 1000 to 2000 MPa, spring steel below 3000."""
UNWOUND = 1.5
"""Maximum elongation of a spring over the wire in its coils [1]. Hooks and end coils unwind, too, and the
wire stretches by some 10 % before it breaks."""
TIMES_LENGTH = 3.0
"""Maximum ratio of the least length of a recording to the length at rest, and of that to the largest [1]. A
pressed tube stretches less: silicone tubes burst first. Units of length differ by 10 or more."""


def check_against_sizes(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    """Refuse currents that no spring bears; forces, elongations and lengths that no specimen of the stated
    sizes has. Single lengths of this kind are asked about."""
    stated, geometry = recording.geometry, recording.full_geometry()
    for name in (name for name in recording.known_columns if name.startswith("current")):
        said = f"the wire of a spring melts below {CURRENT_LIMIT_A:g} A"
        refuse_beyond(recording, name, (-CURRENT_LIMIT_A, CURRENT_LIMIT_A), said, place, rows)
    if recording.kind == "spring" and "wire_diameter_mm" in stated:
        wire = geometry["wire_diameter_mm"]
        most = STRONGEST_MPA * math.pi / 4.0 * wire**2  # of a straight wire, more than a coil bears
        said = f"a wire of {wire:g} mm breaks below {most:.3g} N"
        refuse_beyond(recording, "force_N", (-most, most), said, place, rows)
    if recording.kind == "spring" and {"mandrel_diameter_mm", "active_coils"} <= stated.keys():
        length = 1e3 * wire_length(geometry)
        said = f"the coils have {length:.3g} mm of wire"
        refuse_beyond(recording, "elongation_mm", (-length, UNWOUND * length), said, place, rows)
    if "length_mm" in recording.columns and "length_mm" in stated:
        rest, values = geometry["length_mm"], recording.columns["length_mm"]
        if np.nanmin(values) > TIMES_LENGTH * rest or np.nanmax(values) < rest / TIMES_LENGTH:
            said = f"[geometry] length_mm = {rest:g} is the length at rest"
            ends = rest / TIMES_LENGTH, TIMES_LENGTH * rest
            refuse_beyond(recording, "length_mm", ends, said, place, rows)
        _ask_about_lengths(recording, rest, rows)


def _ask_about_lengths(recording: Recording, rest: float, rows: Sequence[int]) -> None:
    """Ask about lengths that no specimen of this length at rest [mm] has, beside others that it may have."""
    values = recording.columns["length_mm"]
    beyond = np.flatnonzero((values < rest / TIMES_LENGTH) | (values > TIMES_LENGTH * rest))
    if beyond.size:
        first = beyond[0]
        others = f" and {counted(beyond.size - 1, 'other row')}" if beyond.size > 1 else ""
        ask(
            recording,
            f"check: row {rows[first]}{others}: length_mm = {values[first]:g}, though {rest:g} is the length"
            " at rest: are the headings of two columns swapped, or are these no readings?",
        )
