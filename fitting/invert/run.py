"""Inverse problems of one body: targets to drives, many at once."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import numpy as np

from fitting.design.bodies import Body, Solved, build_body, plan_of, without_effect
from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel
from pneusma_jax.errors import InputError
from pneusma_jax.implausible import warn_of_pressure
from pneusma_jax.numerics.rows import joined, lots
from pneusma_jax.numerics.safe import as_array, as_numpy
from pneusma_jax.units import from_si

from .atlas import Atlas, Span, atlas_of, goal_values
from .by_tables import ByTables, tables_of
from .electrical import electrical, heat, highest, unheated
from .forward import fresh, springs_of, states_of
from .goals import GOALS, misses
from .result import Inversion, spring_name
from .search import MOST_STEPS, Box, Found, replaced, search_all
from .touching import AT_END

FIRST_TRY = 25
"""Maximum of steps in the first try: side by side, all wait for the slowest. Of a chain's searches that met
their target, three quarters had done so after 19 steps (1,500 of 2,048 searches)."""
LEAN = 4
"""Number of states with at most one heated spring from which an actuator is searched, for little heat. See
`atlas.AMONG` for which."""
MORE_STARTS = (3, 12)
"""Number of the nearest states that a target is tried from which no start has met so far, all in all."""
SPREAD = (1, 2, 3, 5, 8, 13, 22, 36, 60, 100, 170, 280, 460, 770, 1300, 2100, 3500, 6000)
"""Ranks of the states, by distance, from which a chain is tried where the nearest ones did not help; each is
about 1.7 times the one before. Neighbours end in the same place, and another place may be nearer."""
FEW, LOT = 16, 256
"""Number of searches that go through the program together: few or many, so that two programs serve all."""
SAME_HEAT = 0.01
"""Share of heating power by which another way must need less to become the answer [1]."""
APART = 0.02
"""Least difference of two ways to the same target, as part of a drive's range [1]."""


@dataclass(frozen=True)
class Limits:
    """Ranges of the drives.

    Attributes:
        pressure: gauge [Pa], lowest and highest; equal ends hold it.
        xi0_min: martensite fraction of the hottest spring [1].
        xi0_max: that of the coldest [1]; None for the one of a spring without a current in air of 22 degC.
    """

    pressure: tuple[float, float] = (0.0, 50e3)
    xi0_min: float = 0.1
    xi0_max: float | None = None

    def __post_init__(self) -> None:
        """Warn of ends that are rather in kPa."""
        warn_of_pressure(self.pressure)

    @property
    def span(self) -> Span:
        """Least and largest fraction."""
        return self.xi0_min, self.xi0_max


