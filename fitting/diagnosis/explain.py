"""Which effects explain a campaign: co-refits, evidence, one effect after the other, and what none
explains."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from .program import Program
from .refit import MOST_ROUNDS, SHAPE_SD, Fit, Refitter
from .screen import Score, Screen, screen

MOST_EFFECTS = 3
SIDE_BY_SIDE = 2
"""Fits that run at a time."""
TRIED = 10
"""Candidates that are fitted together with the base, of those that the screen ranks first."""
FIRST_ROUNDS = 4
"""Trial steps of every candidate; the better ones go on."""
PROMISING = 2
"""Candidates that are fitted to the end because the screen ranks them first, however they began."""
POLISHING = 30
"""Most trial steps of a model that was chosen."""
PURSUED = 4
"""Candidates that are fitted to the end, from two starts each."""
SETTLED = 2
"""Of those, the ones whose hidden phases are read anew before they are compared."""
LEVEL = 0.01
"""P-value below which something is missing."""
CERTAIN = 8.0
"""Log Bayes factor from which an effect enters the model; the number of candidates is already counted."""
SHARE = 0.45
"""Of the misfit that is left, what a further effect must take away."""
HELD_OUT_SHARE = 0.1
"""Of the misfit of recordings that were not fitted, what every effect must take away."""
OF_ALL = 0.05
"""Of the base model's own misfit, what a further effect must take away: the imperfect form of a true effect
leaves a remainder that something else fits."""
CLOSE = 4.0
"""Log Bayes factor within which two explanations are not told apart."""
ENOUGH = 1.25
"""Reduced chi-square at which nothing is left to explain."""


@dataclass
class Trial:
    """A candidate fitted together with the base.

    Attributes:
        slug: candidate effect.
        fit: the model with it.
        bayes: log Bayes factor over the model without it, deflated by what the best model leaves.
        held_out: chi-square per value on recordings that were not fitted (or on the fitted ones, if there
        are none).
        returned: largest departure of a base constant from nominal, in standard deviations.
        program: in which it was fitted; phases may be read anew.
    """

    slug: str
    fit: Fit
    bayes: float
    held_out: float
    returned: float
    program: Program


@dataclass
class Stage:
    """One round of the search: the model so far, the screen, and the trials of a further effect."""

    base: Fit
    screen: Screen
    trials: list[Trial]
    chosen: str | None


@dataclass
class Explanation:
    """What a campaign says.

    Attributes:
        program: with phases as the final model reads them.
        base: the base model refitted; `base_program` has its phases.
        final: the model with the effects that were found.
        stages: of the search.
        p_value, p_is_bound: of the base's misfit by chance.
        tries: fits that were made.
    """

    program: Program
    base_program: Program
    base: Fit
    final: Fit
    stages: list[Stage]
    p_value: float
    p_is_bound: bool
    tries: int = 0


def settle(program: Program, u: np.ndarray) -> Program:
    """The program with hidden phases as a model reads them; the original is left alone."""
    copy = replace(program)
    copy._evaluate, copy._always = program._evaluate, program._always
    copy.settle(u)
    return copy


def reduced(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Chi-square per measured value of some recordings, given by a mask."""
    return fit.evaluation.chi2(chosen.astype(float)) / max(program.observations(chosen), 1)


def explain(
    program: Program,
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda _: None,
    effort: int = 1,
) -> Explanation:
    """Search for up to three effects.

    Args:
        program: of the campaign.
        rng: of simulated nulls.
        progress: told what happens, in words.
        effort: 1; 2 tries twice as many candidates, and follows twice as many to the end.
    """
    progress("refitting the base model within its tolerances")
    program, base = _settled_fit(program, (), None, rounds=2)
    base_program, first = program, base
    stages: list[Stage] = []
    current, p_value, bound, tries = base, 1.0, False, 1
    judge = program.judge
    original = reduced(program, base, judge)
    while len(current.slugs) < MOST_EFFECTS:
        if stages and not _much_left(program, current, judge, original):
            break
        progress(f"screening {len(program.unknowns.slugs) - len(current.slugs)} effects")
        refitter = Refitter(program)
        refitter._base = _columns(refitter, current)
        found = screen(refitter, current, program.unknowns.slugs, rng)
        if not stages:
            p_value, bound = found.p_value, found.p_is_bound
        stage = Stage(current, found, [], None)
        stages.append(stage)
        if found.p_value > LEVEL:
            break
        stage.trials, fits = _trials(program, current, found, judge, progress, effort)
        tries += fits
        best = _choice(program, current, stage, judge, None if len(stages) == 1 else original)
        if best is None:
            break
        stage.chosen = best.slug
        program, current = _polished(best.program, best.fit)
        if len(current.slugs) > 1:
            program, current = _pruned(program, current)
    return Explanation(program, base_program, first, current, stages, p_value, bound, tries)


