"""Martensite fractions of an actuator's springs from their measured resistances, all rows together.

The fractions change slowly and the resistances are noisy. So the trajectory of all fractions is smoothed
about the answer of the whole actuator. A heated spring pulls the other one longer, and both resistances
change. A row by itself may have several equilibria or, with noise, none. A trajectory has one most likely
solution.

A spring that nobody heats is exactly cold. Beside such a spring lies another branch, on which it is slightly
heated and the other spring is hotter. So rows in which a spring may be cold are held there, until the other
springs have followed. They stay cold as long as their readings agree. In the end, which rows are cold is
decided together with the kinds of steps between the others (`walks.py`).
"""

import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.inference.noise import robust_noise
from pneusma_jax.actuator.balance import Problem, configuration, spring_responses
from pneusma_jax.actuator.implicit import attached
from pneusma_jax.numerics.lengths import fixed_length, lengthened
from pneusma_jax.program_cache import stored_jit

from .walks import SHORTEST, cold_rows, costs_of, kinds_of, linear_readings, smoothed

ROUNDS = 24
"""Maximum number of linearisations. Most recordings take three to six."""
CLOSE = 1e-4
"""Maximum change of a fraction at which the rounds end [1]."""
LONGEST = 0.1
"""Maximum step of a fraction in a round [1]. Near full heat the tangent is almost flat, and a full step would
leave its range of validity."""
FIRST_HOLD = 1e3
"""Precision with which a row is first held near its fractions [1]: by a standard deviation of 0.03."""
HELD = 30.0
"""Factor of this precision between a step and the next [1]."""
LAST_HOLD = 1e12
"""Precision beyond which no step is looked for [1]: by a standard deviation of 1e-6."""
SETTLED = 0.1
"""Improvement of half the sum of squares below which the rounds end [1]; noise changes it by more."""
NEARLY = 0.1
"""Heat below which a spring may be cold [1]. On branches beside cold springs, these were heated by 0.003 to
0.06."""
MISSED = 4.0
"""Deviation of a reading, in units of its noise, from which its spring is not cold. One reading in 16,000 of
a cold spring deviates by more."""
UNPREDICTED = 30.0
"""Deviation that a row without a prediction counts for, in units of its noise [1]; noise makes no such."""
ENDS = 12
"""Maximum number of rows at ends of cold stretches that are tried at a time."""
TURNS = 8
"""Maximum number of times that the ends of cold stretches are looked for anew."""
RELEASES = 5
"""Maximum number of times that rows are released from being cold."""
LEAST_NOISE = 2e-6
"""Minimum relative noise of a resistance; files keep no smaller digits."""


@dataclass(frozen=True)
class _Trajectory:
    """Fractions of the measured springs.

    Attributes:
        x: fractions [1], beyond 0 and 1 where noise leads there, shape (rows, wired).
        cold: true where a spring is exactly cold, shape (rows, wired).
        missed: what readings miss, over their noise, shape (rows, wired).
        likelihood: logarithm of the evidence of all rows, less what changes of kinds of steps cost.
    """

    x: np.ndarray
    cold: np.ndarray
    missed: np.ndarray
    likelihood: float


