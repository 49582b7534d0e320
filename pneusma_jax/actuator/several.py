"""Rows by resistance, which may have several equilibria; many at a time, in NumPy about one compiled program.

A row starts in the cells of the grid of equilibria that may hold one (`cells`). If only one cell may, it
holds the only equilibrium. At given phases there is one equilibrium, so the map of fractions to resistances
has degree one. Hence the signs of the stiffness at all equilibria of a row add up to one. Rows whose signs do
not have missed one. They get more starts, at last those of `root_find.all_roots`. The sum does not show two
that were missed together. Such two lie beside the one that was found, with a spring nearly cold. So rows
whose resistances hardly change with the fractions (`FLAT`) are looked at once more. So are rows whose cold
spring has too small a resistance.
"""

import itertools
from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np

from .balance import READING, WITHIN
from .batches import (
    Rows,
    Solved,
    fractions_of,
    is_resistance,
    map_of,
    put,
    solved_at_phases,
    solved_from,
    starts_at,
    taken,
)  # fmt: skip
from .cells import CellRanges, Cells, Reading, examined, fractions_beside, starts_in
from .phase_map import PhaseMap, place_of
from .result import Equilibrium, Status
from .root_find import MOST_ROOTS, beside_cold, distinct, in_between, trial_fractions

MOST_CELLS = 16
"""Maximum of cells in which equilibria of a row are looked for; rows with more get all starts."""
WORTHWHILE = 20
"""Number of rows from which on a grid of some 1,300 equilibria is made for them; fewer get all starts, some
150 each."""
FLAT = 0.01
"""Minimum slope of resistances over fractions [1], see `Ended`, at which one equilibrium is believed to be
alone. In 10,000 random rows of PneuSMA2 it was below 0.008 in 0.1 % of those with one. Of 9 rows that came
back as another one, each with a nearly cold spring, it was below 0.006 in 8."""
SAME = 0.01
"""Distance of two starts of a row, in points of the grid, below which one is left out. This spares 12 % of
the attempts of rows with several cells, of 10,000 random ones of PneuSMA2. With 0.1, 2 rows lost one."""
BEYOND = (0.5, 1.0, 2.0)
"""Distances of starts beyond an unstable equilibrium, over that to the stable one on its other side [1]."""
INWARDS = 3.0
"""Tolerances of an exactly cold or hot spring, see `READING`, by which its reading is moved inside [1]."""
TWIN = 1e-5
"""Distance from the end at which an equilibrium beside an exactly cold or hot spring is looked for [1]."""
NEAR = 0.01
"""Maximum change of a scaled unknown with which an equilibrium is the same one after that [1]."""
TOGETHER = 64
"""Number of rows that are searched at a time with all starts; it bounds the memory."""


class Known(NamedTuple):
    """Equilibria of rows that were found, those of a row the least heated first.

    Attributes:
        every: attempts, one after the other.
        which: indices of each row's attempts, shape (rows, roots).
        real: true for those that are equilibria.
        whole: true if the signs of all equilibria of a row add up to one.
        owner: row of each attempt.
    """

    every: Solved
    which: np.ndarray
    real: np.ndarray
    whole: np.ndarray
    owner: np.ndarray

    def result(self, root: np.ndarray | int = 0) -> tuple[Equilibrium, np.ndarray]:
        """One equilibrium of every row, and its joint unknowns."""
        at = self.which[np.arange(len(self.which)), root]
        found = taken(self.every.result, at)
        count = self.real.sum(axis=1)
        count = np.maximum(count, found.equilibria)
        several = (found.status == int(Status.converged)) & (count > 1)
        status = np.where(several, int(Status.several_equilibria), found.status)
        found = eqx.tree_at(lambda f: (f.status, f.equilibria), found, (status, count))
        return found, self.every.unknowns[at]


