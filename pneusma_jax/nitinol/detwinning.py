"""Detwinned martensite fraction as a function of shear strain: Table 2.2, rows 1 and 2."""

from jaxtyping import Array

from ..numerics.safe import namespace_of


def generalised_logistic(gamma: Array, beta_1: Array, beta_2: Array, beta_3: Array) -> Array:
    """Fraction of the martensite that is detwinned, `[1 + exp(-b1 gamma - b2)]^(-b3)` [1].

    The source prints the exponent `+b3`, with which the fraction at zero strain would be 166. With `-b3` it
    runs from 0.006 to 0.93 (correction 1). It is computed through its logarithm, so that it cannot overflow.

    Args:
        gamma: shear strain [1].
        beta_1, beta_2, beta_3: shape constants [1].
    """
    xp = namespace_of(gamma, beta_1, beta_2, beta_3)
    return xp.exp(-beta_3 * xp.logaddexp(0.0, -beta_1 * gamma - beta_2))


def signed_algebraic_sigmoid(x: Array, exponent: Array) -> Array:
    """`x / (1 + |x|^k)^(1/k)`, from -1 to 1, smooth in value and slope at x = 0 [1]."""
    xp = namespace_of(x, exponent)
    size = xp.abs(x)
    small = size < 1e-300
    safe = xp.where(small, 1.0, size)
    # log(1 + |x|^k) through logaddexp: |x|^k overflows for the steep sigmoids of Table 2.2
    root = xp.exp(-xp.logaddexp(0.0, exponent * xp.log(safe)) / exponent)
    return x * xp.where(small, 1.0, root)


def algebraic_sigmoid(gamma: Array, k_1: Array, k_2: Array, k_3: Array) -> Array:
    """Fraction of the austenite that stress has turned into detwinned martensite, Table 2.2 row 2 [1].

    Args:
        gamma: shear strain [1].
        k_1, k_2, k_3: slope, offset and sharpness [1].
    """
    return 0.5 * (1.0 + signed_algebraic_sigmoid(k_1 * gamma + k_2, k_3))
