"""Log Bayes factors of fitted models, by Laplace's approximation, deflated by misfit and correlation."""

import numpy as np
from scipy.special import gammaln

from ..evaluate.noise import correlation_factor
from ..evaluate.program import Program
from ..settings import DEFAULT
from .refit import Fit, absent, at_its_bound, prior_sd

SCALING = DEFAULT.scaling
EVIDENCE = DEFAULT.evidence


def inflation_of(program: Program, fit: Fit) -> float:
    """Inflation of variances: reduced chi-square of a model times its serial-correlation factor."""
    left = 2.0 * fit.objective / max(program.observations(program.fitted), 1)
    return max(1.0, left) * correlation_factor(
        fit.evaluation.misfit[k] for k in np.flatnonzero(program.fitted)
    )


def log_likelihood(program: Program, gained: float, inflation: float = 1.0) -> float:
    """Log-likelihood of a gain in the reduced chi-square of fitted recordings, deflated like evidence."""
    return 0.5 * program.observations(program.fitted) * gained / inflation


def effective_degrees_of_freedom(program: Program, fit: Fit) -> float:
    """Effective degrees of freedom of latent trajectories in the fitted recordings.

    Each more of them explains half a unit of log-likelihood by chance.
    """
    return float(program.freedom_of_trajectories(fit.evaluation)[program.fitted].sum())


def evidence(
    program: Program, current: Fit, further: Fit, inflation: float, followed: float | None = None
) -> float:
    """Log Bayes factor of a model with further effects over one without them; misfit counts by 1 / inflation.

    Models can be compared under one inflation only. An effect that ended at its neutral value has no
    evidence.

    Args:
        program: program of the campaign.
        current: model without the effects.
        further: model with them.
        inflation: inflation of variances [1], see `inflation_of`.
        followed: effective degrees of freedom of the current model's trajectories, if they are known.
    """
    followed = effective_degrees_of_freedom(program, current) if followed is None else followed
    added = [slug for slug in further.slugs if slug not in current.slugs]
    luck = 0.5 * max(effective_degrees_of_freedom(program, further) - followed, 0.0)
    gain = (current.objective - further.objective - luck) / inflation
    known = len(program.unknowns.slugs)
    penalty = log_sets(known, len(current.slugs) + len(added)) - log_sets(known, len(current.slugs))
    penalty += EVIDENCE.minimum_first * sum(at_its_bound(further, slug) for slug in added)
    found = gain + _occam(program, current, further, added, inflation) - penalty
    nothing = any(absent(program.unknowns, further, slug) for slug in added)
    return min(found, 0.0) if nothing else found


def log_sets(effects: int, size: int) -> float:
    """Logarithm of the number of sets of a size among so many effects; 0 for none."""
    size = min(size, effects)
    return float(gammaln(effects + 1) - gammaln(size + 1) - gammaln(effects - size + 1))


def _occam(program: Program, current: Fit, further: Fit, added: list[str], inflation: float) -> float:
    """Occam factor of added effects, by Laplace's approximation; information counts by 1 / inflation.

    Each of several strengths of an effect is absent with a probability of one half. So an unneeded strength
    costs no more than that.
    """
    own, items = program.unknowns.of(added), program.unknowns.items
    before, after = (information(program, fit, inflation) for fit in (current, further))
    total = 0.5 * (np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])
    present = 0.5 * np.log(2.0 * np.pi)
    shape = SCALING.shape_deviation * np.sqrt(2.0 * np.pi)
    widths = {int(k): shape if items[k].shape else items[k].high - items[k].low for k in own}
    total += sum(present - np.log(width) for width in widths.values())
    place = {int(k): n for n, k in enumerate(further.free)}
    away = further.u[further.free] - program.unknowns.neutral[further.free]
    for slug in added:
        strengths = [k for k in program.unknowns.of([slug]) if not items[k].shape]
        if len(strengths) < 2:
            continue
        wanted = {place[int(k)]: np.log(widths[k]) - present for k in strengths}
        total += _spared(np.linalg.inv(after), away, wanted)
        total -= len(strengths) * np.log(2.0)
    return min(total, 0.0)


def information(program: Program, fit: Fit, inflation: float) -> np.ndarray:
    """Information of recordings and priors about a fit's free numbers, (free, free); misfit counts by 1 /
    inflation. The prior of a strength is even between its bounds."""
    unknowns, prior = program.unknowns, prior_sd(program.unknowns, fit.free) ** -2
    seen = np.linalg.inv(fit.covariance) - np.diag(prior)
    span = unknowns.high[fit.free] - unknowns.low[fit.free]
    widest = np.where(prior > 0.0, prior, 12.0 / span**2)
    return seen / inflation + np.diag(widest)


def _spared(covariance: np.ndarray, away: np.ndarray, cost: dict[int, float]) -> float:
    """Log evidence that leaving out strengths saves, to second order: one after the other, all but one.

    Args:
        covariance: covariance of the free numbers, (numbers, numbers).
        away: distance of each number from its absence, (numbers,).
        cost: cost of a strength's prior, by its place among the numbers.
    """
    C, d, left, saved, best = covariance.copy(), away.copy(), dict(cost), 0.0, 0.0
    while len(left) > 1:
        gains = {j: c - 0.5 * d[j] ** 2 / C[j, j] - 0.5 * np.log(C[j, j]) for j, c in left.items()}
        j = max(gains, key=gains.get)
        saved += gains[j]
        best = max(best, saved)
        d = d - C[:, j] * d[j] / C[j, j]
        C = C - np.outer(C[:, j], C[j]) / C[j, j]
        del left[j]
    return best