def solved_by_resistance(rows: Rows, shared: bool) -> tuple[Equilibrium, np.ndarray]:
    """The least heated equilibrium of every row, and its joint unknowns.

    Args:
        rows: rows with a measured resistance, at least one.
        shared: true if the springs' memories are the same in all rows.
    """
    usable = rows.usable
    found = None
    for group, alike in [*_groups(rows, usable, shared), (np.flatnonzero(~usable), False)]:
        if not group.size:
            continue
        one = rows if group.size == len(rows) else rows.taken(group)
        if not usable[group[0]]:
            part = unusable(one).result()
        else:
            part = _by_cells(one) if alike else _by_all_starts(one)
        if group.size == len(rows):
            return part  # a copy of many rows takes much memory
        if found is None:
            found = jax.tree.map(lambda x: np.empty((len(rows), *x.shape[1:]), x.dtype), part)
        jax.tree.map(lambda whole, some: put(whole, group, some), found, part)  # noqa: B023
    return found


def _groups(rows: Rows, usable: np.ndarray, shared: bool) -> list[tuple[np.ndarray, bool]]:
    """Rows whose springs remember the same, each with whether a grid is worth its while; and all others."""
    left = np.flatnonzero(usable)
    if shared:
        return [(left, len(left) >= WORTHWHILE)]
    memories = np.stack([np.asarray(x)[left] for x in jax.tree.leaves(rows.each[2])], axis=1)
    _, kind, count = np.unique(memories, axis=0, return_inverse=True, return_counts=True)
    kind = kind.ravel()
    groups = [(left[kind == k], True) for k in np.flatnonzero(count >= WORTHWHILE)]
    return [*groups, (left[count[kind] < WORTHWHILE], False)]


def _unknowns(rows: Rows) -> int:
    return rows.actuator.freedoms + sum(is_resistance(a) for a in rows.each[1])


def _readings(rows: Rows) -> tuple[Reading, ...]:
    """Readings of every spring."""
    springs = rows.actuator.springs
    found = []
    for k, activation in enumerate(rows.each[1]):
        if is_resistance(activation):
            found.append(Reading(activation.value, True))
        else:
            part = eqx.tree_at(
                lambda a: (a.springs, a.spring_numbers), rows.actuator,
                (springs[k : k + 1], rows.actuator.spring_numbers[k : k + 1]),
            )  # fmt: skip
            alone = Rows(part, (rows.each[0], (activation,), rows.each[2][k : k + 1]))
            found.append(Reading(fractions_of(alone)[0], False))
    return tuple(found)


PIECE = 16_384
"""Maximum of rows whose cells are looked at together; about ten cells each, it bounds the memory."""


def _by_cells(rows: Rows) -> tuple[Equilibrium, np.ndarray]:
    """Rows of springs that remember the same; see the module."""
    grid = map_of(rows, taken(rows.each[2], 0))
    ranges = CellRanges(grid, tuple(is_resistance(a) for a in rows.each[1]))
    found = None
    for first in range(0, len(rows), PIECE):
        part = _piece(rows.taken(slice(first, first + PIECE)), grid, ranges)
        if found is None:
            found = jax.tree.map(lambda x: np.empty((len(rows), *x.shape[1:]), x.dtype), part)
        jax.tree.map(lambda whole, some: put(whole, slice(first, first + PIECE), some), found, part)  # noqa: B023
    return found


LOOK = 20_000
"""Maximum of cells that are looked at together; arrays of more leave the processor's cache."""


class _Looked(NamedTuple):
    """Cells that rows looked at, arrays of shape (n,), rows ascending.

    Attributes:
        row, cells: row and cells of each look; `cells` has shape (springs, n).
        step: see `Cells`.
        possible: true where an equilibrium may lie.
        first: indices of the likeliest cell of every row that can have no other.
        some: indices of all possible cells of the other rows.
        sound: rows for which the grid is sound, shape (rows,).
    """

    row: np.ndarray
    cells: np.ndarray
    step: np.ndarray
    possible: np.ndarray
    first: np.ndarray
    some: np.ndarray
    sound: np.ndarray


