"""Largest admissible strain of a spring: its wire is strained as far as the source's was."""

import functools

import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.errors import InputError
from pneusma_jax.program_cache import stored_jit

STEPS = (1.15, 2.30, 3.45, 4.60, 5.75)
"""Spring strains that it was stretched to, Section 2.4.2."""
HOT_STEPS = 3
"""A hot spring is not stretched further than this step, so as not to damage it."""
ROUND = 0.05
"""Spring strains are rounded to."""
LONGEST = 40.0
"""Spring strain up to which a step is looked for."""


@functools.cache
def published_spring() -> pj.SpringGeometry:
    """The source's spring. It is made when it is wanted, since that compiles programs."""
    return pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)


@stored_jit()
def _shear_strain(geometry: pj.SpringGeometry, strain: Array) -> Array:
    """Shear strain of a spring's wire over the spring strain [1]."""
    return geometry.shear_strain(geometry.free_length * strain)


def steps_of(geometry: pj.SpringGeometry) -> tuple[float, ...]:
    """Spring strains at which the wire of a spring is strained as the source's was at its own five steps.

    Raises:
        InputError: if the spring would have to be stretched beyond all measure.
    """
    wanted = np.asarray(_shear_strain(published_spring(), np.array(STEPS)))
    strain = np.linspace(0.0, LONGEST, 8001)
    gamma = np.asarray(_shear_strain(geometry, strain))
    rising = np.maximum.accumulate(gamma)
    if rising[-1] < float(wanted[-1]):
        raise InputError(
            f"[geometry]: even at {LONGEST:g} times its free length the wire of this spring is strained to"
            f" {rising[-1]:.3g} only, not to {float(wanted[-1]):.3g}; are its dimensions right?"
        )
    steps = ROUND * np.round(np.interp(wanted, rising, strain) / ROUND)
    return tuple(float(f"{max(step, ROUND):.6g}") for step in steps)
