"""The next experiment: the changed repetition of a recording that best separates two explanations.

Both fitted models predict every repetition. Differences do not count that a refit of the rival could remove,
as far as the recordings leave it free.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.specimens.rows import Rows
from pneusma_jax.numerics.safe import as_array

from ..evaluate.evaluation import with_trajectories
from ..evaluate.program import Program
from ..fit.refit import Fit
from ..settings import DEFAULT

NEXT_EXPERIMENT = DEFAULT.next_experiment


@dataclass(frozen=True)
class Design:
    """A repetition and what it is expected to bring.

    Attributes:
        recording: recording to repeat.
        change: change to make, in words.
        log_bayes: expected log Bayes factor of the one explanation over the other, if it is right and leaves
            only noise; not deflated.
    """

    recording: str
    change: str
    log_bayes: float


def best_design(program: Program, first: Fit, second: Fit) -> Design | None:
    """The repetition that best separates two explanations; None where no prediction exists.

    Args:
        program: program of the campaign.
        first: fit of the better explanation.
        second: fit of its rival.
    """
    best = None
    recorded = [with_trajectories(program.stacked, t.evaluation.trajectories) for t in (first, second)]
    both = zip(*(_changed(stacked, program.specimen.loads) for stacked in recorded), strict=True)
    for (change, stacked), (_, other) in both:
        one = program.evaluate(first.u, first.free[:0], stacked)
        two = program.evaluate(second.u, second.free, other)
        gains = [_separation(program, one, two, k, second) for k in range(len(one.misfit))]
        k = int(np.argmax(gains))
        if gains[k] > 0.0 and (best is None or gains[k] > best.log_bayes):
            best = Design(program.recordings[k].name, change, float(gains[k]))
    return best


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
    yield "ten times faster", replace(stacked, time=as_array(time / NEXT_EXPERIMENT.rate_factor))
    yield "in the reverse order", _reversed(stacked)
    if load not in stacked.inputs:
        return
    values = np.asarray(stacked.inputs[load])
    more = replace(stacked, inputs=stacked.inputs | {load: as_array(NEXT_EXPERIMENT.load_factor * values)})
    yield f"with {NEXT_EXPERIMENT.load_factor - 1:.0%} more {load}".replace("%", " %"), more
    largest = np.argmax(np.where(np.asarray(stacked.mask), np.abs(values), -1.0), axis=1)
    after = np.arange(time.shape[1])[None, :] > largest[:, None]
    yield (
        f"with the largest {load} held for five minutes",
        replace(stacked, time=as_array(time + NEXT_EXPERIMENT.pause * after)),
    )


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
