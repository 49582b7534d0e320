"""Evidence of a model discrepancy: a smooth function of a driver, added to an output or the stiffness.

It is a Gaussian process, linear in its numbers. So one derivative of the base model serves every driver,
output and fold, and the evidence is a closed form. Drift of every recording competes with it, because what
drift explains is no physics.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, partial

import numpy as np

from ..evaluate.evaluation import Evaluation
from ..evaluate.noise import correlation_factor
from ..evaluate.program import Program
from ..fit.cross_validation import deciding
from ..fit.instrument_drift import drift_columns
from ..fit.refit import Fit, prior_sd
from ..settings import DEFAULT
from .discrepancy_places import acts, hats, responses
from .locate import distinct_drivers, knots_of

DRIFT = DEFAULT.drift
DISCREPANCY = DEFAULT.discrepancy


@dataclass(frozen=True)
class DiscrepancyEvidence:
    """Evidence of a discrepancy.

    Attributes:
        quantity: output that it adds to, or the stiffness whose relative change it is.
        driver: quantity that it is a function of; the pair is that of largest evidence.
        bayes: log Bayes factor over the model without it, deflated, less the logarithm of the number tried.
        left_out: cross-validated reduced chi-square.
        left_by_drift: reduced chi-square of fitted recordings with drift alone, of the best size.
        moved: by how much the fit's free numbers move when they are fitted beside it, scaled, (free,).
    """

    quantity: str
    driver: str
    bayes: float
    left_out: float
    left_by_drift: float
    moved: np.ndarray = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)


@dataclass(frozen=True)
class _Best:
    """The discrepancy of largest evidence.

    Attributes:
        name: place and driver.
        bayes: log Bayes factor.
        rest: misfit that it leaves, (values,).
        left_by_drift: misfit that errors of instruments alone leave, (values,).
        numbers: the numbers beside it, less the means of their priors, in units of these priors, (numbers,).
    """

    name: tuple[str, str]
    bayes: float
    rest: np.ndarray
    left_by_drift: np.ndarray
    numbers: np.ndarray


def best_discrepancy(program: Program, fit: Fit) -> DiscrepancyEvidence | None:
    """The discrepancy of largest evidence beside a fitted model; None where no driver varies.

    Args:
        program: program of the campaign.
        fit: fit of the base model, or of a model with effects. Base constants have their priors. Numbers of
            effects have Gaussian ones about their fitted values. A shape's is as wide as its prior in the
            fit, and a strength's as wide as an even distribution between its bounds.
    """
    here = program.evaluate(fit.u, fit.free, near=fit.evaluation)
    columns, drift = _columns(program, fit, here)
    if not columns:
        return None
    nominal, A, centre, spread = linearised(program, fit, here)
    sizes = [len(m) for m in here.misfit]
    fitted = np.concatenate([np.full(n, float(f)) for n, f in zip(sizes, program.fitted, strict=True)])
    errors = [(drift, DRIFT.sizes)]

    total = 0.0
    for out in deciding(program, sizes):
        test = np.concatenate(out)
        total += float(test @ _best(nominal, A, errors, columns, fitted * (1.0 - test)).rest ** 2)
    best = _best(nominal, A, errors, columns, fitted)
    count = max(program.observations(program.fitted), 1)
    bayes = _deflated(program, best, columns, sizes)
    low, high = program.unknowns.low[fit.free], program.unknowns.high[fit.free]
    moved = np.clip(centre + spread * best.numbers, low, high) - fit.u[fit.free]
    left_by_drift = float(best.left_by_drift**2 @ fitted) / count
    return DiscrepancyEvidence(*best.name, float(bayes), total / count, left_by_drift, moved)


def discrepancy_beside(
    program: Program, fit: Fit, errors: Sequence[tuple[np.ndarray, Sequence[float]]]
) -> float:
    """Log Bayes factor of the best discrepancy over errors of instruments alone; deflated, less the choice.

    Args:
        program: program of the campaign.
        fit: fit of the base model.
        errors: derivatives of the misfit by errors of unit variance, (values, errors) each, and sizes that
            are tried of them. The errors of most evidence count, with the discrepancy and without it.
    """
    here = program.evaluate(fit.u, fit.free, near=fit.evaluation)
    columns, _ = _columns(program, fit, here)
    if not columns:
        return 0.0
    nominal, A, *_ = linearised(program, fit, here)
    sizes = [len(m) for m in here.misfit]
    fitted = np.concatenate([np.full(n, float(f)) for n, f in zip(sizes, program.fitted, strict=True)])
    return _deflated(program, _best(nominal, A, errors, columns, fitted), columns, sizes)


def _deflated(
    program: Program, best: _Best, columns: dict[tuple[str, str], np.ndarray], sizes: Sequence[int]
) -> float:
    """Log Bayes factor of a discrepancy beside what it leaves, less the logarithm of the number tried.

    Args:
        program: program of the campaign.
        best: the discrepancy.
        columns: what was tried.
        sizes: number of values of each recording.
    """
    fitted = np.concatenate([np.full(n, float(f)) for n, f in zip(sizes, program.fitted, strict=True)])
    rest = best.rest * fitted
    left = float(rest @ rest) / max(program.observations(program.fitted), 1)
    inflation = max(1.0, left) * correlation_factor(np.split(rest, np.cumsum(sizes)[:-1]))
    return float(best.bayes / inflation - np.log(len(columns) * len(DISCREPANCY.lengths)))


def linearised(
    program: Program, fit: Fit, here: Evaluation
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A fitted model to first order, in numbers whose priors are of unit size; see `best_discrepancy`.

    Args:
        program: program of the campaign.
        fit: the model.
        here: its evaluation, with derivatives by its free numbers.

    Returns:
        Misfit with every number at the mean of its prior, (values,), and its derivatives, (values, free).
        Then means and sizes of these priors, scaled, (free,) each.
    """
    r, A = here.joined([np.ones(len(m)) for m in here.misfit])
    precision = prior_sd(program.unknowns, fit.free) ** -2
    own = np.isin(fit.free, program.unknowns.of(fit.slugs))
    span = (program.unknowns.high - program.unknowns.low)[fit.free]
    centre = np.where(own, fit.u[fit.free], 0.0)
    spread = 1.0 / np.sqrt(np.where(precision > 0.0, precision, 12.0 / span**2))
    return r - A @ (fit.u[fit.free] - centre), A * spread, centre, spread


