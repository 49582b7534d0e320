"""Questions about values that are possible but unusual, mostly because another unit is meant."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from pneusma_jax.units import amount

from . import schema
from .column_ranges import PRESSURE_LIMIT_KPA
from .impossible import refuse_first
from .named_tables import load_named
from .other_units import other_units
from .pressure_units import LEAST_KPA
from .questions import ask
from .recording import Recording
from .sidecar import unusual_size
from .table import unusable

KELVIN = (233.0, 473.0)
"""Temperatures that are rather kelvin than degC, where all of a recording lie there: -40 to 200 degC."""
HOTTEST_DEGC = 150.0
"""Middle of a transformation, above which an alloy may be tested at such temperatures in degC."""


def check_kelvin(recording: Recording, place: Path | str) -> None:
    """Ask about temperatures in degC that all look like kelvin. They are refused for a known alloy that
    transforms lower."""
    for name in (name for name in recording.known_columns if name.startswith("temperature")):
        least, most = np.nanmin(recording.columns[name]), np.nanmax(recording.columns[name])
        if not (KELVIN[0] < least and most < KELVIN[1]) or _transforms_hot(recording):
            continue
        right = "if these are kelvin, name the column temperature_K (on import: --unit temperature=K)"
        said = f"temperatures of {least:g} to {most:g} degC in every row"
        if (alloy := recording.geometry.get("alloy", "fit")) != "fit":
            said += f", but the alloy {str(alloy)!r} transforms lower: {right}"
            raise unusable(place, said, column=name)
        ask(recording, f"check: {said} of {name}: {right}")


def ask_about_sizes(recording: Recording) -> None:
    """Ask about dimensions that few specimens have, though their unit may be right."""
    for key, value in recording.geometry.items():
        if key not in schema.GEOMETRY_NUMBERS:
            continue
        if why := unusual_size(key, value, schema.geometry_unit(key)):
            ask(recording, f"check: [geometry] {key}: {why}")


def ask_about_noise(recording: Recording) -> None:
    """Ask about a stated noise that is more than every reading of its column."""
    for name, deviation in recording.noise.items():
        readings = np.abs(recording.columns.get(name, np.zeros(1)))
        most = 0.0 if np.isnan(readings).all() else float(np.nanmax(readings))
        if 0.0 < most < deviation:
            said = f"{deviation:g} is more than the largest reading, {most:g}"
            ask(recording, f"check: [noise] {name}: {said}; is its unit right?")


def ask_about_units(
    recording: Recording, written: Mapping[str, str], stated: Collection[str] = ()
) -> None:
    """Ask about columns whose numbers fit another unit of their dimension far better than the written one.

    Args:
        recording: checked recording; questions are added to its notices.
        written: units in which the file states its columns, by canonical name.
        stated: quantities whose units the user states; nothing is asked about these.
    """
    named = recording.full_geometry().get("material", "fit")
    material = None if named == "fit" else load_named(recording.table("material"), "silicone")
    for question in other_units(recording, material, written):
        if question.quantity not in stated:
            ask(recording, f"check: {question.text}")


def _transforms_hot(recording: Recording) -> bool:
    """True for a recording whose alloy is a table of one that transforms above any nitinol."""
    if recording.full_geometry().get("alloy", "fit") == "fit":
        return False
    return load_named(recording.table("alloy"), "alloy").values().get("T_mid", 0.0) > HOTTEST_DEGC


def question_units(recording: Recording, header: Sequence[str], rows: Sequence[int]) -> None:
    """Refuse or ask about a plain number that is rather percent, where the name of its column states no unit.

    Args:
        recording: recording with columns in canonical units; a question is added to its notices.
        header: names of the columns as they are written.
        rows: line number in the file of each sample.

    Raises:
        InputError: for a magnitude that is too far.
    """
    for name, far in schema.KINDS[recording.kind].farthest.items():
        if name not in header or name not in recording.columns:
            continue
        values = recording.columns[name]
        most = float(np.nanmax(np.abs(values)))
        kind, place = recording.kind, recording.path or recording.name
        right = f"if these are percent, name the column {name}_percent, if fractions {name}_mm/mm"
        too_far = f"no {kind} has a {name} that large; {right}"
        refuse_first(np.abs(values) > far.refused, recording, too_far, place, rows, name)
        if most > far.asked:
            recording.notices.append(f"{name} reaches {most:g}, as in few recordings of kind {kind}; {right}")


def plainly_named(recording: Recording) -> dict[str, np.ndarray]:
    """Columns by the names under which they can be read again: with a unit where it would be asked for."""
    far = schema.KINDS[recording.kind].farthest
    return {
        f"{name}_mm/mm" if name in far and np.nanmax(np.abs(values)) > far[name].asked else name: values
        for name, values in recording.columns.items()
    }


USUAL: dict[str, tuple[float, float]] = {
    "pressure_kPa": (LEAST_KPA, PRESSURE_LIMIT_KPA),
    "length_mm": (1.0, 5e3),
    "elongation_mm": (0.1, 2e3),
    "force_N": (5e-3, 500.0),
    "resistance_ohm": (0.02, 1e3),
    "current_A": (1e-3, 30.0),
    "stress_kPa": (0.3, math.inf),
    "stress_MPa": (0.5, math.inf),
    "curvature_1pm": (0.1, 2e3),
}
"""Least and most of what the largest reading of a column usually is, in its unit; others are asked about.

