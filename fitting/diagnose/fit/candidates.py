"""Candidate fits: effects fitted together with the base, by successive halving, and their evidence."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fitting.inference.parallel import run_parallel
from pneusma_jax.errors import counted

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..evaluate.unknowns import Unknowns
from ..settings import DEFAULT
from .evidence import effective_degrees_of_freedom, evidence, inflation_of, log_likelihood
from .refit import Fit, Refitter, largest_deviation
from .score_test import ScoreTest, about_nominal

CANDIDATES = DEFAULT.candidates
CHANCE = DEFAULT.chance
EVIDENCE = DEFAULT.evidence
EXCESS = DEFAULT.excess
OPTIMISER = DEFAULT.optimiser
SHARE = DEFAULT.share


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


@dataclass(frozen=True)
class Proposal:
    """A set of effects to be fitted together with the base.

    Attributes:
        slugs: effects of the set, with those of the model that it extends.
        starts: scaled numbers: where its scores were made, and nominal base constants.
        near: evaluation from whose latent trajectories a fit begins; that of the extended model if None.
    """

    slugs: tuple[str, ...]
    starts: tuple[np.ndarray, np.ndarray]
    near: Evaluation | None = None


def candidate_fits(
    program: Program,
    current: Fit,
    found: ScoreTest,
    progress: Callable[[str], None],
    effort: int,
    most: int = CANDIDATES.tried,
    known: Iterable[Fit] = (),
) -> list[CandidateFit]:
    """The effects of largest score, each fitted together with everything that is present.

    Args:
        program: program of the campaign.
        current: model so far.
        found: its score test.
        progress: receives a line of text at every step.
        effort: 1, or 2 to follow twice as many candidates.
        most: number of candidates at effort 1.
        known: fits of sets that were fitted before; see `fitted_sets`.

    Returns:
        The candidates, strongest evidence first.
    """
    refitter = Refitter(program)
    likely = [s for s in found.scores if s.p_value < CHANCE.level][: effort * most]
    nominal = about_nominal(refitter, current, found)
    others = [s for s in nominal if s.slug not in {one.slug for one in likely}]
    enough = SHARE.minor * max((s.gain for s in nominal), default=0.0)
    likely += [s for s in others if s.p_value < CHANCE.level and s.gain >= enough][
        : effort * CANDIDATES.about_nominal
    ]
    proposals = [
        Proposal((*current.slugs, s.slug), starts_of(program.unknowns, (s.slug,), s.start)) for s in likely
    ]
    fits = fitted_sets(program, proposals, current, progress, effort, known)
    candidates = [CandidateFit(fit.slugs[-1], fit, 0.0, np.nan) for fit in fits]
    candidates.sort(key=lambda t: t.fit.objective)
    for candidate in candidates:
        candidate.largest_deviation_sd = largest_deviation(program.unknowns, candidate.fit)
    weigh(program, current, candidates)
    return candidates


def fitted_sets(
    program: Program,
    proposals: list[Proposal],
    current: Fit,
    progress: Callable[[str], None],
    effort: int,
    known: Iterable[Fit] = (),
) -> list[Fit]:
    """Sets of effects, each fitted together with the base, by successive halving.

    Args:
        program: program of the campaign.
        proposals: most promising first; of different sets.
        current: model that they extend.
        progress: receives a line of text at every step.
        effort: 1, or 2 to follow twice as many candidates.
        known: fits of sets that were fitted before. Proposals of these sets go on from there.

    Returns:
        A fit of every proposal. The worse ones ended early.
    """
    refitter, starts = Refitter(program), {one.slugs: one.starts for one in proposals}
    near = {one.slugs: one.near or current.evaluation for one in proposals}
    earlier = {frozenset(fit.slugs): fit for fit in known}
    best: dict[tuple[str, ...], Fit] = {
        slugs: replace(earlier[frozenset(slugs)], slugs=slugs)
        for slugs in starts
        if frozenset(slugs) in earlier
    }
    fresh = [slugs for slugs in starts if slugs not in best]

    def fitted(job: tuple[tuple[str, ...], np.ndarray | Fit, int]) -> tuple[tuple[str, ...], Fit]:
        slugs, start, rounds = job
        fit = refitter.fit(slugs, start, rounds, near[slugs], complete=False)
        if min(fit.objective, best[slugs].objective if slugs in best else np.inf) < current.objective:
            return slugs, fit
        added = [slug for slug in slugs if slug not in current.slugs]
        faint = _fainter(program.unknowns, added, current.u, fit.u if isinstance(start, Fit) else start)
        again = refitter.fit(slugs, faint, rounds, current.evaluation, complete=False)
        return slugs, min(fit, again, key=lambda f: f.objective)

    if fresh:
        progress(f"fitting {counted(len(fresh), 'candidate')}")
    best |= dict(run_parallel(fitted, [(slugs, starts[slugs][0], CANDIDATES.first_steps) for slugs in fresh]))
    kept = _ahead(program, refitter, best, starts, effort * CANDIDATES.second_count)
    progress(f"fitting {counted(len(kept), 'candidate')}")
    best |= dict(run_parallel(fitted, [(slugs, best[slugs], CANDIDATES.second_steps) for slugs in kept]))
    kept = _ahead(program, refitter, best, starts, effort * CANDIDATES.final_count)
    names = ["+".join(slug for slug in slugs if slug not in current.slugs) for slugs in kept]
    progress(f"fitting {', '.join(names)} to the end")
    best |= dict(run_parallel(fitted, [(slugs, best[slugs], OPTIMISER.maximum_steps) for slugs in kept]))
    elsewhere = [(slugs, starts[slugs][1]) for slugs in kept]
    for slugs in kept if not program.hidden else ():
        added = [slug for slug in slugs if slug not in current.slugs]
        if len(added) == 1:  # effects of larger sets were tried at other shapes alone
            elsewhere += [(slugs, start) for start in _reshaped(program.unknowns, added[0], best[slugs].u)]

    def begun_again(job: tuple[tuple[str, ...], np.ndarray]) -> Fit:
        slugs, start = job
        return from_elsewhere(program, best[slugs], start, near[slugs], complete=False)

    for fit in run_parallel(begun_again, elsewhere):
        if fit.objective < best[fit.slugs].objective:
            best[fit.slugs] = fit
    return run_parallel(refitter.completed, best.values())


def from_elsewhere(
    program: Program,
    fit: Fit,
    start: "np.ndarray | Fit",
    near: Evaluation | None = None,
    least: float = EVIDENCE.minimum_difference,
    complete: bool = True,
) -> Fit:
    """The better of a fit and one of the same model from another start.

    The latter begins with a few steps. It goes on if its next step promises a better end.

    Args:
        program: program of the campaign.
        fit: fit to improve.
        start, near: see `Refitter.fit`.
        least: how much better, over the variance of the misfit [nat]. By default it is the difference by
            which two explanations are told apart.
        complete: see `Refitter.fit`.
    """
    refitter, few = Refitter(program), CANDIDATES.first_steps + CANDIDATES.second_steps
    other = refitter.fit(fit.slugs, start, few, near, complete=False)
    if fit.objective - refitter.promised(other) > least * refitter.variance(fit.objective):
        other = refitter.fit(fit.slugs, other, OPTIMISER.maximum_steps, complete=False)
    best = min(fit, other, key=lambda one: one.objective)
    return refitter.completed(best) if complete else best


def _ahead(
    program: Program,
    refitter: Refitter,
    best: dict[tuple[str, ...], Fit],
    ranked: Iterable[tuple[str, ...]],
    count: int,
) -> list[tuple[str, ...]]:
    """Sets that are worth further steps: the best so far, the first by score, and one that promises more.

    Args:
        program: program of the campaign.
        refitter: predicts how far the next step of a fit would lower its objective.
        best: fits so far, by set.
        ranked: sets, the largest score first.
        count: number of the best that go on.
    """
    first = sorted(best, key=lambda slugs: best[slugs].objective)[:count]
    worst = max((best[slugs].objective for slugs in first), default=0.0)
    first += [slugs for slugs in list(ranked)[: CANDIDATES.kept_by_score] if slugs not in first]
    promised = {slugs: refitter.promised(fit) for slugs, fit in best.items()}
    rest = sorted((slugs for slugs in best if slugs not in first), key=promised.get)
    first += [slugs for slugs in rest[:1] if promised[slugs] < worst]
    least = min((fit.objective for fit in best.values()), default=np.inf)
    if least >= log_likelihood(program, 1.0 + EXCESS.little, 1.0):
        return first
    return [slugs for slugs in first if promised[slugs] <= CANDIDATES.hopeless_factor * least]


def starts_of(unknowns: Unknowns, added: Sequence[str], at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two starts of a set: the estimate of its scores, and typical strengths at nominal base constants.

    Args:
        unknowns: unknowns of the campaign.
        added: effects that the set adds.
        at: the estimate, scaled.
    """
    first, nominal = at.copy(), unknowns.at_nominal(at)
    for slug in added:
        own = unknowns.amplitudes(slug)
        typical = np.array([unknowns.items[k].start for k in own])
        signs = np.where(at[own] < 0.0, -1.0, 1.0)
        nominal[own] = np.clip(
            np.where(np.abs(at[own]) > 0.0, signs * np.abs(typical), 0.0),
            unknowns.low[own],
            unknowns.high[own],
        )
        zero = (first[own] == 0.0) & (typical != 0.0)  # an amplitude at zero never tells its shapes
        first[own[zero]] = CANDIDATES.begin_share * typical[zero]
    return first, nominal


