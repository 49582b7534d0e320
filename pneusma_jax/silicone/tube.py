"""Elongation of a fibre-wrapped tube under pressure, without springs: Eqs. 3.7 to 3.15."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..late import optimistix as optx
from ..numerics.implicit_root import OneUnknown
from ..precision import require_float64
from .laws import SiliconeLaw

LEAST, MOST = -0.9, 20.0
"""Axial strains between which the balance is looked for [1]."""


def tube_strain(
    pressure: Array, outer_diameter: Array, wall_thickness: Array, law: SiliconeLaw, throw: bool = True
) -> Array:
    """Axial strain that balances the end cap's pressure with the wall's tension, Eq. 3.9 [1].

    Args:
        pressure: gauge pressure [Pa], scalar.
        outer_diameter, wall_thickness: dimensions of the tube [m].
        law: axial engineering stress of the wall; `laws.NeoHookean` or any other.
        throw: false for NaN where the balance has no solution.

    Raises:
        RuntimeError: if the balance has no solution and `throw` is true, or float64 is off.
    """
    require_float64()
    bore = outer_diameter - 2.0 * wall_thickness
    ratio = bore**2 / (outer_diameter**2 - bore**2)

    def balance(strain: Array, _: None) -> Array:
        return (law(strain) - pressure * ratio) / 1e5

    # Newton from rest diverges where a law softens; a bracketed search cannot
    solver = optx.Bisection(rtol=1e-14, atol=1e-14, flip=False)
    options = dict(lower=LEAST, upper=MOST)
    found = optx.root_find(
        balance, solver, jnp.asarray(0.1), None, options=options, max_steps=200, adjoint=OneUnknown(),
        throw=False,
    )
    held = (balance(jnp.asarray(LEAST), None) < 0.0) & (balance(jnp.asarray(MOST), None) > 0.0)
    held = held & (found.result == optx.RESULTS.successful)
    if throw:
        return eqx.error_if(found.value, ~held, "the wall of the tube cannot balance this pressure")
    return jnp.where(held, found.value, jnp.nan)


def tube_length(
    pressure: Array,
    length: Array,
    outer_diameter: Array,
    wall_thickness: Array,
    law: SiliconeLaw,
    throw: bool = True,
) -> Array:
    """Length of the pressurised tube, Eq. 3.10 [m]; other arguments as for `tube_strain`."""
    return length * (1.0 + tube_strain(pressure, outer_diameter, wall_thickness, law, throw))
