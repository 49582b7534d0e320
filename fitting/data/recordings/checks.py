"""Checks for physically impossible values of a recording; each error names file, row and column."""

import functools
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from pneusma_jax.calibration import Calibration, load_calibration
from pneusma_jax.calibration.plausible import questions
from pneusma_jax.errors import InputError
from pneusma_jax.units import amount, find_unit

from . import schema
from .other_units import LEAST_KPA, other_units
from .recording import Recording
from .sidecar import place_of_word, unusual_size
from .table import unusable

PRESSURE_LIMIT_KPA = 1000.0
"""Maximum pressure; a silicone tube bursts far below, so more is a pressure in the wrong unit."""
VACUUM_KPA = -102.0  # Minimum gauge pressure: just below perfect vacuum, to allow a sensor's zero error
ABSOLUTE_ZERO_DEGC = -273.15
CURRENT_LIMIT_A = 100.0
"""Maximum current of a spring [A]. By Preece's rule a wire of 1 mm melts in still air at 80 A if it is
of copper, and at 25 A if it is of iron. More is a current in the wrong unit, such as mA."""
OVERLOAD = 1e30
"""Least number that is no reading: instruments write 9.9e37 for none, in whatever unit the column has."""


def check_recording(
    recording: Recording, rows: Sequence[int] | None = None, sidecar: Path | str | None = None
) -> None:
    """Refuse impossible values.

    Args:
        recording: recording with columns in canonical units.
        rows: line number in the file of each sample; None counts samples from 1.
        sidecar: file that messages about settings name; None for the recording's own.

    Raises:
        InputError: at the first impossible sample or setting, in one line.
    """
    place = recording.path or recording.name
    rows = rows if rows is not None else range(1, len(recording) + 1)
    where = sidecar or place
    _ask_about_sizes(recording)
    _ask_about_noise(recording)
    _check_tube(recording, where)
    _check_table_names(recording, where)
    _check_missing(recording, place, rows)
    _check_time(recording, place, rows)
    _check_ranges(recording, place, rows)
    _check_kelvin(recording, place)
    _check_resistance(recording, place, rows)
    _check_against_sizes(recording, place, rows)
    _ask_about_magnitudes(recording)
    for question in heated_unseen(recording):
        _ask(recording, question)


def _check_tube(recording: Recording, where: Path | str) -> None:
    geometry = recording.full_geometry()
    outer, wall = geometry.get("outer_diameter_mm"), geometry.get("wall_thickness_mm")
    if outer is not None and wall is not None and 2.0 * wall >= outer:
        raise unusable(
            where, f"[geometry] wall_thickness_mm = {wall:g} leaves no bore in outer_diameter_mm = {outer:g};"
            f" the wall must be less than {outer / 2.0:g}",
        )  # fmt: skip


def _check_table_names(recording: Recording, where: Path | str) -> None:
    """Check that the alloy or material of a sidecar exists, and ask about its unusual constants.

    Nominal ones ship with the package.
    """
    for key, kind in (("alloy", "alloy"), ("material", "silicone")):
        if recording.geometry.get(key, "fit") != "fit":
            named = recording.table(key)
            try:
                table = _load(named, kind)
            except InputError as error:
                raise unusable(where, f"{place_of_word(key, where)}: {error}") from None
            for why in questions(table.quantities):
                _ask(recording, f"check: {key} {named}: {why}")
            if key == "alloy" and recording.kind == "actuator":
                _say_prestrain(recording, table)


ON_A_STAND = "of springs on a stand, pre-strain"
"""Words before the pre-strains of springs with which the description of their alloy's table ends."""


def _say_prestrain(recording: Recording, alloy: Calibration) -> None:
    """Say that springs of an actuator begin at another pre-strain than those that the alloy is known from.

    Nothing is said where the recording states its own.
    """
    begun = alloy.description.partition(f"{ON_A_STAND} ")[2]
    own = recording.full_geometry().get("prestrain")
    if not begun or "prestrain" in recording.geometry or own is None or f"{own:g}" == begun:
        return
    name = recording.geometry["alloy"]
    said = f"the alloy {name} was found with springs on a stand that began at a pre-strain of {begun}"
    here = f"in this actuator springs begin at {own:g} (prestrain under [geometry] states another)"
    _ask(recording, f"{said}; {here}")


