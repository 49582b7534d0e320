"""The next experiment: the changed repetition of a recording that best separates two explanations.

Both fitted models predict every repetition. Differences do not count that a refit of the rival could remove,
as far as the recordings leave it free. A repetition that no laboratory can make is not proposed. A specimen
cools as fast as its surroundings let it, and the recordings show how fast that is.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.data.recordings import schema
from fitting.inference.numbers import number
from fitting.specimens.rows import Rows
from pneusma_jax.numerics.safe import as_array
from pneusma_jax.units import from_si

from ..evaluate.evaluation import with_trajectories
from ..evaluate.program import Program
from ..fit.refit import Fit
from ..settings import DEFAULT

NEXT_EXPERIMENT = DEFAULT.next_experiment
FASTER = "ten times faster"


@dataclass(frozen=True)
class Design:
    """A repetition and what it is expected to bring.

    Attributes:
        recording: recording to repeat.
        change: change to make, in words.
        log_bayes: expected log Bayes factor of the one explanation over the other, if it is right and leaves
            only noise; not deflated.
        demand: what the repetition asks of the stand, in words; empty for a slower one.
        impossible: change that would tell more and asks for faster cooling than any recorded; empty without
            one.
    """

    recording: str
    change: str
    log_bayes: float
    demand: str = ""
    impossible: str = ""


def best_design(program: Program, first: Fit, second: Fit) -> Design | None:
    """The repetition that best separates two explanations; None where no prediction exists.

    Args:
        program: program of the campaign.
        first: fit of the better explanation.
        second: fit of its rival.
    """
    best, most, impossible = None, 0.0, ""
    recorded = [with_trajectories(program.stacked, t.evaluation.trajectories) for t in (first, second)]
    fastest = [cooling_rates(t.evaluation.drivers, program.stacked) for t in (first, second)]
    both = zip(*(_changed(stacked, program.specimen.loads) for stacked in recorded), strict=True)
    for (change, stacked), (_, other) in both:
        one = program.evaluate(first.u, first.free[:0], stacked)
        two = program.evaluate(second.u, second.free, other)
        gains = np.array([_separation(program, one, two, k, second) for k in range(len(one.misfit))])
        runs = ((one, stacked), (two, other))
        rates = [cooling_rates(run.drivers, rows)[: len(gains)] for run, rows in runs]
        possible = np.all([_possible(a, b) for a, b in zip(rates, fastest, strict=True)], axis=0)
        if gains.max() > most and not possible[np.argmax(gains)]:
            most, impossible = float(gains.max()), change
        k = int(np.argmax(np.where(possible, gains, 0.0)))
        if possible[k] and gains[k] > 0.0 and (best is None or gains[k] > best.log_bayes):
            best = Design(
                program.recordings[k].name, change, float(gains[k]), _demand(program, stacked, k, change)
            )
    return best if best is None or most <= best.log_bayes else replace(best, impossible=impossible)


def cooling_rates(drivers: Mapping[str, np.ndarray], stacked: Rows) -> np.ndarray:
    """Fastest cooling of every recording, of its temperatures and of its fractions, shape (recordings, 2).

    It is the rate over the steepest half of the largest fall of a temperature [K/s]. Of a martensite fraction
    it is that of the largest rise [1/s]. It is 0 where a recording cools too little to count. Noise of single
    rows is none.

    Args:
        drivers: drivers of the outputs by name, each of shape (recordings, rows).
        stacked: the recordings, whose clock counts.
    """
    time, mask = np.asarray(stacked.time), np.asarray(stacked.mask)
    found = np.zeros((len(time), 2))
    for name, values in drivers.items():
        if name == "temperature":
            place, sign, least = 0, -1.0, NEXT_EXPERIMENT.cooling_kelvin
        elif name.startswith("xi0"):
            place, sign, least = 1, 1.0, NEXT_EXPERIMENT.cooling_fraction
        else:
            continue
        for k in range(len(time)):
            there = mask[k] & np.isfinite(values[k])
            rate = _steepest_rise(time[k][there], sign * np.asarray(values[k])[there], least)
            found[k, place] = max(found[k, place], rate)
    return found


def _steepest_rise(time: np.ndarray, values: np.ndarray, least: float) -> float:
    """Rate over the fastest half of the largest rise of a series [1/s]; 0 where that is less than `least`.

    It is infinite where no clock passes during the rise. The time is that of sorting the rows.
    """
    if len(values) < 2:
        return 0.0
    largest = float(np.max(values - np.minimum.accumulate(values)))
    if largest < least:
        return 0.0
    moments, at = np.unique(time, return_inverse=True)
    lows, highs = np.full(len(moments), np.inf), np.full(len(moments), -np.inf)
    np.minimum.at(lows, at, values)
    np.maximum.at(highs, at, values)
    shortest, starts = np.inf, deque[int]()
    for end, (low, high) in enumerate(zip(lows, highs, strict=True)):
        while starts and high - lows[starts[0]] >= 0.5 * largest:
            # From here no later end is nearer.
            shortest = min(shortest, float(moments[end] - moments[starts.popleft()]))
        while starts and lows[starts[-1]] >= low:
            starts.pop()  # a later start that is lower is nearer to whatever follows
        starts.append(end)
    return float(0.5 * largest / shortest) if np.isfinite(shortest) else np.inf


def _possible(rates: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """Mask of the repetitions that cool no faster than any recording did."""
    return np.all(rates <= NEXT_EXPERIMENT.cooling_factor * recorded.max(axis=0), axis=1)


def _demand(program: Program, stacked: Rows, k: int, change: str) -> str:
    """What a repetition asks of the stand, in words: a faster one its speed, a larger load its maximum."""
    load = program.specimen.loads
    column = schema.column_of(program.recordings[k].kind, load)
    if load not in stacked.inputs or column is None or change not in (FASTER, _more(load)):
        return ""
    unit = schema.quantity_and_unit(column)[1]
    there = np.asarray(stacked.mask)[k]
    values, time = np.asarray(stacked.inputs[load])[k][there], np.asarray(stacked.time)[k][there]
    if change == FASTER:
        steps = np.abs(np.diff(values))[np.diff(time) > 0.0] / np.diff(time)[np.diff(time) > 0.0]
        speed = from_si(float(np.max(steps, initial=0.0)), unit, difference=True)
        return f"if the stand reaches {number(speed)} {unit}/s" if speed > 0.0 else ""
    largest = from_si(float(np.max(np.abs(values))), unit)
    return f"up to {number(largest)} {unit}, if the specimen bears it"


def _separation(program: Program, one: object, two: object, k: int, rival: Fit) -> float:
    """Half the squared distance of two predictions of recording k that the rival's freedom leaves."""
    both = zip(one.predicted[k], two.predicted[k], program.channels[k], strict=True)
    if any(not np.all(np.isfinite((a + b)[np.isfinite(c.sigma)])) for a, b, c in both):
        return 0.0
    d, J = two.misfit[k] - one.misfit[k], two.jacobian[k].T
    if program.process_noise.shape[1]:  # a latent trajectory would follow another resistance
        readings = program.specimen.latent.readings
        counts = [np.full(len(c.measured), c.quantity not in readings) for c in program.channels[k]]
        d, J = d * np.concatenate(counts), J * np.concatenate(counts)[:, None]
    precision = np.linalg.inv(rival.covariance + 1e-12 * np.eye(len(rival.free)))
    step = np.linalg.solve(J.T @ J + precision, J.T @ d)
    return 0.5 * float(d @ (d - J @ step))


