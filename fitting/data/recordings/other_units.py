"""Questions about columns whose numbers fit another unit of their dimension far better than the stated one.

Physics decides: the stiffness of wires, rubbers and tubes, how far a coupon is strained, how long a test
lasts, and how angle and curvature go together. Each question names the unit that fits. Nothing is asked
about a unit that fits as well as another.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from pneusma_jax.calibration import Calibration
from pneusma_jax.errors import counted
from pneusma_jax.units import UNITS, find_unit

from .recording import Recording

STIFFEST_WIRE_MPA = 1.5e5
"""Maximum modulus of a wire [MPa]. Nitinol has 20 to 90 GPa; the stiffest reading of it is some 100 GPa."""
WIRE_STRAINS = (0.003, 0.15)
"""Largest strains of a wire that are usual [1]."""
SILICONE_KPA = (10.0, 5e3)
"""Young's moduli of silicones, as coupons or tubes [kPa]. Gels have 10 kPa, hard ones of Shore A 70 5 MPa."""
SILICONES = "silicones have 0.05 to 5 MPa"
STIFFEST_RUBBER_KPA = 5e4
"""Maximum modulus of a rubber [kPa]: hard ones of Shore A 95 have 50 MPa. The stiffest coupon recorded here
has 1.2 MPa. Thermoplastic elastomers may be stiffer, so that more is a question."""
STRESSES = ("kPa", "MPa", "Pa", "psi")
"""Units that a stress may rather be in, the most usual first."""
RUBBER_STRAINS = (0.05, 19.0)
"""Largest strains of a coupon that are usual [1]. Every measured coupon here was strained by 0.5 or more."""
PERCENT = 100.0
TUBE_APART = 4.0
"""Maximum ratio of a tube's modulus to that of its material, and of that to it [1]. Recorded tubes lie within
0.7 to 1.1."""
TUBE_FITS = 2.0
"""Maximum ratio of the same in a unit that fits [1]."""
LEAST_STRETCHED = 0.02
"""Minimum change of a tube's length that tells its modulus [1]."""
PRESSED = 0.5
"""Minimum pressure of rows that tell a tube's modulus, over the largest [1]. A balloon goes on to grow while
its pressure falls, so that one row does not tell."""
FARTHEST_TUBE = 2.0
"""Maximum pull of the pressure on an actuator's wall over the modulus of its material [1]. At more, the tube
would stretch to three times its length without its springs. Actuators here have 0.1 to 0.4."""
TUBE_PULLS = (0.02, 1.0)
"""The same in a unit that fits [1]. A pressure below stretches the tube by less than 2 %."""
LEAST_KPA = 0.2
"""Minimum of a largest pressure that is usual [kPa]. Smaller ones are asked about by their size alone."""
SWEPT = 0.5
"""Minimum range of a pressure that is driven, over its largest [1]. A vented sensor reads its zero."""
STEADY = 0.02
"""Maximum noise and resolution of a driven pressure, over its largest [1]. Sensors here have 0.002 of 20 kPa.
A zero that drifts by 0.5 kPa comes with noise of 0.03 kPa."""
HEATED = 0.03
"""Minimum change of a spring's resistance that heat makes, over its largest [1]. Here heat changes it by
0.096 or more, and strain alone by 0.017."""
HEATS = 0.6
"""Minimum correlation, by size, of a pressure with a resistance or a current that makes it [1]. Pumped
pressures here have 0.43 or less where springs are heated. A sealed tube that warms within 5 s has 0.7."""
MOST_UNITS = 2
"""Maximum number of units that a question names."""
STATED_PRESSURES = ("bar", "kPa", "MPa", "psi", "mbar")
"""Units that a file may have stated for a pressure, where that is no longer known."""
PRESSURES = ("psi", "kPa", "mbar", "bar", "MPa", "Pa", "mmHg", "inHg", "cmH2O")
"""Units that a pressure may rather be in, the most usual first."""
LONG_S = 10 * 3600.0
"""Minimum duration of a test whose clock may count milliseconds [s]. Slow cycles take 8 hours, with steps of
5 to 240 s. Milliseconds under seconds reach as far after 29 s, and no step tells both apart."""
COUNTED_S = 5.0
"""Minimum step of such a clock [s]. Microcontrollers log every 5 ms or slower."""
SLOWEST_K_PER_S = 0.05 / 60.0
"""Minimum rate at which a chamber is heated or cooled [K/s]; the slowest ramps have 0.05 K/min or more."""
SWEPT_K = 10.0
"""Minimum range of a temperature that is swept, and not held [K]."""
LEAPT = 0.2
"""Maximum change from one row to the next over the range of a column [1]. A creep test that is logged every
minute leaps further where it is loaded."""
HELD = 0.02
"""Maximum distance from its median at which a load or a strain is held, over its largest value [1]."""
NO_LOADS = ("time", "cycle", "current", "resistance", "setpoint", "temperature")
"""Beginnings of columns that may leap in a test of seconds, too."""
BRIEF_S = 0.5
"""Minimum duration of a test with many rows [s]. Testing machines and pumps take longer."""
MANY_ROWS = 50
"""Minimum number of rows of a test whose clock, or whose low pressure, is asked about."""
RADIANS = (math.radians(20.0), 2.0 * math.pi)
"""Largest angles of an actuator that are rather radian than degree [deg]: 20 to 360 degrees in radian."""
TURNS_DEG = 1080.0
"""Maximum bend angle [deg]: three turns. More are rather degrees than radian."""
FAR_BENT_DEG = 540.0
"""Maximum bend angle that is usual [deg]: one and a half turns. Of 50 actuators here none bends by more than
310, as curvature times length."""
TURN_DEG = 360.0
"""A full turn [deg]."""
DEGREES = 180.0 / math.pi
ANGLE_APART = 2.0
"""Maximum factor between an angle and the curvature times the length, in a unit that fits [1]."""