def _load(name_or_path: str | Path, kind: str) -> Calibration:
    if isinstance(name_or_path, Path):
        return load_calibration(name_or_path, kind)  # a file of the laboratory may change at any time
    return _load_shipped(name_or_path, kind)


@functools.cache
def _load_shipped(name: str, kind: str) -> Calibration:
    return load_calibration(name, kind)


def _check_missing(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    columns = recording.known_columns
    gone = np.stack([np.isnan(recording.columns[name]) for name in columns])
    for name, column in zip(columns, gone, strict=True):
        if column.all():
            raise unusable(place, "no row has a value here; remove the column or fill it in", column=name)
    empty = np.flatnonzero(gone.all(axis=0))
    if empty.size:
        raise unusable(place, "every field is empty; remove the row", rows[int(empty[0])])


def _check_time(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    if "time_s" not in recording.columns:
        return
    time = recording.columns["time_s"]
    unknown = np.flatnonzero(np.isnan(time))
    if unknown.size:
        raise unusable(place, "the time is missing; every row needs one", rows[int(unknown[0])], "time_s")
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        i = int(back[0]) + 1
        what = (
            f"time goes backwards, {time[i]:g} s after {time[i - 1]:g} s; rows must be in the order of time"
        )
        raise unusable(place, what, rows[i], "time_s")


# For recordings of every kind; `Kind.ranges` has those of one.
_RULES: tuple[schema.Rule, ...] = (
    (
        "pressure",
        lambda kilopascal: (kilopascal < VACUUM_KPA) | (kilopascal > PRESSURE_LIMIT_KPA),
        f"gauge pressure must lie in {VACUUM_KPA:g} to {PRESSURE_LIMIT_KPA:g} kPa; is the unit right?",
    ),
    (
        "temperature",
        lambda celsius: celsius < ABSOLUTE_ZERO_DEGC,
        "this is below absolute zero; is the unit right?",
    ),
    (
        "length",
        lambda length: length <= 0.0,
        "a length must be more than 0; to a change of length add that at rest (on import, for 56 mm:"
        " --subtract length_mm=-56)",
    ),
    ("resistance", lambda ohm: ohm <= 0.0, "a resistance must be more than 0"),
    ("setpoint", lambda ohm: ohm <= 0.0, "a resistance must be more than 0"),
    ("cycle", lambda count: count < 0.0, "a count of cycles must be 0 or more"),
)


def _check_ranges(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    for name in recording.known_columns:
        values = recording.columns[name]
        right = "an instrument writes it for no reading; leave the field empty"
        _refuse_first(np.abs(values) >= OVERLOAD, values, right, place, rows, name)
    for word, wrong, right in (*_RULES, *schema.KINDS[recording.kind].ranges):
        for name in (name for name in recording.known_columns if name.startswith(word)):
            values = recording.columns[name]
            _refuse_first(wrong(values), values, right, place, rows, name)


KELVIN = (233.0, 473.0)
"""Temperatures that are rather kelvin than degC, where all of a recording lie there: -40 to 200 degC."""
HOTTEST_DEGC = 150.0
"""Middle of a transformation, above which an alloy may be tested at such temperatures in degC."""


def _check_kelvin(recording: Recording, place: Path | str) -> None:
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
        _ask(recording, f"check: {said} of {name}: {right}")


def _ask(recording: Recording, question: str) -> None:
    if question not in recording.notices:
        recording.notices.append(question)


def _ask_about_sizes(recording: Recording) -> None:
    """Ask about dimensions that few specimens have, though their unit may be right."""
    for key, value in recording.geometry.items():
        if key not in schema.GEOMETRY_NUMBERS:
            continue
        if why := unusual_size(key, value, schema.geometry_unit(key)):
            _ask(recording, f"check: [geometry] {key}: {why}")


def _ask_about_noise(recording: Recording) -> None:
    """Ask about a stated noise that is more than every reading of its column."""
    for name, deviation in recording.noise.items():
        readings = np.abs(recording.columns.get(name, np.zeros(1)))
        most = 0.0 if np.isnan(readings).all() else float(np.nanmax(readings))
        if 0.0 < most < deviation:
            said = f"{deviation:g} is more than the largest reading, {most:g}"
            _ask(recording, f"check: [noise] {name}: {said}; is its unit right?")


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
    material = None if named == "fit" else _load(recording.table("material"), "silicone")
    for question in other_units(recording, material, written):
        if question.quantity not in stated:
            _ask(recording, f"check: {question.text}")


def _transforms_hot(recording: Recording) -> bool:
    """True for a recording whose alloy is a table of one that transforms above any nitinol."""
    if recording.full_geometry().get("alloy", "fit") == "fit":
        return False
    return _load(recording.table("alloy"), "alloy").values().get("T_mid", 0.0) > HOTTEST_DEGC


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
        _refuse_first(np.abs(values) > far.refused, values, too_far, place, rows, name)
        if most > far.asked:
            recording.notices.append(f"{name} reaches {most:g}, as in few recordings of kind {kind}; {right}")


def plainly_named(recording: Recording) -> dict[str, np.ndarray]:
    """Columns by the names under which they can be read again: with a unit where it would be asked for."""
    far = schema.KINDS[recording.kind].farthest
    return {
        f"{name}_mm/mm" if name in far and np.nanmax(np.abs(values)) > far[name].asked else name: values
        for name, values in recording.columns.items()
    }


def _refuse_first(
    bad: np.ndarray, values: np.ndarray, right: str, place: Path | str, rows: Sequence[int], name: str,
    ends: tuple[float, float] | None = None,
) -> None:  # fmt: skip
    """Refuse the first bad value. Where its ends are given, a unit that may be meant is asked about."""
    found = np.flatnonzero(bad)
    if found.size:
        i = int(found[0])
        asked = "" if ends is None else f"; {_right_unit(name, float(values[i]), ends)}"
        raise unusable(place, f"{values[i]:g} cannot be: {right}{asked}", rows[i], name)


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
    alloy = _load(recording.table("alloy"), "alloy").values()
    if not {"rho_mean", "rho_span", "alpha_1", "alpha_2"} <= alloy.keys():
        return None
    martensite = [alloy["rho_mean"] + sign * alloy["rho_span"] / 2.0 for sign in (-1.0, 1.0)]
    austenite = [alloy["alpha_1"], alloy["alpha_1"] + alloy["alpha_2"]]
    # Which phase resists more differs between alloys, so both ends look at both.
    least, most = min(martensite + austenite), max(martensite + austenite)
    length = wire_length(geometry)
    return 0.5 * least * length, 2.0 * most * length


def _check_resistance(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
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
        _refuse_first((values < bounds[0]) | (values > bounds[1]), values, right, place, rows, name)


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
        _refuse_beyond(recording, name, (least, most), right, place, rows)


STRONGEST_MPA = 3000.0
"""Maximum tension of a wire [MPa]. Drawn nitinol breaks at 1000 to 2000 MPa, spring steel below 3000."""
UNWOUND = 1.5
"""Maximum elongation of a spring over the wire in its coils [1]. Hooks and end coils unwind, too, and the
wire stretches by some 10 % before it breaks."""
TIMES_LENGTH = 3.0
"""Maximum ratio of the least length of a recording to the length at rest, and of that to the largest [1]. A
pressed tube stretches less: silicone tubes burst first. Units of length differ by 10 or more."""


def _check_against_sizes(recording: Recording, place: Path | str, rows: Sequence[int]) -> None:
    """Refuse currents that no spring bears; forces, elongations and lengths that no specimen of the stated
    sizes has."""
    stated, geometry = recording.geometry, recording.full_geometry()
    for name in (name for name in recording.known_columns if name.startswith("current")):
        said = f"the wire of a spring melts below {CURRENT_LIMIT_A:g} A"
        _refuse_beyond(recording, name, (-CURRENT_LIMIT_A, CURRENT_LIMIT_A), said, place, rows)
    if recording.kind == "spring" and "wire_diameter_mm" in stated:
        wire = geometry["wire_diameter_mm"]
        most = STRONGEST_MPA * math.pi / 4.0 * wire**2  # of a straight wire, more than a coil bears
        said = f"a wire of {wire:g} mm breaks below {most:.3g} N"
        _refuse_beyond(recording, "force_N", (-most, most), said, place, rows)
    if recording.kind == "spring" and {"mandrel_diameter_mm", "active_coils"} <= stated.keys():
        length = 1e3 * wire_length(geometry)
        said = f"the coils have {length:.3g} mm of wire"
        _refuse_beyond(recording, "elongation_mm", (-length, UNWOUND * length), said, place, rows)
    if "length_mm" in recording.columns and "length_mm" in stated:
        rest, values = geometry["length_mm"], recording.columns["length_mm"]
        if np.nanmin(values) > TIMES_LENGTH * rest or np.nanmax(values) < rest / TIMES_LENGTH:
            said = f"[geometry] length_mm = {rest:g} is the length at rest"
            ends = rest / TIMES_LENGTH, TIMES_LENGTH * rest
            _refuse_beyond(recording, "length_mm", ends, said, place, rows)


HEATING_A = 0.02
"""Minimum current of a spring that counts as heated [A]. In still air it warms a wire of 0.25 mm by 0.1 K and
one of 0.1 mm by 2 K, with the constants of the shipped alloys. A current sensor's zero is smaller."""
_OF_SPRING = re.compile(r"current(?P<number>_\d+)?_")


def heated_unseen(recording: Recording) -> list[str]:
    """Questions about springs that carry a current, and whose resistance the recording does not have."""
    found = []
    for name in recording.known_columns:
        spring = _OF_SPRING.match(name)
        if spring is None or recording.has(f"resistance{spring['number'] or ''}"):
            continue
        if np.nanmax(np.abs(recording.si(name)), initial=0.0) <= HEATING_A:
            continue
        number = (spring["number"] or "").replace("_", " ")
        taken = "it is taken as cold" if number else (
            "its phase follows from the temperature, or is taken as cold beside tests with a resistance"
        )
        whose = f"spring{number}" if number else "the spring"
        found.append(
            f"check: {whose} carries a current, but its resistance was not recorded: {taken}"
        )
    return found


def ask_about_copies(recordings: Sequence[Recording]) -> None:
    """Ask about recordings that hold the same numbers in the same columns as an earlier one."""
    first: dict[tuple, Recording] = {}
    for recording in recordings:
        names = sorted(recording.known_columns)
        key = (recording.kind, *((name, recording.columns[name].tobytes()) for name in names))
        other = first.setdefault(key, recording)
        if other is not recording:
            question = (
                f"check: it holds the same numbers as {other.name!r}: is it a copy? Then leave it out, or"
                " every reading counts twice"
            )
            _ask(recording, question)


def notices_of_reading(recordings: Iterable[Recording]) -> list[str]:
    """Notices and questions of each recording after its name. One that was made in memory is asked, too."""
    return [
        f"{recording.name}: {notice}"
        for recording in recordings
        for notice in dict.fromkeys([*recording.notices, *heated_unseen(recording)])
    ]


def questions_of_reading(recordings: Iterable[Recording]) -> list[str]:
    """Those of `notices_of_reading` that ask to check something, or name a column that is not used."""
    told = notices_of_reading(recordings)
    return [notice for notice in told if ": check: " in notice or notice.endswith(schema.IGNORED)]


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


def _ask_about_magnitudes(recording: Recording) -> None:
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
        _ask(recording, said)


def _scatters(values: np.ndarray) -> bool:
    """True for readings that are noise about a level: neighbouring ones differ as any two do.

    The mean square of their differences is twice the variance for white noise, and less for a slow drive.
    """
    known = values[np.isfinite(values)]
    return known.size > 2 and float(np.mean(np.diff(known) ** 2)) > float(np.var(known)) > 0.0


MEANT = {
    "A": ("mA", "uA"), "ohm": ("mohm", "kohm"), "N": ("mN", "kN", "gf", "uN"), "mm": ("um", "cm", "in", "m"),
}  # fmt: skip
"""Units that a column's numbers may rather be in, by the unit of the column, the most usual first."""


def _right_unit(name: str, value: float, ends: tuple[float, float]) -> str:
    """Question after a magnitude that cannot be, with a unit in which it could be, if there is one."""
    quantity, unit = schema.quantity_and_unit(name)
    size = {other: value * find_unit(other).factor / find_unit(unit).factor for other in MEANT.get(unit, ())}
    other = next((one for one, number in size.items() if ends[0] <= number <= ends[1]), None)
    sizes = "" if unit == "A" else ", are the sizes"
    example = f" (such as {other}: {quantity}_{other} heads the column, or on import --unit"
    example += f" {quantity}={other})"
    return f"is its unit right{example if other else ''}{sizes}?"


def _refuse_beyond(
    recording: Recording, name: str, ends: tuple[float, float], right: str, place: Path | str,
    rows: Sequence[int],
) -> None:  # fmt: skip
    if name in recording.columns:
        values = recording.columns[name]
        _refuse_first((values < ends[0]) | (values > ends[1]), values, right, place, rows, name, ends)
