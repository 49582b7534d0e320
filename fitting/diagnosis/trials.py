"""Candidates fitted together with the base: who goes on, and what their evidence is."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from .campaign_noise import with_noise_of
from .noise import lasting
from .program import Program
from .refit import NARROWEST, SHAPE_SD, Fit, Refitter, prior_sd, stopped
from .screen import Score, Screen
from .side_by_side import side_by_side
from .unknowns import Unknowns

TRIED = 10
"""Candidates that are fitted together with the base, of those that the screen ranks first."""
LIKELY = 0.01
"""P-value of a signature, by itself, from which its effect is fitted."""
HALVING = ((10, 2), (5, 4))
"""How many of the best candidates take how many trial steps, before the best are fitted to the end."""
PROMISING = 2
"""Candidates that stay because the screen ranks them first, however they began."""
PURSUED = 3
"""Candidates that are fitted to the end, from two starts each."""
OTHER_SHAPES = (0.15, 0.5, 0.85)
"""Shares of the range of its shapes from which such an effect is fitted, too, where fits are quick: a time
constant or a width has optima of its own."""
TO_THE_END = 40
"""Most trial steps of such a fit."""
FAINTER = 0.1
"""Part of an effect with which a fit begins again that ended worse than the model without it."""
POOR = 1.2
"""Reduced chi-square of the base model from which its fit is tried from the other side of nominal, too."""
SCATTERED = 7
"""Further starts of the same, beside hidden courses; two of five found the better of two optima."""
MIRRORED, CLEARLY = 2.0, 5.0
"""Standard deviations from nominal at which those begin at most; and the log-likelihood, deflated as evidence
is, by which it must be better."""
SHUT_IN = 5.0
"""Log Bayes factor of a trial from which the model without it is looked for near its hidden courses, too."""
SETTLING = 2
"""Rounds in which noise is told from what a base model leaves, and the base model fitted with it."""
AT_BOUND = 8.0
"""Log Bayes factor that an effect loses whose strength ends at a physical bound."""


@dataclass
class Trial:
    """A candidate fitted together with the base.

    Attributes:
        slug: candidate effect.
        fit: the model with it.
        bayes: log Bayes factor over the model without it, deflated by what the best model leaves.
        returned: largest departure of a base constant from nominal, in standard deviations.
        left_out: reduced chi-square of fitted recordings left out in turn, as `folds.gain` counts; NaN
            where it was not asked for.
    """

    slug: str
    fit: Fit
    bayes: float
    returned: float
    left_out: float = np.nan

    @property
    def stopped(self) -> bool:
        """Whether the effect's own strength ended at a physical bound."""
        return stopped(self.fit, self.slug)


