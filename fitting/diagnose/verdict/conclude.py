"""The verdict of a search: probabilities of every candidate, of nothing and of something unknown."""

import numpy as np

from pneusma_jax.effects import CATALOGUE
from pneusma_jax.model_discrepancy import WALL

from ..evaluate.program import Program
from ..fit.misfit import floor, limit_of, predictive_chi_square, reduced
from ..fit.refit import Fit
from ..search.steps import Explanation
from ..settings import DEFAULT
from .accept import accepted
from .conclusion import Conclusion
from .discrepancy import Discrepancy, beside, fitted_discrepancy
from .discrepancy_evidence import DiscrepancyEvidence, best_discrepancy
from .held_out import Correction, HeldOut, Scores
from .left import left_of
from .locate import Place, locate
from .next_experiment import best_design
from .probabilities import (
    UNMODELLED,
    Found,
    effects_found,
    explanation_set,
    probabilities,
    weights_of,
)
from .text import contended, separating
from .unexplained import (
    by_discrepancy,
    contradicted,
    discrepancy_probability,
    helps_nobody,
    leaves_more,
    outdone,
    refuted,
    steady,
    tail,
    unexplained,
)

SCORE_TEST = DEFAULT.score_test
VERDICT = DEFAULT.verdict


def conclude(explanation: Explanation) -> Conclusion:
    """The conclusion of a search."""
    scores = Scores()
    explanation, taken_back = accepted(explanation, scores)
    program = explanation.program
    masks = program.fitted, program.unseen
    base, alone = (
        [f(program, explanation.base, mask) for mask in masks] for f in (predictive_chi_square, reduced)
    )
    last, kept = (
        [f(program, explanation.final, mask) for mask in masks] for f in (predictive_chi_square, reduced)
    )
    floors = [floor(program, explanation.final, mask) for mask in masks]
    named = bool(explanation.final.slugs)
    if min(base) > VERDICT.gross and explanation.p_value > SCORE_TEST.level:
        explanation.p_value = tail(program, base[0])
    discrepancy = best_discrepancy(program, explanation.base)
    mismatch = named or contradicted(explanation, base, discrepancy, floors)
    limits = [limit_of(program, mask) for mask in masks]
    unknown = unexplained(alone, last, floors, limits) if mismatch else 0.0
    if named:
        unknown = max(unknown, refuted(explanation, discrepancy, limits, base, last))
    if mismatch and not named:
        unknown = discrepancy_probability(explanation, base, discrepancy, floors, unknown)
    if not mismatch:  # no candidate survived being fitted; what is left is judged as a whole
        explanation.p_value = max(explanation.p_value, tail(program, steady(base[0], discrepancy)))
        explanation.p_is_bound = False
    more = leaves_more(alone, last, floors) or helps_nobody(alone, kept, floors, explanation.left_out)
    lost = outdone(explanation, discrepancy) if named else 0.0
    beyond = named and unknown <= 0.5 and (more or lost > 0.0)
    unknown = max(unknown, VERDICT.beside_unknown) if beyond else unknown
    rest = beside(program, explanation.final) if beyond or (named and last[0] > limits[0]) else None
    left = left_of(program, explanation.final, rest) if named else None
    if left is not None and not left.trusted:
        unknown = max(unknown, VERDICT.refuted_unknown)
    candidates, nothing = probabilities(explanation, mismatch, unknown)
    unknown = max(0.0, 1.0 - nothing - sum(p for p, _ in candidates.values()))
    found = effects_found(explanation, unknown) if named else []
    place, members = locate(explanation), _members(explanation)
    if mismatch and (unknown > 0.5 or not named):
        if by_discrepancy(discrepancy):
            place = place.led_by(discrepancy.driver)
        seen = None if discrepancy is None else discrepancy.quantity
        found, model, rest, before, after = _described(explanation, place, seen, unknown, found, scores)
        share = unknown if named else 1.0
        members = [(s, p, f, (1.0 - share) * w, more) for s, p, f, w, more in members if s != "base"]
        members.insert(0, (UNMODELLED, *model, share, rest and rest.corrected))
    else:
        before, after = scores.held_out(explanation)
        with_rest = [] if rest is None else [(program, explanation.final, 1.0, rest.corrected)]
        smoothed = scores.averaged(with_rest) if with_rest else after
        if smoothed.reduced_chi2 > after.reduced_chi2:
            rest = None
        if rest is not None:
            after = smoothed
            members = [(*member[:4], rest.corrected) for member in members]
        if beyond:
            rival = None if more else discrepancy
            found.append(_left_over(explanation, unknown, last, found, rival, lost))
        found.sort(key=lambda f: -f.probability)
    names = any(f.slug != UNMODELLED for f in found)
    shown = explanation.final if names else explanation.base
    left = left_of(program, shown, rest, after.reduced_chi2) if mismatch else None
    return Conclusion(
        explanation,
        mismatch,
        place,
        _component(explanation, found, discrepancy),
        found,
        candidates,
        nothing,
        unknown,
        explanation_set(candidates, unknown, found) if mismatch else [],
        before,
        after,
        scores.averaged([member[1:] for member in members]) if len(members) > 1 else after,
        {slug: w for slug, _, _, w, _ in members},
        _next(explanation, found),
        rest,
        discrepancy,
        [*taken_back, *_contending(explanation, found)],
        left=left,
    )


