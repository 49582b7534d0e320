"""Histories of a loaded chain: one scan over the rows carries the memories of all springs of all segments.

A row continues from the last solved one. Pressure, phases and memories change in between. Newton's method
applies them at once or, where that fails, in steps (`serial_chain.balance.search`).
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.balance import Problem
from ..actuator.result import Equilibrium, Validity
from ..nitinol import SpringResponse, SpringState
from ..nitinol.spring import Activation
from ..nitinol.thermal import Heating
from ..numerics.safe import begun_as, zero_unless
from ..program_cache import stored_jit
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


@stored_jit(History, Equilibrium, Validity, SpringResponse, SpringState)
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

    def step(carry: _Carry, row: tuple) -> tuple[_Carry, tuple]:
        pressure, drives, interval = row
        warmed = [
            _phases(body, drive, temperature, resistance, interval)
            for (body, _, _), drive, temperature, resistance in zip(
                stacked, drives, carry.temperatures, carry.resistances, strict=True
            )
        ]
        phases, temperatures = tuple(w[0] for w in warmed), tuple(w[1] for w in warmed)
        problem = _problem(balance, stacked, pressure, phases, carry.states)
        root = chain_root(carry.before, problem, carry.unknowns)
        found = described(problem, root)
        good = root.found
        for row_of_part in found:
            good = good & jnp.all(row_of_part.converged)
        keep = lambda new, old: jax.tree.map(lambda a, b: jnp.where(good, a, b), new, old)  # noqa: E731
        # a failed row is NaN: what it would commit is replaced before the memory's laws see it
        finite = [zero_unless(good, f) for f in found]
        states = tuple(
            keep(_remembered(body, state, f), state)
            for (body, _, _), state, f in zip(stacked, carry.states, finite, strict=True)
        )
        resistances = tuple(
            keep(tuple(r.resistance for r in f.springs), old)
            for f, old in zip(finite, carry.resistances, strict=True)
        )
        unknowns = jnp.where(good, root.unknowns, carry.unknowns)
        after = _Carry(states, temperatures, resistances, unknowns, keep(problem, carry.before))
        shown = [dict(curvature=f.curvature, bend_angle=f.bend_angle, length=f.length) for f in found]
        return after, (tuple(found), states, temperatures, tuple(shown))

    course = (pressure, drives, interval)
    first = _first_carry(balance, stacked, pressure[0], jax.tree.map(lambda x: x[0], drives), guess)
    first = begun_as(first, (balance, stacked, course))
    _, (found, states, temperatures, shown) = jax.lax.scan(step, first, course)
    return tuple(
        History(f, s, jnp.stack(t, axis=-1) if t else jnp.zeros((*f.length.shape, 0)), seen)
        for f, s, t, seen in zip(found, states, temperatures, shown, strict=True)
    )


def _problem(
    balance: ChainProblem, stacked: tuple[Stacked, ...], pressure: Array, phases: tuple, states: tuple
) -> ChainProblem:
    """Balance of the chain in one row."""
    parts = tuple(
        Problem(body, jnp.broadcast_to(pressure, body.length.shape), phase, state)
        for (body, _, _), phase, state in zip(stacked, phases, states, strict=True)
    )
    return dataclasses.replace(balance, parts=parts)


def _first_carry(
    balance: ChainProblem, stacked: tuple[Stacked, ...], pressure: Array, drives: tuple, guess: Array | None
) -> _Carry:
    """State before the first row: springs at rest, and the chain without loads or as it starts by itself."""
    temperatures, resistances = zip(
        *(_at_rest(body, drive) for (body, _, _), drive in zip(stacked, drives, strict=True)), strict=True
    )
    states = tuple(jax.tree.map(lambda x: jnp.asarray(x, dtype=float), state) for _, _, state in stacked)
    begin = tuple(
        _phases(body, drive, t, r, jnp.zeros(()))[0]
        for (body, _, _), drive, t, r in zip(stacked, drives, temperatures, resistances, strict=True)
    )
    rest = _problem(balance, stacked, pressure, begin, states)
    rest = dataclasses.replace(rest, share=jnp.zeros(()))
    if guess is None:
        rest, guess = rest_of(rest) or (rest, None)
    return _Carry(states, temperatures, resistances, guess, rest)


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
