"""Targets over time: each row starts from what the springs remember of the rows before.

A heated spring loses residual strain for good (Section 3.4.1), so a later target may be out of reach that a
new spring would meet. Only stretching the spring again beyond its pre-strain brings that back. The way is
found row by row with the exact memory, least heating first; then the whole history is computed by
`simulate_history`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.design.bodies import Body, Solved
from fitting.inference.results import Result
from pneusma_jax.errors import InputError
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.serial_chain.kinematics import arc_frame

from .atlas import goal_values
from .electrical import electrical, unheated
from .forward import Memories, fresh, state_of
from .goals import GOALS, misses
from .result import Inversion
from .run import Inverse
from .search import Box, Task, exact_look, search

STARTS = 2
"""Number of states of the atlas from which a row is tried, beside the row before and those that are lean."""


@dataclass(frozen=True)
class Trajectory(Result):
    """Drives over time.

    Attributes:
        inversion: inversion of every row, with memory; its values are those of `simulate_history`.
        time: [s], shape (rows,).
        remembered: least martensite fraction so far of every spring [1], shape (rows, springs).
        without_memory: true where springs that are new to heat could meet the row, shape (rows,).
        disagreement: largest difference between the search's values and those of the exact history, in sizes
            of the goals [1].
    """

    inversion: Inversion
    time: np.ndarray
    remembered: np.ndarray
    without_memory: np.ndarray
    disagreement: float

    @property
    def lost(self) -> np.ndarray:
        """Rows that only memory puts out of reach, shape (rows,)."""
        return ~self.inversion.met & self.without_memory

    def warnings(self) -> list[str]:
        """Warnings about steps that cannot be undone."""
        words, rows = [], np.flatnonzero(self.lost)
        if not rows.size or not rows[0]:  # the first row has nothing to remember
            return words
        first = rows[0]
        targets = "1 target needs" if rows.size == 1 else f"{rows.size} targets need"
        name = min(self.inversion.misses, key=lambda n: -self.inversion.misses[n][first])
        for k in range(len(self.inversion.springs)):
            known = self.remembered[:first, k]  # what the row itself heats is no loss that it begins with
            least = known[-1]
            if least < self.inversion.left_alone[k] - 1e-3:
                since = np.flatnonzero(known > least + 1e-9)  # stretched again, or heated less, until then
                when = self.time[since[-1] + 1 if since.size else 0]
                words.append(
                    f"from {self.time[first]:g} s on, {targets} what spring "
                    f"{self.inversion.spring_name(k)} lost when it was heated to a fraction of "
                    f"{least:.3g} at {when:g} s. So {name} is missed. Only stretching the spring again "
                    "brings it back"
                )
        return words


@stored_jit()
def _followed(
    body: Body,
    goals: tuple[str, ...],
    box: Box,
    wanted: Array,
    begin: Array,
    guess: Array,
    memories: Memories,
) -> tuple[Array, Array, Array]:
    """Drives, values and least fractions of all rows; `begin` has shape (rows, starts, drives)."""

    def step(carry: tuple, row: tuple) -> tuple:
        memories, place, unknowns = carry
        wanted, begin, guess = row
        starts = jnp.concatenate([place[None], begin])
        guesses = jnp.concatenate([unknowns[None], guess])
        look = exact_look(body, goals, box, memories)
        found = jax.vmap(lambda x, g: search(Task(look, goals, box, wanted), x, g))(starts, guesses)
        miss = jnp.where(found.miss < 1e-3, 0.0, found.miss)
        which = jnp.lexsort((found.effort, miss))[0]
        found = jax.tree.map(lambda x: x[which], found)
        drives = box.drives(found.place)
        solved = state_of(body, drives[0], drives[1:], memories, found.unknowns)
        after = _remembered(body, memories, solved)
        least = jnp.stack([s.xi_min for own in after for s in own])
        return (after, found.place, found.unknowns), (drives, found.values, found.slope, found.place, least)

    first = (memories, begin[0, 0], guess[0, 0])
    return jax.lax.scan(step, first, (wanted, begin, guess))[1]


def _remembered(body: Body, memories: Memories, solved: Solved) -> Memories:
    return tuple(
        tuple(
            spring.remember(state, response)
            for spring, state, response in zip(segment.springs, own, found.springs, strict=True)
        )
        for segment, own, found in zip(body.segments, memories, solved.segments, strict=True)
    )


def follow(inverse: Inverse, goals: Sequence[str], wanted: np.ndarray, time: np.ndarray) -> Trajectory:
    """Drives for targets over time.

    Args:
        inverse: inverse of a body with springs.
        goals: names of `GOALS`.
        wanted: values in SI, shape (rows, columns).
        time: [s], ascending, shape (rows,).

    Raises:
        InputError: for a body without springs, whose rows are independent anyway.
    """
    goals, wanted = tuple(goals), np.asarray(wanted, dtype=float)
    inverse.check(goals)
    if not inverse.springs:
        raise InputError("without springs nothing is remembered; leave out the column time_s")
    if len({segment.freedoms for segment in inverse.body.segments}) > 1:
        raise InputError("targets over time need a chain whose segments all bend in a plane, or none of them")
    atlas, box = inverse.atlas, inverse.box()
    lean = inverse.lean_starts(goals, wanted)
    near = np.concatenate([lean, atlas.nearest(goals, wanted, STARTS)], axis=1)
    begin = box.place(jnp.asarray(atlas.drives[near]))
    rows = _followed(
        inverse.body,
        goals,
        box,
        jnp.asarray(wanted),
        begin,
        jnp.asarray(atlas.unknowns[near]),
        fresh(inverse.body),
    )
    drives, values, slopes, places, least = (np.asarray(x) for x in rows)
    solved = _history(inverse.body, drives, time)
    exact = goal_values(solved, goals)
    sizes = np.array([GOALS[n].size for n in goals for _ in GOALS[n].columns])
    off = float(np.nanmax(np.abs(exact - values) / sizes))
    missed = {n: np.asarray(m) for n, m in misses(goals, jnp.asarray(exact), jnp.asarray(wanted)).items()}
    met = np.all([m <= GOALS[name].tolerance for name, m in missed.items()], axis=0)
    alone = inverse.solve(goals, wanted)
    stand_in = _Places(places, slopes)
    held = tuple("" if ok else inverse._held(stand_in, k) for k, ok in enumerate(met))
    resistances, currents = electrical(solved)
    found = Inversion(
        inverse.design, goals, wanted, inverse.springs, drives[:, 0], drives[:, 1:], resistances, currents,
        exact, missed, met, held, tuple(np.zeros((0, drives.shape[1])) for _ in met), unheated(inverse.body),
        inverse.highest, tuple(np.zeros(0) for _ in met), inverse.reach(goals),
    )  # fmt: skip
    return Trajectory(found, np.asarray(time, dtype=float), least, alone.met, off)


@dataclass(frozen=True)
class _Places:
    """Ends of searches, in the form that `Inverse._held` reads."""

    place: np.ndarray
    slope: np.ndarray


def _history(body: Body, drives: np.ndarray, time: np.ndarray) -> Solved:
    """The exact history of drives."""
    pressure, at, segments, activations = jnp.asarray(drives[:, 0]), 1, body.segments, []
    for segment in segments:
        count = len(segment.springs)
        activations.append(tuple(pj.MartensiteFraction(drives[:, at + i]) for i in range(count)))
        at += count
    if body.chain is None:
        rows = pj.simulate_history(segments[0], pressure, activations[0], time=time).rows
        frames = jax.vmap(arc_frame)(rows.bend, rows.length)
        return Solved(body, pressure, (rows,), frames, None)
    found = pj.simulate_chain_history(body.chain, pressure, activations, time=time)
    rows = tuple(h.rows for h in found.segments)
    return Solved(body, pressure, rows, found.shape.end_pose, None)
