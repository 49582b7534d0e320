"""States all over what the drives can do, from which searches start."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np

from fitting.design.bodies import Body, Solved
from pneusma_jax.late import Late
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.serial_chain.segments import chain_shape

from .electrical import highest
from .forward import denser, fresh, made_once, padded, springs_of, states_of
from .goals import GOALS, sizes

stats, spatial = Late("scipy.stats"), Late("scipy.spatial")

WITHOUT_TREE = 8
"""Number of targets up to which all states are compared: a library of trees takes 0.1 s to load, and the
comparison of a target with 40,000 states 2 ms."""

PRESSURES = 9
ALONE, TOGETHER = 25, 12
"""Number of fractions of a spring that is heated alone, and of each of two that are heated together."""
MANY = 512
"""Number of random fractions where three or more springs are heated."""
AMONG = 6
"""Number of the nearest lean states of an actuator for each one that a search starts from. Of 200 curvatures
of PneuSMA2 the least heated four of 24 need 15 % less heat than the nearest four, those of 40 no less."""
COMBINATIONS = 40_000
"""Number of random combinations of segments' states of a chain: a target in space then has one about 5 mm
from it."""
LOADED = 2_000
"""The same of a loaded chain, every one of which has to be solved."""


@dataclass(frozen=True)
class Atlas:
    """States of a body without memory of heat.

    Attributes:
        drives: pressure [Pa] and fractions [1], shape (states, drives).
        highest: largest fraction of every spring [1], shape (springs,).
        unknowns: scaled unknowns of the segments, filled up with zeros where one has fewer freedoms, shape
            (states, segments, freedoms).
        solved: all states, arrays with a leading axis.
        trees, known: of `nearest`, kept by goals.
    """

    drives: np.ndarray
    highest: np.ndarray
    unknowns: np.ndarray
    solved: Solved
    trees: dict = field(default_factory=dict, repr=False, compare=False)
    known: dict = field(default_factory=dict, repr=False, compare=False)

    def values(self, goals: tuple[str, ...]) -> np.ndarray:
        """Values of goals in all states, SI, shape (states, columns)."""
        return goal_values(self.solved, goals)

    @cached_property
    def lean(self) -> np.ndarray:
        """True if at most one spring is heated in every segment, shape (states,)."""
        warm, at = self.drives[:, 1:] < self.highest, 0
        good = np.ones(len(warm), bool)
        for segment in self.solved.body.segments:
            count = len(segment.springs)
            good &= warm[:, at : at + count].sum(axis=1) <= 1
            at += count
        return good

    def nearest(
        self, goals: tuple[str, ...], wanted: np.ndarray, ranks: int | Sequence[int], lean: bool = False
    ) -> np.ndarray:
        """Indices of the states nearest to targets, shape (targets, ranks).

        Args:
            goals: names; wanted: values [SI], shape (targets, columns).
            ranks: how many, or which: 1 is the nearest.
            lean: of `lean` states alone.
        """
        good, places = self._places(goals, lean)
        ranks = range(1, ranks + 1) if isinstance(ranks, int) else ranks
        some = [k for k in ranks if k <= good.size]
        if not some:  # no state of a loaded chain is lean
            return np.zeros((len(wanted), 0), dtype=int)
        aims = wanted / np.asarray(sizes(goals))
        if len(aims) <= WITHOUT_TREE:
            away = np.linalg.norm(places[None] - aims[:, None], axis=2)
            return good[np.argsort(away, axis=1, kind="stable")[:, np.array(some, dtype=int) - 1]]
        if (goals, lean) not in self.trees:
            self.trees[goals, lean] = spatial.cKDTree(places)
        return good[self.trees[goals, lean].query(aims, k=some)[1]]

    def least_heated(self, goals: tuple[str, ...], wanted: np.ndarray, count: int) -> np.ndarray:
        """Indices of the lean states near to targets that are heated least, shape (targets, count).

        Args:
            goals, wanted: as those of `nearest`.
            count: how many; they are the least heated of `AMONG` times as many.
        """
        near = self.nearest(goals, wanted, AMONG * count, lean=True)
        heat = np.sum((self.highest - self.drives[:, 1:]) ** 2, axis=1)
        order = np.argsort(heat[near], axis=1, kind="stable")[:, :count]
        return np.take_along_axis(near, order, axis=1)

    def _places(self, goals: tuple[str, ...], lean: bool) -> tuple[np.ndarray, np.ndarray]:
        """Indices of the states that have all values, and these values in sizes of the goals; made once."""
        if (goals, lean) not in self.known:
            values = self.values(goals)
            good = np.flatnonzero(np.all(np.isfinite(values), axis=1) & (self.lean if lean else True))
            self.known[goals, lean] = good, values[good] / np.asarray(sizes(goals))
        return self.known[goals, lean]


def goal_values(solved: Solved, goals: tuple[str, ...]) -> np.ndarray:
    """Values of goals in many states, SI, shape (states, columns)."""
    parts, size = padded(solved.parts)
    return np.asarray(_values(Solved(solved.body, *parts), goals))[:size]


@stored_jit()
def _values(solved: Solved, goals: tuple[str, ...]) -> jax.Array:
    def one(part: tuple) -> jax.Array:
        pressure, segments, end_pose, chain = part
        state = Solved(solved.body, pressure, segments, end_pose, chain)
        return jnp.concatenate([GOALS[name].function(state) for name in goals])

    return jax.vmap(one)(solved.parts)


def fractions_grid(top: np.ndarray, xi0_min: float, seed: int) -> np.ndarray:
    """Fractions of the springs of one segment, shape (states, springs): each alone, every two, all.

    Args:
        top: largest fraction of each [1], shape (springs,).
        xi0_min: least fraction [1].
        seed: seed of random fractions of three springs and more.
    """
    springs, rows = top.size, [top[None]]
    axis = lambda k, count: top[k] - (top[k] - xi0_min) * (1.0 - denser(count))  # noqa: E731
    for k in range(springs):
        alone = np.tile(top, (ALONE, 1))
        alone[:, k] = axis(k, ALONE)
        rows.append(alone[1:])
    for i, j in itertools.combinations(range(springs), 2):
        both = np.tile(top, (TOGETHER**2, 1))
        pair = np.meshgrid(axis(i, TOGETHER), axis(j, TOGETHER), indexing="ij")
        both[:, i], both[:, j] = (x.ravel() for x in pair)
        rows.append(both)
    if springs > 2:
        even = stats.qmc.Sobol(springs, seed=np.random.default_rng(seed)).random(MANY)
        rows.append(top - (top - xi0_min) * even)
    return np.concatenate(rows)


Span = tuple[float, float | None]
"""Least and largest fraction [1]; None for that of a spring without a current."""


def atlas_of(body: Body, pressure: tuple[float, float], span: Span, seed: int) -> Atlas:
    """States of a body: a grid for an actuator, random combinations for a chain."""
    levels = np.linspace(*pressure, PRESSURES)
    if body.chain is None:
        return _single(body, levels, span, seed)
    if body.chain.loaded:
        return _loaded(body, pressure, span, seed)
    return _chain(body, levels, span, seed)


def _grid(body: Body, levels: np.ndarray, span: Span, seed: int) -> tuple[np.ndarray, Solved]:
    fractions = fractions_grid(highest(body, span[1]), span[0], seed)
    loads = np.repeat(levels, len(fractions))
    rows = np.tile(fractions, (len(levels), 1))
    found = states_of(body, loads, rows, fresh(body))
    return np.column_stack([loads, rows]), found


def _single(body: Body, levels: np.ndarray, span: Span, seed: int) -> Atlas:
    drives, found = _grid(body, levels, span, seed)
    return Atlas(drives, highest(body, span[1]), np.asarray(found.only.unknowns)[:, None], found)


def _chain(body: Body, levels: np.ndarray, span: Span, seed: int) -> Atlas:
    """Random combinations of states of the segments, each solved alone; equal segments are solved once."""
    random = np.random.default_rng(seed)
    at = random.integers(len(levels), size=COMBINATIONS)
    drives, picked = [levels[at]], []
    alone = lambda segment: _grid(Body((segment,), None), levels, span, seed)  # noqa: E731
    for own, found in made_once(body.segments, alone):
        each = len(own) // len(levels)
        index = at * each + random.integers(each, size=COMBINATIONS)
        picked.append(jax.tree.map(lambda x, i=index: x[i], found.only))
        drives += list(own[index, 1:].T)
    bends = jnp.stack([x.bend for x in picked], axis=1)
    lengths = jnp.stack([x.length for x in picked], axis=1)
    shape = jax.jit(chain_shape)(body.chain, bends, lengths)
    most = max(segment.freedoms for segment in body.segments)
    filled = [np.pad(x.unknowns, ((0, 0), (0, most - x.unknowns.shape[1]))) for x in picked]
    unknowns = np.stack(filled, axis=1)
    solved = Solved(body, jnp.asarray(drives[0]), tuple(picked), shape.end_pose, None)
    return Atlas(np.column_stack(drives), highest(body, span[1]), unknowns, solved)


def _loaded(body: Body, pressure: tuple[float, float], span: Span, seed: int) -> Atlas:
    count, top = len(springs_of(body)), highest(body, span[1])
    even = stats.qmc.Sobol(count + 1, seed=np.random.default_rng(seed)).random(LOADED)
    loads = pressure[0] + even[:, 0] * (pressure[1] - pressure[0])
    fractions = top - (top - span[0]) * even[:, 1:] ** 2
    found = states_of(body, loads, fractions, fresh(body))
    unknowns = np.stack([np.asarray(x.unknowns) for x in found.segments], axis=1)
    return Atlas(np.column_stack([loads, fractions]), top, unknowns, found)
