"""Turning points between rows, or effects without them: both may explain the same readings.

A drive that is taken to turn between two rows can hide an effect that acts alike. A missing effect can look
like such turns. So the drive is first taken as it was recorded. Turning points are tried beside the effects
that this search names, and in the place of each. Only where they may explain as much is a second search made,
with them. Both are weighed by evidence over the same base model, under the same noise.
"""

from dataclasses import dataclass, replace

import numpy as np

from fitting.inference.notes import joined

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..fit.base_fit import clearly_better
from ..fit.evidence import effective_degrees_of_freedom, evidence, inflation_of, log_sets
from ..fit.refit import Fit, Refitter
from ..search.pool import without
from ..search.steps import Explanation
from .conclude import conclude
from .conclusion import Conclusion, WithoutTurns
from .probabilities import UNMODELLED, Found, told_apart, weights_of

TURNED = "The model fits clearly better with turning points of the drive between rows, listed below"
ADVICE = "Record the turning points, or more rows about them"


@dataclass(frozen=True)
class Weighed:
    """Log evidence of two explanations of the same readings, over the base model without either [nat].

    Attributes:
        turns: of the base model whose drives turn between rows, with the effects that it needs.
        effects: of effects without these turning points.
    """

    turns: float
    effects: float

    @property
    def share(self) -> float:
        """Probability of the effects, if one of the two acts."""
        return float(weights_of(np.array([self.effects, self.turns]))[0])

    @property
    def turns_lead(self) -> bool:
        """True if the readings tell that the drive turned."""
        return self.turns > self.effects and told_apart(self.turns, self.effects)

    @property
    def effects_lead(self) -> bool:
        """True if the readings tell that the effects act instead."""
        return self.effects > self.turns and told_apart(self.effects, self.turns)

    @property
    def text(self) -> str:
        """Both numbers, as a part of a sentence."""
        return f"log Bayes factors of {self.turns:.0f} with turning points and {self.effects:.0f} without"


@dataclass(frozen=True)
class TriedTurns:
    """Turning points between rows, fitted beside what a search without them found.

    Attributes:
        plain: search on the campaign without them.
        program: the campaign with them, under the noise of that search.
        other: the campaign without them, whose errors correlate where those of `program` do.
        alone: base model with them.
    """

    plain: Explanation
    program: Program
    other: Program
    alone: Fit

    @classmethod
    def beside(cls, turned: Program, plain: Explanation) -> "TriedTurns":
        """The turning points of `turned`, a program of the campaign whose drives pass through them."""
        program = _under_noise_of(
            replace(turned, fitted=plain.program.fitted), plain.program, plain.final
        )
        other = plain.program
        if _parts_correlated(other, program):
            other = _under_noise_of(other, program, plain.final, plain.final.evaluation)
        # the base model's constants may have given way to what turning points do
        fits = (Refitter(program).fit((), start) for start in (plain.base.u, None))
        return cls(plain, program, other, min(fits, key=lambda fit: fit.objective))

    def _without(self, fit: Fit) -> Fit:
        """A fit of the search without them, as its errors correlate in `other`."""
        return fit if self.other is self.plain.program else Refitter(self.other).fit(fit.slugs, fit.u)

    @property
    def help_base(self) -> bool:
        """True if the base model fits clearly better with them."""
        return bool(clearly_better(self.program, self._without(self.plain.base), self.alone))

    def matter(self) -> bool:
        """True if they may explain what the effects that were named do not, or as well.

        They are tried beside all of these effects, in the place of each, and in the place of all. Each time
        they are weighed against what they replace, over the model without either.
        """
        plain = self.plain
        if not plain.final.slugs:
            return True
        named = self._without(plain.final)
        whole = Refitter(self.program).fit(named.slugs, named.u)
        if _compared(self.program, whole, self.other, named, named).turns_lead:
            return True
        rests = [
            (without(self.program, whole, slug), self._without(plain.named.leave_one_out[slug].base))
            for slug in named.slugs
        ]
        return not all(
            _compared(self.program, drives, self.other, rest, named).effects_lead
            for drives, rest in [*rests, (self.alone, self._without(plain.base))]
        )


