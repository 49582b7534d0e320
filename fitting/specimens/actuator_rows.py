"""Equilibria of all rows of an actuator's recording, solved at once instead of one after the other.

A spring's memory in one row depends on strains and phases of earlier rows. So the rows are first solved at
given phases and memories. The resulting strains correct both, by the resistance and by the rule of the
memory. Then the rows are solved again.
"""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.actuator.balance import Problem, configuration, first_trial
from pneusma_jax.actuator.designs import GEOMETRY_KEYS
from pneusma_jax.actuator.nearby_root import nearby_root
from pneusma_jax.nitinol import Alloy, Spring, SpringState

from . import silicones
from .rows import Rows, numbers
from .spring_rows import ALLOY

PASSES = 2
"""Number of passes over all rows; the first uses the given phases and memories."""
TINY = 1e-24
"""Minimum square of a bend angle [rad2]; a smaller bend has no direction."""


class Solved(eqx.Module):
    """Solutions of all rows. Arrays have shape (rows,), those of springs (springs, rows); NaN where there is
    no equilibrium.

    Attributes:
        curvature [1/m], bend_angle [rad], bend_direction [rad], length [m]: of the centre line.
        gamma: shear strain [1]; xi0: martensite fraction [1]; ohms: resistance [ohm] of each spring; finite.
    """

    curvature: Array
    bend_angle: Array
    bend_direction: Array
    length: Array
    gamma: Array
    xi0: Array
    ohms: Array


def body_of(parameters: Mapping[str, Array], rows: Rows) -> pj.Actuator:
    """The actuator with these parameters."""
    layout = rows.extra["layout"]
    alloy = Alloy(**{name: parameters[name] for name in ALLOY}) if layout.spring_numbers else None
    geometry = pj.Geometry(**{name: parameters[name] for name in GEOMETRY_KEYS})
    return pj.round_actuator(layout, geometry, alloy, silicones.law_with(rows.extra["law"], parameters))


def trajectory(values: Mapping[str, Array], rows: Rows) -> Solved:
    """Solutions of one recording.

    Args:
        values: free parameters by name, SI.
        rows: one recording.
    """
    parameters = numbers(values, rows)
    body, count = body_of(parameters, rows), rows.time.size
    fresh = SpringState.fresh(jnp.asarray(parameters["prestrain"], float))
    xi0 = _spring_columns(rows, "xi0")
    states = tuple(SpringState(jnp.broadcast_to(fresh.prestrain, (count,)), _earlier_minimum(x)) for x in xi0)
    guess = jnp.broadcast_to(first_trial(body), (count, body.basis.shape[1]))
    for _ in range(PASSES - 1 if body.springs else 0):
        guess, _ = _solve(body, rows, xi0, states, guess)
        gamma = _strains(body, guess)
        xi0 = _corrected(body, rows, gamma)
        springs = zip(body.springs, gamma, xi0, strict=True)
        states = tuple(_memories(spring, fresh, *row) for spring, *row in springs)
    return _solved(body, xi0, *_solve(body, rows, xi0, states, guess))


def _spring_columns(rows: Rows, name: str) -> Array:
    """Given phases and memories of every spring, shape (springs, rows)."""
    columns = rows.extra[name]
    return jnp.stack(columns) if columns else jnp.zeros((0, rows.time.size))


def _earlier_minimum(xi0: Array) -> Array:
    """Smallest martensite fraction of all earlier rows, 1 for the first row [1]."""
    return jnp.concatenate([jnp.ones(1), jax.lax.cummin(xi0)[:-1]])


def _solve(body: pj.Actuator, rows: Rows, xi0: Array, states: tuple, guess: Array) -> tuple[Array, Array]:
    """Scaled unknowns of every row, shape (rows, freedoms), and a mask of the rows that balance."""

    def one(pressure: Array, xi0: Array, states: tuple, guess: Array) -> tuple[Array, Array]:
        phases = tuple(pj.MartensiteFraction(xi0[k]) for k in range(len(body.springs)))
        return nearby_root(Problem(body, pressure, phases, states), guess)

    return jax.vmap(one, in_axes=(0, 1, 0, 0))(rows.inputs["pressure"], xi0, states, guess)


def _strains(body: pj.Actuator, unknowns: Array) -> Array:
    """Shear strain of every spring, shape (springs, rows) [1]."""
    if not body.springs:
        return jnp.zeros((0, len(unknowns)))
    centre, bend = jax.vmap(lambda z: configuration(body, z))(unknowns)
    places = zip(body.springs, body.spring_places, strict=True)
    return jnp.stack([spring.shear_strain(centre + bend @ place) for spring, place in places])


def _corrected(body: pj.Actuator, rows: Rows, gamma: Array) -> Array:
    """Martensite fractions at these strains, shape (springs, rows): the given ones, corrected to first
    order."""
    decided = _spring_columns(rows, "xi0")
    springs = zip(body.springs, decided, gamma, strict=True)
    ohms = jnp.stack([s.alloy.resistivity(x, g) * s.geometry.wire_length for s, x, g in springs])
    corrected = decided + _spring_columns(rows, "gain") * (_spring_columns(rows, "ohms") - ohms)
    return jnp.clip(corrected, 0.0, 1.0)


def _memories(spring: Spring, first: SpringState, gamma: Array, xi0: Array) -> SpringState:
    """Memory at the beginning of every row."""

    def row(state: SpringState, now: tuple[Array, Array]) -> tuple[SpringState, SpringState]:
        return spring.alloy.remember(state, *now), state

    return jax.lax.scan(row, first, (gamma, xi0))[1]


def _solved(body: pj.Actuator, xi0: Array, unknowns: Array, good: Array) -> Solved:
    centre, bends = jax.vmap(lambda z: configuration(body, z))(unknowns)
    bend = bends @ jnp.asarray(body.side_direction)
    if not body.planar:
        bend = jnp.sqrt(jnp.sum(bends**2, axis=1) + TINY)
    length, gamma = body.length + centre, _strains(body, unknowns)
    columns = {
        "curvature": bend / length,
        "bend_angle": bend,
        "bend_direction": jnp.arctan2(bends[:, 1], bends[:, 0] + TINY**0.5),
        "length": length,
    }
    columns = {name: jnp.where(good, column, jnp.nan) for name, column in columns.items()}
    ohms = [
        spring.alloy.resistivity(x, g) * spring.geometry.wire_length
        for spring, x, g in zip(body.springs, xi0, gamma, strict=True)
    ]
    return Solved(**columns, gamma=gamma, xi0=xi0, ohms=jnp.stack(ohms) if ohms else jnp.zeros_like(gamma))
