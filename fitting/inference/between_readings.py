"""Detection of rows that were interpolated on straight lines between readings, and recovery of these
readings.

Loggers and `interp` functions draw such lines.

Rows between two readings lie exactly on a line. Where one line ends and the next begins, there was a reading.
Readings come at even intervals, so these corners lie on an even grid: nothing else puts them there.
"""

from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

from .noise import common_step

linalg = Late("scipy.linalg")

EXACT = 1e-6
"""Maximum distance from a line that counts as none, relative to the largest reading. Files have seven
digits."""
LEAST_STRAIGHT = 0.02
"""Minimum share of moving rows on the line between their neighbours for interpolated rows. At 2.1 rows from
one reading to the next it is 0.05."""
MOVES = 4.0
"""Minimum move of the signal, in such distances, at which lying on a line is significant."""
FARTHER = 10.0
"""Minimum deviation of a reading beyond the rows of its line, in such distances. It is seven at 2.15 rows
from one reading to the next."""
ONE_CORNER = 0.8
"""Minimum share of neighbouring corners with the same turn. Corners of one reading between two rows always
have it; those of rounded readings hardly ever."""
FEWEST = 12
"""Minimum number of corners for a grid; so many fall on a grid by chance once in 10,000 searches."""
ON_GRID, OFF_GRID = 0.9, 0.2
"""Minimum mean resultant length of the corners' phases on a grid (N. I. Fisher, Statistical Analysis of
Circular Data, 1993). Second, maximum distance in rows of nine in ten corners from it; corners of rounded
readings are off by 0.05."""
NEAR = 1e-3
"""Maximum error of a grid's positions, in spacings. It is 0.0007 for 145 readings of seven digits."""
WIDEST, HEAD, FINE = 100.0, 200, 8
"""WIDEST: maximum number of rows from one reading to the next. HEAD: number of corners for the first estimate
of a grid. FINE: number of trial grids for each cycle that these span."""
END, MOST_RESAMPLED, CLOSE = 48, 3000, 2.5
"""END: number of rows at either end on which a number of readings is tested first. MOST_RESAMPLED: maximum
number of rows of a recording, as every number is tested. CLOSE: maximum number of rows per reading."""
SMOOTHED = 0.95
"""Maximum ratio of fourth to second differences, normalised, for the test. It is 0.7 to 0.9 for rows drawn at
1.1 to 1.4 per reading, and 0.9 to 1.05 for white noise over 150 rows."""
ALIKE, SELDOM = 0.95, 0.5
"""Minimum share of equal moves for a law with straight pieces under an even drive, which has no such
readings. Second, minimum share of different moves, or of all numbers of steps, for readings."""


@dataclass(frozen=True)
class OriginalReadings:
    """Readings between which rows were interpolated.

    Attributes:
        at: positions of the readings, in the unit of the rows' positions, shape (m,), ascending.
        values: values of the readings, shape (m,); NaN where no row determines one.
    """

    at: np.ndarray
    values: np.ndarray

    def nearest(self, x: np.ndarray) -> np.ndarray:
        """Index of the row nearest to each reading, for ascending row positions x, without repetition."""
        right = np.clip(np.searchsorted(x, self.at), 1, len(x) - 1)
        return np.unique(np.where(self.at - x[right - 1] < x[right] - self.at, right - 1, right))


def readings_between(x: np.ndarray, y: np.ndarray) -> OriginalReadings | None:
    """Readings between which rows were interpolated, or None where rows are readings themselves.

    Args:
        x: positions of the rows, ascending, about one apart, shape (n,).
        y: values of the rows, shape (n,), finite. Readings may have been rounded, and rows after them.
    """
    if len(x) < 2 * FEWEST or not np.ptp(y) > 0.0:
        return None
    exact = EXACT * float(np.max(np.abs(y)))
    for none in (exact, common_step(y)):
        corners = _corners(x, y, none * (1.0 + EXACT)) if none >= exact else np.zeros(0)
        grid = _grid(corners) if len(corners) >= FEWEST else None
        found = _readings_at(x, y, *grid, none) if grid else None
        if found is not None and _differ_like_noise(found.values, none):
            return found
    found = _resampled(y, exact) if np.ptp(np.diff(x)) == 0.0 else None
    return found if found is not None and _differ_like_noise(found.values, exact) else None


def _resampled(y: np.ndarray, none: float) -> OriginalReadings | None:
    """Readings of rows that were drawn closer than two per reading, from the first reading to the last.

    No two rows of such a file determine a line. But the number of readings has finitely many candidates, and
    only the right one reproduces the rows at both ends.
    """
    if len(y) > MOST_RESAMPLED or not _smoothed(y):
        return None
    for count in range(int(len(y) / CLOSE), int(len(y) / 1.05)):
        every = (len(y) - 1) / (count - 1)
        if all(_largest_distance(part, every) < none for part in (y[:END], y[: -END - 1 : -1])):
            values = _fitted_readings(y, np.arange(len(y)) / every, count)
            if np.max(np.abs(_interpolated_rows(values, every, len(y)) - y)) < none:
                return OriginalReadings(every * np.arange(count), _merged(values, FARTHER * none))
    return None


