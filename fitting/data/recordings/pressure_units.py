"""Questions about a pressure that stretches a tube or an actuator by far too much or too little."""

import numpy as np

from pneusma_jax.calibration import Calibration
from pneusma_jax.units import find_unit

from .recording import Recording
from .strain_units import SILICONE_KPA, SILICONES, in_mpa
from .unit_question import MANY_ROWS, Question, largest

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


def tube_questions(recording: Recording, material: Calibration | None, unit: str | None) -> list[Question]:
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
    told = SILICONES if own is None else f"{geometry['material']} has {in_mpa(own)}"
    other = "" if own is None else "; or is the material another one?"
    return [
        Question(
            "pressure",
            f"{pressure[rows[at]]:.4g} kPa stretch this tube by {100.0 * (stretch[rows[at]] - 1.0):.3g} %, so"
            f" that its silicone has a modulus of {in_mpa(modulus)}; {told}. Is the unit of pressure right?"
            f" It would fit as {meant} (on import: --unit pressure=...){other}",
        )
    ]


def pressure_questions(
    recording: Recording, material: Calibration | None, unit: str | None
) -> list[Question]:
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
    if pressure.size < MANY_ROWS or np.ptp(heat) <= least * largest(heat) or np.ptp(pressure) == 0.0:
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
