"""Tangent of a fitted law: whether the stress rises with strain everywhere, and how steeply."""

from dataclasses import dataclass

import numpy as np

from .fit import LawFit

ACTUATOR_STRAIN = (-0.5, 1.5)
"""Strains of an actuator's wall, rounded; the law of Table 3.3's actuators is limited to -0.54 to 1.5."""
POINTS = 401
"""Number of strains at which a law is evaluated."""
LOCKING_FACTOR = 100.0
"""Minimum factor over the largest tangent in the tested range that counts as locking. Rubber fails before."""
COVERAGE_SLACK = 0.1
"""Maximum strain by which tested strains may fall short of a range and still cover it."""


@dataclass(frozen=True)
class Stability:
    """Tangent of a law over a range of strain.

    Attributes:
        strain_min, strain_max: ends of the range [1].
        greatest_tangent: largest d stress / d strain in the range [Pa].
        falls_from: strain nearest to zero where the stress falls with more strain [1]; None if it never does.
    """

    strain_min: float
    strain_max: float
    greatest_tangent: float
    falls_from: float | None

    @property
    def monotone(self) -> bool:
        """True if the stress rises with strain everywhere in the range."""
        return self.falls_from is None

    def locks(self, tested: "Stability") -> bool:
        """True if the law stiffens without limit in this range, as at the limiting stretch of Gent's law.

        Args:
            tested: the same law over the tested range.
        """
        return self.greatest_tangent > LOCKING_FACTOR * tested.greatest_tangent

    def covers(self, other: "Stability") -> bool:
        """True if this range covers another one, up to `COVERAGE_SLACK`."""
        return (
            self.strain_min < other.strain_min + COVERAGE_SLACK
            and self.strain_max > other.strain_max - COVERAGE_SLACK
        )


def stability(fit: LawFit, strain_min: float, strain_max: float) -> Stability:
    """Check Drucker's condition along the uniaxial path: more strain never needs less stress.

    A stress that is not finite counts as falling.

    Args:
        fit: the law and its constants.
        strain_min, strain_max: ends of the range to check [1].
    """
    strain = np.linspace(strain_min, strain_max, POINTS)
    stress = fit.stress(strain)
    with np.errstate(invalid="ignore", over="ignore"):
        tangent = np.diff(stress) / np.diff(strain)
    greatest = float(np.max(np.where(np.isnan(tangent), np.inf, tangent)))
    tangent = np.where(np.isfinite(tangent), tangent, -np.inf)
    middle = 0.5 * (strain[1:] + strain[:-1])
    falling = middle[tangent <= 0.0]
    falls_from = float(falling[np.argmin(np.abs(falling))]) if len(falling) else None
    return Stability(strain_min, strain_max, greatest, falls_from)
