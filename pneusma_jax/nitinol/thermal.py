"""Lumped electro-thermal state of a spring's wire: Joule heating against convection.

The law is `m c dT/dt = I^2 R - h A (T - T_ambient)`. The source does not give its constants, so they are
assumed, with wide priors. The heat capacity includes the latent heat of the transformation. Temperatures are
in degC.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..numerics.safe import as_array, as_numpy, is_concrete
from .alloy import Alloy
from .geometry import SpringGeometry


class Heating(eqx.Module):
    """Current and air of a spring whose phase follows from its temperature, instead of being given.

    Attributes:
        current: root-mean-square current [A], shape (rows,).
        ambient: temperature of the air [degC], scalar or shape (rows,).
    """

    current: Array = eqx.field(converter=as_array)
    ambient: Array = eqx.field(converter=as_array, default=22.0)


def duty_cycle_current(duty: Array, full_current: Array) -> Array:
    """Root-mean-square current of a pulse-width modulated supply [A].

    Args:
        duty: share of the time that the supply is on [1].
        full_current: current while the supply is on [A].
    """
    return full_current * jnp.sqrt(jnp.clip(duty, 0.0, 1.0))


def time_constant(alloy: Alloy, geometry: SpringGeometry) -> Array:
    """Time in which the wire's excess temperature falls to 1/e, `m c / (h A)` [s].

    Of a wire of diameter d, `m / A` is `density * d / 4`: its ends do not count.
    """
    if is_concrete(alloy, geometry):
        alloy, geometry = as_numpy((alloy, geometry))
    return alloy.density * alloy.heat_capacity * geometry.wire_diameter / (4.0 * alloy.convection)


def steady_temperature(
    alloy: Alloy, geometry: SpringGeometry, current: Array, resistance: Array, ambient: Array
) -> Array:
    """Temperature at which convection carries off the Joule heat [degC].

    Args:
        alloy, geometry: alloy and geometry of the spring.
        current: root-mean-square current [A].
        resistance: resistance of the active wire [ohm].
        ambient: temperature of the air [degC].
    """
    surface = jnp.pi * geometry.wire_diameter * geometry.wire_length
    return ambient + current**2 * resistance / (alloy.convection * surface)


def next_temperature(
    alloy: Alloy,
    geometry: SpringGeometry,
    temperature: Array,
    interval: Array,
    current: Array,
    resistance: Array,
    ambient: Array,
) -> Array:
    """Temperature after an interval of constant current and resistance: the exact solution [degC].

    Args:
        alloy, geometry: alloy and geometry of the spring.
        temperature: temperature at the start [degC].
        interval: duration [s]; 0 changes nothing.
        current: root-mean-square current [A].
        resistance: resistance of the active wire, from the previous row [ohm].
        ambient: temperature of the air [degC].
    """
    target = steady_temperature(alloy, geometry, current, resistance, ambient)
    decay = jnp.exp(-interval / time_constant(alloy, geometry))
    return target + (temperature - target) * decay