class Question(NamedTuple):
    """A question about the unit of a column.

    Attributes:
        quantity: quantity whose stated unit answers the question; empty where none does.
        text: the question, with the unit that fits.
    """

    quantity: str
    text: str


def other_units(
    recording: Recording, material: Calibration | None, written: Mapping[str, str]
) -> list[Question]:
    """Questions about units, each with the unit that fits far better.

    Args:
        recording: recording with columns in canonical units.
        material: table of its silicone; None where it has none, or one that is to be identified.
        written: units in which the file states its columns, by canonical name, as far as they are known.
    """
    if recording.kind in ("wire", "elastomer"):
        asked = _strain(recording, written)
    elif recording.kind == "tube":
        asked = _tube(recording, material, written.get("pressure_kPa"))
    elif recording.kind == "actuator":
        asked = _pressure(recording, material, written.get("pressure_kPa"))
        asked += _angle(recording, written.get("bend_angle_deg"))
    else:
        asked = []
    return [*asked, *_clock(recording, written.get("time_s"))]


def _strain(recording: Recording, written: Mapping[str, str]) -> list[Question]:
    """Ask about a strain that makes a specimen far too stiff.

    Args:
        recording: recording of a wire or a coupon.
        written: units in which the file states its columns, as far as they are known.
    """
    wire = recording.kind == "wire"
    name = "stress_MPa" if wire else "stress_kPa"
    strain, stress = recording.columns["strain"], recording.columns[name]
    reach, most = _largest(strain), _largest(stress)
    usual = WIRE_STRAINS if wire else RUBBER_STRAINS
    # A wire that holds a stress is as stiff as this at least, if its strain counts from rest.
    pulled = float(np.nanmax(stress) - np.nanmin(stress)) > most / 2.0
    apart = [float(np.nanmax(x) - np.nanmin(x)) for x in (stress, strain)] if pulled else [most, reach]
    modulus = apart[0] / apart[1] if apart[1] > 0.0 else 0.0
    percent = ""
    if usual[0] <= PERCENT * reach <= usual[1]:
        percent = (
            "Are these numbers fractions under a heading of percent? Then they reach"
            f" {PERCENT * reach:.3g} (on import: --unit strain=1)"
        )
    made = written.get("strain", "percent") != "percent"
    sizes = "Are its units and sizes right? (on import: --unit, --dimension)"
    said = f"strain reaches {reach:.3g} under {most:.4g}"
    if wire and modulus > STIFFEST_WIRE_MPA and percent:
        rest = "" if pulled else ", if strain counts from no load"
        why = f"a modulus of {1e-3 * modulus:.3g} GPa{rest}; nitinol has 20 to 90 GPa"
        question = f"{said} MPa, {why}. {sizes if made else percent}"
        return [Question("" if made else "strain", question)]
    percent = "" if made else percent
    if wire or modulus <= SILICONE_KPA[1]:
        return []
    said += f" kPa, a modulus of {1e-3 * modulus:.3g} MPa; {SILICONES}"
    if modulus > STIFFEST_RUBBER_KPA:
        asked = [text for text in (percent, _softer(modulus, written.get(name))) if text]
        asked = asked or [sizes]
        return [Question("", f"{said}, hard rubbers up to 50, and plastics more. {'. '.join(asked)}")]
    if percent and modulus / PERCENT >= SILICONE_KPA[0]:
        return [Question("strain", f"{said}, hard rubbers up to 50. {percent}")]
    return []