Most limits are a decade wider than what is known. Balloons of soft gels inflate at 1 to 5 kPa. Wires of 50 um
to 1 mm make springs that pull with 0.02 to 50 N, over 1 to 200 mm, and have 0.2 to 200 ohm. They heat at
0.05 to 5 A, and 5 mA are enough to sense. Gels bear 1 kPa, wires without a load some MPa. Actuators bend to a
radius of 5 mm. A factor of 1000 from an ordinary reading leads outside. Import asks about larger stresses.
"""
THOUSAND = 1000.0
"""Factor between units with neighbouring prefixes, which are taken for each other most often [1]."""


def ask_about_magnitudes(recording: Recording) -> None:
    """Ask about columns whose largest reading few specimens have, though it is possible.

    Nothing is asked of zeros and of readings that scatter about zero. The sizes of a stated wire bound its
    resistance, so nothing is asked of that either.
    """
    for name in recording.known_columns:
        quantity, unit = schema.quantity_and_unit(name)
        quantity = re.sub(r"_[0-9]+$", "", quantity)
        usual = USUAL.get(f"{'resistance' if quantity == 'setpoint' else quantity}_{unit}")
        if usual is None or (unit == "ohm" and "wire_diameter_mm" in recording.geometry):
            continue
        values = recording.columns[name]
        most = float(np.nanmax(np.abs(values)))
        is_small = most < usual[0]
        if most == 0.0 or usual[0] <= most <= usual[1] or (is_small and _scatters(values)):
            continue
        limit, end = (usual[0], "or more") if is_small else (usual[1], "or less")
        said = (
            f"check: {name}: the largest {quantity} is {amount(f'{most:.4g}', unit)}, and mostly it is "
            f"{amount(f'{limit:g}', unit)} {end}; is its unit right?"
        )
        meant, words = (
            (THOUSAND * most, "1000 times as much") if is_small else (most / THOUSAND, "a thousandth of it")
        )
        if usual[0] <= meant <= usual[1]:
            said += f" Usual would be {words}, {amount(f'{meant:.4g}', unit)}"
            said += f" (on import: --unit {schema.quantity_and_unit(name)[0]}=...)"
        ask(recording, said)


def _scatters(values: np.ndarray) -> bool:
    """True for readings that are noise about a level: neighbouring ones differ as any two do.

    The mean square of their differences is twice the variance for white noise, and less for a slow drive.
    """
    known = values[np.isfinite(values)]
    return known.size > 2 and float(np.mean(np.diff(known) ** 2)) > float(np.var(known)) > 0.0
