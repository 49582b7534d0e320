"""Does a fitted law stiffen and soften the way a solid can? Warnings where it does not."""

from dataclasses import dataclass

import numpy as np

from .fit import LawFit

ACTUATOR_STRAIN = (-0.5, 1.5)
"""Strains that an actuator's wall sees; the law of Table 3.3's actuators is limited to -0.54 to 1.5."""
POINTS = 401
LOCKED = 100.0
"""Times the stiffest tangent that was tested; no rubber survives that."""


@dataclass(frozen=True)
class Stability:
    """Tangent of a law over a range of strain.

    Attributes:
        strain_min, strain_max: the range.
        least_tangent, greatest_tangent: extremes of d stress / d strain in the range [Pa].
        falls_from: strain nearest to rest where the stress starts to fall, or None.
    """

    strain_min: float
    strain_max: float
    least_tangent: float
    greatest_tangent: float
    falls_from: float | None

    @property
    def monotone(self) -> bool:
        """The stress rises with strain everywhere in the range."""
        return self.falls_from is None

    def locks(self, tested: "Stability") -> bool:
        """It stiffens in this range past anything that the tested range bears out: a pole lies in it."""
        return self.greatest_tangent > LOCKED * tested.greatest_tangent

    def covers(self, other: "Stability") -> bool:
        """True if this range holds another one, up to a tenth of strain."""
        return self.strain_min < other.strain_min + 0.1 and self.strain_max > other.strain_max - 0.1


def stability(fit: LawFit, strain_min: float, strain_max: float) -> Stability:
    """Check Drucker's condition along the uniaxial path: more strain never needs less stress.

    Args:
        fit: the law and its constants.
        strain_min, strain_max: range to check.
    """
    strain = np.linspace(strain_min, strain_max, POINTS)
    stress = fit.stress(strain)
    with np.errstate(invalid="ignore", over="ignore"):
        tangent = np.diff(stress) / np.diff(strain)
    top = float(np.max(np.where(np.isnan(tangent), np.inf, tangent)))
    tangent = np.where(np.isfinite(tangent), tangent, -np.inf)
    middle = 0.5 * (strain[1:] + strain[:-1])
    falling = middle[tangent <= 0.0]
    first = float(falling[np.argmin(np.abs(falling))]) if len(falling) else None
    return Stability(strain_min, strain_max, float(np.min(tangent)), top, first)


def warnings(fit: LawFit, tested: Stability, actuator: Stability) -> list[str]:
    """Sentences about what the fitted law does that a solid does not."""
    found = []
    if not tested.monotone:
        found.append(
            f"The fitted {fit.law.label} law falls from strain {tested.falls_from:.2g} on, inside the "
            "tested range: it breaks Drucker's condition there, and an equilibrium solved with it may jump."
        )
    outside = actuator.falls_from
    if outside is not None and not tested.strain_min <= outside <= tested.strain_max:
        found.append(
            f"Outside the test the fitted {fit.law.label} law turns back at strain {outside:.2g}, within an "
            "actuator's "
            f"range ({ACTUATOR_STRAIN[0]:g} to {ACTUATOR_STRAIN[1]:g}): do not simulate there with it."
        )
    if fit.law.law == "polynomial":
        rest = fit.stress(np.zeros(1))[0]
        if abs(rest) > 3.0 * fit.sd[-1] and abs(rest) > 0.0:
            found.append(
                f"The polynomial carries {rest / 1e3:.3g} kPa at zero strain (p_{len(fit.values)}): a zero "
                "error of the load cell, or the price of a poor fit; in a simulation it is a stress at rest."
            )
    if fit.law.law == "ogden" and np.any(fit.values[0::2] * fit.values[1::2] <= 0.0):
        found.append("A term of the Ogden law has mu alpha <= 0 and adds no stiffness: fewer terms would do.")
    return found