def _softer(modulus: float, unit: str | None) -> str:
    """Question about the unit of stress in which a coupon is a silicone; empty without one.

    Args:
        modulus: modulus of the coupon [kPa].
        unit: unit that the file states; None where that is no longer known.
    """
    for other in STRESSES if unit in UNITS else ():
        softer = modulus * find_unit(other).factor / find_unit(unit).factor
        if SILICONE_KPA[0] <= softer <= SILICONE_KPA[1]:
            said = f"Are the stresses in {other} under a heading of {unit}?"
            return f"{said} Then the modulus is {_mpa(softer)} (on import: --unit stress={other})"
    return ""


def _tube(recording: Recording, material: Calibration | None, unit: str | None) -> list[Question]:
    """Ask about the pressure of a tube that is far stiffer or softer than its material.

    Its modulus is that of the neo-Hookean silicone that the pull stretches as far. It is too large, or too
    small, if it is so in every row under much pressure.
    """
    geometry, length = recording.full_geometry(), recording.columns["length_mm"]
    pressure = recording.columns["pressure_kPa"]
    if "length_mm" not in recording.geometry:
        return []
    stretch = length / geometry["length_mm"]
    with np.errstate(invalid="ignore"):
        tells = (pressure >= PRESSED * np.nanmax(pressure)) & (pressure > 0.0)
        rows = np.flatnonzero(tells & (stretch >= 1.0 + LEAST_STRETCHED))
    if not rows.size:
        return []
    moduli = 3.0 * _pull(recording, pressure[rows]) / (stretch[rows] - stretch[rows] ** -2)
    own = _modulus_kpa(material)
    ends = SILICONE_KPA if own is None else (own / TUBE_APART, own * TUBE_APART)
    fits = SILICONE_KPA if own is None else (own / TUBE_FITS, own * TUBE_FITS)
    if np.min(moduli) <= ends[1] and np.max(moduli) >= ends[0]:
        return []  # some row is as it should be: a length may lag behind its pressure
    at = int(np.argmin(moduli) if np.min(moduli) > ends[1] else np.argmax(moduli))
    modulus = float(moduli[at])
    meant = _pressure_units(modulus, fits, unit)
    if not meant:
        return []
    told = SILICONES if own is None else f"{geometry['material']} has {_mpa(own)}"
    other = "" if own is None else "; or is the material another one?"
    return [
        Question(
            "pressure",
            f"{pressure[rows[at]]:.4g} kPa stretch this tube by {100.0 * (stretch[rows[at]] - 1.0):.3g} %, so"
            f" that its silicone has a modulus of {_mpa(modulus)}; {told}. Is the unit of pressure right? It"
            f" would fit as {meant} (on import: --unit pressure=...){other}",
        )
    ]


