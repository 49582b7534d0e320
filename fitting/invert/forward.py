"""Fast states from drives: Newton's method from a state nearby, exact derivatives."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.design.bodies import Body, Solved, by_segment
from fitting.inference.parallel import run_parallel
from pneusma_jax.actuator.balance import first_trial
from pneusma_jax.actuator.implicit import attached
from pneusma_jax.actuator.result import Validity, equilibrium_of
from pneusma_jax.actuator.root_find import newton
from pneusma_jax.nitinol import SpringState
from pneusma_jax.nitinol.spring import SpringResponse
from pneusma_jax.numerics.rows import filled, first_rows, joined, lots
from pneusma_jax.pipeline import Effect
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.serial_chain.kinematics import arc_frame
from pneusma_jax.serial_chain.segments import ChainEquilibrium, chain_shape
from pneusma_jax.serial_chain.shape import ChainShape
from pneusma_jax.simulate.rest import problem_at_rest

FEW, LOT = 16, 256
"""Number of rows that are solved together: few or many."""

Memories = tuple[tuple[SpringState, ...], ...]  # of every segment, of every spring


def springs_of(body: Body) -> tuple[tuple[int, int], ...]:
    """Segment (from 1) and number of every spring."""
    return tuple((k, n) for k, segment in enumerate(body.segments, 1) for n in segment.spring_numbers)


def fresh(body: Body) -> Memories:
    """Memories of newly attached springs."""
    states = tuple(segment.fresh_states() for segment in body.segments)
    return jax.tree.map(lambda x: jnp.asarray(x, dtype=float), states)


def first_guess(body: Body) -> Array:
    """Start of Newton's method in every segment, shape (segments, freedoms)."""
    return jnp.stack([first_trial(segment) for segment in body.segments])


def state_of(body: Body, pressure: Array, fractions: Array, memories: Memories, guess: Array) -> Solved:
    """State of a body without loads between its segments; NaN where Newton's method finds none.

    Args:
        body: the body that is driven.
        pressure: gauge [Pa].
        fractions: martensite fractions of all springs, segment by segment, shape (springs,).
        memories: memories of the springs.
        guess: scaled unknowns of every segment, shape (segments, freedoms).
    """
    if body.chain is not None and body.chain.loaded:
        drives = by_segment(body, fractions)
        whole = pj.solve_chain(body.chain, pressure, drives, memories, throw=False)
        return Solved(body, pressure, whole.segments, whole.end_pose, whole)
    found = segments_of(body, pressure, fractions, memories, guess)
    if body.chain is None:
        return Solved(body, pressure, (found[0],), arc_frame(found[0].bend, found[0].length), None)
    bends, lengths = jnp.stack([x.bend for x in found]), jnp.stack([x.length for x in found])
    shape = chain_shape(body.chain, bends, lengths)
    return Solved(body, pressure, tuple(found), shape.end_pose, pj.ChainEquilibrium(tuple(found), shape))


def segments_of(
    body: Body, pressure: Array, fractions: Array, memories: Memories, guess: Array
) -> list[pj.Equilibrium]:
    """Every segment in equilibrium, without loads between them; arguments as those of `state_of`."""
    rows = list(zip(body.segments, by_segment(body, fractions), memories, guess, strict=True))
    return [_one(pressure, rows[0], body.effects, body.gravity)] if body.effects else _alike(rows, pressure)


def _one(
    pressure: Array, row: tuple, effects: tuple[Effect, ...] = (), gravity: Array | None = None
) -> pj.Equilibrium:
    segment, drive, memory, guess = row
    problem = problem_at_rest(segment, effects, pressure, drive, memory, gravity)
    ended = newton(problem, guess)
    root = jnp.where(ended.good, ended.unknowns, jnp.nan)
    return equilibrium_of(problem, attached(problem, root), ended.steps)


def _alike(rows: Sequence[tuple], pressure: Array) -> list[pj.Equilibrium]:
    """Segments, all in one batch where they are alike in structure."""
    rows = [jax.tree.map(jnp.asarray, row) for row in rows]
    kinds = {(jax.tree.structure(row), *(leaf.shape for leaf in jax.tree.leaves(row))) for row in rows}
    if len(rows) == 1 or len(kinds) > 1:
        return [_one(pressure, row) for row in rows]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *rows)
    found = jax.vmap(_one, (None, 0))(pressure, stacked)
    return [jax.tree.map(lambda leaf, k=k: leaf[k], found) for k in range(len(rows))]


