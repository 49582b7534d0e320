"""Score test of every effect against the residuals of a fitted model, calibrated over all effects.

The sensitivity of an effect is the derivative of the outputs at its absence, projected off the base
constants. Several shapes are tried where it depends on a shape (a threshold, a time constant). Where the
derivative vanishes, the change by a typical effect replaces it.

Residuals include the deviations of the base constants from nominal, because each prior is a row like a
measured one. So an effect that brings the constants back scores as well as one that removes misfit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np
from scipy.stats import chi2

from fitting.inference.noise import GAUSSIAN_MAD
from fitting.inference.parallel import run_parallel

from ..evaluate.evaluation import Evaluation
from ..evaluate.unknowns import Unknowns
from ..settings import DEFAULT
from .refit import Fit, Refitter, largest_deviation

OPTIMISER = DEFAULT.optimiser
SCORE_TEST = DEFAULT.score_test


@dataclass(frozen=True)
class Score:
    """Score of one effect.

    Attributes:
        slug: effect.
        gain: decrease of chi-square along its sensitivity, at the best shape.
        freedom: numbers that it takes.
        p_value: of such a gain by chance, at that shape alone.
        start: scaled numbers from which to fit it.
        strength: length of its sensitivity for a typical effect, in standard deviations.
    """

    slug: str
    gain: float
    freedom: int
    p_value: float
    start: np.ndarray
    strength: float


@dataclass(frozen=True)
class ScoreTest:
    """All scores, strongest first, and the p-value of the strongest.

    Attributes:
        scores: of every effect that these recordings can show.
        p_value: of the strongest by chance, all effects, shapes and slow cosines counted.
        p_is_bound: no simulated null was as strong.
        untestable: slugs of effects that these recordings do not show.
        scale: standard deviation of fast residuals; above 1 where the noise is larger than stated.
        tried: slugs of all effects that were asked for.
    """

    scores: list[Score]
    p_value: float
    p_is_bound: bool
    untestable: list[str]
    scale: float
    tried: tuple[str, ...]


@dataclass(frozen=True)
class _Sensitivities:
    """Residuals and all sensitivities about one point.

    Attributes:
        here: the evaluation.
        project: projects sensitivities off the base constants.
        scale: see `ScoreTest`.
        left: projected residuals, in units of `scale`.
        tried: slug, orthonormal directions, start, indices.
        strength: longest sensitivity of every effect.
    """

    here: Evaluation
    project: "_Projector"
    scale: float
    left: np.ndarray
    tried: list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]
    strength: dict[str, float]


class _Projector:
    """Projects sensitivities off the free numbers of a fit, whose priors count as rows.

    Args:
        A: derivatives of the measured rows by those numbers, (rows, numbers).
        sd: standard deviations of their priors, infinite where flat.
    """

    def __init__(self, A: np.ndarray, sd: np.ndarray):
        self.A = np.concatenate([A, np.diag(1.0 / sd)])
        size = np.linalg.norm(self.A, axis=0)
        size[size == 0.0] = 1.0
        scaled = self.A / size  # columns may be zero or alike where recordings do not tell numbers apart
        self.H = np.linalg.pinv(scaled.T @ scaled, OPTIMISER.alike_share, hermitian=True) / np.outer(
            size, size
        )
        self.rows = len(A)

    def __call__(self, J: np.ndarray, priors: np.ndarray | None = None) -> np.ndarray:
        """Projected columns (rows, n), then rows of the priors (zero if None), (rows + numbers, n)."""
        if priors is None:
            priors = np.zeros((len(self.A) - self.rows, J.shape[1]))
        whole = np.concatenate([J, priors])
        return whole - self.A @ (self.H @ (self.A.T @ whole))


def score_effects(refitter: Refitter, fit: Fit, slugs: Sequence[str], rng: np.random.Generator) -> ScoreTest:
    """Score every effect against a fit.

    Args:
        refitter: of the campaign.
        fit: model to improve.
        slugs: effects to try; those of the fit are left out.
        rng: of the simulated nulls.
    """
    slugs, weight = [slug for slug in slugs if slug not in fit.slugs], refitter.weight
    look = _sensitivities_about(refitter, fit, slugs)
    scores, pool = _scores(look)
    pool.append((None, _slow_cosines(look.here, weight, look.project)))
    p_value, bound = _p_value(pool, look.left, rng)
    untestable = [slug for slug in slugs if look.strength[slug] < SCORE_TEST.minimum_length]
    return ScoreTest(scores, p_value, bound, untestable, look.scale, tuple(slugs))


def about_nominal(refitter: Refitter, fit: Fit, found: ScoreTest) -> list[Score]:
    """Scores about nominal base constants, strongest first; empty where the constants of the fit are near.

    Far from nominal a true effect may seem to act the wrong way.
    """
    if largest_deviation(refitter.unknowns, fit) < SCORE_TEST.far_from_nominal:
        return []
    nominal = replace(fit, u=refitter.unknowns.at_nominal(fit.u))
    by_slope, whole = _scores(_sensitivities_about(refitter, nominal, found.tried))[0], []
    if (
        not fit.slugs and not refitter.program.process_noise.shape[1]
    ):  # 100 runs; 200 where each searches for trajectories
        whole = _whole_effects(refitter, nominal, found.tried, found.scale)
    return _interleaved(by_slope, whole)


def _whole_effects(refitter: Refitter, fit: Fit, slugs: Sequence[str], scale: float) -> list[Score]:
    """Scores by the change of chi-square with typical effects while nothing else moves, strongest first."""
    program, unknowns, nothing = refitter.program, refitter.unknowns, fit.free[:0]
    low, high = unknowns.low, unknowns.high

    def left(u: np.ndarray) -> float:
        r, _ = program.evaluate(u, nothing, near=fit.evaluation).joined(refitter.weight)
        return float(r @ r)

    jobs = []
    for slug in slugs:
        own = unknowns.amplitudes(slug)
        typical = np.array([unknowns.items[k].start for k in own])
        for share in [sign * part for part in SCORE_TEST.whole_effects for sign in (1.0, -1.0)]:
            u = fit.u.copy()
            u[own] = np.clip(share * typical, low[own], high[own])
            if np.any(u[own] != unknowns.neutral[own]):
                jobs.append((slug, u))
    before, *after = run_parallel(left, [fit.u, *(u for _, u in jobs)])
    best: dict[str, Score] = {}
    for (slug, u), remains in zip(jobs, after, strict=True):
        gain, freedom = (before - remains) / scale**2, len(unknowns.amplitudes(slug))
        if gain > (best[slug].gain if slug in best else 0.0):
            best[slug] = Score(slug, gain, freedom, float(chi2.sf(gain, freedom)), u, np.nan)
    return sorted(best.values(), key=lambda s: -s.gain)


def _interleaved(*lists: Sequence[Score]) -> list[Score]:
    """The first of every list, the second of every list, and so on; each effect once."""
    found: dict[str, Score] = {}
    for row in zip_longest(*lists):
        for score in row:
            if score is not None:
                found.setdefault(score.slug, score)
    return list(found.values())


def _sensitivities_about(refitter: Refitter, fit: Fit, slugs: Sequence[str]) -> _Sensitivities:
    """The sensitivities of effects about the numbers of a fit."""
    program, unknowns, weight = refitter.program, refitter.unknowns, refitter.weight
    here = program.evaluate(fit.u, fit.free, near=fit.evaluation)
    r, A = here.joined(weight)
    departure, sd = refitter._prior(fit.u, fit.free)
    movable = ~np.isin(fit.free, _at_bound(unknowns, fit))
    project = _Projector(A[:, movable], sd[movable])
    scale = _noise_scale(here, weight)
    left = project(r[:, None], (departure / sd)[movable, None])[:, 0] / scale
    tried: list[tuple[str, np.ndarray, np.ndarray, np.ndarray]] = []  # slug, Q, start u, indices
    strength = dict.fromkeys(slugs, 0.0)
    shaped = [slug for slug in slugs if unknowns.shapes(slug).size]
    for number, u in enumerate(_shapes(refitter, fit, slugs)):
        members = shaped if number else slugs
        if not members:
            break
        columns = np.concatenate([unknowns.amplitudes(slug) for slug in members]).astype(int)
        _, J = program.evaluate(u, columns, near=fit.evaluation).joined(weight)  # trajectories as of A
        for slug in members:
            own = unknowns.amplitudes(slug)
            tried += _directions(refitter, slug, own, J[:, np.isin(columns, own)], project, u, left, strength)
    for slug in [s for s in slugs if strength[s] < SCORE_TEST.minimum_length]:
        u = fit.u.copy()
        own = unknowns.of([slug])
        u[own] = [unknowns.items[k].start for k in own]
        change = program.evaluate(u, own[:0], near=fit.evaluation).joined(weight)[0] - r
        sensitivity = project(change[:, None])
        strength[slug] = float(np.linalg.norm(sensitivity))
        if strength[slug] >= SCORE_TEST.minimum_length:
            tried.append((slug, sensitivity / strength[slug], u, own))
    return _Sensitivities(here, project, scale, left, tried, strength)


def _at_bound(unknowns: Unknowns, fit: Fit) -> np.ndarray:
    """Indices of base constants that ended at a bound: those absorb no more."""
    base = unknowns.base
    return base[
        (fit.u[base] <= unknowns.low[base] + OPTIMISER.negligible_distance)
        | (fit.u[base] >= unknowns.high[base] - OPTIMISER.negligible_distance)
    ]


def _shapes(refitter: Refitter, fit: Fit, slugs: Sequence[str]) -> list[np.ndarray]:
    """Points that differ from the fit in the shapes of absent effects only."""
    unknowns, points = refitter.unknowns, []
    rng = np.random.default_rng(0)
    for number in range(SCORE_TEST.shapes):
        u = fit.u.copy()
        for slug in slugs:
            shapes = unknowns.shapes(slug)
            u[unknowns.amplitudes(slug)] = 0.0
            for place, k in enumerate(shapes):
                share = (
                    (number if place == 0 else rng.permutation(SCORE_TEST.shapes)[number]) + 0.5
                ) / SCORE_TEST.shapes
                item = unknowns.items[k]
                u[k] = item.at_share(share) if number else item.start
        points.append(u)
    return points


def _directions(
    refitter: Refitter,
    slug: str,
    own: np.ndarray,
    J: np.ndarray,
    project: _Projector,
    u: np.ndarray,
    left: np.ndarray,
    strength: dict[str, float],
) -> list[tuple]:
    """Directions of an effect's sensitivity at one shape, within its bounds."""
    unknowns = refitter.unknowns
    P = project(J)
    lengths = np.linalg.norm(P, axis=0)
    kept = lengths > SCORE_TEST.minimum_length
    if not kept.any():
        return []
    strength[slug] = max(strength[slug], float(lengths.max()))
    own, P = own[kept], P[:, kept]
    for _ in range(len(own)):
        H = P.T @ P
        step = -np.linalg.solve(H + 1e-9 * np.trace(H) * np.eye(len(own)), P.T @ left)
        wrong = ((step < 0.0) & (unknowns.low[own] >= 0.0)) | ((step > 0.0) & (unknowns.high[own] <= 0.0))
        if not wrong.any():
            break
        if wrong.all():
            return []
        own, P = own[~wrong], P[:, ~wrong]
    start = u.copy()
    start[own] = np.clip(step, unknowns.low[own], unknowns.high[own])
    values, vectors = np.linalg.eigh(P.T @ P)
    solid = values > 1e-8 * values.max()
    Q = (P @ vectors[:, solid]) / np.sqrt(values[solid])
    return [(slug, Q, start, own)]


