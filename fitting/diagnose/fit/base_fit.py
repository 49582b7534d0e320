"""The base fit with its noise: every search begins with it."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from fitting.inference.parallel import run_parallel
from fitting.specimens.rows import of_specimen

from ..evaluate.evaluation import TRAJECTORY, row_count
from ..evaluate.program import Program
from ..evaluate.unknowns import Unknowns
from ..settings import DEFAULT
from .campaign_noise import recordings_differ, with_noise_of
from .evidence import inflation_of
from .misfit import reduced
from .outliers import without_outliers
from .refit import Fit, Refitter

BASE_FIT = DEFAULT.base_fit
CHANCE = DEFAULT.chance
EVIDENCE = DEFAULT.evidence
EXCESS = DEFAULT.excess
OPTIMISER = DEFAULT.optimiser
SHARE = DEFAULT.share


def base_fit(
    program: Program,
    start: np.ndarray | None = None,
    further: Callable[[Program], Iterable[np.ndarray]] = lambda _: (),
) -> tuple[Program, Fit]:
    """The base model refitted, and the program with the noise and the latent trajectories that it shows.

    The fit is made again from other starts where it leaves much, or where a constant ends at a bound.
    Fractions at their limits, and rows that a metal remembers, make false optima, which would pass for
    missing physics.

    Further starts may be dear. They are asked for only where all others leave much, too, and one after the
    other. The first that is not clearly better than all before ends them. It was found in another way, so it
    tells that these fits are not shut in. A law of springs missed one campaign, for instance. All starts of
    `characterise` took 83 s there. A fit from their best ended higher than one from a scattered start, which
    takes 0.7 s. In another campaign nothing was missing. Nine fits ended at objectives of 686 or more, and
    the first start of `characterise` at 486, which is noise.

    Args:
        program: program of the campaign.
        start: scaled numbers to begin with; nominal ones if None.
        further: makes more starts for a program, in its scaled numbers, those found soonest first.
    """
    begin = program.unknowns.neutral if start is None else start
    program, fit = fit_with_noise(program, Refitter(program).fit((), start))
    if _doubtful(program, fit):
        stuck = bool(at_bound(program.unknowns, fit)) or not departed_from(program, fit, begin)
        refitter = Refitter(program)
        others = run_parallel(
            lambda u: refitter.fit((), u, complete=False), _elsewhere(program, fit, stuck)
        )
        other = min(others, key=lambda f: f.objective)
        if _doubtful(program, min(fit, other, key=lambda f: f.objective)):
            other = _from_further(program, refitter, min(fit, other, key=lambda f: f.objective), further)
        if clearly_better(program, fit, other):
            program, fit = fit_with_noise(program, refitter.completed(other))
    return with_hot_tests_at_rest(program, fit)


def _doubtful(program: Program, fit: Fit) -> bool:
    """True if a base fit leaves much, or has a constant at a bound: it may be shut in."""
    much = reduced(program, fit, program.fitted) > 1.0 + EXCESS.little
    return bool(at_bound(program.unknowns, fit)) or much


def _from_further(
    program: Program, refitter: Refitter, best: Fit, further: Callable[[Program], Iterable[np.ndarray]]
) -> Fit:
    """The best of a fit and of those from further starts.

    They end with the first that is no better, or that leaves little.
    """
    for start in further(program):
        other = refitter.fit((), start, complete=False)
        best, before = min(best, other, key=lambda f: f.objective), best
        if not clearly_better(program, before, other) or not _doubtful(program, best):
            break
    return best


def with_hot_tests_at_rest(program: Program, fit: Fit) -> tuple[Program, Fit]:
    """The base fit with constant martensite fractions in tests near full heat, where that leaves only noise.

    There the resistance says nothing of the fraction. One that walks is at its limit, which noise crosses one
    way only: it follows the noise, its mean is above zero, and the austenite's stiffness is drawn after it. A
    constant one has an unknown value, which may be zero.

    Args:
        program: program of the campaign.
        fit: the base fit, with fractions that walk.
    """
    latent = program.specimen.latent
    for k in np.flatnonzero(program.fitted) if latent.may_rest else ():
        resting = latent.resting(program.stacked)
        course = fit.evaluation.drivers[TRAJECTORY][k, : row_count(program.stacked, k)]
        if resting[k] or not np.max(course) <= SHARE.small:
            continue
        resting[k] = True
        trial = replace(program, stacked=latent.with_resting(program.stacked, resting)).prepared(fit.u)
        other = Refitter(trial).fit((), fit.u)
        before, after = (float(np.sum(one.evaluation.misfit[k] ** 2)) for one in (fit, other))
        elsewhere = 2.0 * (other.objective - fit.objective) - (after - before)
        count = sum(channel.count for channel in program.channels[k])
        if by_chance(after, count) and by_chance(elsewhere, len(program.unknowns.base)):
            program, fit = trial, other
    return program, fit


def by_chance(chi_square: float, count: int) -> bool:
    """True if noise makes such a chi-square of so many values, or of so many constants that moved."""
    return chi_square <= count + CHANCE.deviations * np.sqrt(2.0 * count)


def clearly_better(program: Program, fit: Fit, other: Fit) -> bool:
    """True if another fit of the same model is better by more than the minimum log-likelihood."""
    return fit.objective - other.objective > EVIDENCE.minimum_difference * inflation_of(program, other)


def departed_from(program: Program, fit: Fit, start: np.ndarray) -> bool:
    """True if any base constant moved from the start of a fit."""
    base = program.unknowns.base
    return bool(np.any(fit.u[base] != start[base]))


def at_bound(unknowns: Unknowns, fit: Fit) -> list[str]:
    """Base constants that ended at a bound, by name."""
    return [
        unknowns.items[k].name
        for k in unknowns.base
        if min(fit.u[k] - unknowns.low[k], unknowns.high[k] - fit.u[k])
        < OPTIMISER.at_bound_share * (unknowns.high[k] - unknowns.low[k])
    ]


def told_at_bound(program: Program, fit: Fit) -> list[str]:
    """`at_bound`, by names for a reader."""
    specimens = [recording.specimen for recording in program.recordings]
    return [of_specimen(name, specimens) for name in at_bound(program.unknowns, fit)]


def _elsewhere(program: Program, fit: Fit, stuck: bool) -> list[np.ndarray]:
    """Starts far from where a fit of the base model ended, scaled."""
    starts, rng = [np.clip(-fit.u, -BASE_FIT.maximum_start, BASE_FIT.maximum_start)], np.random.default_rng(0)
    base = program.unknowns.base
    for _ in range(BASE_FIT.scattered_starts if program.hidden or stuck else 0):
        starts.append(fit.u.copy())
        starts[-1][base] = np.clip(
            rng.standard_normal(len(base)), -BASE_FIT.maximum_start, BASE_FIT.maximum_start
        )
    return starts


def fit_with_noise(program: Program, fit: Fit) -> tuple[Program, Fit]:
    """The program with the noise about a fitted model, without outliers, and the fit with both.

    Args:
        program: program of the campaign.
        fit: base model, or one with effects.
    """
    program, fit = _with_noise(program, fit)
    return program, Refitter(program).fit(fit.slugs, fit.u)


def _with_noise(program: Program, fit: Fit, apart: bool = False) -> tuple[Program, Fit]:
    """See `fit_with_noise` and `with_noise_of`; returns the fit that the last noise was told about."""
    for left in reversed(range(BASE_FIT.noise_rounds)):
        program = without_outliers(program, fit.evaluation)  # under the noise that is known so far
        program = with_noise_of(program, fit.evaluation, apart).prepared(fit.u, fit.evaluation)
        if program.process_noise.shape[1]:
            program.count_input_noise(fit.u)
        if left:
            fit = Refitter(program).fit(fit.slugs, fit.u)
    return program, fit


def quieter_beside(program: Program, fit: Fit) -> Program | None:
    """The program with the noise that named effects leave, where that is clearly less than about the base.

    The base model's slow misfit passes for correlated noise where nobody states the noise. Once effects
    explain it, it is none. What is left of an instrument's noise then is what `characterise` judges by.

    Only here recordings that clearly differ have a noise each. Before names are tried, fast misfit in one of
    them would pass for its noise.

    Args:
        program: program of the campaign, with the noise about its base model.
        fit: model with the named effects; the base model where there are none.

    Returns:
        The program; None where every noise is stated, or the noise is much the same.
    """
    if program.noise_stated:
        return None
    differ = recordings_differ(program, fit.evaluation)
    if not fit.slugs and not differ:
        return None
    other, _ = _with_noise(program, fit, apart=True)
    channels = zip(program.recordings, program.bare, other.bare, strict=True)
    ratios = [
        float(np.median(before.sigma[there]) / np.median(after.sigma[there]))
        for recording, row, quieter in channels
        for before, after in zip(row, quieter, strict=True)
        if not recording.noise_si(before.quantity)
        and (there := np.isfinite(before.sigma) & np.isfinite(after.sigma)).any()
    ]
    return other if differ or max(ratios, default=0.0) > CHANCE.scatter_ratio else None