def _reshaped(unknowns: Unknowns, slug: str, best: np.ndarray) -> list[np.ndarray]:
    """The best fit of a candidate so far with its shapes elsewhere, at typical strength."""
    shapes, own, found = unknowns.shapes(slug), unknowns.amplitudes(slug), []
    for share in CANDIDATES.other_shapes if shapes.size else ():
        u = best.copy()
        u[shapes] = [unknowns.items[k].at_share(share) for k in shapes]
        typical = np.array([unknowns.items[k].start for k in own])
        signs = np.where(u[own] < 0.0, -1.0, 1.0)
        u[own] = np.clip(signs * np.abs(typical), unknowns.low[own], unknowns.high[own])
        found.append(u)
    return found


def _fainter(unknowns: Unknowns, added: Sequence[str], current: np.ndarray, start: np.ndarray) -> np.ndarray:
    """A start close to the model so far, with a little of the added effects."""
    found = current.copy()
    for slug in added:
        whole, own = unknowns.of([slug]), unknowns.amplitudes(slug)
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
        enough = max(EVIDENCE.minimum_difference, CANDIDATES.minimum_ahead * best if slow else 0.0)
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
    """The model so far, fitted from a candidate's own constants and from its latent trajectories.

    These fits go on as long as any other: what they miss would count as evidence for an effect.
    """
    base, found = program.unknowns.base, []
    better = partial(from_elsewhere, program, current, least=OPTIMISER.minimum_decrease)
    if np.max(np.abs(candidate.fit.u[base] - current.u[base]), initial=0.0) > CANDIDATES.minimum_elsewhere:
        found.append(better(candidate.fit))  # with the candidate's effect absent
    if any(program.followed(current.evaluation)):
        found.append(better(current.u, candidate.fit.evaluation))
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