def _smoothed(y: np.ndarray) -> bool:
    """True if fast changes are smaller than slower ones, as lines between readings leave them. For white
    noise, normalised fourth differences are as large as second ones."""
    second, fourth = (np.diff(y, order) for order in (2, 4))
    return bool(np.mean(np.abs(fourth)) / np.sqrt(70.0) < SMOOTHED * np.mean(np.abs(second)) / np.sqrt(6.0))


def _largest_distance(y: np.ndarray, every: float) -> float:
    """Largest distance of rows from lines between readings; the first row is a reading."""
    count = int((len(y) - 1) / every) + 2
    rows = _interpolated_rows(_fitted_readings(y, np.arange(len(y)) / every, count), every, len(y))
    return float(np.max(np.abs(rows - y)))


def _interpolated_rows(values: np.ndarray, every: float, rows: int) -> np.ndarray:
    """Rows on the lines between readings."""
    return np.interp(np.arange(rows), every * np.arange(len(values)), values)


def readings_at(grid: OriginalReadings, x: np.ndarray, y: np.ndarray) -> OriginalReadings | None:
    """Readings of a column at the positions of another column's readings; None if its rows are not on lines
    between them.

    Args:
        grid: readings of another column of the same file.
        x: positions of the rows, ascending, shape (n,).
        y: values of the rows, shape (n,), finite.
    """
    count = len(grid.at)
    if len(x) < 2 * FEWEST or count < FEWEST or not np.ptp(y) > 0.0:
        return None
    every = float(np.ptp(grid.at)) / (count - 1)
    place = (x - grid.at[0]) / every + 1.0  # one reading more on either side of the grid
    inside = (place >= 0.0) & (place <= count + 1.0)
    exact = EXACT * float(np.max(np.abs(y)))
    for none in (exact, common_step(y)):
        if none >= exact:
            values = _fitted_readings(y[inside], place[inside], count + 2)
            drawn = np.interp(place[inside], np.arange(count + 2.0), values)
            values = values[1:-1]
            allowed = none + NEAR * float(np.max(np.abs(np.diff(values, 2))))
            if np.max(np.abs(drawn - y[inside])) < allowed and _differ_like_noise(values, none):
                return OriginalReadings(grid.at, _merged(values, FARTHER * none))
    return None


def _fitted_readings(y: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
    """Readings between which rows lie, by least squares. A tiny weight keeps those that no row determines.

    Args:
        y: values of the rows, shape (n,).
        place: positions of the rows in readings, between 0 and `count` - 1, shape (n,).
        count: number of readings.
    """
    reading_before = np.minimum(np.floor(place + EXACT).astype(int), count - 2)
    part = np.clip(place - reading_before, 0.0, 1.0)
    bands = np.zeros((2, count))
    np.add.at(bands[1], reading_before, (1.0 - part) ** 2)
    np.add.at(bands[1], reading_before + 1, part**2)
    np.add.at(bands[0], reading_before + 1, part * (1.0 - part))
    bands[1] += 1e-12
    right = np.zeros(count)
    np.add.at(right, reading_before, (1.0 - part) * y)
    np.add.at(right, reading_before + 1, part * y)
    return linalg.solveh_banded(bands, right)


def _corners(x: np.ndarray, y: np.ndarray, none: float) -> np.ndarray:
    """Ascending positions at which lines between rows end, where detectable; empty if few rows lie on a
    line."""
    part = (x[2:] - x[1:-1]) / (x[2:] - x[:-2])
    off = np.concatenate([[0.0], y[1:-1] - part * y[:-2] - (1.0 - part) * y[2:], [0.0]])
    corner = np.abs(off) > none
    moving = np.concatenate([[False], np.abs(y[2:] - y[:-2]) > MOVES * none, [False]])
    straight = moving & ~corner
    if straight.sum() < LEAST_STRAIGHT * (straight | corner).sum():
        return np.zeros(0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], corner, [False]]).astype(int)))
    first, last = edges[::2], edges[1::2] - 1
    single = first[first == last]
    even = (last - first) % 2 == 1
    pairs = np.unique(np.concatenate([first[even], last[even] - 1]))
    pairs = pairs[(pairs >= 1) & (pairs + 2 < len(x))]
    one = off[pairs] * off[pairs + 1] > 0.0
    if len(pairs) and np.mean(one) < ONE_CORNER:
        return np.zeros(0)
    return np.unique(np.concatenate([x[single], _crossings(x, y, pairs[one])]))