def with_turns(turned: Explanation, plain: Explanation) -> tuple[Conclusion, str]:
    """The conclusion where turning points between rows may explain as much as effects do.

    It is that of the search with turning points, unless effects without them have clearly more evidence.
    Where recordings do not tell the two apart, it names both. On both sides only effects count that held-out
    recordings do not contradict.

    Args:
        turned: search on a campaign whose drives pass through turning points between rows.
        plain: search on the campaign without them.

    Returns:
        The conclusion, and a note about turning points.
    """
    with_them = conclude(turned)
    kept = with_them.explanation  # without effects that did not hold their place
    odds = weighed(kept, plain)
    if not _hidden(kept, plain):
        if odds.effects > odds.turns:
            return conclude(plain), as_recorded(plain)
        return with_them, f"{TURNED}. No other effect explains the recordings without them. {ADVICE}"
    if odds.turns_lead:
        names = joined(plain.final.slugs)
        said = f"{TURNED}. Without them the evidence of {names} is less ({odds.text}). {ADVICE}"
        return with_them, said
    recorded = conclude(plain)
    names = joined([f.slug for f in recorded.found if f.slug != UNMODELLED])
    if not names or not _hidden(kept, recorded.explanation):
        return with_them, f"{TURNED}. Without them no other effect holds its place. {ADVICE}"
    if recorded.explanation is not plain:  # not all of its effects held their place
        odds = weighed(kept, recorded.explanation)
    if odds.effects_lead:
        return recorded, (
            "The model fits better with turning points of the drive between rows than without. "
            f"The evidence of {names} is clearly more ({odds.text}), so the drive is taken as it was recorded"
        )
    how = "less" if odds.turns_lead else "as much"
    said = f"{TURNED}. Without them the evidence of {names} is {how} ({odds.text}). {ADVICE}"
    return with_them if odds.turns_lead else either(with_them, recorded, odds), said


def as_recorded(plain: Explanation) -> str:
    """A note where the base model fits better with turning points, and effects explain what they do."""
    names = joined(plain.final.slugs)
    why = f"Beside {names} they explain less" if names else "That is too little"
    return (
        "The base model alone fits better with turning points of the drive between rows. "
        f"{why}, so the drive is taken as it was recorded"
    )


def _hidden(turned: Explanation, plain: Explanation) -> set[str]:
    """Effects that only a search without turning points names."""
    return set(plain.final.slugs) - set(turned.final.slugs)


def weighed(turned: Explanation, plain: Explanation) -> Weighed:
    """Evidence for turning points, and for effects without them.

    Turning points are one more candidate. They pay for the choice among candidates like an effect. Their
    number, times and values follow from the rates of the drive, so nothing else of them is free.

    Args:
        turned: search on a campaign whose drives pass through turning points between rows.
        plain: search on the campaign without them.
    """
    fitted = turned.program.fitted | plain.program.fitted
    program, drives = turned.program, turned.final
    if np.any(program.fitted != fitted):
        program = replace(program, fitted=fitted)
        drives = Refitter(program).fit(drives.slugs, drives)
    other = replace(plain.program, fitted=fitted)
    other = _under_noise_of(other, program, plain.final, plain.final.evaluation)
    refitter = Refitter(other)
    base, effects = refitter.fit((), plain.base), refitter.fit(plain.final.slugs, plain.final)
    return _compared(program, drives, other, base, effects)


def _compared(turned: Program, drives: Fit, plain: Program, base: Fit, effects: Fit) -> Weighed:
    """`weighed`, of fits under the same noise.

    Args:
        turned: program with turning points.
        drives: fit of it.
        plain: program without them.
        base: fit of that, or of its model without what is compared.
        effects: fit of that with effects.
    """
    best = min(((turned, drives), (plain, effects)), key=lambda one: one[1].objective)
    inflation, followed = inflation_of(*best), effective_degrees_of_freedom(plain, base)
    choice = log_sets(len(turned.unknowns.slugs), 1)
    return Weighed(
        float(evidence(turned, base, drives, inflation, followed)) - choice,
        float(evidence(plain, base, effects, inflation, followed)),
    )


def _under_noise_of(program: Program, other: Program, fit: Fit, near: Evaluation | None = None) -> Program:
    """A program under the noise of another one of the same campaign, whose drives turn between other rows.

    Args:
        program: program of the campaign.
        other: the other one.
        fit: fit about which inputs' noise is counted and latent trajectories are found.
        near: an evaluation of the program itself close by, if there is one.
    """
    bare = []
    for k, channels in enumerate(program.bare):
        mine, theirs = common_rows(program, other, k)
        bare.append([])
        for channel, known in zip(channels, other.bare[k], strict=True):
            sigma = np.full(len(channel.sigma), np.inf)
            sigma[mine] = known.sigma[theirs]
            correlation = _parted(known.correlation, mine, theirs, len(sigma))
            bare[-1].append(replace(channel, sigma=sigma, correlation=correlation))
    program = replace(program, bare=bare, channels=bare)
    program.count_input_noise(fit.u)
    return program.prepared(fit.u, near)