def _pressure(recording: Recording, material: Calibration | None, unit: str | None) -> list[Question]:
    """Ask about a pressure that stretches an actuator's tube far beyond what silicone bears, or hardly."""
    own, pressure = _modulus_kpa(material), recording.columns["pressure_kPa"]
    most = float(np.nanmax(pressure))
    pull = 0.0 if own is None else _pull(recording, most) / own
    if pull > FARTHEST_TUBE:
        told = "more than silicone bears"
    elif 0.0 < pull < TUBE_PULLS[0] and most >= LEAST_KPA and _is_driven(recording):
        told = "so that it hardly does anything"
    else:
        return []
    meant = _pressure_units(pull, TUBE_PULLS, unit)
    if not meant:
        return []
    return [
        Question(
            "pressure",
            f"{most:.4g} kPa pull the wall of this tube by {pull:.2g} times the modulus of"
            f" {recording.full_geometry()['material']}, {told}. Is the unit of pressure"
            f" right? It would fit as {meant} (on import: --unit pressure=...); or is the material another"
            " one?",
        )
    ]


def _is_driven(recording: Recording) -> bool:
    """True for a pressure that is swept, far beyond noise and resolution, and not a zero that drifts.

    One of a sealed tube that warms is not driven either: it follows the heat of the springs.
    """
    pressure = recording.columns["pressure_kPa"]
    known = pressure[np.isfinite(pressure)]
    most, levels = float(np.max(np.abs(known))), np.unique(known)
    if known.size < MANY_ROWS or float(np.ptp(known)) < SWEPT * most:
        return False
    curved = np.abs(np.diff(known, 2))  # of independent readings, with six times their variance
    if max(float(np.median(curved)) / 2.0, float(np.median(np.diff(levels)))) > STEADY * most:
        return False
    heats = [name for name in recording.columns if name.startswith(("resistance", "current"))]
    return not any(_warms(pressure, recording.columns[name], name) for name in heats)


def _warms(pressure: np.ndarray, heat: np.ndarray, name: str) -> bool:
    """True for a pressure that follows a resistance that heat changes, or a current."""
    both = np.isfinite(pressure) & np.isfinite(heat)
    pressure, heat = pressure[both], heat[both]
    least = HEATED if name.startswith("resistance") else 0.0
    if pressure.size < MANY_ROWS or np.ptp(heat) <= least * _largest(heat) or np.ptp(pressure) == 0.0:
        return False
    return bool(abs(np.corrcoef(pressure, heat)[0, 1]) >= HEATS)


def _pull(recording: Recording, pressure: float | np.ndarray) -> float | np.ndarray:
    """Axial stress in the wall of a tube with closed ends, in the unit and shape of the pressure."""
    geometry = recording.full_geometry()
    outer, wall = geometry["outer_diameter_mm"], geometry["wall_thickness_mm"]
    bore = outer - 2.0 * wall
    return pressure * bore**2 / (outer**2 - bore**2)


def _modulus_kpa(material: Calibration | None) -> float | None:
    """Young's modulus of a silicone at small strains [kPa]; None where no constant states it."""
    if material is None:
        return None
    values = material.values()
    if "mu" in values:
        return 3e-3 * values["mu"]
    return 6e-3 * values["c_10"] if "c_10" in values else None


def _mpa(kilopascal: float) -> str:
    return f"{1e-3 * kilopascal:.2g} MPa"


def _pressure_units(size: float, ends: tuple[float, float], unit: str | None) -> str:
    """Units in which a pressure becomes usual, in words; empty without any.

    Args:
        size: size that is proportional to the pressure.
        ends: least and most of what is usual.
        unit: unit that the file states; None where that is no longer known.
    """
    found = [
        f"{other} under a heading of {one}"
        for other in PRESSURES
        for one in (STATED_PRESSURES if unit is None else (unit,))
        if other != one and ends[0] <= size * find_unit(other).factor / find_unit(one).factor <= ends[1]
    ]
    return " or ".join(found[:MOST_UNITS])