def _looked(
    grid: PhaseMap, ranges: CellRanges, pressure: np.ndarray, readings: tuple[Reading, ...]
) -> _Looked:
    """Cells that rows start from."""
    row, cell = ranges.met(pressure, readings)
    order, parts, size = np.argsort(row, kind="stable"), [], len(pressure)
    row, cells = row[order], ranges.cells[:, cell[order]]
    for first in range(0, len(row), LOOK):
        own = slice(first, first + LOOK)
        whose = tuple(Reading(r.value[row[own]], r.measured) for r in readings)
        parts.append(examined(grid, pressure[row[own]], whose, cells[:, own]))
    seen = Cells(*(np.concatenate(x, axis=-1) for x in zip(*parts, strict=True)))
    possible = seen.holds | seen.turned
    count = np.bincount(row[possible], minlength=size)
    turned = np.bincount(row[seen.turned], minlength=size) > 0
    held = np.bincount(row[seen.holds], minlength=size) > 0
    sound = grid.holds(pressure) & (count > 0) & (count <= MOST_CELLS)
    alone = sound & held & ~turned
    # of a row that is alone the cell whose own slopes put the zero nearest to its middle
    near = np.flatnonzero(seen.holds & alone[row])
    near = near[np.lexsort((seen.away[near], row[near]))]
    first = near[np.unique(row[near], return_index=True)[1]]
    some = np.flatnonzero(possible & (sound & ~alone)[row])
    return _Looked(row, cells, seen.step, possible, first, some, sound)


def _piece(rows: Rows, grid: PhaseMap, ranges: CellRanges) -> tuple[Equilibrium, np.ndarray]:
    """Rows of `_by_cells`."""
    pressure, readings, size = rows.each[0], _readings(rows), len(rows)
    row, cells, step, possible, first, some, sound = _looked(grid, ranges, pressure, readings)
    measured = np.asarray([r.measured for r in readings])
    tried = np.concatenate([first, some])

    def solved(at: np.ndarray, fractions: np.ndarray) -> Solved:
        begin = np.concatenate([starts_at(grid, pressure[row[at]], fractions), fractions[measured].T], axis=1)
        return solved_from(rows.taken(row[at]), begin)

    of = tuple(Reading(r.value[row[tried]], r.measured) for r in readings)
    begin = starts_in(grid, pressure[row[tried]], of, cells[:, tried], step[:, tried])
    new = ~_repeated(row[tried], place_of(begin, grid.size))
    tried, some, begin = tried[new], some[new[len(first) :]], begin[:, new]
    every = solved(tried, begin)
    # most rows are alone: one attempt each, and nothing to compare
    found = jax.tree.map(lambda x: np.empty((size, *x.shape[1:]), x.dtype), (every.result, every.unknowns))
    sure, flat = np.zeros(size, bool), np.zeros(size, bool)
    single, several = np.arange(len(first)), np.arange(len(first), len(tried))

    def kept(which: np.ndarray, part: tuple, good: np.ndarray) -> None:
        jax.tree.map(lambda whole, one: put(whole, which, one), found, part)
        sure[which] = good

    kept(row[first], taken((every.result, every.unknowns), single), every.good[single])
    flat[row[first]] = every.good[single] & (every.slope[single] < FLAT)
    doubtful = np.unique(row[some])
    if doubtful.size:
        known = _known(rows.taken(doubtful), np.searchsorted(doubtful, row[some]), taken(every, several))
        known = _with_third(rows.taken(doubtful), known)
        known = _counted_at_ends(rows.taken(doubtful), known)
        kept(doubtful, known.result(), known.whole)
        lone = known.whole & (known.real.sum(axis=1) == 1)
        flat[doubtful] = lone & (known.every.slope[known.which[:, 0]] < FLAT)
    flat |= sure & (found[0].equilibria == 1) & _beyond_cold(rows, found[0])
    if flat.any():
        which = np.flatnonzero(flat)
        some = rows.taken(which)
        known = _with_cold_ends(some, np.arange(len(which)), solved_from(some, found[1][which]))
        kept(which, known.result(), np.ones(len(which), bool))
    again = np.flatnonzero(sound & ~sure)
    if again.size:
        missed = np.flatnonzero(possible & np.isin(row, again))
        before = np.isin(row[tried], again)
        ways = [np.asarray(way)[:, None] for way in itertools.product((-1.0, 1.0), repeat=len(readings))]
        beside = np.concatenate([fractions_beside(grid, cells[:, missed], way) for way in ways], axis=1)
        missed = np.tile(missed, len(ways))
        more = _joined([taken(every, before), solved(missed, beside)])
        whose = np.concatenate([row[tried][before], row[missed]])
        known = _known(rows.taken(again), np.searchsorted(again, whose), more)
        kept(again, known.result(), known.whole)
    on_grid = grid.holds(pressure)
    for there, starts in ((on_grid, grid), (~on_grid, None)):
        left = np.flatnonzero(~sure & there)
        if left.size:
            kept(left, _by_all_starts(rows.taken(left), starts), np.ones(len(left), bool))
    return found