def _much_left(program: Program, current: Fit, judge: np.ndarray, original: float) -> bool:
    """Whether a further effect could take away enough to be believed."""
    left = reduced(program, current, judge)
    if left - 1.0 < OF_ALL * (original - 1.0):
        return False
    return max(left, reduced(program, current, program.fitted)) >= ENOUGH


def _columns(refitter: Refitter, fit: Fit) -> np.ndarray:
    """Derivatives by the base constants at a fit."""
    return refitter.program.evaluate(fit.u, refitter.unknowns.base).joined(refitter.weight)[1]


def _settled_fit(
    program: Program, slugs: tuple[str, ...], start: np.ndarray | None, rounds: int = 1
) -> tuple[Program, Fit]:
    """A fit whose hidden phases are those of the fitted model."""
    fit = Refitter(program).fit(slugs, start) if not slugs else None
    for _ in range(rounds if program.has_phases else 0):
        program = settle(program, fit.u if fit else start)
        fit = Refitter(program).fit(slugs, fit.u if fit else start)
    return program, fit


def _trials(
    program: Program,
    current: Fit,
    found: Screen,
    judge: np.ndarray,
    progress: Callable[[str], None],
    effort: int,
) -> tuple[list[Trial], int]:
    """The candidates that the screen ranks first, fitted together with everything that is present."""
    refitter = Refitter(program)
    refitter._base = _columns(refitter, current)
    nominal = refitter._base
    likely = [s for s in found.scores if s.p_value < 0.01][: effort * TRIED]
    starts = {score.slug: _starts(refitter, current, score) for score in likely}

    def fitted(job: tuple[str, np.ndarray, int]) -> tuple[str, Fit]:
        slug, start, rounds = job
        own = Refitter(program)
        own._base = nominal
        return slug, own.fit((*current.slugs, slug), start, rounds)

    progress(f"fitting {len(likely)} candidates")
    best = dict(_side_by_side(fitted, [(slug, pair[0], FIRST_ROUNDS) for slug, pair in starts.items()]))
    ahead = sorted(best, key=lambda slug: best[slug].objective)[: effort * PURSUED]
    ahead += [score.slug for score in likely[:PROMISING] if score.slug not in ahead]
    progress(f"fitting {', '.join(ahead)} to the end")
    jobs = [(slug, start, MOST_ROUNDS) for slug in ahead for start in (best[slug].u, starts[slug][1])]
    for slug, fit in _side_by_side(fitted, jobs):
        if fit.objective < best[slug].objective:
            best[slug] = fit
    fits = len(likely) + len(jobs)
    trials = [Trial(slug, fit, 0.0, np.nan, np.nan, program) for slug, fit in best.items()]
    trials.sort(key=lambda t: t.fit.objective)
    if program.has_phases:
        progress(f"reading hidden phases under {', '.join(t.slug for t in trials[:SETTLED])}")
        again = _side_by_side(lambda t: _settled_fit(program, t.fit.slugs, t.fit.u), trials[:SETTLED])
        for trial, (settled_program, fit) in zip(trials, again, strict=False):
            trial.program, trial.fit = settled_program, fit
        fits += 2 * len(again)
    for trial in trials:
        trial.held_out = reduced(trial.program, trial.fit, judge)
        base = program.unknowns.base
        trial.returned = float(np.max(np.abs(trial.fit.u[base]), initial=0.0))
    _weigh(program, current, trials)
    trials.sort(key=lambda t: -t.bayes)
    return trials, fits


def _side_by_side(function: Callable, jobs: list) -> list:
    """Results in the order of the jobs; compiled programs run without Python's lock, two at a time."""
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        return list(pool.map(function, jobs))