def _angle(recording: Recording, unit: str | None) -> list[Question]:
    """Ask about bend angles that are rather radian, degrees under a heading of radian, or beyond a turn.

    Args:
        recording: recording of an actuator.
        unit: unit that the file states; None where that is no longer known.
    """
    if "bend_angle_deg" not in recording.columns:
        return []
    angle = recording.columns["bend_angle_deg"]
    most, made = _largest(angle), _made_angle(recording)
    turned = f"{DEGREES * most:.3g} degrees"
    radian = f"Are these radian? Then they reach {turned} (on import: --unit bend_angle=rad)"
    degree = "Are these degrees under a heading of radian? (on import: --unit bend_angle=deg)"
    reaches = f"bend_angle_deg reaches {most:.4g}"
    if made > 0.0 and most > 0.0:
        for factor, asked in ((DEGREES, radian), (1.0 / DEGREES, degree)):
            if abs(math.log(factor * most / made)) < math.log(ANGLE_APART):
                return [Question("bend_angle", f"{reaches}, and curvature times length {made:.3g}. {asked}")]
    elif most > TURNS_DEG and unit != "deg":
        return [Question("bend_angle", f"{reaches}, more than three turns. {degree}")]
    elif RADIANS[0] <= most <= RADIANS[1]:
        return [Question("bend_angle", f"{reaches}, and few actuators bend so little. {radian}")]
    if most > FAR_BENT_DEG:
        rows = counted(int(np.sum(np.abs(angle) > FAR_BENT_DEG)), "row")
        said = f"{reaches}, {most / TURN_DEG:.3g} turns, with more than {FAR_BENT_DEG:g} in {rows}"
        asked = "are these readings right, and their unit (on import: --unit bend_angle=...)?"
        return [Question("", f"{said}. Few actuators bend so far: {asked}")]
    return []


def _made_angle(recording: Recording) -> float:
    """Largest angle that curvature times length makes [deg]; 0 where no curvature was recorded."""
    if "curvature_1pm" not in recording.columns:
        return 0.0
    length = recording.columns.get("length_mm", recording.full_geometry()["length_mm"])
    angle = np.degrees(1e-3 * recording.columns["curvature_1pm"] * length)
    return _largest(angle) if np.isfinite(angle).any() else 0.0


def _clock(recording: Recording, unit: str | None) -> list[Question]:
    """Ask about a clock that counts milliseconds, or one that is far too fast and not stated in seconds."""
    time = recording.columns.get("time_s", np.zeros(0))
    if time.size < MANY_ROWS or recording.counts_rows:
        return []
    steps, lasts = np.diff(time), float(time[-1] - time[0])
    if 0.0 < lasts < BRIEF_S and unit != "s":
        return [
            Question(
                "time",
                f"time_s: {time.size} rows last {lasts:.3g} s together. Is the unit of time right?"
                " (on import: --unit time=s, if these are seconds)",
            )
        ]
    whole, step = bool(np.all(np.mod(time, 1.0) == 0.0)), float(np.median(steps))
    if not whole or step < COUNTED_S or lasts < LONG_S or _is_slow(recording, steps):
        return []
    return [
        Question(
            "time",
            f"time_s: the test lasts {lasts / 3600.0:.3g} h, with a row every {step:.4g} s. Are"
            f" these milliseconds? Then it lasts {1e-3 * lasts:.4g} s (on import: --unit time=ms)",
        )
    ]


def _is_slow(recording: Recording, steps: np.ndarray) -> bool:
    """True for a test of hours: a chamber is heated faster than the slowest, or a load or strain is held.

    It is held in most rows, or comes from one row to the next. Tests of creep and of relaxation do so.

    Args:
        recording: recording of a test.
        steps: time from each row to the next [s], shape (rows - 1,).
    """
    temperature = recording.columns.get("temperature_degC")
    if temperature is not None and np.nanmax(temperature) - np.nanmin(temperature) > SWEPT_K:
        rates = np.abs(np.diff(temperature))[steps > 0.0] / steps[steps > 0.0]
        return bool(np.nanpercentile(rates, 90.0) > SLOWEST_K_PER_S) if np.isfinite(rates).any() else False
    for name in recording.known_columns:
        values = recording.columns[name]
        known = values[np.isfinite(values)]
        if name.startswith(NO_LOADS) or known.size < 2:
            continue
        held = np.abs(known - np.median(known)) <= HELD * float(np.max(np.abs(known)))
        leapt = float(np.max(np.abs(np.diff(known)))) > LEAPT * float(np.ptp(known)) > 0.0
        if leapt or np.mean(held) > 0.5:
            return True
    return False


def _largest(values: np.ndarray) -> float:
    return float(np.nanmax(np.abs(values)))
