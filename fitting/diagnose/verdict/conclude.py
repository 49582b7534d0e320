"""The verdict of a search: probabilities of every candidate, of nothing and of something unknown."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.inference.notes import joined
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.model_discrepancy import WALL

from ..evaluate.program import Program
from ..fit.evidence import log_likelihood
from ..fit.misfit import reduced, scored
from ..fit.refit import Fit
from ..search.steps import Explanation
from ..settings import DEFAULT
from .accept import accepted
from .assess import Assessment, assess
from .conclusion import Conclusion
from .discrepancy import Discrepancy, fitted_discrepancy
from .discrepancy_evidence import DiscrepancyEvidence
from .held_out import Correction, HeldOut, Scores
from .left import left_of
from .locate import Place, locate
from .probabilities import (
    UNMODELLED,
    Found,
    effects_found,
    explanation_sets,
    none_likelier_than_acting,
    probabilities,
    weights_of,
)
from .proposal import proposed
from .refusals import beyond_form, contended, small_share
from .repeats import Repeats, repeats_of
from .unexplained import by_discrepancy

PROBABILITY = DEFAULT.probability
SHARE = DEFAULT.share

Member = tuple[str, Program, Fit, float, Correction | None]
"""A model that predictions average over: its last effect, program, fit, weight [1] and correction."""


@dataclass(frozen=True)
class _Account:
    """What is told of a search beside its probabilities.

    Attributes:
        found: effects, and something without a name.
        place: where the misfit is.
        fit: the model that is told.
        before, after: scores on left-out recordings without the effects, and with the model that is told.
        rest: smooth discrepancy beside it, if one predicts better.
        repeats: period of the misfit, where that was asked.
        members: models that predictions average over, see `_members`.
    """

    found: list[Found]
    place: Place
    fit: Fit
    before: HeldOut
    after: HeldOut
    rest: Discrepancy | None
    repeats: Repeats | None
    members: list[Member]


def conclude(explanation: Explanation) -> Conclusion:
    """The conclusion of a search."""
    scores = Scores()
    explanation, judged, taken_back = _assessed(explanation, scores)
    program, mismatch, moving = explanation.program, judged.mismatch, judged.moving
    candidates, nothing = probabilities(explanation, mismatch, judged.unknown)
    unknown = max(0.0, 1.0 - nothing - sum(p for p, _ in candidates.values()))
    found = effects_found(explanation, unknown, moving and moving.moved) if judged.named else []
    if judged.mimicked and not judged.beyond:
        unknown += _share_with_lookalikes(judged.mimicked, candidates, found)
    unnamed = mismatch and (unknown > 0.5 or not judged.named)
    candidates, nothing, unknown = none_likelier_than_acting(candidates, nothing, unknown, found)
    told = (_without_names if unnamed else _with_names)(explanation, judged, unknown, found, scores)
    found, rest, before, after = told.found, told.rest, told.before, told.after
    names = any(f.slug != UNMODELLED for f in found)
    shown = explanation.final if names else explanation.base
    left = left_of(program, shown, rest, after.reduced_chi2, explanation.base) if mismatch else None
    if left is not None and judged.unsupported and names:
        left = replace(left, supports=False)
    several = len(told.members) > 1
    return Conclusion(
        explanation,
        mismatch,
        told.place,
        _component(explanation, found, judged.discrepancy),
        found,
        candidates,
        nothing,
        unknown,
        explanation_sets(candidates, unknown, found) if mismatch else [],
        before.within_errors(program, explanation.base),
        after.within_errors(program, told.fit, rest),
        scores.averaged([member[1:] for member in told.members]) if several else after,
        {slug: w for slug, _, _, w, _ in told.members},
        proposed(explanation, found),
        rest,
        judged.discrepancy,
        [*taken_back, *_contending(explanation, found)],
        left=left,
        signs=judged.signs,
        repeats=told.repeats,
        moving=moving,
    )


def _assessed(explanation: Explanation, scores: Scores) -> tuple[Explanation, Assessment, list[str]]:
    """The accepted explanation with its assessment, and remarks on what was taken back.

    The second look of a search counts where the first one finds the recordings consistent.
    """
    explanation, taken_back = accepted(explanation, scores)
    judged, second = assess(explanation, scores), explanation.second_look
    if second is not None and not judged.mismatch and (found_together := assess(second, scores)).mismatch:
        explanation, judged, taken_back = second, found_together, []  # what was removed is of the first look
    return explanation.with_chance(*judged.chance), judged, taken_back


def _with_names(
    explanation: Explanation, judged: Assessment, unknown: float, found: list[Found], scores: Scores
) -> _Account:
    """Account of named effects with what they leave, or of recordings that are consistent."""
    before, after, rest = _with_rest(explanation, judged.rest, scores)
    members = _members(explanation)
    if rest is not None:
        members = [(*member[:4], rest.corrected) for member in members]
    program = explanation.program
    # a period may pass for noise that nobody states
    hidden = not judged.mismatch and not program.noise_stated
    repeats = repeats_of(program, explanation.final) if hidden or judged.beyond else None
    found = list(found)
    if judged.beyond:
        found.append(_left_over(explanation, unknown, judged, found))
    found.sort(key=lambda f: -f.probability)
    if judged.mimicked and not judged.beyond:  # last: nothing in the recordings speaks against a name
        found.append(_lookalike(judged.mimicked))
    return _Account(found, locate(explanation), explanation.final, before, after, rest, repeats, members)


def _without_names(
    explanation: Explanation, judged: Assessment, unknown: float, found: list[Found], scores: Scores
) -> _Account:
    """Account of something without a name; doubtful effects stay beside it where they predict better."""
    place, discrepancy = locate(explanation), judged.discrepancy
    if by_discrepancy(discrepancy):
        place = place.led_by(discrepancy.driver)
    seen = None if discrepancy is None else discrepancy.quantity
    found, fit, rest, repeats, before, after = _described(explanation, place, seen, unknown, found, scores)
    share = unknown if judged.named else 1.0
    members = [
        (s, p, f, (1.0 - share) * w, more) for s, p, f, w, more in _members(explanation) if s != "base"
    ]
    members.insert(0, (UNMODELLED, explanation.program, fit, share, rest and rest.corrected))
    return _Account(found, place, fit, before, after, rest, repeats, members)


def _with_rest(
    explanation: Explanation, rest: Discrepancy | None, scores: Scores
) -> tuple[HeldOut, HeldOut, Discrepancy | None]:
    """Scores without and with the effects, and the discrepancy beside them where it predicts better."""
    before, after = scores.held_out(explanation)
    if rest is None:
        return before, after, None
    smoothed = scores.averaged([(explanation.program, explanation.final, 1.0, rest.corrected)])
    return (before, after, None) if smoothed.reduced_chi2 > after.reduced_chi2 else (before, smoothed, rest)


def _contending(explanation: Explanation, found: list[Found]) -> list[str]:
    """Remark on sets that contend with the named one, or with the base model where nothing is found."""
    if found and found[0].slug == UNMODELLED:
        return []
    named = explanation.final.slugs
    others = [one for one in explanation.contending if set(one) != set(named)]
    said = [contended(one, bool(named)) for one in others]
    said += [beyond_form(slug, named) for slug in explanation.beyond_form]
    return said + [small_share(slug, named) for slug in explanation.of_all if named]


def _described(
    explanation: Explanation,
    place: Place,
    seen: str | None,
    unknown: float,
    doubtful: list[Found],
    scores: Scores,
) -> tuple[list[Found], Fit, Discrepancy | None, Repeats | None, HeldOut, HeldOut]:
    """Effects, fit, discrepancy, period and both scores of `_Account`, where something is unmodelled.

    Doubtful effects stay if held-out recordings need them. A smooth term stays if it predicts them better.
    """
    doubtful = sorted(doubtful, key=lambda f: -f.probability)
    alone = [_unmodelled(unknown, doubtful, explanation)]
    program = explanation.program
    before = scores.averaged([(program, explanation.base, 1.0)])
    models = [(before, alone, explanation.base)]
    if doubtful:
        score = scores.averaged([(program, explanation.final, 1.0)])
        if score.reduced_chi2 - 1.0 < SHARE.most * max(before.reduced_chi2 - 1.0, 0.0):
            models.append((score, [*alone, *doubtful], explanation.final))
    options = []
    for score, found, fit in models:
        repeats = repeats_of(program, fit)
        options.append((score, found, fit, None, repeats))
        rest = fitted_discrepancy(program, fit, place, seen, repeats)
        if rest is not None:
            score = scores.averaged([(program, fit, 1.0, rest.corrected)])
            options.append((score, found, fit, rest, repeats))
    after, found, fit, rest, repeats = min(options, key=lambda option: option[0].reduced_chi2)
    return found, fit, rest, repeats, before, after


def _members(explanation: Explanation) -> list[Member]:
    """Explanations that predictions average over: candidates for the last effect, by their probabilities."""
    if not explanation.leave_one_out:
        return [("base", explanation.program, explanation.base, 1.0, None)]
    last = explanation.leave_one_out[-1]
    weights = weights_of(np.array([last.worth(t) for t in last.candidates]))
    kept = [
        (t, w)
        for t, w in zip(last.candidates, weights, strict=True)
        if w >= PROBABILITY.least or t.slug == last.slug
    ]
    total = sum(w for _, w in kept)
    program, final = explanation.program, explanation.final
    return [
        (t.slug, program, final if t.slug == last.slug else t.fit, float(w / total), None) for t, w in kept
    ]


def _left_over(explanation: Explanation, unknown: float, judged: Assessment, found: list[Found]) -> Found:
    """Misfit that named effects leave, as an entry of its own beside them.

    Args:
        explanation: result of the search.
        unknown: probability of something unknown as the strongest.
        judged: what speaks for it; it may act beside the names with a larger probability.
        found: the named effects.
    """
    program, names = explanation.program, [f.slug for f in found]
    masks = scored(program)
    excess = [
        (left - 1.0) * program.observations(mask) for left, mask in zip(judged.last, masks, strict=True)
    ]
    text = (
        f"{joined(names)} {'leaves' if len(names) == 1 else 'leave'} more than noise: the form is not "
        "quite nature's, or something else acts as well or instead."
    )
    if by_discrepancy(judged.further):
        text = (
            f"Beside {joined(names)}, {_function_of(judged.further)} has a log Bayes factor of "
            f"{judged.further.bayes:.3g}: the form is not quite nature's, or something else acts as well or "
            "instead."
        )
    if judged.rival is not None:
        well = "better than" if judged.lost > 0.0 else "about as well as"
        text = (
            f"A smooth function of {judged.rival.driver.replace('_', ' ')} without a name predicts "
            f"recordings that are left out {well} {joined(names)}: that may stand for something else."
        )
    if judged.unsupported:
        text = (
            f"With {joined(names)} values that were not fitted are missed more than by the base model. So "
            f"nothing outside the fit supports {'it' if len(names) == 1 else 'them'}, and something else may "
            "act instead."
        )
    text = " ".join([text, *([_looks_like(judged.mimicked)] if judged.mimicked else ())])
    further = 0.0 if judged.further is None else judged.further.bayes
    log_bayes = max(judged.lost, further, float(0.5 * max(excess)) / explanation.inflation, 0.0)
    return Found(UNMODELLED, float(max(unknown, judged.acts_beside)), log_bayes, {}, names, text)


def _function_of(one: DiscrepancyEvidence) -> str:
    """A discrepancy in words."""
    return f"a change of {one.quantity.replace('_', ' ')} with {one.driver.replace('_', ' ')}"


def _share_with_lookalikes(
    slugs: tuple[str, ...], candidates: dict[str, tuple[float, float]], found: list[Found]
) -> float:
    """Take a share of their probability from effects that something without a name looks like.

    The evidence of a further effect was computed beside such a name. Where something else acts in its
    place, an effect of less evidence may be what the name's form leaves of it. So it gives the share, too.

    Args:
        slugs: effects that something without a name looks like.
        candidates: probability and evidence of each as the strongest effect; those of `slugs` are replaced.
        found: the named effects; their probabilities are replaced.

    Returns:
        Probability that the strongest effect is one without a name.
    """
    kept, moved = 1.0 - PROBABILITY.beside, 0.0
    for slug in slugs:
        probability, bayes = candidates[slug]
        candidates[slug] = kept * probability, bayes
        moved += (1.0 - kept) * probability
    doubted = max((one.bayes for one in found if one.slug in slugs), default=-np.inf)
    for one in found:
        one.probability *= kept if one.slug in slugs or one.bayes < doubted else 1.0
    return moved


def _lookalike(slugs: tuple[str, ...]) -> Found:
    """Something outside the catalogue that looks like named effects, as an entry of its own beside them."""
    return Found(UNMODELLED, PROBABILITY.beside, 0.0, {}, list(slugs), _looks_like(slugs))


def _looks_like(slugs: tuple[str, ...]) -> str:
    """What is known to look like named effects, in sentences."""
    alike = [(slug, CATALOGUE[slug].lookalike) for slug in slugs]
    return " ".join(f"{other[0].upper()}{other[1:]} looks the same as {slug}." for slug, other in alike)


def _unmodelled(unknown: float, found: list[Found], explanation: Explanation) -> Found:
    """Something unmodelled in place of every effect.

    Its log Bayes factor is what the base model's misfit beyond noise is worth. What the base fit paid in
    priors and trajectories does not count, so it is no bound for effects.
    """
    program, misread = explanation.program, explanation.misread
    excess = reduced(program, explanation.base, program.fitted) - 1.0
    text = (
        "What the recordings show is none of the effects that are known here; nothing named explains "
        "enough of it."
    )
    if misread is not None:
        text = misread.text
    elif found:
        text += f" Nearest is {found[0].slug}, which leaves too much."
    if excess > 0.0:
        text += (
            " The log Bayes factor is what the misfit beyond noise is worth. An effect may have more: it may "
            "also bring constants back to nominal, or make a latent trajectory steadier."
        )
    return Found(
        UNMODELLED,
        float(unknown),
        log_likelihood(program, float(excess), explanation.inflation),
        {},
        [f.slug for f in found],
        text,
    )


def _component(explanation: Explanation, found: list[Found], discrepancy: DiscrepancyEvidence | None) -> str:
    """Component in which a report locates the misfit; springs of an actuator by their number."""
    if not found:
        return "none"
    named = [f.slug for f in found if f.slug != UNMODELLED]
    if not named or found[0].slug == UNMODELLED:
        softened = by_discrepancy(discrepancy) and discrepancy.quantity == WALL
        return "elastomer" if softened else _guess(explanation)
    program = explanation.program
    return program.specimen.located(CATALOGUE[named[0]].component, program.recordings, named[0])


def _guess(explanation: Explanation) -> str:
    """Component of a misfit that no effect explains: that of the best candidate."""
    if explanation.first:
        component, program = CATALOGUE[explanation.first.slug].component, explanation.program
        return program.specimen.located(component, program.recordings, "")
    return "unknown"

