"""Shear stress of the wire: Eqs. 2.29 to 2.33 and 3.3."""

from jaxtyping import Array

from ..numerics.safe import namespace_of


def shear_modulus(xi0: Array, G_m: Array, G_a: Array) -> Array:
    """Shear modulus of the phase mixture by Voigt's rule, Eq. 2.29 [Pa]."""
    return xi0 * G_m + (1.0 - xi0) * G_a


def detwinning_stress(
    xi0: Array, xi_sm: Array, xi_sa: Array, G_m: Array, G_a: Array, gamma_L: Array
) -> Array:
    """Difference between the elastic stress and the stress with detwinning, the last two terms of Eq. 2.33
    [Pa]."""
    return gamma_L * (xi0 * G_m * xi_sm + (1.0 - xi0) * G_a * xi_sa)


def shear_stress(gamma: Array, modulus: Array, detwinning: Array, gamma_R: Array) -> Array:
    """Shear stress on loading and after pre-strain in one expression, equal to Eq. 3.3 [Pa].

    The printed intersection strain is where the elastic line through `gamma_R` meets the loading curve, so
    the larger of the two subtracted stresses decides. At a tie the elastic branch is taken. Eqs. 2.33, 2.49
    and 3.3 print `G` in place of `G gamma` (correction 3).

    Args:
        gamma: shear strain [1].
        modulus: `shear_modulus(...)` [Pa].
        detwinning: `detwinning_stress(...)` [Pa].
        gamma_R: residual strain [1].
    """
    loading = on_detwinning_branch(modulus, detwinning, gamma_R)
    return shear_stress_on(loading, gamma, modulus, detwinning, gamma_R)


def shear_stress_on(
    loading: Array, gamma: Array, modulus: Array, detwinning: Array, gamma_R: Array
) -> Array:
    """Shear stress on a given branch [Pa].

    Args:
        loading: true on the detwinning curve, false on the elastic line through `gamma_R`.
        gamma, modulus, detwinning, gamma_R: same as for `shear_stress`.
    """
    xp = namespace_of(loading, gamma, modulus, detwinning, gamma_R)
    return modulus * gamma - xp.where(loading, detwinning, modulus * gamma_R)


def on_detwinning_branch(modulus: Array, detwinning: Array, gamma_R: Array) -> Array:
    """True if the wire is loading along the detwinning curve rather than elastically."""
    return detwinning > modulus * gamma_R
