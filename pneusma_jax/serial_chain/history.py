"""Histories of a loaded chain: one scan over the rows carries the memories of all springs of all segments.

A row continues from the last solved one. Pressure, phases and memories change in between. Newton's method
applies them at once or, where that fails, in steps (`serial_chain.balance.search`).
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem
from ..actuator.result import Equilibrium
from ..nitinol import SpringState
from ..nitinol.spring import Activation
from ..nitinol.thermal import Heating
from ..numerics.safe import begun_as, is_concrete
from ..precision import require_float64
from ..simulate.history import History, phases_of
from .balance import ChainProblem, chain_root, described, rest_of

Stacked = tuple[Actuator, tuple[Activation | Heating, ...], tuple[SpringState, ...]]


class _Carry(eqx.Module):
    """State that one row passes to the next.

    Attributes:
        states, temperatures, resistances: tuple over springs of arrays over segments, for each part.
        unknowns: unknowns of the last solved row; before: its balance.
    """

    states: tuple[tuple[SpringState, ...], ...]
    temperatures: tuple[tuple[Array, ...], ...]
    resistances: tuple[tuple[Array, ...], ...]
    unknowns: Array
    before: ChainProblem


@eqx.filter_jit
def loaded_history(
    balance: ChainProblem,
    stacked: tuple[Stacked, ...],
    pressure: Float[Array, "rows"],
    time: Float[Array, "rows"],
    guess: Float[Array, "unknowns"] | None,
) -> tuple[History, ...]:
    """Histories of every part, with leading axes of rows and segments.

    Args:
        balance: balance of the chain, whose parts stand for the first row.
        stacked: actuators, activations with arrays of shape (segments, rows), and initial memories, for each
            part.
        pressure: gauge pressure [Pa], shape (rows,).
        time: time [s], shape (rows,).
        guess: unknowns of the chain without loads in the first row; None to begin at rest.
    """
    rows = pressure.shape[0]
    drives = tuple(_by_row(drive, rows) for _, drive, _ in stacked)
    interval = jnp.diff(time, prepend=time[:1])

    def problem_of(pressure: Array, phases: tuple, states: tuple) -> ChainProblem:
        parts = tuple(
            Problem(body, jnp.broadcast_to(pressure, body.length.shape), phase, state)
            for (body, _, _), phase, state in zip(stacked, phases, states, strict=True)
        )
        return dataclasses.replace(balance, parts=parts)

    def step(carry: _Carry, row: tuple) -> tuple[_Carry, tuple]:
        pressure, drives, interval = row
        warmed = [
            _phases(body, drive, temperature, resistance, interval)
            for (body, _, _), drive, temperature, resistance in zip(
                stacked, drives, carry.temperatures, carry.resistances, strict=True
            )
        ]
        phases, temperatures = tuple(w[0] for w in warmed), tuple(w[1] for w in warmed)
        problem = problem_of(pressure, phases, carry.states)
        stand = chain_root(carry.before, problem, carry.unknowns)
        found = described(problem, stand)
        good = stand.found
        for row_of_part in found:
            good = good & jnp.all(row_of_part.converged)
        keep = lambda new, old: jax.tree.map(lambda a, b: jnp.where(good, a, b), new, old)  # noqa: E731
        # a failed row is NaN: what it would commit is replaced before the memory's laws see it
        calm = [
            jax.tree.map(lambda x: jnp.where(good, x, 0.0) if eqx.is_inexact_array(x) else x, f)
            for f in found
        ]
        states = tuple(
            keep(_remembered(body, state, f), state)
            for (body, _, _), state, f in zip(stacked, carry.states, calm, strict=True)
        )
        resistances = tuple(
            keep(tuple(r.resistance for r in f.springs), old)
            for f, old in zip(calm, carry.resistances, strict=True)
        )
        unknowns = jnp.where(good, stand.unknowns, carry.unknowns)
        after = _Carry(states, temperatures, resistances, unknowns, keep(problem, carry.before))
        shown = [dict(curvature=f.curvature, bend_angle=f.bend_angle, length=f.length) for f in found]
        return after, (tuple(found), states, temperatures, tuple(shown))

    first_drives = jax.tree.map(lambda x: x[0], drives)
    temperatures, resistances = zip(
        *(_at_rest(body, drive) for (body, _, _), drive in zip(stacked, first_drives, strict=True)),
        strict=True,
    )
    states = tuple(jax.tree.map(lambda x: jnp.asarray(x, dtype=float), state) for _, _, state in stacked)
    begin = tuple(
        _phases(body, drive, t, r, jnp.zeros(()))[0]
        for (body, _, _), drive, t, r in zip(stacked, first_drives, temperatures, resistances, strict=True)
    )
    rest = dataclasses.replace(problem_of(pressure[0], begin, states), share=jnp.zeros(()))
    if guess is None:
        rest, guess = rest_of(rest) or (rest, None)
    course = (pressure, drives, interval)
    first = begun_as(_Carry(states, temperatures, resistances, guess, rest), (balance, stacked, course))
    _, (found, states, temperatures, shown) = jax.lax.scan(step, first, course)
    return tuple(
        History(f, s, jnp.stack(t, axis=-1) if t else jnp.zeros((*f.length.shape, 0)), seen)
        for f, s, t, seen in zip(found, states, temperatures, shown, strict=True)
    )


def check_course(pressure: Array, activations: tuple, time: Array | None) -> None:
    """Refuse meaningless inputs, in one sentence.

    Raises:
        RuntimeError: if float64 is off.
        ValueError: for an empty history, arrays of different lengths, or time going backwards.
    """
    require_float64()
    if jnp.ndim(pressure) != 1 or not jnp.shape(pressure)[0]:
        raise ValueError(
            f"Argument `pressure` must be a history of at least one row, but its shape is "
            f"{jnp.shape(pressure)}."
        )
    rows = jnp.shape(pressure)[0]
    named = [("activations", leaf) for leaf in jax.tree.leaves(activations) if jnp.ndim(leaf)]
    for what, array in [*named, *([] if time is None else [("time", time)])]:
        if jnp.shape(array) != (rows,):
            raise ValueError(
                f"Argument `{what}` must have {rows} rows like the pressure, but one has {jnp.shape(array)}."
            )
    drives = jax.tree.leaves(activations, is_leaf=lambda x: isinstance(x, Heating))
    if time is None:
        if any(isinstance(drive, Heating) for drive in drives):
            raise ValueError("Argument `time` must be given where a current heats a spring, but it is None.")
    elif is_concrete(time):
        back = np.flatnonzero(np.diff(np.asarray(time)) < 0.0)
        if back.size:
            raise ValueError(f"Argument `time` must not go backwards, but it does after row {back[0] + 1}.")


def _by_row(drive: tuple, rows: int) -> tuple:
    """Activations with the rows first: their arrays of shape (segments, rows) transposed."""
    return jax.tree.map(lambda x: jnp.swapaxes(jnp.broadcast_to(x, (x.shape[0], rows)), 0, 1), drive)


def _phases(
    body: Actuator, drive: tuple, temperatures: tuple, resistances: tuple, interval: Array
) -> tuple[tuple[Activation, ...], tuple[Array, ...]]:
    """Activations of a row, currents turned into phases, and the springs' temperatures [degC]."""

    def one(body: Actuator, drive: tuple, temperatures: tuple, resistances: tuple) -> tuple[tuple, tuple]:
        return phases_of(body.springs, drive, temperatures, resistances, interval)

    return jax.vmap(one)(body, drive, temperatures, resistances)


def _at_rest(body: Actuator, drive: tuple) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Temperatures [degC] and resistances [ohm] of springs at ambient temperature and attached length."""

    def one(body: Actuator, drive: tuple) -> tuple[tuple, tuple]:
        warm = tuple(a.ambient if isinstance(a, Heating) else jnp.asarray(jnp.nan) for a in drive)
        ohms = tuple(
            s.alloy.resistivity(jnp.asarray(1.0), s.shear_strain(jnp.asarray(0.0))) * s.geometry.wire_length
            for s in body.springs
        )
        return warm, ohms

    return jax.vmap(one)(body, drive)


def _remembered(body: Actuator, states: tuple, found: Equilibrium) -> tuple[SpringState, ...]:
    """Memories after a row."""

    def one(body: Actuator, states: tuple, found: Equilibrium) -> tuple[SpringState, ...]:
        rows = zip(body.springs, states, found.springs, strict=True)
        return tuple(spring.remember(state, response) for spring, state, response in rows)

    return jax.vmap(one)(body, states, found)