def _repeated(row: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Whether a start is that of another attempt of the same row, within `SAME`.

    Args:
        row: row of each attempt; attempts of a row follow each other.
        place: place of each start on the axes of the grid [1], shape (springs, n).
    """
    repeated = np.zeros(len(row), bool)
    for apart in range(1, MOST_CELLS):
        alike = row[apart:] == row[:-apart]
        if not alike.any():
            break
        near = np.max(np.abs(place[:, apart:] - place[:, :-apart]), axis=0) < SAME
        repeated[apart:] |= alike & near & ~repeated[:-apart]
    return repeated


def _with_third(rows: Rows, known: Known) -> Known:
    """Equilibria of rows, and the third one of rows where two were found, of which one is unstable.

    It is looked for on the line through both, beyond the unstable one.

    Args:
        rows, known: rows, and what was found in them.
    """
    two = np.flatnonzero(~known.whole & (known.real.sum(axis=1) == 2))
    if not two.size:
        return known
    at = known.which[two, :2]
    stable = known.every.sign[at] > 0.0
    two, at, stable = (x[stable.sum(axis=1) == 1] for x in (two, at, stable))
    if not two.size:
        return known
    roots, count = known.every.unknowns[at], rows.actuator.freedoms
    turned = roots[~stable]
    starts = turned + np.asarray(BEYOND)[:, None, None] * (turned - roots[stable])
    starts[..., count:] = np.clip(starts[..., count:], 0.0, 1.0)
    others = np.tile(two, len(BEYOND))
    more = solved_from(rows.taken(others), starts.reshape(len(others), -1))
    return _known(rows, np.concatenate([known.owner, others]), _joined([known.every, more]))


def _counted_at_ends(rows: Rows, known: Known) -> Known:
    """Equilibria of rows, where those with an exactly cold or hot spring are counted rightly.

    At an end the map has another slope on either side, and a sign is that of one side. Another equilibrium
    may lie right beside, inside. It is looked for first. Then readings are moved to the inside, by a few of
    the tolerances within which a spring stays at its end. An equilibrium at the end that is gone then counts
    nothing: the two have met.

    Args:
        rows, known: rows, and what was found in them.
    """
    count = rows.actuator.freedoms
    here, _ = _at_ends(rows, known)
    row, root = np.nonzero(here.any(axis=0) & ~known.whole[:, None])
    if not row.size:
        return known
    starts = known.every.unknowns[known.which[row, root]]
    inner = np.where(here[:, row, root].T, np.abs(starts[:, count:] - TWIN), starts[:, count:])
    beside = solved_from(rows.taken(row), np.concatenate([starts[:, :count], inner], axis=1), patient=False)
    known = _known(rows, np.concatenate([known.owner, row]), _joined([known.every, beside]))
    here, moved = _at_ends(rows, known)
    row, root = np.nonzero(here.any(axis=0) & ~known.whole[:, None])
    if not row.size:
        return known
    nearby = rows.taken(row)
    measured = [k for k, a in enumerate(rows.each[1]) if is_resistance(a)]
    for k, by in zip(measured, moved[:, row, root], strict=True):
        value = nearby.each[1][k].value + by
        nearby = Rows(nearby.actuator, eqx.tree_at(lambda e: e[1][k].value, nearby.each, value))  # noqa: B023
    starts = known.every.unknowns[known.which[row, root]]
    ended = solved_from(nearby, starts, patient=False)
    own, near = known.every.sign[known.which], np.max(np.abs(ended.unknowns - starts), axis=1) < NEAR
    signs = np.where(known.real, own, 0.0)
    kept = ended.good & near & (ended.sign == own[row, root])
    signs[row, root] = np.where(kept, own[row, root], 0.0)
    settled = (signs.sum(axis=1) == 1.0) & (known.real.sum(axis=1) < MOST_ROOTS)
    return known._replace(whole=known.whole | settled)


def _at_ends(rows: Rows, known: Known) -> tuple[np.ndarray, np.ndarray]:
    """Springs that are exactly cold or hot in equilibria, and by what their readings are moved inside [ohm].

    Readings with noise are left alone: their tolerance is wide. Both have the shape (measured, rows, roots).
    """
    count, here, moved = rows.actuator.freedoms, [], []
    measured = [k for k, a in enumerate(rows.each[1]) if is_resistance(a)]
    for place, k in enumerate(measured):
        activation, xi0 = rows.each[1][k], known.every.unknowns[known.which, count + place]
        least = READING * float(rows.actuator.springs[k].contrast_at_rest)
        seen = known.every.result.springs[k].resistance[known.which]
        met = (np.abs(seen - activation.value[:, None]) <= least) & (activation.noise == 0.0)[:, None]
        here.append(known.real & met & ((xi0 >= 1.0) | (xi0 <= 0.0)))
        rises = np.where(known.every.contrasts[known.which, k] < 0.0, -1.0, 1.0)
        moved.append(np.where(here[-1], INWARDS * least * rises * np.where(xi0 >= 1.0, -1.0, 1.0), 0.0))
    return np.stack(here), np.stack(moved)


def _with_cold_ends(rows: Rows, owner: np.ndarray, every: Solved) -> Known:
    """Equilibria that attempts found and those beside them, see `root_find.beside_cold`.

    Args:
        rows, owner, every: the same as those of `_known`.
    """
    known = _known(rows, owner, every)
    roots = every.unknowns[known.which[known.real]]
    if not len(roots):
        return known
    starts, held = beside_cold(roots[:, None], np.ones((len(roots), 1), bool), rows.actuator.freedoms)
    others = np.repeat(np.flatnonzero(known.real) // known.real.shape[1], len(held))
    many, starts, held = rows.taken(others), starts.reshape(len(others), -1), np.tile(held, (len(roots), 1))
    seen = solved_from(many, starts, held)
    more = solved_from(many, np.where(seen.good[:, None], seen.unknowns, starts))
    return _known(rows, np.concatenate([owner, others]), _joined([every, more]))


def _beyond_cold(rows: Rows, result: Equilibrium) -> np.ndarray:
    """Whether a spring was found cold with a smaller resistance than was measured."""
    found = np.zeros(len(rows), bool)
    for spring, activation, seen in zip(rows.actuator.springs, rows.each[1], result.springs, strict=True):
        if is_resistance(activation):
            least = READING * float(spring.contrast_at_rest) + WITHIN * activation.noise
            found |= (seen.xi0 >= 1.0) & (np.abs(seen.resistance - activation.value) > least)
    return found


def _joined(parts: list[Solved]) -> Solved:
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)


def _known(rows: Rows, owner: np.ndarray, every: Solved) -> Known:
    """Equilibria of every row that attempts found.

    Args:
        rows: the rows, of which some may have no attempt.
        owner: row of each attempt, in any order.
        every: attempts.
    """
    size, total = len(rows), len(owner)
    order = np.argsort(owner, kind="stable")
    place = np.arange(total) - np.searchsorted(owner[order], owner[order])
    width = max(int(place.max()) + 1, 1)
    which = np.zeros((size, width), int)
    there = np.zeros((size, width), bool)
    which[owner[order], place], there[owner[order], place] = order, True
    good = there & (every.good & (every.sign != 0.0))[which]
    best, real = distinct(every.unknowns[which], good, rows.actuator.freedoms)
    which = np.take_along_axis(which, best, axis=1)
    signs = np.where(real, every.sign[which], 0.0).sum(axis=1)
    return Known(every, which, real, (signs == 1.0) & (real.sum(axis=1) < MOST_ROOTS), owner)


def every_root(rows: Rows, grid: PhaseMap | None = None) -> Known:
    """All equilibria of usable rows by resistance, as `root_find.all_roots` finds those of one.

    Args:
        rows: usable rows.
        grid: equilibria at phases, if there is a grid that is sound about the rows' pressures.
    """
    count, size = rows.actuator.freedoms, len(rows)
    trials = trial_fractions(sum(is_resistance(a) for a in rows.each[1]))
    owner = np.repeat(np.arange(size), len(trials))
    many, trials = rows.taken(owner), np.tile(trials, (size, 1))
    if grid is None:
        begin = np.concatenate([np.full((len(owner), count), np.nan), trials], axis=1)
        seen = solved_from(many, begin, held=True)
        begin = np.where(seen.good[:, None], seen.unknowns, begin)
    else:
        fractions, given = [], iter(trials.T)
        for reading in _readings(many):
            fractions.append(next(given) if reading.measured else reading.value)
        begin = np.concatenate([starts_at(grid, many.each[0], np.stack(fractions)), trials], axis=1)
    every = solved_from(many, begin)
    known = _known(rows, owner, every)
    roots = every.unknowns[known.which]
    between = in_between(np.where(known.real[..., None], roots, np.nan_to_num(roots)), known.real, count)
    others = np.repeat(np.arange(size), between.shape[1])
    more = solved_from(rows.taken(others), between.reshape(len(others), -1))
    return _with_cold_ends(rows, np.concatenate([owner, others]), _joined([every, more]))


def every_root_at_phases(rows: Rows) -> Known:
    """Equilibria of rows without measured resistances: without loads one each, under loads from `TRIALS`."""
    found = solved_at_phases(rows, taken(rows.each[2], 0))
    owner = np.arange(len(rows))
    if not rows.actuator.loads:
        return _known(rows, owner, found)
    directions = rows.actuator.freedoms
    stretched = directions > 1 and rows.actuator.freedoms != 2 - rows.actuator.planar
    axes = [STRETCHES] * stretched + [BENDS] * (directions - stretched)
    trials = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, directions)
    others = np.repeat(owner, len(trials))
    more = solved_from(rows.taken(others), np.tile(trials, (len(rows), 1)))
    return _known(rows, np.concatenate([owner, others]), _joined([found, more]))


STRETCHES = np.linspace(-0.2, 0.4, 3)
BENDS = np.linspace(-0.6, 0.6, 9)
"""Scaled unknowns from which equilibria under loads are searched [1]. They are a stretch of -20 to 40 %, and
bends up to a full turn of the source's actuators. Their length is nine radii."""


def unusable(rows: Rows) -> Known:
    """Rows that cannot be solved, with the status that says why."""
    found = solved_from(rows, np.full((len(rows), _unknowns(rows)), np.nan))
    which = np.arange(len(rows))[:, None]
    return Known(found, which, np.zeros_like(which, bool), np.zeros(len(rows), bool), np.arange(len(rows)))


def _by_all_starts(rows: Rows, grid: PhaseMap | None = None) -> tuple[Equilibrium, np.ndarray]:
    """The least heated equilibrium of rows, each searched with all starts; `grid` as for `every_root`."""
    parts = []
    for first in range(0, len(rows), TOGETHER):
        parts.append(every_root(rows.taken(slice(first, first + TOGETHER)), grid).result())
    return jax.tree.map(lambda *x: np.concatenate(x), *parts)