def _scores(look: _Sensitivities) -> tuple[list[Score], list[tuple]]:
    """The best score of every effect, strongest first, and all directions that were tried."""
    best: dict[str, Score] = {}
    pool = []
    for slug, Q, start, _ in look.tried:
        gain = float(np.sum((Q.T @ look.left) ** 2))
        p = float(chi2.sf(gain, Q.shape[1]))
        pool.append((slug, Q))
        held = best.get(slug)
        if held is None or (p, -gain) < (held.p_value, -held.gain):
            best[slug] = Score(slug, gain, Q.shape[1], p, start, look.strength[slug])
    order = sorted(best.values(), key=lambda s: -(s.gain - SCORE_TEST.price * s.freedom))
    return order, pool


def _slow_cosines(here: Evaluation, weight: np.ndarray, project: _Projector) -> np.ndarray:
    """Orthonormal slow cosines over every fitted recording, projected off the base."""
    parts = [len(m) for m in here.misfit]
    total, first, columns = sum(parts), 0, []
    for k, size in enumerate(parts):
        if np.any(weight[k]):
            t = (np.arange(size) + 0.5) / size
            for order in range(SCORE_TEST.slow_cosines):
                column = np.zeros(total)
                column[first : first + size] = weight[k] * np.cos(np.pi * order * t)
                columns.append(column)
        first += size
    Q, R = np.linalg.qr(project(np.stack(columns, axis=1)))
    return Q[:, np.abs(np.diag(R)) > 1e-8]


