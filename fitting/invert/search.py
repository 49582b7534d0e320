"""Many inverse problems at once: damped Gauss-Newton steps in a box, in one compiled program.

A problem may have more drives than goals. Then the least heating is wanted: a small weight draws all springs
towards cold, and fades when the steps are short. A drive at an end of its range stays there while the miss
would make it go further.

The bounded trust-region step of `inference.least_squares` was tried in its place, on 64 curvatures of
PneuSMA2 from the nearest states of an atlas. It took 71 steps a target instead of 4, and 7 times the
processor time. Its rule for the end counts in standard errors, which say nothing where a miss vanishes. Ended
after 8 steps of each weight, it took 1.7 times the time and missed by up to 0.07 of a goal's size, instead of
2e-6.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.design.bodies import Body
from pneusma_jax.program_cache import stored_jit

from .derivatives import values_of_tables, values_with_slope
from .forward import Memories
from .goals import sizes
from .tables import Table

MOST_STEPS = 40
"""Maximum of steps from a start; 4 to 12 are taken where the target can be reached."""
SEARCHING = 15
"""Maximum of steps with the weight of heating; after them only the miss is closed."""
CLOSE = 1e-5
"""Miss at which a search ends, in sizes of the goals [1]."""
STILL = 1e-7
"""Step in the box at which a search ends [1]."""
BLOCK = 64
"""Number of searches side by side; a block waits for its slowest."""
WEIGHT, LAST_WEIGHT = 1e-3, 1e-9
"""Weight of heating while the way is looked for, and when only the miss is left to close [1]. With the
first, a curvature is missed by about 1e-5 1/m, and the heating is the least to a few thousandths."""
NEAR = 3e-3
"""Step in the box from which on only the miss is closed [1]."""
LONGEST = 0.3
"""Longest step of a drive in the box [1]: beyond it the linear model says little."""
FLAT = 1e-3
"""Least share of the steepest drive's squared slope that damps any drive [1]. A drive at a goal's maximum has
no slope. Without this floor it is undamped, takes the longest step, and the search stalls."""
FIRST_DAMPING, LAST_FIRST_DAMPING, LEAST_DAMPING = 1e-3, 1e-6, 1e-12
"""Damping at the start, at that of the last stage, and the smallest [1], as parts of squared slopes."""
MORE, LESS = 10.0, 0.1
"""Factors of the damping after a step that does not help, and after one that does."""
STUCK, LOST = 1e3, 1e6
"""Damping beyond which a stage ends, and the search [1]; steps are then a thousandth of undamped ones."""
FLOOR = 1e-8
"""Minimum damping of a drive [1]; goals are in units of their sizes, so that this is far below any slope."""
COLD_PRESSURE = 0.1
"""Weight of pressure beside that of a spring's heat [1]: pressure costs little, heat is slow."""


class Box(eqx.Module):
    """Ranges of the drives: the pressure, then all springs.

    Attributes:
        low, high: [Pa, 1], shape (drives,). Equal ends hold a drive.
        rest: drives that cost nothing: no pressure, cold springs, shape (drives,).
    """

    low: Array
    high: Array
    rest: Array

    def drives(self, place: Array) -> Array:
        """Drives at a place in the box [1]."""
        return self.low + place * (self.high - self.low)

    def place(self, drives: Array) -> Array:
        """Place in the box of drives, of any leading shape; the middle where an end equals the other."""
        wide = self.high > self.low
        return jnp.where(wide, (drives - self.low) / jnp.where(wide, self.high - self.low, 1.0), 0.5)

    def places(self, drives: np.ndarray) -> np.ndarray:
        """`place` of many drives at once, without JAX, shape (rows, drives)."""
        low, high = np.asarray(self.low), np.asarray(self.high)
        wide = high > low
        return np.where(wide, (drives - low) / np.where(wide, high - low, 1.0), 0.5)


class Found(eqx.Module):
    """Result of a search.

    Attributes:
        place: place in the box [1], shape (drives,).
        miss: distance from the goals, in sizes of the goals [1].
        values: values of the goals [SI], shape (columns,).
        effort: square of the distance from rest [1].
        slope: derivative of half the squared miss by the place [1], shape (drives,).
        unknowns: unknowns of the state, to start a neighbouring one, shape (segments, freedoms).
        steps: number of steps taken.
    """

    place: Array
    miss: Array
    values: Array
    effort: Array
    slope: Array
    unknowns: Array
    steps: Array