def _changed(stacked: Rows, load: str) -> Iterator[tuple[str, Rows]]:
    """Repetitions in words and as rows of the same shape; `load` is the input that may be made larger."""
    time = np.asarray(stacked.time)
    yield "ten times slower", replace(stacked, time=as_array(time * NEXT_EXPERIMENT.rate_factor))
    yield FASTER, replace(stacked, time=as_array(time / NEXT_EXPERIMENT.rate_factor))
    yield "in the reverse order", _reversed(stacked)
    if load not in stacked.inputs:
        return
    values = np.asarray(stacked.inputs[load])
    more = replace(stacked, inputs=stacked.inputs | {load: as_array(NEXT_EXPERIMENT.load_factor * values)})
    yield _more(load), more
    largest = np.argmax(np.where(np.asarray(stacked.mask), np.abs(values), -1.0), axis=1)
    after = np.arange(time.shape[1])[None, :] > largest[:, None]
    yield (
        f"with the largest {load} held for five minutes",
        replace(stacked, time=as_array(time + NEXT_EXPERIMENT.pause * after)),
    )


def _more(load: str) -> str:
    """The change to a larger load, in words."""
    return f"with {NEXT_EXPERIMENT.load_factor - 1:.0%} more {load}".replace("%", " %")


def _reversed(stacked: Rows) -> Rows:
    """Drivers of every recording, last row first; the clock runs on."""
    mask = np.asarray(stacked.mask)
    count, size = mask.sum(axis=1), mask.shape[1]
    place = np.arange(size)[None, :]
    back = np.where(place < count[:, None], count[:, None] - 1 - place, place)

    def turn(leaf: jax.Array) -> jax.Array:
        leaf = np.asarray(leaf)
        if leaf.ndim != 2 or leaf.shape != mask.shape:
            return as_array(leaf)
        return as_array(np.take_along_axis(leaf, back, axis=1))

    turned = jax.tree.map(turn, (stacked.inputs, stacked.extra))
    for name, column in turned[1].items():
        if name.startswith("correlation_"):  # with the row before, which was the one after
            turned[1][name] = jnp.roll(column, 1, axis=1)
    return eqx.tree_at(lambda r: (r.inputs, r.extra), stacked, turned)