def _crossings(x: np.ndarray, y: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Intersections of the line through a row and the one before with the line through the next two."""
    before = (y[row] - y[row - 1]) / (x[row] - x[row - 1])
    after = (y[row + 2] - y[row + 1]) / (x[row + 2] - x[row + 1])
    at = (y[row + 1] - y[row] + before * x[row] - after * x[row + 1]) / (before - after)
    return np.clip(at, x[row], x[row + 1])


def _grid(corners: np.ndarray) -> tuple[float, float] | None:
    """First position and spacing of the widest even grid through the corners; None if there is none."""
    head = corners[:HEAD]
    span = float(np.ptp(head))
    if not span > 0.0:
        return None
    trial = np.arange(1.0 / WIDEST, 0.51, 1.0 / (FINE * max(span, 1.0)))
    length = np.abs(np.exp(2j * np.pi * np.outer(trial, head)).mean(axis=1))
    if length.max() < ON_GRID:
        return None
    near = np.flatnonzero(length >= ON_GRID)
    near = near[near <= near[0] + FINE]
    best = trial[near[np.argmax(length[near])]]
    every = 1.0 / best
    begin = float(np.angle(np.exp(2j * np.pi * best * head).mean()) / (2.0 * np.pi * best))
    count = min(FEWEST, len(corners))
    while True:  # the spacing comes from a growing number of corners, so that none is assigned wrongly
        some = corners[:count]
        number = np.round((some - begin) / every)
        if np.ptp(number) > 0.0:
            every, begin = (float(c) for c in np.polyfit(number, some, 1))
        if count == len(corners):
            break
        count = min(2 * count, len(corners))
    off = np.abs(corners - begin - every * np.round((corners - begin) / every))
    return (begin, every) if every > 1.0 and np.quantile(off, 0.9) < OFF_GRID else None


def _readings_at(x: np.ndarray, y: np.ndarray, begin: float, every: float, none: float) -> OriginalReadings:
    """Readings at the positions of a grid, from the lines on either side of each; equal ones are made
    equal."""
    near = NEAR * every
    number = (x[[0, -1]] - begin + np.array([-near, near])) / every
    at = begin + every * np.arange(np.ceil(number[0]), np.floor(number[1]) + 1.0)
    first = np.searchsorted(x, at - near)
    last = np.searchsorted(x, at + every + near) - 1
    determined = (last > first) & (first < len(x))
    a, b = first[determined], last[determined]
    slope = (y[b] - y[a]) / (x[b] - x[a])
    sides = np.full((2, len(at) + 1), np.nan)
    sides[0, :-1][determined] = y[a] + slope * (at[determined] - x[a])
    sides[1, 1:][determined] = y[a] + slope * (at[determined] + every - x[a])
    defined = np.isfinite(sides[:, :-1])
    total = np.where(defined, sides[:, :-1], 0.0).sum(axis=0)
    either_side = defined.any(axis=0)
    values = np.full(len(at), np.nan)
    values[either_side] = _merged(total[either_side] / defined.sum(axis=0)[either_side], FARTHER * none)
    return OriginalReadings(at, values)


def _merged(values: np.ndarray, none: float) -> np.ndarray:
    """Numbers with differences of arithmetic removed, and those at whole steps put there, so that rounded
    readings keep their step."""
    order = np.argsort(values, kind="stable")
    group = np.concatenate([[0], np.cumsum(np.diff(values[order]) > none)])
    means = np.bincount(group, values[order]) / np.bincount(group)
    merged = np.empty_like(values)
    merged[order] = _at_steps(means, none)[group]
    return merged


def _at_steps(values: np.ndarray, none: float) -> np.ndarray:
    """Ascending numbers at whole multiples of their step, if all lie closer to these than `none`."""
    between = np.diff(values)
    if len(between) < 2 or between.min() < MOVES * none:
        return values
    step = np.median(between[between < 1.5 * between.min()])
    number = np.concatenate([[0.0], np.cumsum(np.round(between / step))])
    fitted = np.polyval(np.polyfit(number, values, 1), number)
    return fitted if np.max(np.abs(fitted - values)) < none else values


def _differ_like_noise(values: np.ndarray, none: float) -> bool:
    """True if moves between readings differ in size like those of noisy readings. They are seldom alike or,
    for rounded ones, take all numbers of steps. A law with straight pieces repeats a few sizes."""
    values = values[np.isfinite(values)]
    moves, step = np.abs(np.diff(values)), common_step(values)
    if not len(moves) or len(np.unique(np.round(moves / (MOVES * none)))) >= SELDOM * len(moves):
        return len(moves) > 0
    if not step > 0.0:
        return False
    steps = np.round(moves / step)
    low, high = np.quantile(steps, [0.05, 0.95])
    sizes, counts = np.unique(steps, return_counts=True)
    filled = np.sum((sizes >= low) & (sizes <= high)) / (high - low + 1.0)
    return bool(filled >= SELDOM and counts.max() < ALIKE * len(moves))
