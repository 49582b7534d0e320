"""A test stand for one spring: travel, a current from a PID controller, and the wire's own heat balance.

The controller increases the current while the resistance lies above its set-point. Where stress has turned
the wire into detwinned martensite, no heating or cooling changes the resistance much. At high strain the
set-point is therefore lost, and the controller saturates (Section 2.4.5).
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import pneusma_jax as pj
from pneusma_jax.nitinol.thermal import duty_cycle_current, next_temperature, time_constant
from pneusma_jax.numerics.safe import as_array
from pneusma_jax.program_cache import stored_jit

STEP_S = 0.05  # Time step of the controller and of the simulation
TRICKLE = 1e-3  # Minimum duty cycle; without any current the resistance cannot be measured
HOT_WIDTHS = 10.0  # Excess of full heating over the transformation's middle, in its widths and in kelvin
HOT_KELVIN = 30.0
BANDWIDTH = 2.0  # Bandwidth of the loop where the resistance is most sensitive [rad/s]
RESET_S = 2.0  # integral time
LEAD_S = 0.1  # derivative time


class Stand(eqx.Module):
    """A spring on a stand with a heater.

    Attributes:
        spring: tested spring.
        ambient: temperature of the air around it [degC].
        full_current: current while the supply is on [A].
        proportional: duty per resistance error relative to the spring's contrast at rest [1].
        contrast: resistance of the cold, unstrained spring less that of the hot one [ohm].
        read_noise: standard deviation of the controller's own readings [ohm].
    """

    spring: pj.Spring
    ambient: Array
    full_current: Array
    proportional: Array
    contrast: Array
    read_noise: Array


class StandRun(eqx.Module):
    """Time histories of a test in fine steps, arrays of shape (..., steps).

    Attributes:
        resistance [ohm], temperature [degC], current: root mean square [A], xi0 [1].
    """

    resistance: Array
    temperature: Array
    current: Array
    xi0: Array


def rest_resistances(spring: pj.Spring) -> tuple[float, float]:
    """Resistance of the unstrained spring, cold and hot [ohm]."""
    cold, hot = np.asarray(_at_rest(spring))
    return float(cold), float(hot)


@stored_jit()
def _at_rest(spring: pj.Spring) -> Array:
    """Resistances of the unstrained spring, cold and hot, (2,) [ohm]."""
    return spring.alloy.resistivity(jnp.asarray([1.0, 0.0]), jnp.zeros(2)) * spring.geometry.wire_length


def build_stand(spring: pj.Spring, ambient: float, read_noise: float) -> Stand:
    """A stand whose supply can heat this spring through its transformation, and whose controller suits it."""
    settings = _settings(spring, as_array(ambient))
    return Stand(spring=spring, ambient=as_array(ambient), read_noise=as_array(read_noise), **settings)


@stored_jit()
def _settings(spring: pj.Spring, ambient: Array) -> dict[str, Array]:
    """Fields of a `Stand` that its spring decides."""
    alloy, g = spring.alloy, spring.geometry
    cold, hot = _at_rest(spring)
    rise = alloy.T_mid + HOT_WIDTHS * alloy.T_width + HOT_KELVIN - ambient
    loss = alloy.convection * jnp.pi * g.wire_diameter * g.wire_length
    rate = rise / time_constant(alloy, g)
    temperatures = jnp.linspace(alloy.T_mid - 10 * alloy.T_width, alloy.T_mid + 5 * alloy.T_width, 400)
    weight = alloy.martensite_fraction_at(temperatures) ** alloy.a
    sensitivity = jnp.max(jnp.abs(jnp.gradient(weight, temperatures)))
    return {
        "full_current": jnp.sqrt(rise * loss / hot),
        "proportional": BANDWIDTH / (rate * sensitivity),
        "contrast": cold - hot,
    }


@stored_jit(StandRun)
def run_stand(
    stand: Stand,
    elongation: Float[Array, "tests steps"],
    setpoint: Float[Array, "tests"],
    duty_limits: Float[Array, "tests 2"],
    readings: Float[Array, "tests steps"],
) -> StandRun:
    """Simulate tests that each start at rest and at ambient temperature.

    Resistance does not depend on the wire's memory, which is left to `simulate_spring`.

    Args:
        stand: test stand.
        elongation: travel [m] every `STEP_S`, shape (tests, steps).
        setpoint: resistance to hold [ohm], shape (tests,).
        duty_limits: minimum and maximum duty cycle, shape (tests, 2); equal ones fix it.
        readings: standard normal errors of the controller's readings, shape (tests, steps).
    """
    return jax.vmap(lambda *test: _run(stand, *test))(elongation, setpoint, duty_limits, readings)


def _run(stand: Stand, elongation: Array, setpoint: Array, limits: Array, readings: Array) -> StandRun:
    spring, alloy = stand.spring, stand.spring.alloy

    def step(carry: tuple, row: tuple) -> tuple[tuple, StandRun]:
        temperature, resistance, integral, before = carry
        travel, noise = row
        error = (resistance + stand.read_noise * noise - setpoint) / stand.contrast
        duty, integral = _pid(stand.proportional, error, before, integral, limits)
        current = duty_cycle_current(duty, stand.full_current)
        temperature = next_temperature(
            alloy, spring.geometry, temperature, STEP_S, current, resistance, stand.ambient
        )
        xi0 = alloy.martensite_fraction_at(temperature)
        resistance = alloy.resistivity(xi0, spring.shear_strain(travel)) * spring.geometry.wire_length
        after = (temperature, resistance, integral, error)
        return after, StandRun(resistance, temperature, current, xi0)

    xi0 = alloy.martensite_fraction_at(stand.ambient)
    resistance = alloy.resistivity(xi0, jnp.asarray(0.0)) * spring.geometry.wire_length
    first = (stand.ambient, resistance, jnp.asarray(0.0), (resistance - setpoint) / stand.contrast)
    return jax.lax.scan(step, first, (elongation, readings))[1]


def _pid(gain: Array, error: Array, before: Array, integral: Array, limits: Array) -> tuple[Array, Array]:
    """Duty cycle and integral term. The integral rests while the error pushes the output against a limit."""
    grown = integral + gain * error * STEP_S / RESET_S
    wanted = gain * (error + LEAD_S * (error - before) / STEP_S) + grown
    stuck = ((wanted > limits[1]) & (error > 0.0)) | ((wanted < limits[0]) & (error < 0.0))
    return jnp.clip(wanted, limits[0], limits[1]), jnp.where(stuck, integral, grown)


def steps_of(seconds: float) -> int:
    """Number of simulation steps in a duration, at least one."""
    return max(1, round(seconds / STEP_S))


def travel_profile(peaks: np.ndarray, rest_s: float, leg_s: np.ndarray) -> np.ndarray:
    """Travel that waits at zero, then goes to each peak and back to zero at steady speed, every `STEP_S`.

    Args:
        peaks: elongations [m], shape (cycles,).
        rest_s: wait before the first pull [s].
        leg_s: duration of each pull, and of each return [s], shape (cycles,).
    """
    parts = [np.zeros(steps_of(rest_s) + 1)]
    for peak, seconds in zip(peaks, leg_s, strict=True):
        ramp = np.arange(1, steps_of(seconds) + 1) / steps_of(seconds)
        parts += [peak * ramp, peak * (1.0 - ramp)]
    return np.concatenate(parts)