def _starts(refitter: Refitter, current: Fit, score: Score) -> list[np.ndarray]:
    """Where the fit of a candidate begins: from the screen's estimate, and from nominal constants."""
    unknowns = refitter.unknowns
    nominal = score.start.copy()
    nominal[unknowns.base] = 0.0
    own = unknowns.amplitudes(score.slug)
    typical = np.array([unknowns.items[k].start for k in own])
    signs = np.where(score.start[own] < 0.0, -1.0, 1.0)
    nominal[own] = np.clip(
        np.where(np.abs(score.start[own]) > 0.0, signs * np.abs(typical), 0.0),
        unknowns.low[own],
        unknowns.high[own],
    )
    first = score.start.copy()
    idle = (first[own] == 0.0) & (typical != 0.0)  # an amplitude at zero never tells its shapes
    first[own[idle]] = 0.02 * typical[idle]
    return [first, nominal]


def _weigh(program: Program, current: Fit, trials: list[Trial]) -> None:
    """Log Bayes factors over the current model, deflated by what the best model leaves unexplained."""
    if not trials:
        return
    count = program.observations(program.fitted)
    best = min(t.fit.objective for t in trials)
    left = 2.0 * best / max(count, 1)
    inflation = max(1.0, left) * _correlation(program, min(trials, key=lambda t: t.fit.objective).fit)
    penalty = np.log(max(len(program.unknowns.slugs), 1))
    for trial in trials:
        trial.bayes = (
            (current.objective - trial.fit.objective) / inflation + _occam(program, current, trial) - penalty
        )


def _occam(program: Program, current: Fit, trial: Trial) -> float:
    """What the freedom of an effect costs, by Laplace's approximation."""
    total = 0.5 * (current.log_det - trial.fit.log_det)
    for k in program.unknowns.of([trial.slug]):
        item = program.unknowns.items[k]
        width = SHAPE_SD * np.sqrt(2.0 * np.pi) if item.shape else item.high - item.low
        total += 0.5 * np.log(2.0 * np.pi) - np.log(width)
    return min(total, 0.0)


def _correlation(program: Program, fit: Fit) -> float:
    """Serial correlation that the best model's whitened residuals still have, as a factor on variances."""
    above, below = 0.0, 1e-12
    for k in np.flatnonzero(program.fitted):
        r = fit.evaluation.misfit[k]
        r = r[r != 0.0]
        above += float(np.sum(r[1:] * r[:-1]))
        below += float(np.sum(r * r))
    rho = np.clip(above / below, 0.0, 0.9)
    return float((1.0 + rho) / (1.0 - rho))


def _choice(
    program: Program, current: Fit, stage: Stage, judge: np.ndarray, original: float | None
) -> Trial | None:
    """The trial that enters the model, if any may.

    Args:
        program: as the current model reads its phases.
        current: model so far.
        stage: with the trials, best first.
        judge: recordings that decide.
        original: reduced chi-square of the base model on those; None for the first effect.
    """
    first = original is None
    before, fitted = reduced(program, current, judge), reduced(program, current, program.fitted)
    for trial in stage.trials:
        after = reduced(trial.program, trial.fit, program.fitted)
        share = HELD_OUT_SHARE if first else SHARE
        gained = (before - trial.held_out) / max(before - 1.0, 1e-3)
        here = (fitted - after) / max(fitted - 1.0, 1e-3)
        if trial.bayes < CERTAIN or (not first and trial.fit.at_bound):
            continue
        if gained < share or here < share:
            continue
        if not first and before - trial.held_out < OF_ALL * (original - 1.0):
            continue
        return trial
    return None


def _polished(program: Program, fit: Fit) -> tuple[Program, Fit]:
    """A chosen model fitted once more: from nominal base constants, too, in case the others held it back."""
    home = fit.u.copy()
    home[program.unknowns.base] = 0.0
    options = _side_by_side(lambda u: Refitter(program).fit(fit.slugs, u, POLISHING), [fit.u, home])
    best = min([fit, *options], key=lambda f: f.objective)
    if program.has_phases:
        settled_program = settle(program, best.u)
        return settled_program, Refitter(settled_program).fit(fit.slugs, best.u, POLISHING)
    return program, best


def _pruned(program: Program, fit: Fit) -> tuple[Program, Fit]:
    """Drop effects whose absence costs nothing once the others are there."""
    for slug in fit.slugs[:-1]:
        rest = tuple(s for s in fit.slugs if s != slug)
        start = fit.u.copy()
        own = program.unknowns.of([slug])
        start[own] = program.unknowns.neutral[own]
        without = Refitter(program).fit(rest, start)
        count = program.observations(program.fitted)
        inflation = max(1.0, 2.0 * fit.objective / count) * _correlation(program, fit)
        if (without.objective - fit.objective) / inflation < CERTAIN:
            return program, without
    return program, fit
