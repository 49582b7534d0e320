"""Resistivity of the wire from its phases, and the inverse for the martensite fraction: Eqs. 2.40 to 2.48.

Resistivity is in ohm per metre of wire, as the source states it.
"""

import equinox as eqx
from jaxtyping import Array, Bool

from ..numerics.safe import chord_power, complement_power, frozen, namespace_of, safe_divide, unit_power
from .detwinning import signed_algebraic_sigmoid

DEGENERATE_CONTRAST = 0.02
"""Minimum contrast of distinguishable phases [ohm/m], about a thousandth of a phase's resistivity."""
LOWEST_EXPONENT = 0.5


def martensite_resistivity(
    xi_sm: Array, rho_mean: Array, rho_span: Array, k_1: Array, k_2: Array, k_3: Array
) -> Array:
    """Resistivity of cold wire over its detwinned fraction, Table 2.2 row 3 [ohm/m]."""
    return rho_mean + 0.5 * rho_span * signed_algebraic_sigmoid(k_1 * xi_sm + k_2, k_3)


def austenite_resistivity(xi_sa: Array, alpha_1: Array, alpha_2: Array) -> Array:
    """Resistivity of hot wire over its stress-induced fraction, Table 2.2 row 4 [ohm/m].

    The printed `alpha_1` is 48 ohm/m too large for an austenite that conducts better than martensite; the
    shipped constants are reconstructed (correction 4).
    """
    return alpha_1 + alpha_2 * xi_sa


def interpolation_exponent(gamma: Array, a: Array, b: Array, gamma_max: Array) -> Array:
    """Exponent of Eq. 2.41: `a` at zero strain, 1 at gamma_max [1]; the second exponent likewise, from `c`.

    A negative strain counts as zero. Past gamma_max the printed power continues to fall and would change
    sign. It is held at 0.5 (reached at about 1.1 gamma_max).
    """
    xp = namespace_of(gamma, a, b, gamma_max)
    return xp.maximum(a + (1.0 - a) * chord_power(gamma / gamma_max, b), LOWEST_EXPONENT)


def mixing_fraction(xi0: Array, exponent: Array, second: Array | float = 1.0) -> Array:
    """Weight A of the martensite's resistivity in the mixture, Eq. 2.41 [1].

    Args:
        xi0: onset martensite fraction [1].
        exponent: exponent of Eq. 2.41 [1].
        second: second exponent, 1 for the source's power law. Another alloy may mix otherwise (Section
            2.4.6): A = 1 - (1 - xi0^exponent)^second, the double-bounded distribution of Kumaraswamy (1980).
            The weight may then also rise early and late, or slowly at both ends. It inverts in closed form.
    """
    return complement_power(unit_power(xi0, exponent), second)


def mixed_resistivity(weight: Array, rho_m: Array, rho_a: Array) -> Array:
    """Resistivity of the two-phase wire, Eq. 2.40 [ohm/m]."""
    return weight * rho_m + (1.0 - weight) * rho_a


class PhaseReading(eqx.Module):
    """Phase from a resistance.

    Attributes:
        xi0: onset martensite fraction [1].
        clipped: true if the resistance is impossible for the phases at this strain. Then xi0 was clipped to 0
            or 1 and does not respond to the resistance.
        degenerate: true if both phases conduct alike at this strain, so that resistance cannot distinguish
            them.
    """

    xi0: Array
    clipped: Bool[Array, "..."]
    degenerate: Bool[Array, "..."]

    @property
    def blind(self) -> Array:
        """True if xi0 does not follow from the resistance here."""
        return self.clipped | self.degenerate


def martensite_fraction(
    rho: Array, rho_m: Array, rho_a: Array, exponent: Array, second: Array | float = 1.0
) -> PhaseReading:
    """Onset martensite fraction from resistivity, Eq. 2.48, with its base clipped to [0, 1] (correction 14).

    A clipped base has zero slope. Both flags of the reading mark such results.
    """
    weight, clipped = martensite_weight(rho, rho_m, rho_a)
    degenerate = abs(rho_m - rho_a) < DEGENERATE_CONTRAST
    powered = complement_power(weight, 1.0 / second)
    return PhaseReading(unit_power(powered, 1.0 / exponent), clipped, degenerate)


def martensite_weight(rho: Array, rho_m: Array, rho_a: Array) -> tuple[Array, Array]:
    """Weight A of Eq. 2.46 clipped to [0, 1], and a flag for clipping [1, boolean]."""
    weight = safe_divide(rho - rho_a, rho_m - rho_a, floor=1e-9)
    clipped = (weight <= 0.0) | (weight >= 1.0)
    xp = namespace_of(weight)
    return xp.where(clipped, frozen(xp.clip(weight, 0.0, 1.0)), weight), clipped