def _contending(explanation: Explanation, found: list[Found]) -> list[str]:
    """Remark on pairs that contend with the named set, if there is one."""
    if not found or found[0].slug == UNMODELLED:
        return []
    return [contended(pair) for pair in explanation.contending if set(pair) != set(explanation.final.slugs)]


def _described(
    explanation: Explanation,
    place: Place,
    seen: str | None,
    unknown: float,
    doubtful: list[Found],
    scores: Scores,
) -> tuple[list[Found], tuple[Program, Fit], Discrepancy | None, HeldOut, HeldOut]:
    """The model discrepancy and the scores where something is unmodelled.

    Doubtful effects stay if held-out recordings need them. A smooth term stays if it predicts them better.
    """
    alone = [_unmodelled(unknown, doubtful, explanation)]
    program = explanation.program
    before = scores.averaged([(program, explanation.base, 1.0)])
    options = [(before, alone, explanation.base, None)]
    if doubtful:
        score = scores.averaged([(program, explanation.final, 1.0)])
        if score.reduced_chi2 - 1.0 < VERDICT.maximum_kept * max(before.reduced_chi2 - 1.0, 0.0):
            options.append(
                (score, [*alone, *sorted(doubtful, key=lambda f: -f.probability)], explanation.final, None)
            )
    for _, found, fit, _ in tuple(options):
        rest = fitted_discrepancy(program, fit, place, seen)
        if rest is not None:
            options.append((scores.averaged([(program, fit, 1.0, rest.corrected)]), found, fit, rest))
    after, found, fit, rest = min(options, key=lambda option: option[0].reduced_chi2)
    return found, (program, fit), rest, before, after


def _members(explanation: Explanation) -> list[tuple[str, Program, Fit, float, Correction | None]]:
    """Explanations that predictions average over: candidates for the last effect, by their probabilities."""
    if not explanation.leave_one_out:
        return [("base", explanation.program, explanation.base, 1.0, None)]
    last = explanation.leave_one_out[-1]
    weights = weights_of(np.array([last.worth(t) for t in last.candidates]))
    kept = [
        (t, w)
        for t, w in zip(last.candidates, weights, strict=True)
        if w >= VERDICT.minimum_weight or t.slug == last.slug
    ]
    total = sum(w for _, w in kept)
    program, final = explanation.program, explanation.final
    return [
        (t.slug, program, final if t.slug == last.slug else t.fit, float(w / total), None) for t, w in kept
    ]


def _left_over(
    explanation: Explanation,
    unknown: float,
    last: list[float],
    found: list[Found],
    rival: DiscrepancyEvidence | None,
    lost: float,
) -> Found:
    """Misfit that named effects leave, as an entry of its own beside them.

    Args:
        explanation: result of the search.
        unknown: probability of something unknown.
        last: predictive chi-squares of the model with the effects.
        found: the named effects.
        rival: discrepancy that predicts held-out recordings better, where the effects leave no more than
            noise.
        lost: log-likelihood by which it does.
    """
    program, names = explanation.program, [f.slug for f in found]
    masks = program.fitted, program.unseen
    excess = [(left - 1.0) * program.observations(mask) for left, mask in zip(last, masks, strict=True)]
    text = (
        f"{' and '.join(names)} {'leaves' if len(names) == 1 else 'leave'} more than noise: the form is not "
        "quite nature's, or something else acts as well or instead."
    )
    if rival is not None:
        text = (
            f"A smooth function of {rival.driver.replace('_', ' ')} without a name predicts recordings that "
            f"are left out better than {' and '.join(names)}: that may stand for something else."
        )
    return Found(UNMODELLED, float(unknown), max(lost, float(0.5 * max(excess))), {}, names, text)


def _unmodelled(unknown: float, found: list[Found], explanation: Explanation) -> Found:
    base = reduced(explanation.program, explanation.base, explanation.program.fitted)
    text = (
        "What the recordings show is none of the effects that are known here; nothing named explains "
        "enough of it."
    )
    if found:
        text += f" Nearest is {found[0].slug}, which leaves too much."
    return Found(
        UNMODELLED,
        float(unknown),
        float(0.5 * (base - 1.0) * explanation.program.observations(explanation.program.fitted)),
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


def _next(explanation: Explanation, found: list[Found]) -> dict | None:
    """The experiment that separates the best explanation from its nearest rival."""
    first = explanation.first
    if not first or not found:
        return None
    rivals = [t for t in explanation.leading.candidates if t is not first]
    names = [first.slug, *(t.slug for t in rivals[:1])]
    if not rivals:
        return {
            "text": separating(names),
            "separates": names,
            "expected_log_bayes_factor": max(first.bayes, 0.0),
        }
    design = best_design(explanation.program, first, rivals[0])
    if design is None:
        return {"text": separating(names), "separates": names, "expected_log_bayes_factor": 0.0}
    text = (
        f"Repeat {design.recording} {design.change}: it would tell {names[0]} from {names[1]} by a log Bayes "
        f"factor of about {design.log_bayes:.3g}. {separating(names)}"
    )
    return {"text": text, "separates": names, "expected_log_bayes_factor": float(design.log_bayes)}
