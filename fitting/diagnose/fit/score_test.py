"""Score test of every effect against the residuals of a fitted model, calibrated over all effects.

The sensitivity of an effect is the derivative of the outputs at its absence, projected off the base
constants. Several shapes are tried where it depends on a shape (a threshold, a time constant). Where the
derivative vanishes, the change by a typical effect replaces it.

Residuals include the deviations of the base constants from nominal, because each prior is a row like a
measured one. So an effect that brings the constants back scores as well as one that removes misfit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest

import numpy as np

from fitting.inference.chance import chi_square_tail, log_chi_square_tail
from fitting.inference.parallel import run_parallel

from ..evaluate.evaluation import Evaluation
from ..evaluate.unknowns import Unknowns
from ..settings import DEFAULT
from .refit import Fit, Refitter, largest_deviation
from .sensitivities import Block, Projector, Sensitivities, sensitivities_about

CHANCE = DEFAULT.chance
OPTIMISER = DEFAULT.optimiser
SCORE_TEST = DEFAULT.score_test

UNSEEN = "no output of a fitted recording changes with it"
ABSORBED = "constants of the base model absorb all that it changes"
UNTIMED = "only a clock tells it, and time_s only counts rows"
"""Reasons why an effect cannot be tested."""


@dataclass(frozen=True)
class Score:
    """Score of one effect.

    Attributes:
        slug: effect.
        gain: decrease of chi-square along its sensitivity, at the best shape.
        freedom: numbers that it takes.
        p_value: probability of such a gain by chance, at that shape alone.
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
        scores: scores of every effect that these recordings can show.
        p_value: probability of the strongest score by chance; all effects, shapes and slow cosines are
            counted.
        p_is_bound: no simulated null was as strong.
        untestable: slugs of effects that these recordings do not show, with the reason in words.
        scale: standard deviation of fast residuals; above 1 where the noise is larger than stated.
        tried: slugs of all effects that were asked for.
        look: sensitivities that the scores are made of.
    """

    scores: list[Score]
    p_value: float
    p_is_bound: bool
    untestable: dict[str, str]
    scale: float
    tried: tuple[str, ...]
    look: Sensitivities | None = field(default=None, repr=False)


def score_effects(refitter: Refitter, fit: Fit, slugs: Sequence[str], rng: np.random.Generator) -> ScoreTest:
    """Score every effect against a fit.

    Args:
        refitter: refitter of the campaign.
        fit: model to improve.
        slugs: effects to try; those of the fit are left out.
        rng: random numbers of the simulated nulls.
    """
    slugs, weight = [slug for slug in slugs if slug not in fit.slugs], refitter.weight
    look = sensitivities_about(refitter, fit, slugs)
    scores, pool = _scores(refitter.unknowns, look)
    pool.append((None, _slow_cosines(look.here, weight, look.project)))
    p_value, bound = _p_value(pool, look.left, rng)
    untestable = {
        slug: UNSEEN if look.change[slug] < OPTIMISER.negligible else ABSORBED
        for slug in slugs
        if look.strength[slug] < OPTIMISER.negligible
    }
    untestable |= dict.fromkeys(refitter.program.untimed, UNTIMED)
    return ScoreTest(scores, p_value, bound, untestable, look.scale, tuple(slugs), look)


def about_nominal(refitter: Refitter, fit: Fit, found: ScoreTest) -> list[Score]:
    """Scores about nominal base constants, strongest first; empty where the constants of the fit are near.

    Far from nominal a true effect may seem to act the wrong way.
    """
    if largest_deviation(refitter.unknowns, fit) < CHANCE.deviations:
        return []
    nominal = replace(fit, u=refitter.unknowns.at_nominal(fit.u))
    by_slope, whole = _scores(refitter.unknowns, sensitivities_about(refitter, nominal, found.tried))[0], []
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
        there = program.evaluate(u, nothing, near=fit.evaluation, chosen=refitter.counted)
        r, _ = there.joined(refitter.weight)
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
            best[slug] = Score(slug, gain, freedom, float(chi_square_tail(gain, freedom)), u, np.nan)
    return sorted(best.values(), key=lambda s: -s.gain)


def _interleaved(*lists: Sequence[Score]) -> list[Score]:
    """The first of every list, the second of every list, and so on; each effect once."""
    found: dict[str, Score] = {}
    for row in zip_longest(*lists):
        for score in row:
            if score is not None:
                found.setdefault(score.slug, score)
    return list(found.values())


def _within_bounds(
    unknowns: Unknowns, block: Block, left: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Orthonormal directions of a block and a start; without strengths that would have the wrong sign.

    None where every one would.
    """
    own, P = block.own, block.columns
    if block.whole:
        return P / np.linalg.norm(P), block.u
    for _ in range(len(own)):
        H = P.T @ P
        step = -np.linalg.solve(H + 1e-9 * np.trace(H) * np.eye(len(own)), P.T @ left)
        wrong = ((step < 0.0) & (unknowns.low[own] >= 0.0)) | ((step > 0.0) & (unknowns.high[own] <= 0.0))
        if not wrong.any():
            break
        if wrong.all():
            return None
        own, P = own[~wrong], P[:, ~wrong]
    start = block.u.copy()
    start[own] = np.clip(step, unknowns.low[own], unknowns.high[own])
    values, vectors = np.linalg.eigh(P.T @ P)
    solid = values > 1e-8 * values.max()
    return (P @ vectors[:, solid]) / np.sqrt(values[solid]), start