def _p_value(pool: list[tuple], left: np.ndarray, rng: np.random.Generator) -> tuple[float, bool]:
    """P-value of the strongest result among all, by simulation of independent unit errors."""

    def smallest(R: np.ndarray) -> np.ndarray:
        found = np.ones(R.shape[1])
        for _, Q in pool:
            found = np.minimum(found, chi2.logsf(np.sum((Q.T @ R) ** 2, axis=0), Q.shape[1]))
        return found

    errors = rng.standard_normal((len(left), SCORE_TEST.draws)) * (left != 0.0)[:, None]
    null, here = smallest(errors), smallest(left[:, None])[0]
    as_small = int(np.sum(null <= here))
    return (as_small + 1) / (SCORE_TEST.draws + 1), as_small == 0


def _noise_scale(here: Evaluation, weight: np.ndarray) -> float:
    """Standard deviation of whitened residuals from their fastest changes; 1 where the stated noise holds."""
    steps = []
    for k, misfit in enumerate(here.misfit):
        r = weight[k] * misfit
        r = r[r != 0.0]
        if len(r) > 8:
            steps.append(np.diff(r, 2) / np.sqrt(6.0))
    if not steps:
        return 1.0
    joined = np.abs(np.concatenate(steps))
    return float(max(1.0, np.median(joined) / GAUSSIAN_MAD))
