"""Turning points between rows, or effects without them: both may explain the same readings.

A drive that is taken to turn between two rows can hide an effect that acts alike. So the search is made
without these turning points, too. Its effects are weighed against them by evidence over the same base model,
under the same noise.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..evaluate.program import Program
from ..fit.evidence import effective_degrees_of_freedom, evidence, inflation_of, log_sets
from ..fit.refit import Fit, Refitter
from ..search.steps import Explanation
from .conclude import conclude
from .conclusion import Conclusion, WithoutTurns
from .probabilities import UNMODELLED, Found, told_apart, weights_of

TURNED = "The base model fits clearly better with turning points of the drive between rows, listed below"
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
    def apart(self) -> bool:
        """True if the readings tell which of the two acts."""
        return told_apart(max(self.turns, self.effects), min(self.turns, self.effects))

    @property
    def text(self) -> str:
        """Both numbers, as a part of a sentence."""
        return f"log Bayes factors of {self.turns:.0f} with turning points and {self.effects:.0f} without"


def with_turns(turned: Explanation, plain: Explanation) -> tuple[Conclusion, str]:
    """The conclusion where the base model fits clearly better with turning points between rows.

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
    if not _hidden(kept, plain):
        return with_them, f"{TURNED}. No other effect explains the recordings without them. {ADVICE}"
    odds = weighed(kept, plain)
    if odds.apart and odds.turns > odds.effects:
        names = " and ".join(plain.final.slugs)
        said = f"{TURNED}. Without them the evidence of {names} is less ({odds.text}). {ADVICE}"
        return with_them, said
    without = conclude(plain)
    names = " and ".join(f.slug for f in without.found if f.slug != UNMODELLED)
    if not names or not _hidden(kept, without.explanation):
        return with_them, f"{TURNED}. Without them no other effect holds its place. {ADVICE}"
    if without.explanation is not plain:  # not all of its effects held their place
        odds = weighed(kept, without.explanation)
    if odds.apart and odds.effects > odds.turns:
        return without, (
            "The base model fits better with turning points of the drive between rows than without. "
            f"The evidence of {names} is clearly more ({odds.text}), so the drive is taken as it was recorded"
        )
    how = "less" if odds.apart else "as much"
    said = f"{TURNED}. Without them the evidence of {names} is {how} ({odds.text}). {ADVICE}"
    return with_them if odds.apart else either(with_them, without, odds), said


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
    other, base, effects = _under_noise_of(program, plain)
    best = min(((program, drives), (other, effects)), key=lambda one: one[1].objective)
    inflation, followed = inflation_of(*best), effective_degrees_of_freedom(other, base)
    choice = log_sets(len(program.unknowns.slugs), 1)
    return Weighed(
        evidence(program, base, drives, inflation, followed) - choice,
        evidence(other, base, effects, inflation, followed),
    )


def _under_noise_of(turned: Program, plain: Explanation) -> tuple[Program, Fit, Fit]:
    """The campaign without turning points under the noise of the one with them, its base model and its
    effects, both refitted."""
    program, bare = plain.program, []
    for k, channels in enumerate(program.bare):
        rows = recorded_rows(turned, program, k)
        bare.append([])
        for channel, other in zip(channels, turned.bare[k], strict=True):
            sigma = np.full(len(channel.sigma), np.inf)
            sigma[: len(rows)] = other.sigma[rows]
            bare[-1].append(replace(channel, sigma=sigma, correlation=other.correlation))
    program = replace(program, bare=bare, channels=bare, fitted=turned.fitted)
    program.count_input_noise(plain.final.u)
    program = program.prepared(plain.final.u, plain.final.evaluation)
    refitter = Refitter(program)
    return program, refitter.fit((), plain.base), refitter.fit(plain.final.slugs, plain.final)


def recorded_rows(turned: Program, plain: Program, k: int) -> np.ndarray:
    """Rows of recording k that were recorded, among those with turning points.

    Args:
        turned: program of a campaign with turning points.
        plain: program of the same campaign without them.
        k: number of the recording.
    """
    with_them, recorded = (
        np.asarray(one.stacked.time)[k][np.asarray(one.stacked.mask)[k]] for one in (turned, plain)
    )
    if len(with_them) == len(recorded):  # nothing was added; the clock may stand still
        return np.arange(len(recorded))
    return np.searchsorted(with_them, recorded)


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
        next_experiment=_to_tell(hidden, odds),
        without_turns=WithoutTurns(hidden, odds.turns, odds.effects, 1.0 - share),
    )


def _to_tell(hidden: list[Found], odds: Weighed) -> dict:
    """The experiment that tells turning points from effects."""
    names = [f.slug for f in hidden]
    acts = f"{' and '.join(names)} {'acts' if len(names) == 1 else 'act'}"
    text = f"{ADVICE}: this tells whether the drive turned between rows or {acts}."
    return {
        "text": text,
        "separates": names,
        "expected_log_bayes_factor": 0.0,  # of an experiment that nothing simulates
    }