def reduced(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Chi-square per measured value of some recordings, given by a mask."""
    return fit.evaluation.chi2(chosen.astype(float)) / max(program.observations(chosen), 1)


def spread(program: Program, chosen: np.ndarray) -> float:
    """Standard deviation of the reduced chi-square of some recordings by chance."""
    return float(np.sqrt(2.0 / max(program.observations(chosen), 1)))


def foretold(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """`reduced`, less what the fit's own uncertainty leaves open in recordings that it has not seen: their
    misfit in units of the errors of its predictions, to first order, where no number leaves its bounds."""
    if np.any(chosen & program.fitted):
        return reduced(program, fit, chosen)
    r, A = fit.evaluation.joined(chosen.astype(float))
    held = np.linalg.cholesky(np.linalg.inv(fit.covariance)).T
    at, unknowns = fit.u[fit.free], program.unknowns
    low, high = unknowns.low[fit.free] - at - NARROWEST, unknowns.high[fit.free] - at + NARROWEST
    both = np.concatenate([A, held]), np.concatenate([-r, np.zeros(len(at))])
    square = 2.0 * lsq_linear(*both, (low, high), method="bvls").cost
    return float(square) / max(program.observations(chosen), 1)


def surprise(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Negative log-density, less constants, that a fit foretold for recordings that it has not seen: a wide
    prediction is forgiven more, and was worth less. Of those that it has, half their chi-square."""
    square = foretold(program, fit, chosen) * program.observations(chosen)
    if np.any(chosen & program.fitted):
        return 0.5 * square
    _, A = fit.evaluation.joined(chosen.astype(float))
    span = program.unknowns.high[fit.free] - program.unknowns.low[fit.free]
    known = np.linalg.inv(fit.covariance) + np.diag(12.0 / span**2)  # within bounds at the widest
    widened = np.linalg.slogdet(known + A.T @ A)[1] - np.linalg.slogdet(known)[1]
    return 0.5 * float(square + widened)


def floor(program: Program, fit: Fit, chosen: np.ndarray) -> float:
    """Chi-square per measured value that noise alone explains: 1, or what neighbouring misfits differ by.

    Noise that grows with its signal leaves more in recordings of large signals; physics leaves slow courses.
    """
    steps = [np.zeros(0)]
    for k in np.flatnonzero(chosen):
        first = 0
        for channel in program.channels[k]:
            size = len(channel.measured)
            r = fit.evaluation.misfit[k][first : first + size][np.isfinite(channel.sigma)]
            steps.append(np.diff(r, 2) ** 2 / 6.0)
            first += size
    total = float(np.sum(np.concatenate(steps)))
    return max(1.0, total / max(program.observations(chosen), 1))


def settled_fit(program: Program, start: np.ndarray | None = None) -> tuple[Program, Fit]:
    """The base model refitted, and the program with the noise and the hidden courses that it shows.

    Where much is left the fit is made again from the other side of nominal, and beside hidden courses from
    places all about it: fractions at their limits, and rows that a metal remembers, shut in false optima that
    would pass for missing physics.
    """
    program, fit = _settled(program, Refitter(program).fit((), start))
    if reduced(program, fit, program.fitted) > POOR:
        others = side_by_side(lambda u: Refitter(program).fit((), u), _elsewhere(program, fit))
        other = min(others, key=lambda f: f.objective)
        if (fit.objective - other.objective) / inflation_of(program, fit) > CLEARLY:
            program, fit = _settled(program, other)
    return program, fit


def _elsewhere(program: Program, fit: Fit) -> list[np.ndarray]:
    """Starts far from where a fit of the base model ended, scaled."""
    starts, rng = [np.clip(-fit.u, -MIRRORED, MIRRORED)], np.random.default_rng(0)
    for _ in range(SCATTERED if program.hidden else 0):
        starts.append(fit.u.copy())
        base = program.unknowns.base
        starts[-1][base] = np.clip(rng.standard_normal(len(base)), -MIRRORED, MIRRORED)
    return starts


def _settled(program: Program, fit: Fit) -> tuple[Program, Fit]:
    """The program with the noise that a base model shows, and its fit there."""
    for _ in range(SETTLING):
        program = with_noise_of(program, fit.evaluation).prepared(fit.u)
        if program.pace.shape[1]:
            program.count_input_noise(fit.u)
        fit = Refitter(program).fit((), fit.u)
    return program, fit


def trials_of(
    program: Program,
    current: Fit,
    found: Screen,
    progress: Callable[[str], None],
    effort: int,
    most: int = TRIED,
) -> list[Trial]:
    """The candidates that the screen ranks first, fitted together with everything that is present.

    Args:
        program: of the campaign.
        current: model so far.
        found: what the screen says about it.
        progress: told what happens, in words.
        effort: 1; 2 follows twice as many.
        most: candidates at effort 1.

    Returns:
        The trials, strongest evidence first.
    """
    likely = [s for s in found.scores if s.p_value < LIKELY][: effort * most]
    starts = {score.slug: _starts(program.unknowns, score) for score in likely}
    best: dict[str, Fit] = {}
    kept = [score.slug for score in likely]

    def fitted(job: tuple[str, np.ndarray | Fit, int]) -> tuple[str, Fit]:
        slug, start, rounds = job
        fit = Refitter(program).fit((*current.slugs, slug), start, rounds, current.evaluation)
        if min(fit.objective, best[slug].objective if slug in best else np.inf) < current.objective:
            return slug, fit
        faint = _fainter(program.unknowns, slug, current.u, fit.u if isinstance(start, Fit) else start)
        again = Refitter(program).fit(fit.slugs, faint, rounds, current.evaluation)
        return slug, min(fit, again, key=lambda f: f.objective)

    def ahead(count: int) -> list[str]:
        first = sorted(best, key=lambda slug: best[slug].objective)[: effort * count]
        return first + [score.slug for score in likely[:PROMISING] if score.slug not in first]

    for count, rounds in HALVING:
        kept = ahead(count) if best else kept
        progress(f"fitting {len(kept)} candidates")
        jobs = [(slug, best[slug] if slug in best else starts[slug][0], rounds) for slug in kept]
        best |= dict(side_by_side(fitted, jobs))
    kept = ahead(PURSUED)
    progress(f"fitting {', '.join(kept)} to the end")
    jobs = [(slug, start, TO_THE_END) for slug in kept for start in (best[slug], starts[slug][1])]
    if not program.hidden:
        elsewhere = {slug: _reshaped(program.unknowns, slug, best) for slug in kept}
        jobs += [(slug, start, TO_THE_END) for slug in kept for start in elsewhere[slug]]
    for slug, fit in side_by_side(fitted, jobs):
        if fit.objective < best[slug].objective:
            best[slug] = fit
    trials = [Trial(slug, fit, 0.0, np.nan) for slug, fit in best.items()]
    trials.sort(key=lambda t: t.fit.objective)
    for trial in trials:
        trial.returned = float(np.max(np.abs(trial.fit.u[program.unknowns.base]), initial=0.0))
    weigh(program, current, trials)
    return trials


def _starts(unknowns: Unknowns, score: Score) -> list[np.ndarray]:
    """Where the fit of a candidate begins: from the screen's estimate, and from nominal constants."""
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


def _reshaped(unknowns: Unknowns, slug: str, best: dict[str, Fit]) -> list[np.ndarray]:
    """The best fit of a candidate so far with its shapes elsewhere, at typical strength."""
    shapes, own, found = unknowns.shapes(slug), unknowns.amplitudes(slug), []
    for share in OTHER_SHAPES if shapes.size else ():
        u = best[slug].u.copy()
        u[shapes] = [unknowns.items[k].at_share(share) for k in shapes]
        typical = np.array([unknowns.items[k].start for k in own])
        signs = np.where(u[own] < 0.0, -1.0, 1.0)
        u[own] = np.clip(signs * np.abs(typical), unknowns.low[own], unknowns.high[own])
        found.append(u)
    return found


def _fainter(unknowns: Unknowns, slug: str, current: np.ndarray, start: np.ndarray) -> np.ndarray:
    """A start from which an effect cannot have led astray: the model so far, with a little of the effect."""
    found, whole, own = current.copy(), unknowns.of([slug]), unknowns.amplitudes(slug)
    typical = np.array([unknowns.items[k].start for k in own])
    found[whole] = start[whole]
    found[own] = FAINTER * np.where(np.abs(start[own]) > FAINTER * np.abs(typical), start[own], typical)
    return found


def inflation_of(program: Program, fit: Fit) -> float:
    """Factor on variances by what a model leaves and by the serial correlation of its residuals."""
    left = 2.0 * fit.objective / max(program.observations(program.fitted), 1)
    return max(1.0, left) * lasting(fit.evaluation.misfit[k] for k in np.flatnonzero(program.fitted))


def taken_up(program: Program, fit: Fit) -> float:
    """Measured values of the fitted recordings that hidden courses follow instead of a model: a model that
    lets them follow one more error explains half a unit of log-likelihood by that alone."""
    hidden = program.followed(fit.evaluation)
    return float(sum(hidden[k].taken().sum() for k in np.flatnonzero(program.fitted) if hidden[k]))


def fair(program: Program, current: Fit, trials: list[Trial]) -> Fit:
    """The model so far, its hidden courses begun with those of a trial where that is better.

    The metal's memory has kinks at which the search for a course ends; a trial that got past one would be
    credited with it. The trials are weighed anew.
    """
    if not any(program.followed(current.evaluation)):
        return current
    for trial in [t for t in trials if t.bayes > SHUT_IN][:PROMISING]:
        again = Refitter(program).fit(current.slugs, current.u, near=trial.fit.evaluation)
        if again.objective < current.objective:
            current = again
    weigh(program, current, trials)
    return current


def weigh(program: Program, current: Fit, trials: list[Trial]) -> None:
    """Log Bayes factors over the current model, deflated by what the best model leaves; strongest first."""
    if not trials:
        return
    inflation = inflation_of(program, min(trials, key=lambda t: t.fit.objective).fit)
    followed = taken_up(program, current)
    for trial in trials:
        trial.bayes = evidence(program, current, trial.fit, inflation, followed)
    trials.sort(key=lambda t: -t.bayes)


def evidence(
    program: Program, current: Fit, further: Fit, inflation: float, followed: float | None = None
) -> float:
    """Log Bayes factor of a model with further effects over one without them; misfit counts by 1 / inflation.

    Models are compared with each other under one inflation only. `followed` is what the current model's
    courses take up, if that is known.
    """
    followed = taken_up(program, current) if followed is None else followed
    added = [slug for slug in further.slugs if slug not in current.slugs]
    luck = 0.5 * max(taken_up(program, further) - followed, 0.0)
    gain = (current.objective - further.objective - luck) / inflation
    penalty = len(added) * np.log(max(len(program.unknowns.slugs), 1))
    penalty += AT_BOUND * sum(stopped(further, slug) for slug in added)
    return gain + _occam(program, current, further, added, inflation) - penalty


def _occam(program: Program, current: Fit, further: Fit, added: list[str], inflation: float) -> float:
    """What the freedom of added effects costs, by Laplace's approximation; misfit counts by 1 / inflation,
    and so does what it tells of the numbers.

    Of several strengths of an effect each is absent as likely as not: what the recordings do not need costs
    no more than that.
    """
    own, items = program.unknowns.of(added), program.unknowns.items
    before, after = (_information(program, fit, inflation) for fit in (current, further))
    total = 0.5 * (np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])
    present = 0.5 * np.log(2.0 * np.pi)
    shape = SHAPE_SD * np.sqrt(2.0 * np.pi)
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


def _information(program: Program, fit: Fit, inflation: float) -> np.ndarray:
    """Of recordings and priors, on a fit's free numbers, (free, free); misfit counts by 1 / inflation."""
    unknowns, prior = program.unknowns, prior_sd(program.unknowns, fit.free) ** -2
    seen = np.linalg.inv(fit.covariance) - np.diag(prior)
    span = unknowns.high[fit.free] - unknowns.low[fit.free]
    widest = np.where(prior > 0.0, prior, 12.0 / span**2)
    return seen / inflation + np.diag(widest)


def _spared(covariance: np.ndarray, away: np.ndarray, cost: dict[int, float]) -> float:
    """What leaving out strengths saves in log-evidence, to second order: one after the other, all but one.

    Args:
        covariance: of the free numbers, (numbers, numbers).
        away: how far each is from its absence, (numbers,).
        cost: of a strength's prior, by its place among the numbers.
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
