"""Linear problems of latent trajectories, solved exactly: rows are eliminated one by one, the latest first.

A row of a recording depends on the row before and on the one that each trajectory remembers. So an eliminated
row leaves couplings of two rows only, and two passes over the rows solve the whole problem. It is compiled
once for a number of trajectories, channels and rows.
"""

from collections.abc import Callable
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from pneusma_jax.program_cache import cached_program

from ..settings import DEFAULT

TRAJECTORIES = DEFAULT.trajectories


@cache
def best_steps() -> Callable:
    """Compiled `_best`."""
    return cached_program(_best, f"best trajectories: {TRAJECTORIES}")


@cache
def projected_columns() -> Callable:
    """Compiled `_projected`."""
    return cached_program(_projected, f"directions off trajectories: {TRAJECTORIES}")


def _best(
    problem: tuple, fraction: Float[Array, "t n"], pull: Float[Array, "t n"], misfit: Float[Array, "c n"]
) -> dict[str, Array]:
    """Steps of all trajectories, the mask of the rows that are at no end after it, and the misfit with it.

    Args:
        problem: see `_System`.
        fraction: trajectories at which the model was evaluated.
        pull: derivative of half the square of their increments.
        misfit: misfit of the model there, whitened.
    """
    system = _System(*problem)

    def attempt(carry: tuple) -> tuple:
        count, _, free, step = carry
        fixed = jnp.where(free, 0.0, step)
        walk = pull + system.walked(fixed)
        moved = misfit + system.changed(fixed)
        found = system.solved(free, moved[..., None], walk[..., None])[..., 0]
        step = jnp.where(free, found, step)
        beyond = free & ((fraction + step < 0.0) | (fraction + step > 1.0))
        step = jnp.where(beyond, jnp.clip(fraction + step, 0.0, 1.0) - fraction, step)
        return count + 1, jnp.any(beyond), free & ~beyond, step

    begun = jnp.asarray(0), jnp.asarray(True), system.there, jnp.zeros_like(fraction)
    goes_on = lambda carry: carry[1] & (carry[0] < TRAJECTORIES.rounds)  # noqa: E731
    _, _, free, step = jax.lax.while_loop(goes_on, attempt, begun)
    most = TRAJECTORIES.maximum_step
    step = jnp.clip(jnp.clip(fraction + step, 0.0, 1.0) - fraction, -most, most)
    return {"step": step, "free": free, "misfit": misfit + system.changed(step)}


def _projected(
    problem: tuple, free: Bool[Array, "t n"], jacobian: Float[Array, "k c n"]
) -> dict[str, Array]:
    """Directions of the misfit projected off the free rows, and the derivatives of the trajectories.

    Args:
        problem: see `_System`.
        free: mask of the rows that are not held.
        jacobian: the directions.
    """
    system = _System(*problem)
    columns = jnp.moveaxis(jacobian, 0, -1)
    slopes = system.solved(free, columns, jnp.zeros((*free.shape, columns.shape[-1])))
    slopes = jnp.moveaxis(slopes, -1, 0)
    return {"slopes": slopes, "jacobian": jacobian + jax.vmap(system.changed)(slopes)}


