"""Martensite fractions of an actuator's springs from their measured resistances, all rows together.

The fractions change slowly and the resistances are noisy. So the trajectory of all fractions is smoothed
about the answer of the whole actuator. A heated spring pulls the other one longer, and both resistances
change. A row by itself may have several equilibria or, with noise, none. A trajectory has one most likely
solution.
"""

from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.inference.noise import robust_noise
from pneusma_jax.actuator.balance import Problem, configuration, spring_responses
from pneusma_jax.actuator.root_find import attached
from pneusma_jax.program_cache import stored_jit

ROUNDS = 12
"""Maximum number of linearisations. Most recordings take three to six."""
CLOSE = 1e-4
"""Maximum change of a fraction at which the rounds end [1]."""
LONGEST = 0.1
"""Maximum step of a fraction in a round [1]. Near full heat the tangent is almost flat, and a full step would
leave its range of validity."""
SHARES = (1.0, 0.3, 0.1, 0.03)
"""Shares of a step that are tried, the longest first [1]."""
SETTLED = 0.1
"""Improvement of half the sum of squares below which the rounds end [1]; noise changes it by more."""
NEARLY = (0.05, 0.01)
"""Heats below which a spring is tried as cold [1]. On branches beside cold springs, these were heated by
0.003 to 0.05."""
LEAST_NOISE = 2e-6
"""Minimum relative noise of a resistance; files keep no smaller digits."""
WANDER = 10.0 ** np.arange(-9.0, 0.0, 1.0)
"""Candidate variances of a fraction's change [1/s], from a cold spring, which stays, to one heated in
seconds."""
FIRST = 1.0
"""Variance of a fraction before the first reading [1], when it is unknown."""


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
    wired = sorted(measured)
    rows = len(time)
    read = np.stack([measured[k] for k in wired], axis=1)
    noise = np.array([max(robust_noise(time, r), LEAST_NOISE * np.median(r)) for r in read.T])
    begun = np.stack([np.broadcast_to(np.asarray(given[k].value), rows) for k in wired], axis=1)
    starts = [begun]
    for column in range(len(wired)):  # noise may have heated a spring that is cold throughout
        cold = begun.copy()
        cold[:, column] = 1.0
        starts += [cold] if np.min(begun[:, column]) < 1.0 - CLOSE else []
    smoothed = lambda x: _smoothed(actuator, time, pressure, read, noise, x, wired, given, states)  # noqa: E731
    best = max(map(smoothed, starts), key=lambda one: one[1])
    for heat in NEARLY:
        for colder in _nearly_cold(best[0], heat):
            best = max(best, smoothed(colder), key=lambda one: one[1])
    return list(_with_fractions(given, wired, np.clip(best[0], 0.0, 1.0)))


def _nearly_cold(x: np.ndarray, heat: float) -> list[np.ndarray]:
    """Fractions with the nearly cold rows of all springs, and of each, made cold; shape (rows, wired) each.

    Beside a cold spring lies another branch, on which it is slightly heated: a search for small changes goes
    along either.
    """
    cold = np.where(x > 1.0 - heat, 1.0, x)
    springs = np.arange(x.shape[1])
    each = [np.where(springs == k, cold, x) for k in springs] if len(springs) > 1 else []
    return [one for one in [cold, *each] if np.any(one != x)]


