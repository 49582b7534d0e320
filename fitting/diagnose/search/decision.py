"""The decision about a set of effects: evidence, left-out recordings, instruments, for each of its effects.

A set is named if every one of its effects is needed beside the others. Its evidence over the set without it
must be enough, also less what noise of inputs explains. Drift must not explain it better. It must predict
fitted recordings that are left out in turn, and must not make validation recordings worse. What fitted
recordings gain outweighs a faint loss there, but no clear one. A further effect must remove a large share of
what the others leave. For the imperfect form of a true effect leaves a remainder, which another effect fits
in part. It must remove a share of the whole misfit, too, unless the set leaves no more than noise. Where the
others leave about noise, it must explain 0.25 % of the evidence. A form that is right to 5 % of its size
leaves as much. With some effects base constants come back that else lie far from nominal. A remainder of
misfit does not tell where they belong. So such an effect need remove only a minor share of what the others
leave. But a tolerance may be stated too small. Any effect that acts alike brings its constant back then. Only
the strongest effect may end at a bound, unless the set leaves no more than noise.

A set of which no part would be named alone must explain the misfit down to the noise, or nearly all of it.
Otherwise it is named only before a set of less evidence that leaves more. So is one with a further effect at
a bound.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from ..evaluate.program import Program
from ..fit.base_fit import by_chance
from ..fit.cross_validation import HeldOutScores, gain
from ..fit.evidence import evidence, inflation_of, log_likelihood
from ..fit.instrument_drift import instrument_parts
from ..fit.misfit import floor, limit_of, reduced, spread
from ..fit.prediction import Loss, negative_log_predictive_density, predictive_chi_square
from ..fit.refit import Fit, at_its_bound
from ..settings import DEFAULT
from .pool import Pool

CANDIDATES = DEFAULT.candidates
CHANCE = DEFAULT.chance
EVIDENCE = DEFAULT.evidence
EXCESS = DEFAULT.excess
SHARE = DEFAULT.share

LITTLE, BOUND, UNSEEN, LEFT_OUT, SMALL, OF_ALL, FORM, INSTRUMENTS, REMAINS, BOUND_REMAINS = (
    "too little evidence", "at a bound", "validation recordings", "left-out recordings",
    "a small share of what is left", "a small share of the misfit",
    "less than a form is known by", "instruments explain it", "more than noise remains",
    "at a bound, and more than noise remains",
)  # fmt: skip
"""Reasons why a set is refused."""


@dataclass
class Decision:
    """The set that is named, and what was refused.

    Attributes:
        fit: fit of the set; the base model if none is named.
        refused: sets with more evidence that were judged, and why each was refused. Sets far behind the best
            of their size are not judged.
    """

    fit: Fit
    refused: list[tuple[tuple[str, ...], str]]


@dataclass
class _Known:
    """Reason why a fit was refused, and the fits that it was compared with: a better one asks again."""

    fit: Fit
    beside: list[Fit | None]
    why: str | None


class Judge:
    """Decides about the sets of a pool.

    Args:
        pool: fitted sets.
        scores: cross-validation of models.

    Attributes:
        explained: evidence of a single effect that instruments explain as well, by its name.
    """

    def __init__(self, pool: Pool, scores: HeldOutScores):
        self.pool, self.scores = pool, scores
        self._known: dict[int, _Known] = {}
        self.explained: dict[str, float] = {}

    def decide(self) -> Decision:
        """The set of most evidence of which every effect earns its place."""
        refused, tops, asked, incomplete = [], {}, Counter(), []
        for fit, worth in self.pool.ranked():
            if worth < EVIDENCE.minimum_first:
                break
            size = len(fit.slugs)
            top = tops.setdefault(size, worth)
            if top - worth > max(EVIDENCE.minimum_difference, SHARE.minor * top):
                continue
            asked[size] += 1
            if size > 1 and asked[size] > CANDIDATES.final_count:  # the others were not fitted to the end
                continue
            why = self.refusal(fit) or self._too_much_left(fit)
            if why is None:
                for one, before in incomplete:
                    if self._kept(one) <= self._kept(fit):
                        return Decision(one, before)
                return Decision(fit, refused)
            if why in (REMAINS, BOUND_REMAINS):
                incomplete.append((fit, list(refused)))
            if why == INSTRUMENTS and top == worth:
                del tops[size]  # what instruments explain is no better guess
            refused.append((fit.slugs, why))
        return Decision(self.pool.base, refused)

    def refusal(self, fit: Fit) -> str | None:
        """Reason why a set is not named; None if each of its effects is needed."""
        known = self._known.get(id(fit))  # a fit that is kept keeps its id
        if known is None or [id(one) for one in known.beside] != [id(one) for one in self._beside(fit)]:
            why = self._refusal(fit)  # which may better a fit beside it
            known = self._known[id(fit)] = _Known(fit, self._beside(fit), why)
        return known.why

    def _beside(self, fit: Fit) -> list[Fit | None]:
        """Fits that a set is compared with: the base model, and the set without each of its effects."""
        return [self.pool.base, *(self.pool.get(s for s in fit.slugs if s != slug) for slug in fit.slugs)]

    def _refusal(self, fit: Fit) -> str | None:
        """The cheap questions about all effects first."""
        program, single = self.pool.program, len(fit.slugs) == 1
        inflation = inflation_of(program, fit)
        enough = EVIDENCE.minimum_first if single else EVIDENCE.minimum_difference
        _, *quick = self._beside(fit)
        if any(rest is not None and evidence(program, rest, fit, inflation) < enough for rest in quick):
            return LITTLE  # which a better fit of the rest would not change
        rests = {slug: self.pool.without(fit, slug) for slug in fit.slugs}
        worth = {slug: evidence(program, rest, fit, inflation) for slug, rest in rests.items()}
        if min(worth.values()) < enough:
            return LITTLE
        if any(self._needless(rest, fit, worth[slug]) for slug, rest in rests.items()):
            return FORM
        strongest = max(worth, key=worth.get)
        bounded = [slug for slug in fit.slugs if at_its_bound(fit, slug)]
        if bounded and self.scores(self.pool.base).sum() < 1.0 + EXCESS.little:
            return BOUND
        for rest in rests.values():
            gained, share = gain(self.scores(rest), self.scores(fit))
            if log_likelihood(program, gained, inflation) < EVIDENCE.minimum_difference:
                return LEFT_OUT
            small = None if single else self._small(rest, fit, gained, share)
            if small is not None:
                return small
            if loses(program, rest, fit, gained, inflation):
                return UNSEEN
        for slug, rest in rests.items():
            drifting, from_inputs = instrument_parts(program, rest, fit)
            if single:
                self.explained[slug] = drifting + from_inputs
            net = worth[slug] - from_inputs
            if net < enough or net < drifting:
                return INSTRUMENTS
        return BOUND_REMAINS if set(bounded) - {strongest} and leaves_more(program, fit) else None

    def _needless(self, rest: Fit, fit: Fit, worth: float) -> bool:
        """True if an effect explains next to nothing of the misfit, and about noise is left without it."""
        program, base = self.pool.program, self.pool.base
        if brings_back(program, rest, fit):
            return False
        if rest is base or worth >= SHARE.small**2 * evidence(
            program, base, fit, inflation_of(program, fit)
        ):
            return False
        masks = program.fitted, program.unseen
        left = max(predictive_chi_square(program, rest, mask) - floor(program, rest, mask) for mask in masks)
        return left <= EXCESS.little

    def _small(self, rest: Fit, fit: Fit, gained: float, share: float) -> str | None:
        """Why a further effect is refused that removes a small share only; None if it does not.

        It must remove most of what the others leave, or much of the whole misfit; and a share of that. If it
        brings base constants back, it need remove only a minor share of what the others leave.
        """
        program, base = self.pool.program, self.pool.base
        before, after, whole = (reduced(program, f, program.fitted) for f in (rest, fit, base))
        faint = whole - 1.0 < CHANCE.deviations * spread(program, program.fitted)
        taken = 0.0 if faint else (before - after) / (whole - 1.0)
        if taken >= SHARE.minor or (share >= SHARE.minor and brings_back(program, rest, fit)):
            return None
        if share < SHARE.most:
            return SMALL
        if not self._leaves_more(fit):  # imperfect forms do
            return None
        original = float(self.scores(base).sum())
        minor = gained < SHARE.small * (original - 1.0) and taken < SHARE.small
        return OF_ALL if minor else None

    def _too_much_left(self, fit: Fit) -> str | None:
        """Why a set is refused of which no effect would be named alone.

        It leaves more than noise, and more than right effects in imperfect forms do.
        """
        if len(fit.slugs) < 2:
            return None
        parts = [self.pool.get([slug]) for slug in fit.slugs]
        if any(part is not None and self.refusal(part) is None for part in parts):
            return None
        return REMAINS if self._leaves_more(fit) and self._kept(fit) > SHARE.small else None

    def _kept(self, fit: Fit) -> float:
        """See `kept_of`."""
        return kept_of(self.pool.program, self.pool.base, fit)

    def _leaves_more(self, fit: Fit) -> bool:
        """True if a set leaves more than noise.

        Recordings for validation judge where they contradict the base model. Otherwise parts left out in turn
        judge, too; these may be extrapolated, and missed for that.
        """
        program = self.pool.program
        unseen, base = program.unseen, self.pool.base
        whole = not program.fitted.all() and (
            predictive_chi_square(program, base, unseen) > limit_of(program, unseen)
        )
        return leaves_more(program, fit, np.nan if whole else float(self.scores(fit).sum()))


def brings_back(program: Program, rest: Fit, fit: Fit) -> bool:
    """True if base constants lie farther from nominal than chance puts them, and with an effect they do not.

    All of them count together: their squares are those of as many errors. So does what the effect takes of
    them. Else it might only move them over the limit.
    """
    base = program.unknowns.base
    far, near = (float(one.u[base] @ one.u[base]) for one in (rest, fit))
    return by_chance(near, len(base)) and not by_chance(far - near, len(base))


def kept_of(program: Program, base: Fit, fit: Fit) -> float:
    """Largest share of the base's misfit that a set leaves, of fitted and of validation recordings.

    Recordings that do not contradict the base have no misfit to be shared.
    """
    shares = [0.0]
    for mask in (program.fitted, program.unseen):
        left, whole = (predictive_chi_square(program, f, mask) for f in (fit, base))
        if max(left, whole) > limit_of(program, mask):
            shares.append((left - 1.0) / (max(left, whole) - 1.0))
    return max(shares)


def loses(program: Program, rest: Fit, fit: Fit, gained: float, inflation: float) -> bool:
    """True if validation recordings contradict a further effect, by more than left-out ones may outweigh."""
    fewer, named = (negative_log_predictive_density(program, f, program.unseen) for f in (rest, fit))
    loss = Loss(fewer, named, program.observations(program.unseen))
    return counts(program, fit, loss, gained, inflation)


def counts(program: Program, fit: Fit, loss: Loss, gained: float, inflation: float) -> bool:
    """True if values that were not fitted lose by effects what neither chance nor an imperfect form explains.

    Left-out parts of fitted recordings outweigh a loss that is a small share of what they gain. They do not
    outweigh a clear one, see `clear`.

    Args:
        program: program of the campaign.
        fit: model with the effects.
        loss: of values that were not fitted.
        gained: gain in the reduced chi-square of fitted values that were left out in turn.
        inflation: inflation of variances [1], see `inflation_of`.
    """
    if loss.nats / inflation <= EVIDENCE.minimum_difference:
        return False
    return loss.nats > SHARE.small * log_likelihood(program, gained) or clear(program, fit, loss)


def clear(program: Program, fit: Fit, loss: Loss) -> bool:
    """True if values that were not fitted are predicted clearly worse, whatever fitted recordings gain.

    They are if the reduced chi-square grows by more than `excess.clear`, and by more than a tenth. Drift
    within the noise explains less. The imperfect form of a true effect may leave as much in other recordings
    as in fitted ones, so that is not counted.
    """
    left = max(reduced(program, fit, program.fitted) - 1.0, 0.0)
    return loss.growth > max(EXCESS.clear + left, SHARE.alike * loss.before)


def leaves_more(program: Program, fit: Fit, left_out: float = np.nan) -> bool:
    """True if a model leaves more than noise; `left_out` is its cross-validated reduced chi-square."""
    left = [(predictive_chi_square(program, fit, mask), mask) for mask in (program.fitted, program.unseen)]
    left.append((left_out, program.fitted))
    return any(score > limit_of(program, mask) for score, mask in left)
