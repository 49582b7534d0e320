"""Uniaxial engineering stress of incompressible hyperelastic laws, as functions of the stretch.

Every law is written for the deviatoric uniaxial path `lambda_2 = lambda_3 = lambda^(-1/2)`.
"""

from jaxtyping import Array

from ..numerics.safe import namespace_of

GENT_LIMIT = 0.999  # Maximum of (I1 - 3) / J_m, beyond which the tangent replaces the pole


def first_invariant(stretch: Array) -> Array:
    """First invariant of uniaxial incompressible stretch, Eq. 3.12 [1]."""
    return stretch**2 + 2.0 / stretch


def neo_hookean_stress(stretch: Array, mu: Array) -> Array:
    """Engineering stress `mu (lambda - 1/lambda^2)` [Pa]; mu is the shear modulus [Pa] (correction 15)."""
    return mu * (stretch - stretch**-2)


def printed_neo_hookean_stress(stretch: Array, mu: Array) -> Array:
    """The form of Table 3.2, `mu (lambda^2 - 1/lambda)` [Pa]: a true stress, with twice the constant."""
    return mu * (stretch**2 - 1.0 / stretch)


def constrained_neo_hookean_stress(stretch: Array, mu: Array) -> Array:
    """Engineering stress with the circumference held by fibres, `mu (lambda - 1/lambda^3)`, Eq. 3.13 [Pa]."""
    return mu * (stretch - stretch**-3)


def yeoh_stress(stretch: Array, c_10: Array, c_20: Array, c_30: Array) -> Array:
    """Yeoh's third-order law [Pa]; shear modulus `2 c_10`. O. H. Yeoh, Rubber Chem. Technol. 66, 754."""
    excess = first_invariant(stretch) - 3.0
    return 2.0 * (stretch - stretch**-2) * (c_10 + 2.0 * c_20 * excess + 3.0 * c_30 * excess**2)


def gent_stress(stretch: Array, mu: Array, j_m: Array) -> Array:
    """Gent's law of limited chain extension [Pa]. A. N. Gent, Rubber Chem. Technol. 69 (1996) 59.

    Within a thousandth of the pole at `I1 - 3 = j_m`, and past it, the amplification is continued along its
    tangent. A trial step may then cross the pole.

    Args:
        stretch: axial stretch [1].
        mu: shear modulus [Pa].
        j_m: limit of `I1 - 3` [1].
    """
    used = (first_invariant(stretch) - 3.0) / j_m
    past = used > GENT_LIMIT
    xp = namespace_of(used)
    inside = 1.0 / (1.0 - xp.where(past, 0.0, used))
    edge = 1.0 / (1.0 - GENT_LIMIT)
    amplification = xp.where(past, edge + edge**2 * (used - GENT_LIMIT), inside)
    return mu * amplification * (stretch - stretch**-2)


def ogden_stress(stretch: Array, mu: Array, alpha: Array) -> Array:
    """Ogden's law, `sum_p mu_p (lambda^(alpha_p - 1) - lambda^(-alpha_p/2 - 1))` [Pa].

    Energy `sum mu_p/alpha_p (sum_i lambda_i^alpha_p - 3)`, so that the shear modulus is
    `sum mu_p alpha_p / 2`. R. W. Ogden, Proc. R. Soc. A 326 (1972) 565.

    Args:
        stretch: axial stretch [1], any shape.
        mu: moduli [Pa], shape (terms,).
        alpha: exponents [1], shape (terms,).
    """
    xp = namespace_of(stretch, mu, alpha)
    stretch, mu, alpha = xp.asarray(stretch)[..., None], xp.asarray(mu), xp.asarray(alpha)
    return xp.sum(mu * (stretch ** (alpha - 1.0) - stretch ** (-0.5 * alpha - 1.0)), axis=-1)
