"""Fractions of the phases in the whole wire: Table 2.1 and Eqs. 2.25 to 2.28.

The onset fraction xi0 is the martensite fraction without stress. Stress turns the share xi_sm of it from
twinned to detwinned martensite. It turns the share xi_sa of the rest from austenite to detwinned martensite.
Brinson's internal variables xi, xi_s and xi_t follow. The source writes Eq. 2.26 with `xi_tm = 1 - xi_sm` and
Eq. 2.28 with `alpha_a = 1 - xi_sa` (Table 2.1).
"""

import equinox as eqx
from jaxtyping import Array

from .alloy import Alloy


def detwinned_fraction(xi0: Array, xi_sm: Array, xi_sa: Array) -> Array:
    """Detwinned martensite in the wire, xi_s, Eq. 2.25 [1].

    Args:
        xi0: onset martensite fraction [1].
        xi_sm: detwinned share of the onset martensite [1].
        xi_sa: stress-induced share of the onset austenite [1].
    """
    return xi0 * xi_sm + (1.0 - xi0) * xi_sa


def twinned_fraction(xi0: Array, xi_sm: Array) -> Array:
    """Twinned martensite in the wire, xi_t, Eq. 2.26 [1]; arguments as of `detwinned_fraction`."""
    return xi0 * (1.0 - xi_sm)


def austenite_fraction(xi0: Array, xi_sa: Array) -> Array:
    """Austenite in the wire, alpha, Eq. 2.28 [1]; arguments as of `detwinned_fraction`."""
    return (1.0 - xi0) * (1.0 - xi_sa)


class PhaseFractions(eqx.Module):
    """Phase fractions of a wire; the three add up to one.

    Attributes:
        detwinned: fraction of martensite that stress has detwinned or induced, xi_s [1].
        twinned: fraction of twinned martensite, as it comes from cooling, xi_t [1].
        austenite: fraction of austenite, alpha [1].
    """

    detwinned: Array
    twinned: Array
    austenite: Array

    @property
    def martensite(self) -> Array:
        """All martensite, xi, Eq. 2.27 [1]."""
        return self.detwinned + self.twinned


def phase_fractions(alloy: Alloy, xi0: Array, gamma: Array) -> PhaseFractions:
    """Phases of a wire at an onset fraction and a shear strain, Eqs. 2.25 to 2.28.

    Args:
        alloy: alloy with the detwinning curves (Table 2.2).
        xi0: onset martensite fraction [1].
        gamma: shear strain [1]; broadcasts with `xi0`.
    """
    xi_sm, xi_sa = alloy.xi_sm(gamma), alloy.xi_sa(gamma)
    return PhaseFractions(
        detwinned_fraction(xi0, xi_sm, xi_sa), twinned_fraction(xi0, xi_sm), austenite_fraction(xi0, xi_sa)
    )
