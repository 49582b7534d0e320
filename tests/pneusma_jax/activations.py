"""Martensite fractions as the solvers take them."""

import jax.numpy as jnp

import pneusma_jax as pj


def phases(*xi0):
    """Given fractions, one for each spring."""
    return tuple(pj.MartensiteFraction(jnp.asarray(x)) for x in xi0)