class Inverse:
    """The inverse of one design.

    Args:
        design, alloy, material: names or paths of tables; the design's own where None.
        limits: limits of the drives.
        seed: seed of random combinations.
        model: constants in place of the tables', and effects beyond the base model; these act as at the start
            of a recording.

    Raises:
        InputError: for a design that cannot be used, or without springs under a held pressure, or fractions
            that no spring has; for a model with an unnamed correction, or with effects for a chain.
    """

    def __init__(
        self,
        design: str,
        limits: Limits = Limits(),
        alloy: str | None = None,
        material: str | None = None,
        seed: int = 0,
        model: AugmentedModel = BASE,
    ):
        plan = plan_of(design, alloy, material, model)
        if why := without_effect(plan):
            raise InputError(why)
        self.design = plan.tables[0].name if plan.chain is None else plan.chain.name
        self.body: Body = build_body(plan, {}, plan.materials())
        self.limits, self.seed, self.springs = limits, seed, springs_of(self.body)
        if not self.springs and limits.pressure[0] == limits.pressure[1]:
            raise InputError(f"{design}: without springs and with a held pressure there is nothing to drive")
        self.highest = highest(self.body, limits.xi0_max)
        if np.any(self.highest <= limits.xi0_min):
            raise InputError(
                f"{design}: the fraction of the hottest spring, {limits.xi0_min:g}, is not below that of the "
                f"coldest, {self.highest.min():.4g}"
                + (", which has no current in air of 22 degC" if limits.xi0_max is None else "")
            )
        self.names = tuple(spring_name(self.springs, k) for k in range(len(self.springs)))

    @cached_property
    def atlas(self) -> Atlas:
        """States to start from.

        Raises:
            InputError: if none of them has an equilibrium.
        """
        found = atlas_of(self.body, self.limits.pressure, self.limits.span, self.seed)
        if not np.any(np.isfinite(np.asarray(found.solved.end_pose)[:, 2, 3])):
            low, high = (from_si(end, "kPa") for end in self.limits.pressure)
            raise InputError(
                f"{self.design}: no state that was tried from {low:g} to {high:g} kPa has an equilibrium; "
                "give it other pressures"
            )
        return found

    @cached_property
    def by_tables(self) -> ByTables | None:
        """Searches in tables, for a chain whose segments are independent of each other."""
        tables = tables_of(self.body, self.limits.pressure, self.limits.span)
        return None if tables is None else ByTables(self.body, self.atlas, tables, self.box())

    def box(self, heated: Sequence[int] | None = None) -> Box:
        """Ranges of the drives; springs beyond those of `heated` (indices) are not heated."""
        count = len(self.springs)
        low = np.full(count, self.limits.xi0_min)
        if heated is not None:
            low = np.where(np.isin(np.arange(count), heated), low, self.highest)
        ends = self.limits.pressure
        rest = np.append(np.clip(0.0, *ends), self.highest)
        return Box(*(as_array(x) for x in (np.append(ends[0], low), np.append(ends[1], self.highest), rest)))

    def check(self, goals: Sequence[str]) -> None:
        """Refuse goals that this body cannot have.

        Raises:
            InputError: naming the goal.
        """
        for name in goals:
            if self.body.chain is not None and not GOALS[name].chain:
                raise InputError(f"a chain has no {name} of its own; want its tip or direction instead")
            planar = self.body.chain is None and self.body.segments[0].planar
            if name in ("curvature", "bend_angle") and not planar:
                raise InputError(
                    f"{name} has a sign only where bending is held in a plane; want a bend instead"
                )

    def solve(self, goals: Sequence[str], wanted: np.ndarray, all_ways: bool = False) -> Inversion:
        """Drives for targets, with springs that are new to heat.

        Args:
            goals: names of `GOALS`.
            wanted: values in SI, shape (targets, columns).
            all_ways: look for other ways, too: with every set of heated springs of an actuator, from more
                starts of a chain. The answer is then the way with the least heating power of all.
        """
        goals, wanted = tuple(goals), np.atleast_2d(np.asarray(wanted, dtype=float))
        self.check(goals)
        near, tried = self.lean_starts(goals, wanted), 0
        if not near.shape[1]:  # no state of a loaded chain is lean
            near, tried = self.atlas.nearest(goals, wanted, 1), 1
        # where a search costs little, it starts from the nearest state, too, for less heat
        if self.body.chain is None or self.by_tables is not None:
            near, tried = np.concatenate([near, self.atlas.nearest(goals, wanted, 1)], axis=1), 1
        best = self._exact(goals, wanted, _best(self._searched(goals, wanted, near, most=FIRST_TRY)))
        more = [
            range(first + 1, last + 1)
            for first, last in zip((tried, *MORE_STARTS), MORE_STARTS, strict=False)
        ]
        for ranks in [*more, *([SPREAD] if self.by_tables is not None else [])]:
            lost = np.flatnonzero(~self._met(goals, np.asarray(best.values), wanted))
            if not lost.size:
                break
            again = self.atlas.nearest(goals, wanted[lost], ranks)
            found = self._exact(goals, wanted[lost], _best(self._searched(goals, wanted[lost], again)))
            both = jax.tree.map(lambda a, b, k=lost: np.stack([a[k], b], axis=1), best, found)
            best = replaced(best, lost, _best(both))
        ways = [np.zeros((0, 1 + len(self.springs)))] * len(wanted)
        if all_ways:
            best, ways = self._ways(goals, wanted, best)
        return self._inversion(goals, wanted, best, ways)

    def lean_starts(self, goals: tuple[str, ...], wanted: np.ndarray) -> np.ndarray:
        """Indices of states of the atlas with little heat, shape (targets, starts)."""
        if self.body.chain is None:
            return self.atlas.least_heated(goals, wanted, LEAN)
        return self.atlas.nearest(goals, wanted, 1, lean=True)

    def _searched(
        self,
        goals: tuple[str, ...],
        wanted: np.ndarray,
        near: np.ndarray,
        heated: Sequence[int] | None = None,
        most: int = MOST_STEPS,
    ) -> Found:
        """Searches from states of the atlas, arrays of shape (targets, starts, ...)."""
        if self.by_tables is not None and heated is None:
            return self.by_tables.searched(goals, wanted, near, most)
        targets, starts = near.shape
        box = self.box(heated)
        flat = near.ravel()
        places = box.places(self.atlas.drives[flat])
        rows = (np.repeat(wanted, starts, axis=0), places, self.atlas.unknowns[flat])
        lot, memories = FEW if flat.size <= FEW else LOT, fresh(self.body)
        boxes = jax.tree.map(lambda x: np.broadcast_to(np.asarray(x), (lot, *x.shape)), box)
        found = []
        for part in lots(rows, lot):
            aims, begin, guess = part
            ended = search_all(self.body, goals, boxes, aims, (begin, guess), memories, np.asarray(most))
            found.append(jax.tree.map(np.asarray, ended))
        whole = joined(found, flat.size)
        return jax.tree.map(lambda x: x.reshape(targets, starts, *x.shape[1:]), whole)

    def _exact(self, goals: tuple[str, ...], wanted: np.ndarray, found: Found) -> Found:
        """Ends of searches on the exact model, arrays of shape (targets, ...) or (targets, starts, ...)."""
        if self.by_tables is None:
            return found
        lead = found.miss.shape
        many = np.repeat(wanted, found.miss.size // len(wanted), axis=0)
        flat = jax.tree.map(lambda x: x.reshape(len(many), *x.shape[len(lead) :]), found)
        exact = self.by_tables.corrected(goals, many, flat)
        return jax.tree.map(lambda x: x.reshape(*lead, *x.shape[1:]), exact)

    def _met(self, goals: tuple[str, ...], values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        found = misses(goals, np.asarray(values), np.asarray(wanted))
        return np.all([np.asarray(m) <= GOALS[name].tolerance for name, m in found.items()], axis=0)

    def _ways(
        self, goals: tuple[str, ...], wanted: np.ndarray, best: Found
    ) -> tuple[Found, list[np.ndarray]]:
        """The way to each target that needs the least heat, and the drives of all others in that order."""
        box, ways, answers = as_numpy(self.box()), [], []
        scale = np.where(box.high > box.low, box.high - box.low, 1.0)
        candidates = self._candidates(goals, wanted)
        found_first = jax.tree.map(lambda x: np.asarray(x)[:, None], best)
        many = jax.tree.map(lambda *x: np.concatenate(x, axis=1), found_first, *candidates)
        drives = box.low + many.place * (box.high - box.low)
        power = heat(self.body, drives[..., 1:])
        power[:, 0] *= 1.0 - SAME_HEAT
        for t, target in enumerate(wanted):
            met = self._met(goals, many.values[t], np.broadcast_to(target, many.values[t].shape))
            order = [int(k) for k in np.argsort(power[t], kind="stable") if met[k]]
            first = order[0] if order else 0
            taken = [drives[t, first]]
            for k in order:
                if all(np.max(np.abs(drives[t, k] - other) / scale) > APART for other in taken):
                    taken.append(drives[t, k])
            answers.append(first)
            ways.append(np.array(taken[1:]).reshape(-1, len(self.springs) + 1))
        rows = np.arange(len(wanted))
        return jax.tree.map(lambda x: x[rows, answers], many), ways

    def _candidates(self, goals: tuple[str, ...], wanted: np.ndarray) -> list[Found]:
        """Ends of further searches, in the box of all drives, arrays of shape (targets, ways, ...)."""
        if self.body.chain is not None:
            many = self._searched(goals, wanted, self.atlas.nearest(goals, wanted, MORE_STARTS[-1]))
            return [self._exact(goals, wanted, many)]
        near, whole, found = self.lean_starts(goals, wanted), self.box(), []
        if not near.shape[1]:  # no lean state has an equilibrium
            near = self.atlas.nearest(goals, wanted, 1)
        springs = range(len(self.springs))
        sets = [one for size in springs for one in itertools.combinations(springs, size + 1)]
        for heated in sets:
            one = _best(self._searched(goals, wanted, near, heated))
            drives = as_numpy(self.box(heated)).drives(one.place)
            found.append(replace(one, place=whole.places(drives)))
        return [jax.tree.map(lambda x: np.asarray(x)[:, None], one) for one in found]

    def _inversion(
        self, goals: tuple[str, ...], wanted: np.ndarray, best: Found, ways: list[np.ndarray]
    ) -> Inversion:
        box = self.box()
        drives = as_numpy(box).drives(best.place)
        solved = self.verified(drives)
        values = goal_values(solved, goals)
        found = {
            name: np.asarray(m) for name, m in misses(goals, np.asarray(values), np.asarray(wanted)).items()
        }
        met = np.all([m <= GOALS[name].tolerance for name, m in found.items()], axis=0)
        held = tuple("" if ok else self._held(best, k) for k, ok in enumerate(met))
        resistances, currents = electrical(solved)
        return Inversion(
            self.design, goals, wanted, self.springs, drives[:, 0], drives[:, 1:], resistances, currents,
            values, found, met, held, tuple(ways), unheated(self.body), self.highest,
            self._heat_of(ways), self.reach(goals),
        )  # fmt: skip

    def reach(self, goals: Sequence[str]) -> dict[str, tuple[float, float]]:
        """Least and largest value of each goal that has one column, over the states of the atlas [SI]."""
        found = {}
        for name in (name for name in goals if len(GOALS[name].columns) == 1):
            values = self.atlas.values((name,))
            found[name] = float(np.nanmin(values)), float(np.nanmax(values))
        return found

    def _heat_of(self, ways: list[np.ndarray]) -> tuple[np.ndarray, ...]:
        """Heating power of every way [W], shape (ways,) of each target; all are computed together."""
        watts = heat(self.body, np.concatenate(ways)[:, 1:])
        return tuple(np.split(watts, np.cumsum([len(own) for own in ways])[:-1]))

    def verified(self, drives: np.ndarray) -> Solved:
        """States of drives on the exact model, each solved from rest, shape (targets, drives)."""
        return states_of(self.body, drives[:, 0], drives[:, 1:], fresh(self.body))

    def _held(self, best: Found, k: int) -> str:
        """Bounds that hold an unmet target, in words."""
        place, slope = best.place[k], best.slope[k]
        low = np.flatnonzero((place <= AT_END) & (slope > 0.0))
        high = np.flatnonzero((place >= 1.0 - AT_END) & (slope < 0.0))
        return self.bound_words(low, high) or "the goals contradict each other"

    def bound_words(self, low: np.ndarray, high: np.ndarray) -> str:
        """Ends of drives in words; a drive whose ends are equal is no choice and is left out.

        Args:
            low, high: indices of the drives at their lowest and at their highest.
        """
        box, words = self.box(), []
        for j, name in enumerate(["pressure", *(f"xi0_{n}" for n in self.names)]):
            if not float(box.high[j]) > float(box.low[j]):
                continue
            unit = " kPa" if j == 0 else ""
            for which, end, bound in ((low, "lowest", box.low), (high, "highest", box.high)):
                if j in which:
                    value = float(from_si(float(bound[j]), "kPa" if j == 0 else "1"))
                    words.append(f"{name} at its {end}, {value:.4g}{unit}")
        return "; ".join(words)


def _best(found: Found) -> Found:
    """The best start of every target: the least miss, then the least heating."""
    miss = np.where(found.miss < 1e-3, 0.0, found.miss)
    which = np.lexsort((found.effort, miss), axis=1)[:, 0]
    rows = np.arange(len(which))
    return jax.tree.map(lambda x: np.asarray(x)[rows, which], found)