def replaced(found: Found, where: np.ndarray, new: Found) -> Found:
    """Results of many searches with those at some indices replaced.

    Args:
        found: results with a leading axis of searches.
        where: indices of the searches.
        new: their results, with a leading axis of that length.
    """

    def put(old: np.ndarray, part: np.ndarray) -> np.ndarray:
        old = np.array(old)
        old[where] = part
        return old

    return jax.tree.map(put, found, new)


Look = Callable[[Array, Array], tuple[Array, Array, Array]]
"""Values of the goals [SI], their derivative by the place, and unknowns of the state, from a place in the box
and the unknowns of a state nearby."""


class _Seen(NamedTuple):
    """What is known of a place: the miss in sizes of the goals and its slope [1], values [SI], unknowns."""

    miss: Array
    slope: Array
    values: Array
    unknowns: Array


class _Stage(NamedTuple):
    """Stage of a search: place in the box, what is known of it, damping and weight of heating [1], steps."""

    place: Array
    seen: _Seen
    damping: Array
    weight: Array
    steps: Array
    done: Array


@dataclass(frozen=True)
class Task:
    """One inverse problem.

    Attributes:
        look: model of the body that is driven.
        goals: static; names.
        box: ranges of the drives.
        wanted: values of the goals in SI, shape (columns,).
        most: maximum of steps.
    """

    look: Look
    goals: tuple[str, ...]
    box: Box
    wanted: Array
    most: Array | int = MOST_STEPS

    @property
    def wide(self) -> Array:
        """Drives that are not held."""
        return self.box.high > self.box.low

    @property
    def rest(self) -> Array:
        """Place in the box that costs nothing."""
        return jnp.clip(self.box.place(self.box.rest), 0.0, 1.0)

    @property
    def cost(self) -> Array:
        """Weight of every drive in the effort [1]."""
        return jnp.concatenate([jnp.full(1, COLD_PRESSURE), jnp.ones(self.box.low.size - 1)])

    def seen(self, place: Array, guess: Array) -> _Seen:
        """What is known of a place."""
        scale = sizes(self.goals)
        values, slope, unknowns = self.look(place, guess)
        return _Seen((values - self.wanted) / scale, slope / scale[:, None], values, unknowns)

    def effort(self, place: Array) -> Array:
        """Square of the distance from rest [1]."""
        return jnp.sum(self.cost * (place - self.rest) ** 2)

    def total(self, miss: Array, place: Array, weight: Array) -> Array:
        """Half the squared miss, and half the effort with its weight."""
        return 0.5 * miss @ miss + 0.5 * weight * self.effort(place)


def _trial(task: Task, at: _Stage) -> Array:
    """Place after a damped Gauss-Newton step of the drives that no end of their range holds."""
    place, seen, weight = at.place, at.seen, at.weight
    gradient = seen.slope.T @ seen.miss + weight * task.cost * (place - task.rest)
    held = ~task.wide | ((place <= 0.0) & (gradient > 0.0)) | ((place >= 1.0) & (gradient < 0.0))
    free = jnp.where(held, 0.0, 1.0)
    steep = jnp.sum(seen.slope**2, axis=0)
    damped = at.damping * jnp.maximum(steep, jnp.maximum(FLAT * jnp.max(steep), FLOOR))
    matrix = seen.slope.T @ seen.slope + jnp.diag(weight * task.cost + damped)
    matrix = matrix * free[:, None] * free[None, :] + jnp.diag(1.0 - free)
    step = -jnp.linalg.solve(matrix, free * gradient)
    return jnp.clip(place + jnp.clip(step, -LONGEST, LONGEST), 0.0, 1.0)


