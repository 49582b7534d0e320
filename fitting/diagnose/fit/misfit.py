"""Misfit of a fitted model, what noise explains of it, and how much chance makes."""

import numpy as np

from fitting.inference.noise import within_accuracy

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..settings import DEFAULT
from .refit import Fit

CHANCE = DEFAULT.chance
SHARE = DEFAULT.share


def reduced(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Chi-square per measured value of some recordings, given by a mask."""
    return fit.evaluation.chi2(chosen.astype(float)) / max(program.observations(chosen), 1)


def relative_errors(
    program: Program, evaluation: Evaluation, quantity: str = "", factor: float = 1.0, still: float = np.inf
) -> np.ndarray:
    """Largest root mean square error of an output over its range in each recording [1], (recordings,).

    Infinite where the model has no answer in a row that was read.

    Args:
        program: program of a campaign.
        evaluation: its model.
        quantity: output whose readings are multiplied by `factor` before they are compared.
        factor: not 0.
        still: error of an output that does not vary.
    """
    found = []
    for channels, predicted in zip(program.channels, evaluation.predicted, strict=True):
        shares = [0.0]
        for channel, values in zip(channels, predicted, strict=True):
            there = np.isfinite(channel.sigma)
            if there.any():
                measured = channel.measured[there] * (factor if channel.quantity == quantity else 1.0)
                error = np.sqrt(np.mean((values[there] - measured) ** 2))
                reach = np.ptp(measured)
                shares.append(error / reach if reach > 0.0 else still)
        found.append(np.max(np.nan_to_num(shares, nan=np.inf)))
    return np.array(found)


def relative_error(program: Program, fit: Fit) -> float:
    """Root mean square error of an output over its range in a recording [1]: the largest of all recordings.

    Each recording counts by itself: a long one does not hide what a short one shows. See `relative_errors`.
    """
    return float(np.max(relative_errors(program, fit.evaluation), initial=0.0))


def accurate(program: Program, fit: Fit) -> bool:
    """True if nobody states any noise, and a model misses its outputs by less than usual instruments do.

    The noise of neighbouring readings says nothing about an instrument's accuracy. Recordings for validation
    are to be met as well.
    """
    return within_accuracy(relative_error(program, fit), not program.noise_unstated)


def range_of(program: Program, quantity: str) -> float:
    """Range of the values of an output that count, over all recordings, SI; 0 where there are none."""
    read = [c for channels in program.channels for c in channels if c.quantity == quantity]
    every = np.concatenate([np.zeros(0), *(c.measured[np.isfinite(c.sigma)] for c in read)])
    return float(np.ptp(every)) if every.size else 0.0


def scored(program: Program) -> tuple[np.ndarray, np.ndarray]:
    """Masks of fitted and of scored recordings: the fitted ones again where none is for validation."""
    return program.fitted, program.unseen if np.any(program.unseen) else program.fitted


def spread(program: Program, chosen: np.ndarray) -> float:
    """Standard deviation of the reduced chi-square of some recordings by chance."""
    return float(np.sqrt(2.0 / max(program.observations(chosen), 1)))


def limit_of(program: Program, chosen: np.ndarray) -> float:
    """Reduced chi-square of some recordings up to which nothing counts as left over."""
    return 1.0 + max(SHARE.alike, CHANCE.deviations * spread(program, chosen))


def floor(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Chi-square per measured value that noise explains: 1, or that of second differences of the misfit.

    Noise that grows with its signal leaves more in recordings of large signals. Physics leaves slow misfit.
    """
    steps = [np.zeros(0)]
    for k in np.flatnonzero(chosen):
        first = 0
        for channel in program.channels[k]:
            size = len(channel.measured)
            r = fit.evaluation.misfit[k][first : first + size][np.isfinite(channel.sigma)]
            steps.append(np.diff(r, 2) ** 2 / 6.0)
            first += size
    total = float(np.sum(np.concatenate(steps)))
    return max(1.0, total / max(program.observations(chosen), 1))