def _scores(unknowns: Unknowns, look: Sensitivities) -> tuple[list[Score], list[tuple]]:
    """The best score of every effect, strongest first, and all directions that were tried."""
    best: dict[str, Score] = {}
    pool = []
    for block in look.blocks:
        found = _within_bounds(unknowns, block, look.left)
        if found is None:
            continue
        slug, (Q, start) = block.slug, found
        gain = float(np.sum((Q.T @ look.left) ** 2))
        p = float(chi_square_tail(gain, Q.shape[1]))
        pool.append((slug, Q))
        held = best.get(slug)
        if held is None or (p, -gain) < (held.p_value, -held.gain):
            best[slug] = Score(slug, gain, Q.shape[1], p, start, look.strength[slug])
    order = sorted(best.values(), key=lambda s: -(s.gain - SCORE_TEST.price * s.freedom))
    return order, pool


def _slow_cosines(here: Evaluation, weight: np.ndarray, project: Projector) -> np.ndarray:
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


def simulated(X: np.ndarray, left: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Products of directions with independent unit errors wherever a residual counts, (directions, draws).

    They are Gaussian, and their covariance is the Gram matrix. So no error of a single row is drawn.

    Args:
        X: the directions, (rows, directions).
        left: residuals, zero where none counts, (rows,).
        rng: random numbers.
    """
    counted = X[left != 0.0]
    lengths = np.linalg.norm(counted, axis=0)
    counted = counted / np.where(lengths > 0.0, lengths, 1.0)  # rounding is that of each direction
    values, axes = np.linalg.eigh(counted.T @ counted)
    root = lengths[:, None] * axes * np.sqrt(np.maximum(values, 0.0))
    return root @ rng.standard_normal((len(values), SCORE_TEST.draws))


def _p_value(pool: list[tuple], left: np.ndarray, rng: np.random.Generator) -> tuple[float, bool]:
    """P-value of the strongest result among all, by simulation of independent unit errors."""
    X = np.concatenate([Q for _, Q in pool], axis=1)
    ends = np.cumsum([Q.shape[1] for _, Q in pool])

    def smallest(products: np.ndarray) -> np.ndarray:
        found = np.ones(products.shape[1])
        for own in np.split(products, ends[:-1]):
            found = np.minimum(found, log_chi_square_tail(np.sum(own**2, axis=0), len(own)))
        return found

    null, here = smallest(simulated(X, left, rng)), smallest((X.T @ left)[:, None])[0]
    as_small = int(np.sum(null <= here))
    return (as_small + 1) / (SCORE_TEST.draws + 1), as_small == 0