def _parted(
    correlation: float | np.ndarray, mine: np.ndarray, theirs: np.ndarray, size: int
) -> float | np.ndarray:
    """Correlation of neighbouring errors in a program, of `size` rows, that has fewer rows than another one.

    A row without a reading parts the errors of the other program on its two sides. They are parted here, too.
    Else the same misfit would count differently in both, whatever the drive does in that row.

    Args:
        correlation: that of the other program, one number or one a row.
        mine, theirs: rows that both have, see `common_rows`.
    """
    parted = _parted_rows(mine, theirs)
    if not parted.size and np.ndim(correlation) == 0:
        return correlation
    found = np.zeros(size)
    found[mine] = correlation if np.ndim(correlation) == 0 else np.asarray(correlation)[theirs]
    found[parted] = 0.0
    return found


def _parts_correlated(program: Program, turned: Program) -> bool:
    """True if rows of a program with turning points part errors that correlate in the one without."""
    for k, channels in enumerate(program.bare):
        mine, theirs = common_rows(program, turned, k)
        if not _parted_rows(mine, theirs).size:
            continue
        if any(np.any(np.asarray(one.correlation) != 0.0) for one in channels):
            return True
    return False


def _parted_rows(mine: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Rows of a program before which the other one has rows of its own; see `_parted` for the arguments."""
    return mine[1:][np.diff(theirs) > 1]


def common_rows(one: Program, other: Program, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of recording k that two programs of a campaign share, by their number in each.

    Args:
        one, other: programs of the same campaign, with turning points between rows or without.
        k: number of the recording.
    """
    mine, theirs = (
        np.asarray(p.stacked.time)[k][np.asarray(p.stacked.mask)[k]] for p in (one, other)
    )
    if len(mine) == len(theirs):  # nothing was added; the clock may stand still
        return np.arange(len(mine)), np.arange(len(mine))
    return np.intersect1d(mine, theirs, assume_unique=True, return_indices=True)[1:]


def either(turned: Conclusion, plain: Conclusion, odds: Weighed) -> Conclusion:
    """The conclusion where recordings do not tell turning points from effects: one of the two acts.

    Probabilities are averaged over both. What was concluded with turning points stays the verdict, so that no
    drive that turned between rows is called a mismatch.

    Args:
        turned: conclusion with turning points.
        plain: conclusion without them.
        odds: evidence of both.
    """
    share, there = odds.share, {f.slug for f in turned.found}
    instead = {f.slug: f.probability for f in plain.found}

    def averaged(one: float, other: float) -> float:
        return share * other + (1.0 - share) * one

    found = [
        replace(f, probability=averaged(f.probability, instead.get(f.slug, 0.0))) for f in turned.found
    ]
    hidden = [
        replace(f, probability=averaged(0.0, f.probability))
        for f in plain.found
        if f.slug not in there and f.slug != UNMODELLED
    ]
    if not hidden:  # a second look with turning points names them, too
        return turned
    candidates = {
        slug: (averaged(p, plain.candidates[slug][0]), max(bayes, plain.candidates[slug][1]))
        for slug, (p, bayes) in turned.candidates.items()
    }
    return replace(
        turned,
        found=found,
        candidates=candidates,
        nothing=averaged(turned.nothing, plain.nothing),
        unknown=averaged(turned.unknown, plain.unknown),
        explanation_sets=[*turned.explanation_sets, *plain.explanation_sets],
        next_experiment=_to_tell(hidden),
        without_turns=WithoutTurns(hidden, odds.turns, odds.effects, 1.0 - share),
    )


def _to_tell(hidden: list[Found]) -> dict:
    """The experiment that tells turning points from effects."""
    names = [f.slug for f in hidden]
    acts = f"{joined(names)} {'acts' if len(names) == 1 else 'act'}"
    text = f"{ADVICE}: this tells whether the drive turned between rows or {acts}."
    return {
        "text": text,
        "separates": names,
        "expected_log_bayes_factor": 0.0,  # of an experiment that nothing simulates
    }
