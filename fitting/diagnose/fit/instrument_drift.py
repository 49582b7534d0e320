"""Evidence that instruments explain by themselves: slow drift, and noise of inputs.

A zero that drifts within its noise leaves slow misfit, which effects fit a little. Drift is a Gaussian
process of each output of each recording: a few cosines, of a size within the noise. So its evidence beside
any fitted model is a closed form.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import block_diag
from scipy.special import logsumexp

from fitting.inference.channels import Channel

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..settings import DEFAULT
from .evidence import inflation_of
from .input_noise_evidence import explained_by_input_noise
from .refit import Fit

SCORE_TEST = DEFAULT.score_test
DRIFT = DEFAULT.drift


def drift_columns(
    program: Program, here: Evaluation, size_of: Callable[[str], float] | None = None
) -> np.ndarray:
    """Sensitivities of the misfit to drift of every output, projected off latent trajectories.

    Args:
        program: program of the campaign.
        here: evaluation of its model.
        size_of: size of the drift by output, SI; None for the noise of each row.

    Returns:
        In 1-sigmas of the noise, (values, cosines). Together the cosines of a recording have this size.
    """
    followed, drift = program.followed(here), []
    for quantity in outputs_of(program):
        parts = []
        for k, channels in enumerate(program.channels):
            own = [
                _cosines(c, None if size_of is None else size_of(quantity))
                if c.quantity == quantity
                else np.zeros((SCORE_TEST.slow_cosines, len(c.measured)))
                for c in channels
            ]
            added = np.concatenate(own, axis=1)
            parts.append((followed[k].projected(added)[0] if followed[k] else added).T)
        drift.append(block_diag(*parts))
    return np.concatenate(drift, axis=1)


def outputs_of(program: Program) -> list[str]:
    """Measured outputs that no latent trajectory follows."""
    names = dict.fromkeys(c.quantity for channels in program.channels for c in channels)
    return [name for name in names if not program.follows(name)]


def _cosines(channel: Channel, size: float | None) -> np.ndarray:
    """Drift of a channel, whitened, (cosines, values); together of a size, None for that of its noise."""
    there = np.isfinite(channel.sigma)
    sizes = np.where(there, channel.sigma if size is None else size, 0.0)
    return channel.whitened(cosines(there) * sizes)


def cosines(there: Bool[np.ndarray, " rows"]) -> Float[np.ndarray, "cosines rows"]:
    """Cosines of slow drift over the rows that count, together of unit variance."""
    order = np.arange(SCORE_TEST.slow_cosines)[:, None]
    t = (np.cumsum(there) - 0.5) / max(there.sum(), 1)
    size = 1.0 / (1.0 + (DRIFT.lasting_part * np.pi * order) ** 2)
    found = np.sqrt(size / size.sum()) * np.where(order > 0, np.sqrt(2.0), 1.0) * np.cos(np.pi * order * t)
    return np.where(there, found, 0.0)


def drift_gain(program: Program, fit: Fit) -> tuple[float, float]:
    """Log-evidence that drift adds to a fitted model, its numbers following; averaged over `DRIFTS`.

    Returns:
        It, and its mean if drift of the largest size were there. A gain beyond that mean is no drift.
    """
    here = fit.evaluation
    counts = [np.full(len(m), float(f)) for m, f in zip(here.misfit, program.fitted, strict=True)]
    r, A = here.joined(counts)
    D = drift_columns(program, here) * np.concatenate(counts)[:, None]
    across = D.T @ A
    known, axes = np.linalg.eigh(D.T @ D - across @ fit.covariance @ across.T)
    known = np.maximum(known, 0.0)
    seen = (axes.T @ (D.T @ r)) ** 2
    ratio = np.square(DRIFT.sizes)[:, None] * known
    gains = 0.5 * np.sum(np.square(DRIFT.sizes)[:, None] * seen / (1.0 + ratio) - np.log1p(ratio), axis=1)
    most = 0.5 * np.sum(ratio[-1] - np.log1p(ratio[-1]))
    return float(logsumexp(gains) - np.log(len(DRIFT.sizes))), float(most)


def explained_by_drift(program: Program, current: Fit, further: Fit) -> float:
    """Log-evidence of a further effect that drift of the instruments explains as well, not deflated."""
    (before, most), (after, _) = drift_gain(program, current), drift_gain(program, further)
    return float(np.clip(before - after, 0.0, max(most, 0.0)))


def drifted_chi_square(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Reduced chi-square of recordings that were not fitted, beside the largest drift, to first order.

    It is in units of the errors of prediction: noise, drift, and the uncertainty of the fit's numbers. Chance
    makes it about 1 where there is no more than these.

    Args:
        program: program of the campaign.
        fit: model, fitted without these recordings.
        chosen: mask of the recordings.
    """
    return fit.predicted("drifted", program, chosen, lambda: _drifted_chi_square(program, fit, chosen))


def _drifted_chi_square(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """`drifted_chi_square`, not kept with the fit."""
    here = fit.evaluation
    counts = [np.full(len(m), float(one)) for m, one in zip(here.misfit, chosen, strict=True)]
    r, A = here.joined(counts)
    variances, axes = np.linalg.eigh(fit.covariance)
    uncertain = A @ (axes * np.sqrt(np.maximum(variances, 0.0)))
    drift = DRIFT.sizes[-1] * drift_columns(program, here) * np.concatenate(counts)[:, None]
    wide = np.concatenate([uncertain, drift], axis=1)
    pull = wide.T @ r
    left = r @ r - pull @ np.linalg.solve(np.eye(wide.shape[1]) + wide.T @ wide, pull)
    return float(left) / max(program.observations(chosen), 1)


def instrument_parts(program: Program, current: Fit, further: Fit) -> tuple[float, float]:
    """Evidence of a further effect that drift explains, and that noise of inputs explains, both deflated."""
    inflation = inflation_of(program, further)
    parts = explained_by_drift(program, current, further), explained_by_input_noise(program, current, further)
    return parts[0] / inflation, parts[1] / inflation
