"""Candidate fits: effects fitted together with the base, by successive halving, and their evidence."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.inference.parallel import run_parallel

from ..evaluate.program import Program
from ..evaluate.unknowns import Unknowns
from ..settings import DEFAULT
from .evidence import effective_degrees_of_freedom, evidence, inflation_of, log_likelihood
from .refit import Fit, Refitter, at_its_bound, largest_deviation
from .score_test import Score, ScoreTest, about_nominal

OPTIMISER = DEFAULT.optimiser
CANDIDATES = DEFAULT.candidates
EVIDENCE = DEFAULT.evidence


@dataclass
class CandidateFit:
    """A candidate effect, fitted together with the base.

    Attributes:
        slug: candidate effect.
        fit: the model with it.
        bayes: log Bayes factor over the model without it, deflated by the misfit of the best model.
        largest_deviation_sd: largest deviation of a base constant from nominal, in standard deviations.
        left_out: cross-validated reduced chi-square, counted by `cross_validation.gain`; NaN if not computed.
        explained_by_instruments: part of `bayes` that drift and noise of inputs explain; 0 if not computed.
        explained_by_inputs: part of `bayes` that noise of inputs explains, which rivals do not share.
    """

    slug: str
    fit: Fit
    bayes: float
    largest_deviation_sd: float
    left_out: float = np.nan
    explained_by_instruments: float = 0.0
    explained_by_inputs: float = 0.0

    @property
    def at_a_bound(self) -> bool:
        """Whether the effect's own strength ended at a physical bound."""
        return at_its_bound(self.fit, self.slug)


def candidate_fits(
    program: Program,
    current: Fit,
    found: ScoreTest,
    progress: Callable[[str], None],
    effort: int,
    most: int = CANDIDATES.tried,
) -> list[CandidateFit]:
    """The effects of largest score, each fitted together with everything that is present.

    Args:
        program: of the campaign.
        current: model so far.
        found: its score test.
        progress: receives a line of text at every step.
        effort: 1; 2 follows twice as many.
        most: number of candidates at effort 1.

    Returns:
        The candidates, strongest evidence first.
    """
    refitter = Refitter(program)
    likely = [s for s in found.scores if s.p_value < CANDIDATES.maximum_p_value][: effort * most]
    nominal = about_nominal(refitter, current, found)
    others = [s for s in nominal if s.slug not in {known.slug for known in likely}]
    enough = CANDIDATES.comparable_share * max((s.gain for s in nominal), default=0.0)
    likely += [s for s in others if s.p_value < CANDIDATES.maximum_p_value and s.gain >= enough][
        : effort * CANDIDATES.about_nominal
    ]
    starts = {score.slug: _starts(program.unknowns, score) for score in likely}
    best: dict[str, Fit] = {}
    kept = [score.slug for score in likely]

    def fitted(job: tuple[str, np.ndarray | Fit, int]) -> tuple[str, Fit]:
        slug, start, rounds = job
        fit = refitter.fit((*current.slugs, slug), start, rounds, current.evaluation)
        if min(fit.objective, best[slug].objective if slug in best else np.inf) < current.objective:
            return slug, fit
        faint = _fainter(program.unknowns, slug, current.u, fit.u if isinstance(start, Fit) else start)
        again = refitter.fit(fit.slugs, faint, rounds, current.evaluation)
        return slug, min(fit, again, key=lambda f: f.objective)

    def ahead(count: int) -> list[str]:
        first = sorted(best, key=lambda slug: best[slug].objective)[: effort * count]
        worst = max((best[slug].objective for slug in first), default=0.0)
        first += [score.slug for score in likely[: CANDIDATES.kept_by_score] if score.slug not in first]
        promised = {slug: refitter.promised(fit) for slug, fit in best.items()}
        rest = sorted((slug for slug in best if slug not in first), key=promised.get)
        first += [slug for slug in rest[:1] if promised[slug] < worst]
        least = min((fit.objective for fit in best.values()), default=np.inf)
        ended = least < log_likelihood(program, CANDIDATES.explained, 1.0)
        return (
            [slug for slug in first if promised[slug] <= CANDIDATES.hopeless_factor * least]
            if ended
            else first
        )

    for rounds in (CANDIDATES.first_steps, CANDIDATES.second_steps):
        kept = ahead(CANDIDATES.second_count) if best else kept
        progress(f"fitting {len(kept)} candidates")
        jobs = [(slug, best[slug] if slug in best else starts[slug][0], rounds) for slug in kept]
        best |= dict(run_parallel(fitted, jobs))
    kept = ahead(CANDIDATES.final_count)
    progress(f"fitting {', '.join(kept)} to the end")
    jobs = [(slug, start, OPTIMISER.final_steps) for slug in kept for start in (best[slug], starts[slug][1])]
    if not program.hidden:
        elsewhere = {slug: _reshaped(program.unknowns, slug, best) for slug in kept}
        jobs += [(slug, start, OPTIMISER.final_steps) for slug in kept for start in elsewhere[slug]]
    for slug, fit in run_parallel(fitted, jobs):
        if fit.objective < best[slug].objective:
            best[slug] = fit
    candidates = [CandidateFit(slug, fit, 0.0, np.nan) for slug, fit in best.items()]
    candidates.sort(key=lambda t: t.fit.objective)
    for candidate in candidates:
        candidate.largest_deviation_sd = largest_deviation(program.unknowns, candidate.fit)
    weigh(program, current, candidates)
    return candidates


