"""Resistance and inductance of a design's springs."""

import jax.numpy as jnp
from jaxtyping import Array

import pneusma_jax as pj
from fitting.design.bodies import build_body, plan_of
from pneusma_jax.errors import InputError
from pneusma_jax.program_cache import stored_jit

from .choose import Springs
from .circuit import spring_inductance


def springs_of_design(design: str) -> Springs:
    """The first spring of a design, cold and as it is attached.

    Raises:
        InputError: if it has none.
    """
    plan = plan_of(design)
    springs = [s for segment in build_body(plan, {}, plan.materials()).segments for s in segment.springs]
    if not springs:
        raise InputError(f"{design}: there is no spring to be heated")
    resistance, coil = _of_spring(springs[0])
    return Springs(float(resistance), float(coil))


@stored_jit()
def _of_spring(spring: pj.Spring) -> tuple[Array, Array]:
    """Resistance [ohm] and inductance [H] of a cold spring at its attached length."""
    geometry = spring.geometry
    rho = spring.alloy.resistivity(jnp.ones(()), spring.shear_strain(jnp.zeros(())))
    coil = spring_inductance(geometry.active_coils, geometry.coil_diameter, spring.attached_length)
    return rho * geometry.wire_length, coil
