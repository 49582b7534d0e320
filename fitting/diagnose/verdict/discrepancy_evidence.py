"""A correction without a name, raced against the named ones: a smooth function of one driver, added to one
output or to the silicone's stiffness.

It is a Gaussian process, linear in its numbers, so that one derivative of the base model serves every
driver, output and fold, and its evidence is a closed form. Slow drift of every recording by itself competes
with it: what an instrument's drift explains as well is no physics.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from ..evaluate.evaluation import Evaluation
from ..evaluate.noise import lasting
from ..evaluate.program import Program
from ..fit.cross_validation import deciding
from ..fit.instrument_drift import drift_columns
from ..fit.refit import Fit
from ..settings import DEFAULT
from .discrepancy_places import acts, hats, responses
from .locate import drivers_of, knots_of

DRIFT = DEFAULT.drift
DISCREPANCY = DEFAULT.discrepancy


@dataclass(frozen=True)
class DiscrepancyEvidence:
    """How well a nameless correction explains a campaign.

    Attributes:
        quantity: output that it adds to, or the stiffness whose relative change it is; see `places`.
        driver: what it is a function of; the pair is that of largest evidence.
        bayes: log Bayes factor over the base model; the number of corrections tried is counted, and it is
            deflated by what they leave, as those of effects are.
        left_out: reduced chi-square of fitted recordings left out in turn.
        adrift: reduced chi-square of the fitted ones that slow drift alone leaves, of the best size.
    """

    quantity: str
    driver: str
    bayes: float
    left_out: float
    adrift: float


@dataclass(frozen=True)
class _Best:
    """The correction of largest evidence: name, log Bayes factor, and misfit that it leaves, (values,); and
    what drift alone leaves."""

    name: tuple[str, str]
    bayes: float
    rest: np.ndarray
    adrift: np.ndarray


def race(program: Program, base: Fit) -> DiscrepancyEvidence | None:
    """The best nameless correction of a refitted base model; None where no driver varies.

    Args:
        program: of the campaign.
        base: the base model refitted.
    """
    here = program.evaluate(base.u, base.free, near=base.evaluation)
    r, A = here.joined([np.ones(len(m)) for m in here.misfit])
    columns, drift = _columns(program, base, here)
    if not columns:
        return None
    sizes = [len(m) for m in here.misfit]
    fitted = np.concatenate([np.full(n, float(f)) for n, f in zip(sizes, program.fitted, strict=True)])
    nominal = r - A @ base.u[base.free]

    total = 0.0
    for out in deciding(program, sizes):
        test = np.concatenate(out)
        total += float(test @ _best(nominal, A, drift, columns, fitted * (1.0 - test)).rest ** 2)
    best = _best(nominal, A, drift, columns, fitted)
    count = max(program.observations(program.fitted), 1)
    rest = best.rest * fitted
    inflation = max(1.0, float(rest @ rest) / count) * lasting(np.split(rest, np.cumsum(sizes)[:-1]))
    bayes = best.bayes / inflation - np.log(len(columns) * len(DISCREPANCY.lengths))
    return DiscrepancyEvidence(
        *best.name, float(bayes), total / count, float(best.adrift**2 @ fitted) / count
    )


def _best(
    nominal: np.ndarray,
    A: np.ndarray,
    drift: np.ndarray,
    columns: dict[tuple[str, str], np.ndarray],
    w: np.ndarray,
) -> _Best:
    """The correction of largest evidence on values of weight 1, and the misfit that it leaves of all.

    Args:
        nominal: misfit of the nominal base model, to first order, (values,).
        A: its derivatives by base constants, whose priors are of unit size, (values, constants).
        drift: slow courses of unit size, (values, courses).
        columns: derivatives by a correction's values at its knots, (values, knots), by place and driver.
        w: 1 where a value counts, 0 elsewhere.
    """
    sizes = np.array(DISCREPANCY.sizes)
    highest, found, without, adrift = -np.inf, None, -np.inf, nominal
    for size in DRIFT.sizes:
        N = np.concatenate([A, size * drift], axis=1) if size else A
        NW = N.T * w
        G = np.linalg.inv(np.eye(N.shape[1]) + NW @ N)
        told = NW @ nominal
        alone = 0.5 * (told @ G @ told + np.linalg.slogdet(G)[1])
        if alone > without:
            without, adrift = alone, nominal - N @ (G @ told)
        for name, B in columns.items():
            BW = B.T * w
            across = BW @ N
            M = BW @ B - across @ G @ across.T
            v = BW @ nominal - across @ G @ told
            for smooth in DISCREPANCY.lengths:
                L = _factor(B.shape[1], smooth)
                values, vectors = np.linalg.eigh(L.T @ M @ L)
                gain = np.maximum(values, 0.0) * sizes[:, None] ** 2
                seen = (vectors.T @ (L.T @ v)) ** 2 * sizes[:, None] ** 2
                evidence = 0.5 * np.sum(seen / (1.0 + gain) - np.log1p(gain), axis=1)
                k = int(np.argmax(evidence))
                if alone + evidence[k] > highest:
                    highest, found = alone + evidence[k], (name, N, sizes[k] * B @ L)
    name, *parts = found
    N = np.concatenate(parts, axis=1)
    NW = N.T * w
    x = np.linalg.solve(np.eye(N.shape[1]) + NW @ N, NW @ nominal)
    return _Best(name, float(highest - without), nominal - N @ x, adrift)


@cache
def _factor(count: int, smooth: float) -> np.ndarray:
    """Lower factor of the prior covariance of a correction's values at its knots."""
    apart = np.arange(count)[:, None] - np.arange(count)
    return np.linalg.cholesky(np.exp(-0.5 * (apart / smooth) ** 2) + 1e-6 * np.eye(count))


def _columns(
    program: Program, base: Fit, here: Evaluation
) -> tuple[dict[tuple[str, str], np.ndarray], np.ndarray]:
    """What nameless corrections and drift do to the misfit, less what latent trajectories explain of it.

    Returns:
        Hat functions in 1-sigmas of the noise, (values, knots), by place and driver; and slow courses of
        every recording's outputs, (values, courses).
    """
    followed, places = program.followed(here), responses(program, base)
    drivers, found = drivers_of(program, base), {}

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