def _smoothed(
    actuator: pj.Actuator,
    time: np.ndarray,
    pressure: np.ndarray,
    read: np.ndarray,
    noise: np.ndarray,
    x: np.ndarray,
    wired: Sequence[int],
    given: Sequence[pj.MartensiteFraction],
    states: tuple[pj.SpringState, ...],
) -> tuple[np.ndarray, float]:
    """Fractions of the measured springs from a start, shape (rows, wired), and their log-likelihood.

    Steps of the Gauss-Newton method are shortened until they improve the fit. Unshortened, they leave even
    the truth: near a cold spring, resistances turn over with its fraction.
    """

    def told(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Resistances over their noise, and their slopes, at fractions."""
        inside = np.clip(x, 0.0, 1.0)
        fractions = _with_fractions(given, wired, inside)
        history = pj.simulate_history(actuator, pressure, fractions, states)
        found = _predicted_resistances(actuator, pressure, fractions, states, history, tuple(wired))
        ohms, slope = (np.asarray(part) for part in found)
        good = np.all(np.isfinite(slope), axis=(1, 2)) & np.all(np.isfinite(ohms), axis=1)
        ohms, slope = np.where(good[:, None], ohms, read), np.where(good[:, None, None], slope, 0.0)
        # beyond its ends a fraction is continued, so that noise about a cold spring does not heat it
        ohms = ohms + np.einsum("tij,tj->ti", slope, x - inside)
        return ohms / noise, slope / noise[:, None]

    ohms, slope = told(x)
    along = lambda x: np.einsum("tij,tj->ti", slope, x)  # noqa: E731
    wander = _process_noise_of(time, read / noise - ohms + along(x), slope)
    least = _unlikely(time, x, read / noise - ohms, wander)
    for _ in range(ROUNDS):
        target = read / noise - ohms + along(x)
        after, likelihood = _smooth(time, target, slope, wander)
        # the likelihood of these fractions, not of those that the tangent promises
        likelihood += _unlikely(time, after, target - along(after), wander) - least
        step = np.clip(after - x, -LONGEST, LONGEST)
        for share in SHARES:
            trial = x + share * step
            found = told(trial)
            there = _unlikely(time, trial, read / noise - found[0], wander)
            if there < least:
                break
        else:
            break
        settled = least - there < SETTLED or share * np.max(np.abs(step)) < CLOSE
        x, (ohms, slope), least = trial, found, there
        if settled:
            break
    return x, likelihood


def _unlikely(time: np.ndarray, x: np.ndarray, missed: np.ndarray, wander: np.ndarray) -> float:
    """Half the sum of squares of what readings miss, and of the walk's steps in units of their deviation.

    Args:
        time: time [s], shape (n,).
        x: fractions [1], shape (n, m).
        missed: readings less predictions, in units of their noise, shape (n, m).
        wander: variance of each fraction's change [1/s], shape (m,).
    """
    steps, changes = np.diff(time)[:, None], np.diff(x, axis=0)
    walked = np.sum(changes**2 / (wander * np.maximum(steps, 1e-9)))
    return 0.5 * float(np.sum(missed**2) + walked + np.sum((x[0] - 0.5) ** 2) / FIRST)


def _with_fractions(
    given: Sequence[pj.MartensiteFraction], wired: Sequence[int], x: np.ndarray
) -> tuple[pj.MartensiteFraction, ...]:
    """Activations with the fractions of the measured springs replaced."""
    fractions = list(given)
    for column, k in enumerate(wired):
        fractions[k] = pj.MartensiteFraction(x[:, column])
    return tuple(fractions)


@stored_jit()
def _predicted_resistances(
    actuator: pj.Actuator,
    pressure: Array,
    given: tuple[pj.MartensiteFraction, ...],
    states: tuple[pj.SpringState, ...],
    history: pj.History,
    wired: tuple[int, ...],
) -> tuple[Array, Array]:
    """Resistances of a history, shape (rows, wired), and their slopes over the fractions of each row."""
    rows = jnp.shape(pressure)[0]
    whole = jnp.stack([jnp.broadcast_to(a.value, (rows,)) for a in given], axis=1)
    begun = lambda first, later: jnp.concatenate([jnp.broadcast_to(first, (1,)), later[:-1]])  # noqa: E731
    before = jax.tree.map(begun, states, history.states)

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

    return jax.vmap(one)((jnp.asarray(pressure), whole, before, history.rows.unknowns))


def _process_noise_of(time: np.ndarray, target: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Most likely variance of each fraction's change [1/s], one spring after the other, twice."""
    count = target.shape[1]
    wander = np.full(count, 1e-4)
    for _ in range(2):
        for k in range(count):
            trials = np.repeat(wander[None], len(WANDER), axis=0)
            trials[:, k] = WANDER
            wander = trials[int(np.argmax([_smooth(time, target, slope, w)[1] for w in trials]))]
    return wander


def _smooth(
    time: np.ndarray, target: np.ndarray, slope: np.ndarray, wander: np.ndarray
) -> tuple[np.ndarray, float]:
    """Kalman filter and Rauch-Tung-Striebel smoother of a random walk.

    Args:
        time: time [s], ascending, shape (n,).
        target: readings in units of their noise, shape (n, m).
        slope: slope of the readings over the fractions, shape (n, m, m).
        wander: variance of each fraction's change [1/s], shape (m,).

    Returns:
        Fractions, shape (n, m), and the log-likelihood of the readings.
    """
    rows, count = target.shape
    steps = np.diff(time, prepend=time[0])
    unit = np.eye(count)
    means, variances = np.empty((rows, count)), np.empty((rows, count, count))
    mean, variance, likelihood = np.full(count, 0.5), FIRST * unit, 0.0
    for t in range(rows):
        variance = variance + np.diag(wander * steps[t])
        H = slope[t]
        spread = H @ variance @ H.T + unit
        surprise = target[t] - H @ mean
        gain = np.linalg.solve(spread, H @ variance).T
        mean = mean + gain @ surprise
        variance = variance - gain @ H @ variance
        variance = 0.5 * (variance + variance.T)
        likelihood -= 0.5 * (surprise @ np.linalg.solve(spread, surprise) + np.log(np.linalg.det(spread)))
        means[t], variances[t] = mean, variance
    smooth = means.copy()
    for t in range(rows - 2, -1, -1):
        ahead = variances[t] + np.diag(wander * steps[t + 1])
        gain = np.linalg.solve(ahead + 1e-300 * unit, variances[t]).T
        smooth[t] = means[t] + gain @ (smooth[t + 1] - means[t])
    return smooth, float(likelihood)