class _System:
    """Second derivative of half the square of misfit and increments, row by row.

    Args:
        own, remembered: derivatives of the channels by the fraction of their row, and by that of the row it
            remembers, (trajectories, channels, rows).
        source: row that each row remembers, (trajectories, rows).
        precision: precision of every increment, (trajectories, rows).
        there: mask of the rows of the recording, (trajectories, rows).
        here, before: factors that whiten a channel's errors, on its row and on the one before, (channels,
            rows).
    """

    def __init__(
        self,
        own: Array,
        remembered: Array,
        source: Array,
        precision: Array,
        there: Array,
        here: Array,
        before: Array,
    ):
        self.source, self.there, (self.count, rows) = source, there, source.shape
        self.renews = (source == jnp.arange(rows)).astype(own.dtype)
        parts = here * own, here * remembered, -before * _earlier(own), -before * _earlier(remembered)
        self._parts = parts
        most = TRAJECTORIES.maximum_stiffness * jnp.maximum(self._information(), TRAJECTORIES.hold_weight)
        self._walk = jnp.minimum(precision, most)
        self._design = jnp.concatenate(parts)  # (4 trajectories, channels, rows)

    def _information(self) -> Array:
        """Largest information about a fraction."""

        def of_one(source: Array, *parts: Array) -> Array:
            rows = len(source)
            places = jnp.arange(rows), source
            places += tuple(jnp.concatenate([place[:1], place[:-1]]) for place in places)
            found = jnp.zeros(rows)
            for place, part in zip(places, parts, strict=True):
                found = found.at[place].add(jnp.sum(part**2, axis=0))
            return jnp.max(found)

        return jnp.max(jax.vmap(of_one)(self.source, *self._parts))

    def changed(self, steps: Array) -> Array:
        """Change of the misfit (channels, rows) with steps of the trajectories, (trajectories, rows)."""
        remembered = jnp.take_along_axis(steps, self.source, axis=1)
        moves = jnp.concatenate([steps, remembered, _earlier(steps), _earlier(remembered)])
        return jnp.sum(self._design * moves[:, None], axis=0)

    def walked(self, steps: Array) -> Array:
        """Derivative of half the square of the increments of steps, (trajectories, rows)."""
        rise = self._walk * (steps - _earlier(steps))
        return rise - jnp.concatenate([rise[:, 1:], jnp.zeros_like(rise[:, :1])], axis=1)

    def solved(self, free: Array, misfit: Array, walk: Array) -> Array:
        """Steps of the free rows that make the squares least; the others stay.

        Args:
            free: mask, (trajectories, rows).
            misfit: right-hand sides as misfit, (channels, rows, columns).
            walk: their derivatives by the fractions otherwise, (trajectories, rows, columns).

        Returns:
            Shape (trajectories, rows, columns).
        """
        count = self.count
        square = jnp.einsum("acn,bcn->nab", self._design, self._design)
        linear = jnp.einsum("acn,cnk->nak", self._design, misfit)
        linear = linear.at[:, :count].add(jnp.moveaxis(walk, 0, 1))
        own = np.arange(count)
        before = own + 2 * count
        walk = self._walk.T
        square = square.at[:, own, own].add(walk + TRAJECTORIES.hold_weight)
        square = square.at[:, before, before].add(walk)
        square = square.at[:, own, before].add(-walk).at[:, before, own].add(-walk)
        rows = square, linear, self.renews.T, free.T.astype(square.dtype)
        later = 0.0 * square[0, : 2 * count, : 2 * count], 0.0 * linear[0, : 2 * count]
        _, (gains, shifts) = jax.lax.scan(partial(_eliminated, count), later, rows, reverse=True)

        def forth(earlier: tuple, row: tuple) -> tuple:
            gain, shift, renews = row
            others, found = jnp.concatenate(earlier), []
            for j in reversed(range(count)):
                known = jnp.stack([*found[::-1]]) if found else jnp.zeros((0, others.shape[1]))
                known = jnp.concatenate([known, others])
                found.append(-shift[j] - jnp.sum(gain[j, j + 1 :, None] * known, axis=0))
            step = jnp.stack(found[::-1])
            return (step, jnp.where(renews[:, None] > 0.0, step, earlier[1])), step

        nothing = 0.0 * shifts[0]
        _, steps = jax.lax.scan(forth, (nothing, nothing), (gains, shifts, self.renews.T))
        return jnp.moveaxis(steps, 1, 0)


def _eliminated(count: int, later: tuple, row: tuple) -> tuple:
    """Couplings of the row before and of what it remembers, once a row is eliminated.

    Args:
        count: number of trajectories.
        later: couplings of the row and of what it remembers that later rows leave: square and linear part.
        row: those of the row itself and of the two before it, whether it is remembered from then on, and
            whether it is free.
    """
    square, linear, renews, free = row
    two = 2 * count
    square = square.at[:two, :two].add(later[0])
    linear = linear.at[:two].add(later[1])
    keeps = (1.0 - renews)[:, None]
    renews = renews[:, None]
    x, m, b, k = (slice(j * count, (j + 1) * count) for j in range(4))

    def replaced(rows: Array) -> Array:
        """What is remembered in terms of the row itself and of what the row before remembers."""
        return jnp.concatenate([rows[x] + renews * rows[m], rows[b], rows[k] + keeps * rows[m]])

    square, linear = replaced(replaced(square).T), replaced(linear)
    gains, shifts = [], []
    for j in range(count):
        coupled = square[j] * free[j]
        pivot = jnp.where(free[j] > 0.0, square[j, j], 1.0)
        gain, shift = coupled / pivot, linear[j] * free[j] / pivot
        square = square - gain[:, None] * coupled
        linear = linear - gain[:, None] * (linear[j] * free[j])
        gains.append(gain)
        shifts.append(shift)
    return (square[count:, count:], linear[count:]), (jnp.stack(gains), jnp.stack(shifts))


def _earlier(each: Array) -> Array:
    """Every row's entry of the row before, along the last axis; the first has its own."""
    return jnp.concatenate([each[..., :1], each[..., :-1]], axis=-1)