def equal(a: pj.Actuator, b: pj.Actuator) -> bool:
    """True if two actuators are the same in structure and in all numbers."""
    return bool(eqx.tree_equal(a, b))


def made_once(segments: Sequence[pj.Actuator], make: Callable[[pj.Actuator], Any]) -> Iterator[Any]:
    """What is made of each segment, in order; equal segments share it, and it is made once."""
    known: list[tuple] = []
    for segment in segments:
        own = next((made for other, made in known if equal(other, segment)), None)
        if own is None:
            own = make(segment)
            known.append((segment, own))
        yield own


def unknowns_of(solved: Solved) -> Array:
    """Scaled unknowns of every segment, shape (segments, freedoms)."""
    return jnp.stack([segment.unknowns for segment in solved.segments])


def states_of(body: Body, pressure: Array, fractions: Array, memories: Memories) -> Solved:
    """Many states, each from rest; arrays of the result have a leading axis of rows.

    The segments of a chain without loads are solved one by one, by the program of a single actuator.

    Args:
        body: the body that is driven.
        pressure: gauge [Pa], shape (rows,).
        fractions: martensite fractions of all springs, segment by segment, shape (rows, springs).
        memories: memories of the springs.
    """
    pressure, fractions = np.asarray(pressure), np.asarray(fractions)
    if body.chain is None or body.chain.loaded:
        return Solved(body, pressure, *_in_lots(body, pressure, fractions, memories))
    found, at = [], 0
    for segment, own in zip(body.segments, memories, strict=True):
        of_it, at = fractions[:, at : at + len(own)], at + len(own)
        found += _in_lots(Body((segment,), None), pressure, of_it, (own,))[0]
    segments = tuple(found)
    bends, lengths = np.stack([x.bend for x in segments], 1), np.stack([x.length for x in segments], 1)
    (bends, lengths), size = padded((bends, lengths))
    shape = first_rows(_placed(body.chain, bends, lengths), size)
    return Solved(body, pressure, segments, shape.end_pose, pj.ChainEquilibrium(segments, shape))


def padded(tree: tuple) -> tuple[tuple, int]:
    """Arrays filled up to a power of two of rows with the last one, so that few programs serve all numbers of
    rows; their number."""
    size = jax.tree.leaves(tree)[0].shape[0]
    return filled(tree, max(FEW, 1 << max(size - 1, 0).bit_length())), size


_placed = eqx.filter_jit(chain_shape)


def _in_lots(body: Body, pressure: Array, fractions: Array, memories: Memories) -> tuple:
    """States in lots of `LOT` rows, so that one program serves all numbers of rows.

    Filling up a lot takes milliseconds, another program a quarter of a second to load and seconds to compile.
    """
    rows = np.asarray(pressure), np.asarray(fractions)
    return in_parallel(lambda row: _lot(body, *row, memories), rows, LOT, LOT)


def in_parallel(work: Callable, rows: tuple, few: int, many: int) -> tuple:
    """Results of all rows, in lots of one of two sizes, one thread for each core; the order is that of the
    rows.

    The first lot goes alone, so that its program is compiled once.
    """
    count = len(rows[0])
    cut = lots(rows, few if count <= few else many)
    done = lambda row: jax.tree.map(np.asarray, work(row))  # noqa: E731
    return joined([done(cut[0]), *run_parallel(done, cut[1:])], count)


@stored_jit(pj.Equilibrium, Validity, SpringResponse, ChainEquilibrium, ChainShape)
def _lot(body: Body, pressure: Array, fractions: Array, memories: Memories) -> tuple:
    def one(p: Array, x: Array) -> tuple:
        found = state_of(body, p, x, memories, first_guess(body))
        return found.segments, found.end_pose, found.chain

    if not fractions.shape[1]:  # without springs rows have arrays without numbers, which no batch can cut
        return jax.vmap(one)(pressure, fractions)
    return jax.lax.map(lambda row: one(*row), (pressure, fractions), batch_size=64)


def denser(count: int) -> np.ndarray:
    """Fractions of a grid, from 1 down to 0, closer together where a spring is cold [1]."""
    return 1.0 - np.linspace(0.0, 1.0, count) ** 1.5
