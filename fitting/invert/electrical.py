"""What a spring's fraction means on its wires: resistance, the current that holds it, the fraction without
one."""

import jax
import jax.numpy as jnp
import numpy as np

from fitting.design.bodies import Body, Solved
from fitting.design.quantities import AMBIENT, balance_of, convected, temperature, wire_temperature
from pneusma_jax.nitinol import Spring
from pneusma_jax.numerics.rows import first_rows
from pneusma_jax.numerics.safe import as_numpy
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.simulate.row import wire_resistances

from .forward import padded

COOL = 1e-9
"""Rise over the air's temperature that is rounding error [K]: a spring without a current has none."""


def unheated(body: Body) -> np.ndarray:
    """Martensite fraction of every spring in air of 22 degC without a current [1], shape (springs,)."""
    alloys = [spring.alloy for segment in body.segments for spring in segment.springs]
    return np.array([float(as_numpy(alloy).martensite_fraction_at(AMBIENT)) for alloy in alloys])


def highest(body: Body, xi0_max: float | None) -> np.ndarray:
    """Largest martensite fraction that the drives may give every spring [1], shape (springs,).

    Args:
        body: the body that is driven.
        xi0_max: the same for all springs; None for that which each has without a current.
    """
    found = unheated(body)
    return found if xi0_max is None else np.full(found.size, xi0_max)


def holding_power(spring: Spring, degrees: jax.Array) -> jax.Array:
    """Power that holds a wire at a temperature [degC] in air of 22 degC [W]."""
    return convected(spring, jnp.where(degrees - AMBIENT > COOL, degrees - AMBIENT, 0.0))


def heat(body: Body, fractions: np.ndarray) -> np.ndarray:
    """Power that holds all springs at their fractions in air of 22 degC [W], shape (...).

    It depends on nothing but the fractions: each tells the temperature of its wire (Section 2.4.3).

    Args:
        body: the body that is driven.
        fractions: martensite fractions [1], shape (..., springs).
    """
    total = np.zeros(fractions.shape[:-1])
    springs = [spring for segment in body.segments for spring in segment.springs]
    for k, spring in enumerate(springs):
        total += np.asarray(_held(spring, fractions[..., k]))
    return total


@stored_jit()
def _held(spring: Spring, xi0: jax.Array) -> jax.Array:
    """Power that holds a wire at its fractions [W]; 0 for a cold one."""
    return jnp.where(xi0 < 1.0, holding_power(spring, wire_temperature(spring, xi0)), 0.0)


def electrical(solved: Solved) -> tuple[np.ndarray, np.ndarray]:
    """Resistance of every spring as a meter shows it [ohm], and the current that holds its temperature in air
    of 22 degC [A].

    The power that heats a wire is the square of its current times its own resistance, without leads.

    Args:
        solved: states, arrays with a leading axis of rows.
    """
    parts, size = padded(solved.parts)
    return first_rows(_electrical(solved.body, parts), size)


@stored_jit()
def _electrical(body: Body, parts: tuple) -> tuple[jax.Array, jax.Array]:
    """Resistances and currents in every row, (rows, springs)."""

    def one(part: tuple) -> tuple[jax.Array, jax.Array]:
        state = Solved(body, *part)
        resistances, currents = [], []
        for k, segment in enumerate(body.segments):
            if not segment.springs:
                continue
            found = state.segments[k].springs
            wires = wire_resistances(*balance_of(state, k))
            rows = zip(segment.springs, found, temperature(state, k), wires, strict=True)
            for spring, response, degrees, wire in rows:
                power = holding_power(spring, degrees)
                resistances.append(response.resistance)
                currents.append(jnp.where(response.xi0 < 1.0, jnp.sqrt(power / wire), 0.0))
        blank = jnp.zeros(0)
        return (jnp.stack(resistances), jnp.stack(currents)) if resistances else (blank, blank)

    return jax.vmap(one)(parts)