def _best(
    nominal: np.ndarray,
    A: np.ndarray,
    errors: Sequence[tuple[np.ndarray, Sequence[float]]],
    columns: dict[tuple[str, str], np.ndarray],
    w: np.ndarray,
) -> _Best:
    """The discrepancy of largest evidence on values of weight 1.

    Args:
        nominal: misfit with every number at the mean of its prior, to first order, (values,).
        A: its derivatives by these numbers, whose priors are of unit size, (values, numbers).
        errors: derivatives by errors of instruments of unit variance, (values, errors) each, and sizes that
            are tried of them. The errors of most evidence count.
        columns: derivatives by values at the knots, (values, knots), by place and driver.
        w: 1 where a value counts, 0 elsewhere.
    """
    sizes = np.array(DISCREPANCY.sizes)
    highest, found, without, left_by_drift = -np.inf, None, -np.inf, nominal
    own = {name: ((B.T * w) @ B, (B.T * w) @ nominal) for name, B in columns.items()}
    for error, tried in errors:
        N = np.concatenate([A, error], axis=1)
        NW = N.T * w
        products, pulls = NW @ N, NW @ nominal  # once for all sizes
        beside = {name: (B.T * w) @ N for name, B in columns.items()}
        for size in tried:
            scale = np.concatenate([np.ones(A.shape[1]), np.full(error.shape[1], size)])
            G = np.linalg.inv(np.eye(len(scale)) + scale[:, None] * products * scale)
            pull = scale * pulls
            alone = 0.5 * (pull @ G @ pull + np.linalg.slogdet(G)[1])
            if alone > without:
                without, left_by_drift = alone, nominal - N @ (scale * (G @ pull))
            for name, B in columns.items():
                across = beside[name] * scale
                M = own[name][0] - across @ G @ across.T
                v = own[name][1] - across @ G @ pull
                for smooth in DISCREPANCY.lengths:
                    L = smooth_factor(B.shape[1], smooth)
                    values, vectors = np.linalg.eigh(L.T @ M @ L)
                    gain = np.maximum(values, 0.0) * sizes[:, None] ** 2
                    seen = (vectors.T @ (L.T @ v)) ** 2 * sizes[:, None] ** 2
                    evidence = 0.5 * np.sum(seen / (1.0 + gain) - np.log1p(gain), axis=1)
                    k = int(np.argmax(evidence))
                    if alone + evidence[k] > highest:
                        highest, found = alone + evidence[k], (name, N, scale, sizes[k] * B @ L)
    name, N, scale, discrepancy = found
    N = np.concatenate([N * scale, discrepancy], axis=1)
    NW = N.T * w
    x = np.linalg.solve(np.eye(N.shape[1]) + NW @ N, NW @ nominal)
    numbers = -x[: A.shape[1]]  # the misfit is what the model gives less what was measured
    return _Best(name, float(highest - without), nominal - N @ x, left_by_drift, numbers)


@cache
def smooth_factor(count: int, smooth: float) -> np.ndarray:
    """Lower Cholesky factor of the prior covariance of values at the knots."""
    apart = np.arange(count)[:, None] - np.arange(count)
    return np.linalg.cholesky(np.exp(-0.5 * (apart / smooth) ** 2) + 1e-6 * np.eye(count))


def _columns(
    program: Program, base: Fit, here: Evaluation
) -> tuple[dict[tuple[str, str], np.ndarray], np.ndarray]:
    """Sensitivities of the misfit to discrepancies and to drift, projected off latent trajectories.

    Returns:
        Hat functions in 1-sigmas of the noise, (values, knots), by place and driver; and drift, (values,
        cosines).
    """
    followed, places = program.followed(here), responses(program, base)
    drivers, found = distinct_drivers(program, base), {}

    def seen(columns: Callable[[int, int], np.ndarray]) -> np.ndarray:
        """Columns by number of recording and channel, of all recordings."""
        parts = []
        for k, channels in enumerate(program.channels):
            added = np.concatenate([columns(k, j) for j in range(len(channels))], axis=1)
            parts.append((followed[k].projected(added)[0] if followed[k] else added).T)
        return np.concatenate(parts)

    bent = {
        name: knots_of(np.nan_to_num(values[program.fitted]), DISCREPANCY.knots)
        for name, values in drivers.items()
    }
    for name, knots in bent.items():
        for place, response in places.items() if knots is not None else ():
            if acts(place, name, program.kind):
                whole = seen(partial(hats, program, response=response, driver=drivers[name], knots=knots))
                size = np.sqrt(np.sum(whole**2) / max(np.count_nonzero(whole.any(axis=1)), 1))
                if size > 0.0:
                    found[place, name] = whole / size
    return found, drift_columns(program, here)