def _starts(unknowns: Unknowns, score: Score) -> list[np.ndarray]:
    """Two starts of a candidate fit: the estimate of the score test, and nominal base constants."""
    nominal = unknowns.at_nominal(score.start)
    own = unknowns.amplitudes(score.slug)
    typical = np.array([unknowns.items[k].start for k in own])
    signs = np.where(score.start[own] < 0.0, -1.0, 1.0)
    nominal[own] = np.clip(
        np.where(np.abs(score.start[own]) > 0.0, signs * np.abs(typical), 0.0),
        unknowns.low[own],
        unknowns.high[own],
    )
    first = score.start.copy()
    zero = (first[own] == 0.0) & (typical != 0.0)  # an amplitude at zero never tells its shapes
    first[own[zero]] = CANDIDATES.begin_share * typical[zero]
    return [first, nominal]


def _reshaped(unknowns: Unknowns, slug: str, best: dict[str, Fit]) -> list[np.ndarray]:
    """The best fit of a candidate so far with its shapes elsewhere, at typical strength."""
    shapes, own, found = unknowns.shapes(slug), unknowns.amplitudes(slug), []
    for share in CANDIDATES.other_shapes if shapes.size else ():
        u = best[slug].u.copy()
        u[shapes] = [unknowns.items[k].at_share(share) for k in shapes]
        typical = np.array([unknowns.items[k].start for k in own])
        signs = np.where(u[own] < 0.0, -1.0, 1.0)
        u[own] = np.clip(signs * np.abs(typical), unknowns.low[own], unknowns.high[own])
        found.append(u)
    return found


def _fainter(unknowns: Unknowns, slug: str, current: np.ndarray, start: np.ndarray) -> np.ndarray:
    """A start close to the model so far, with a little of the effect."""
    found, whole, own = current.copy(), unknowns.of([slug]), unknowns.amplitudes(slug)
    typical = np.array([unknowns.items[k].start for k in own])
    found[whole] = start[whole]
    found[own] = CANDIDATES.faint_share * np.where(
        np.abs(start[own]) > CANDIDATES.faint_share * np.abs(typical), start[own], typical
    )
    return found


def refitted_baseline(program: Program, current: Fit, candidates: list[CandidateFit]) -> Fit:
    """The refitted baseline: the model so far, fitted from where its candidates ended, if that is better.

    Otherwise a candidate would get credit for a better optimum of the base constants, or of the trajectories.
    The candidates are weighed anew.
    """
    slow, asked = program.hidden, set()
    while True:
        best = max((t.bayes for t in candidates), default=0.0)
        enough = (
            max(EVIDENCE.minimum_further, CANDIDATES.minimum_ahead * best)
            if slow
            else EVIDENCE.minimum_further
        )
        ahead = [t for t in candidates if t.bayes > enough and t.slug not in asked]
        if not ahead:
            weigh(program, current, candidates)
            return current
        ahead = ahead[:1] if slow else ahead
        asked |= {t.slug for t in ahead}
        again = [fit for t in ahead for fit in _without(program, current, t)]
        again = min(again, key=lambda fit: fit.objective, default=current)
        if again.objective < current.objective:
            current = again
            weigh(program, current, candidates)


def _without(program: Program, current: Fit, candidate: CandidateFit) -> list[Fit]:
    """The model so far, fitted from a candidate's own constants and from its latent trajectories."""
    refitter, base, found = Refitter(program), program.unknowns.base, []
    if np.max(np.abs(candidate.fit.u[base] - current.u[base]), initial=0.0) > CANDIDATES.minimum_elsewhere:
        found.append(refitter.fit(current.slugs, candidate.fit))  # which leaves the others at their absence
    if any(program.followed(current.evaluation)):
        found.append(refitter.fit(current.slugs, current.u, near=candidate.fit.evaluation))
    return found


def weigh(program: Program, current: Fit, candidates: list[CandidateFit]) -> None:
    """Log Bayes factors over the current model, deflated by the misfit of the best model; strongest first."""
    if not candidates:
        return
    inflation = inflation_of(program, min(candidates, key=lambda t: t.fit.objective).fit)
    followed = effective_degrees_of_freedom(program, current)
    for candidate in candidates:
        candidate.bayes = evidence(program, current, candidate.fit, inflation, followed)
    candidates.sort(key=lambda t: -t.bayes)