@dataclass(frozen=True)
class _Readings:
    """Measured resistances of an actuator, and what predicts them; see `fractions_behind`.

    Attributes:
        wired: indices of the measured springs.
        read, noise: measured resistances and their noise [ohm], shapes (rows, wired) and (wired,).
    """

    actuator: pj.Actuator
    time: np.ndarray
    pressure: np.ndarray
    given: Sequence[pj.MartensiteFraction]
    states: tuple[pj.SpringState, ...]
    wired: tuple[int, ...]
    read: np.ndarray
    noise: np.ndarray

    def missed(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What readings miss at fractions, and slopes of the predictions, both over the readings' noise.

        Shapes (rows, wired) and (rows, wired, wired). A row without a prediction is missed by `UNPREDICTED`
        and has no slope: it pulls nowhere, but speaks against the fractions.
        """
        inside = np.clip(x, 0.0, 1.0)
        fractions = self.with_fractions(inside)
        history = pj.simulate_history(self.actuator, self.pressure, fractions, self.states)
        whole = np.stack([np.broadcast_to(np.asarray(a.value), len(self.time)) for a in fractions], axis=1)
        rows = self.pressure, whole, _before(self.states, history), history.rows.unknowns
        longer = lengthened(rows, fixed_length(len(self.time)))
        found = _predicted_resistances(self.actuator, longer, self.wired)
        ohms, slope = (np.asarray(part)[: len(self.time)] for part in found)
        good = np.all(np.isfinite(slope), axis=(1, 2)) & np.all(np.isfinite(ohms), axis=1)
        ohms = np.where(good[:, None], ohms, self.read - UNPREDICTED * self.noise)
        slope = np.where(good[:, None, None], slope, 0.0)
        # beyond its ends a fraction is continued, so that noise about a cold spring does not heat it
        ohms = ohms + linear_readings(slope, x - inside)
        return (self.read - ohms) / self.noise, slope / self.noise[:, None]

    def with_fractions(self, x: np.ndarray) -> tuple[pj.MartensiteFraction, ...]:
        """Activations with the fractions of the measured springs replaced."""
        fractions = list(self.given)
        for column, k in enumerate(self.wired):
            fractions[k] = pj.MartensiteFraction(x[:, column])
        return tuple(fractions)


def fractions_behind(
    actuator: pj.Actuator,
    time: np.ndarray,
    pressure: np.ndarray,
    measured: Mapping[int, np.ndarray],
    given: Sequence[pj.MartensiteFraction],
    states: tuple[pj.SpringState, ...],
) -> list[pj.MartensiteFraction]:
    """Martensite fractions of all springs.

    Args:
        actuator: loaded actuator.
        time: time [s], ascending, shape (rows,).
        pressure: gauge pressure [Pa], shape (rows,).
        measured: resistances by index of the measured springs [ohm], shape (rows,).
        given: initial fractions, one per spring, of shape (rows,) or (); springs that are not measured keep
            theirs.
        states: memories before the first row.

    Returns:
        Fractions, one array per spring; of shape (rows,) where measured.
    """
    wired = tuple(sorted(measured))
    read = np.stack([measured[k] for k in wired], axis=1)
    noise = np.array([max(robust_noise(time, r), LEAST_NOISE * np.median(r)) for r in read.T])
    readings = _Readings(actuator, time, pressure, given, states, wired, read, noise)
    begun = np.stack([np.broadcast_to(np.asarray(given[k].value), len(time)) for k in wired], axis=1)
    best = _searched(readings, begun, np.zeros(begun.shape, bool))
    tried = [best.cold]
    for heat in (1.0, NEARLY):
        for cold in _may_be_cold(best.x, heat):
            if not any(np.array_equal(cold, other) for other in tried):
                tried.append(cold)
                best = max(best, _searched(readings, best.x, cold), key=_likelihood)
    for _ in range(TURNS):
        cold = _likely_cold(readings, best)
        released = best.cold & ~cold
        ways = [_between(best.x, released)]
        if released.any():
            ways.append(np.where(released, _continued(readings.time, best), best.x))
        better = max(best, *(_searched(readings, way, cold) for way in ways), key=_likelihood)
        better = _ends_moved(readings, better)
        if better.likelihood < best.likelihood + SETTLED:
            break
        best = better
    return list(readings.with_fractions(np.clip(best.x, 0.0, 1.0)))


_likelihood = operator.attrgetter("likelihood")


def _may_be_cold(x: np.ndarray, heat: float) -> Iterator[np.ndarray]:
    """Masks of rows in which all springs, or one of them, are heated by less; shape (rows, wired) each."""
    cold = x > 1.0 - heat
    springs = np.arange(x.shape[1])
    yield cold
    for k in springs if len(springs) > 1 else ():
        yield cold & (springs == k)


def _likely_cold(readings: _Readings, found: _Trajectory) -> np.ndarray:
    """Mask of rows in which springs are likely cold, shape (rows, wired), one spring after the other."""
    cold, heated = found.cold.copy(), _continued(readings.time, found)
    for k in range(cold.shape[1]):
        about = []
        for of_spring in (heated[:, k], np.where(found.x[:, k] > 1.0 - NEARLY, 1.0, found.x[:, k])):
            x = found.x.copy()
            x[:, k] = of_spring
            missed, slope = readings.missed(x)
            about.append((missed + linear_readings(slope, x), slope))
        cold[:, k] = cold_rows(readings.time, *about, cold, k)
    return cold


def _ends_moved(readings: _Readings, found: _Trajectory) -> _Trajectory:
    """The same trajectory or a likelier one, with single rows at ends of cold stretches heated or cold.

    The rows that miss most are tried first, at most `ENDS` of them.
    """
    changed = found.cold[1:] != found.cold[:-1]
    none = np.zeros_like(found.cold[:1])
    ends = np.concatenate([changed, none]) | np.concatenate([none, changed])
    misses = np.where(ends, np.max(np.abs(found.missed), axis=1, keepdims=True), -1.0)
    best = found
    for place in np.argsort(-misses, axis=None)[: min(ENDS, int(np.sum(ends)))]:
        row, k = np.unravel_index(place, misses.shape)
        x, cold = best.x.copy(), best.cold.copy()
        cold[row, k] = not cold[row, k]
        x[row, k] = 1.0 if cold[row, k] else _continued(readings.time, best)[row, k]
        trial = _smoothed(readings, x, cold)
        best = trial if trial.likelihood > best.likelihood + SETTLED else best
    return best


def _continued(time: np.ndarray, found: _Trajectory) -> np.ndarray:
    """Fractions with those of cold rows on lines that continue the heated rows beside them, at most 1.

    So they are linearised where they would be had the heating begun earlier, or ended later.
    """
    x = found.x.copy()
    for column, cold in zip(x.T, found.cold.T, strict=True):
        known = column.copy()
        for way in (slice(None), slice(None, None, -1)):  # forwards in time, then backwards
            clock, line, is_cold, here = np.abs(time - time[way][0])[way], known[way], cold[way], column[way]
            for end in np.flatnonzero(is_cold[2:] & ~is_cold[1:-1] & ~is_cold[:-2]) + 1:
                rows = np.arange(end + 1, len(cold))
                rows = rows[np.logical_and.accumulate(is_cold[rows])]
                rate = (line[end] - line[end - 1]) / max(clock[end] - clock[end - 1], SHORTEST)
                if rate > 0.0:
                    here[rows] = np.clip(line[end] + rate * (clock[rows] - clock[end]), 0.0, here[rows])
    return x


def _between(x: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """Fractions with those of unknown rows on straight lines between the others, shape (rows, wired)."""
    rows, x = np.arange(len(x)), x.copy()
    for column, which in zip(x.T, unknown.T, strict=True):
        if not which.all():
            column[which] = np.interp(rows[which], rows[~which], column[~which])
    return x


def _searched(readings: _Readings, x: np.ndarray, cold: np.ndarray) -> _Trajectory:
    """The likeliest trajectory that a search from fractions meets, with springs held cold in rows of a mask.

    Whenever the other springs have followed, rows whose readings contradict it are released. One of them may
    lead all others to another branch, so what is found last is not always the likeliest.
    """
    found = best = _smoothed(readings, np.where(cold, 1.0, x), cold)
    for _ in range(RELEASES):
        agrees = np.abs(found.missed) < MISSED
        if np.all(agrees | ~found.cold):
            break
        start = np.where(found.cold & ~agrees, x, found.x)
        found = _smoothed(readings, start, found.cold & agrees)
        best = max(best, found, key=_likelihood)
    return best


def _smoothed(readings: _Readings, x: np.ndarray, cold: np.ndarray) -> _Trajectory:
    """The most likely trajectory near fractions.

    Rows in which a step of the Gauss-Newton method worsens the fit are held near their fractions, and the
    step is taken anew (Levenberg-Marquardt, row by row). Unheld, steps leave even the truth: near a cold
    spring, resistances turn over with its fraction.

    The step is that of a smoother along the rows: 0.3 ms for 200 rows of two springs. The bounded
    trust-region step of `inference.least_squares` factorises a dense matrix, which takes 130 ms for as many
    fractions.
    """
    time = readings.time
    missed, slope = readings.missed(x)
    kind = kinds_of(time, missed + linear_readings(slope, x), slope, cold)
    costs = costs_of(time, x, missed, kind, cold)
    hold = np.zeros(len(time))
    for _ in range(ROUNDS):
        after, _ = smoothed(time, missed + linear_readings(slope, x), slope, kind, cold, (x, hold))
        step = np.clip(after - x, -LONGEST, LONGEST)
        trial = x + step
        found = readings.missed(trial)
        there = costs_of(time, trial, found[0], kind, cold)
        gain = np.sum(costs) - np.sum(there)
        worse = there > costs
        if gain > 0.0:
            settled = gain < SETTLED or np.max(np.abs(step)) < CLOSE
            x, (missed, slope), costs = trial, found, there
            hold = np.where(worse, hold, np.where(hold > FIRST_HOLD, hold / HELD, 0.0))
        else:
            settled = np.max(hold) > LAST_HOLD or not worse.any()
            hold = np.where(worse, np.maximum(HELD * hold, FIRST_HOLD), hold)
        if settled:
            break
    after, evidence = smoothed(time, missed + linear_readings(slope, x), slope, kind, cold)
    # the likelihood of these fractions, not of those that the tangent promises
    promised = np.sum(costs_of(time, after, missed + linear_readings(slope, x - after), kind, cold))
    turns = np.sum(cold[1:] != cold[:-1]) + np.sum(kind[1:] != kind[:-1])
    # no fraction is beyond 0 or 1: there readings miss what they would at the ends
    ends = np.sum(linear_readings(slope, x - np.clip(x, 0.0, 1.0)) ** 2, axis=1)
    ends = 0.5 * np.sum(ends[ends > MISSED**2])
    likelihood = evidence + promised - np.sum(costs) - turns * np.log(len(time)) - ends
    return _Trajectory(x, cold, missed, float(likelihood))


def _before(states: tuple[pj.SpringState, ...], history: pj.History) -> tuple[pj.SpringState, ...]:
    """Memories that each row of a history begins with."""
    begun = lambda first, later: np.append(np.asarray(first), np.asarray(later)[:-1])  # noqa: E731
    return jax.tree.map(begun, states, history.states)


@stored_jit()
def _predicted_resistances(
    actuator: pj.Actuator, rows: tuple[Array, Array, tuple, Array], wired: tuple[int, ...]
) -> tuple[Array, Array]:
    """Resistances of a history's rows, shape (rows, wired), and their slopes over the fractions of each row.

    Args:
        actuator: loaded actuator.
        rows: pressure [Pa], fractions of all springs [1], memories before the row, and the configuration.
        wired: indices of the measured springs.
    """

    def ohms_at(followed: Array, row: tuple) -> Array:
        pressure, fractions, states, root = row
        fractions = fractions.at[jnp.asarray(wired)].set(followed)
        activations = tuple(pj.MartensiteFraction(x) for x in fractions)
        problem = Problem(actuator, pressure, activations, states)
        responses = spring_responses(problem, *configuration(actuator, attached(problem, root)))
        return jnp.stack([responses[k].resistance for k in wired])

    def one(row: tuple) -> tuple[Array, Array]:
        followed = row[1][jnp.asarray(wired)]
        return ohms_at(followed, row), jax.jacfwd(ohms_at)(followed, row)

    return jax.vmap(one)(rows)
