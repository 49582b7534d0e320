"""Sensitivities of a model's misfit to every absent effect, whitened and projected off the free numbers.

The sensitivity of an effect is the derivative of the outputs at its absence. An effect with shapes (a
threshold, a time constant) has one block of columns for each of several shapes. Where every derivative
vanishes, the change by a typical effect takes their place. The same function serves at any point: where the
base model was refitted, at nominal constants, or at a model that has effects already.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.inference.noise import GAUSSIAN_MAD

from ..evaluate.evaluation import Evaluation
from ..evaluate.unknowns import Unknowns
from ..settings import DEFAULT
from .refit import Fit, Refitter

OPTIMISER = DEFAULT.optimiser
SCORE_TEST = DEFAULT.score_test


@dataclass(frozen=True)
class Block:
    """Sensitivities of one effect at one shape.

    Attributes:
        slug: effect.
        columns: projected, (rows and priors, strengths).
        own: indices of these strengths.
        u: scaled numbers with that shape, from which a fit of the effect starts.
        whole: the one column is the change by the typical effect that is in `u` already.
    """

    slug: str
    columns: np.ndarray
    own: np.ndarray
    u: np.ndarray
    whole: bool = False


@dataclass(frozen=True)
class Sensitivities:
    """Residuals and all sensitivities about one point.

    Attributes:
        here: the evaluation.
        project: projects sensitivities off the free numbers.
        scale: standard deviation of fast residuals; above 1 where the noise is larger than stated.
        left: projected residuals, in units of `scale`; departures of priors are rows of it.
        blocks: blocks of every effect and shape that these recordings show.
        strength: longest sensitivity of every effect.
        change: the same before the projection: zero where no output that counts changes with the effect.
    """

    here: Evaluation
    project: "Projector"
    scale: float
    left: np.ndarray
    blocks: list[Block]
    strength: dict[str, float]
    change: dict[str, float]


class Projector:
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
        self.H = np.linalg.pinv(scaled.T @ scaled, OPTIMISER.rounding, hermitian=True) / np.outer(
            size, size
        )
        self.rows = len(A)

    def __call__(self, J: np.ndarray, priors: np.ndarray | None = None) -> np.ndarray:
        """Projected columns (rows, n), then rows of the priors (zero if None), (rows + numbers, n)."""
        if priors is None:
            priors = np.zeros((len(self.A) - self.rows, J.shape[1]))
        whole = np.concatenate([J, priors])
        return whole - self.A @ (self.H @ (self.A.T @ whole))


def sensitivities_about(refitter: Refitter, fit: Fit, slugs: Sequence[str]) -> Sensitivities:
    """The sensitivities of effects about the numbers of a fit."""
    program, unknowns, weight = refitter.program, refitter.unknowns, refitter.weight
    here = program.evaluate(fit.u, fit.free, near=fit.evaluation, chosen=refitter.counted)
    r, A = here.joined(weight)
    departure, sd = refitter._prior(fit.u, fit.free)
    movable = ~np.isin(fit.free, constants_at_bound(unknowns, fit))
    project = Projector(A[:, movable], sd[movable])
    scale = _noise_scale(here, weight)
    left = project(r[:, None], (departure / sd)[movable, None])[:, 0] / scale
    blocks: list[Block] = []
    strength, change = dict.fromkeys(slugs, 0.0), dict.fromkeys(slugs, 0.0)
    shaped = [slug for slug in slugs if unknowns.shapes(slug).size]
    for number, u in enumerate(_shapes(refitter, fit, slugs)):
        members = shaped if number else slugs
        if not members:
            break
        columns = np.concatenate([unknowns.amplitudes(slug) for slug in members]).astype(int)
        # trajectories as of A
        _, J = program.evaluate(u, columns, near=fit.evaluation, chosen=refitter.counted).joined(weight)
        for slug in members:
            own = unknowns.amplitudes(slug)
            whole = J[:, np.isin(columns, own)]
            change[slug] = max(change[slug], float(np.linalg.norm(whole, axis=0).max(initial=0.0)))
            P = project(whole)
            lengths = np.linalg.norm(P, axis=0)
            kept = lengths > OPTIMISER.negligible
            strength[slug] = max(strength[slug], float(lengths.max(initial=0.0)))
            if kept.any():
                blocks.append(Block(slug, P[:, kept], own[kept], u))
    for slug in [s for s in slugs if strength[s] < OPTIMISER.negligible]:
        u = fit.u.copy()
        own = unknowns.of([slug])
        u[own] = [unknowns.items[k].start for k in own]
        changed = program.evaluate(u, own[:0], near=fit.evaluation, chosen=refitter.counted)
        difference = changed.joined(weight)[0] - r
        change[slug] = max(change[slug], float(np.linalg.norm(difference)))
        sensitivity = project(difference[:, None])
        strength[slug] = float(np.linalg.norm(sensitivity))
        if strength[slug] >= OPTIMISER.negligible:
            blocks.append(Block(slug, sensitivity, own, u, whole=True))
    return Sensitivities(here, project, scale, left, blocks, strength, change)


def constants_at_bound(unknowns: Unknowns, fit: Fit) -> np.ndarray:
    """Indices of base constants that ended at a bound: those absorb no more."""
    base = unknowns.base
    return base[
        (fit.u[base] <= unknowns.low[base] + OPTIMISER.negligible)
        | (fit.u[base] >= unknowns.high[base] - OPTIMISER.negligible)
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
