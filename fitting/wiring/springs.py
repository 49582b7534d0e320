"""Resistance and inductance of a design's springs."""

import jax.numpy as jnp

from fitting.design.bodies import build_body, plan_of
from pneusma_jax.errors import InputError

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
    one, zero = springs[0], jnp.zeros(())
    geometry = one.geometry
    resistance = one.alloy.resistivity(jnp.asarray(1.0), one.shear_strain(zero)) * geometry.wire_length
    coil = spring_inductance(geometry.active_coils, geometry.coil_diameter, one.attached_length)
    return Springs(float(resistance), float(coil))