def _advance(task: Task, at: _Stage) -> _Stage:
    """One step: taken where it helps; where it does not, the damping grows."""
    trial = _trial(task, at)
    after = task.seen(trial, at.seen.unknowns)
    better = task.total(after.miss, trial, at.weight) < task.total(at.seen.miss, at.place, at.weight)
    better = better & jnp.all(jnp.isfinite(after.miss)) & jnp.all(jnp.isfinite(after.slope))
    place, seen = jax.tree.map(lambda new, old: jnp.where(better, new, old), (trial, after), at[:2])
    moved, faint = jnp.max(jnp.abs(trial - at.place)), at.weight <= LAST_WEIGHT
    near = (better & (moved < NEAR)) | (at.damping > STUCK) | (at.steps > SEARCHING)
    # where no step helps any more, however short, the search has come to its end
    still = jnp.where(better, moved < STILL, at.damping > LOST) & faint
    grown = MORE * jnp.maximum(at.damping, LAST_FIRST_DAMPING)
    damping = jnp.where(better, jnp.maximum(LESS * at.damping, LEAST_DAMPING), grown)
    damping = jnp.where(near & ~faint, LAST_FIRST_DAMPING, damping)
    small = (jnp.linalg.norm(seen.miss) < CLOSE) & faint
    done = small | still | (at.steps + 1 >= task.most)
    return _Stage(place, seen, damping, jnp.where(near, LAST_WEIGHT, at.weight), at.steps + 1, done)


def search(task: Task, begin: Array, guess: Array, weight: Array | float = WEIGHT) -> Found:
    """One inverse problem from one start.

    Args:
        task: the problem.
        begin: place in the box, shape (drives,).
        guess: unknowns of a state near the start.
        weight: of heating while the way is looked for [1].
    """
    begin = jnp.where(task.wide, jnp.clip(begin, 0.0, 1.0), 0.5)
    seen = task.seen(begin, guess)
    bad = ~jnp.all(jnp.isfinite(seen.miss))
    first = _Stage(begin, seen, jnp.asarray(FIRST_DAMPING), jnp.asarray(weight), jnp.asarray(0), bad)
    last = jax.lax.while_loop(lambda at: ~at.done, lambda at: _advance(task, at), first)
    size = jnp.where(bad, jnp.inf, jnp.linalg.norm(last.seen.miss))
    slope = last.seen.slope.T @ last.seen.miss
    return Found(
        last.place, size, last.seen.values, task.effort(last.place), slope, last.seen.unknowns, last.steps
    )


@stored_jit(Found)
def search_all(
    body: Body,
    goals: tuple[str, ...],
    boxes: Box,
    wanted: Array,
    start: tuple[Array, Array],
    memories: Memories,
    most: Array,
) -> Found:
    """Many searches; all arrays but the memories and the number of steps have a leading axis of searches.

    A start is a place in the box and the unknowns of a state near it.
    """

    def one(row: tuple) -> Found:
        box, wanted, begin, guess = row
        return search(Task(exact_look(body, goals, box, memories), goals, box, wanted, most), begin, guess)

    return jax.lax.map(one, (boxes, wanted, *start), batch_size=BLOCK)


def exact_look(body: Body, goals: tuple[str, ...], box: Box, memories: Memories) -> Look:
    """The exact model of a body for `search`."""
    return lambda place, guess: values_with_slope(body, goals, box.drives, place, memories, guess)


@stored_jit(Found)
def search_tables(
    body: Body,
    tables: tuple[Table, ...],
    goals: tuple[str, ...],
    box: Box,
    wanted: Array,
    begin: Array,
    weight: Array,
    most: Array,
) -> Found:
    """Many searches of a chain without loads in the tables of its segments.

    Args:
        body: the chain.
        tables: table of each segment.
        goals: static; names.
        box: ranges of the drives.
        wanted: values of the goals [SI], shape (searches, columns).
        begin: places in the box, shape (searches, drives).
        weight: of heating while the way is looked for [1].
        most: maximum of steps.
    """

    def one(row: tuple) -> Found:
        wanted, begin = row
        look = lambda place, _: values_of_tables(body, tables, goals, box.drives, place)  # noqa: E731
        guess = jnp.zeros((len(tables), 1))  # a table needs no start
        return search(Task(look, goals, box, wanted, most), begin, guess, weight)

    return jax.lax.map(one, (wanted, begin), batch_size=BLOCK)
