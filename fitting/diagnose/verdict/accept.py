"""Removal of effects with which recordings that were not fitted are predicted worse."""

from dataclasses import replace

from ..fit.evidence import inflation_of
from ..search.decision import outweighs
from ..search.pool import without
from ..search.steps import Explanation, Named
from .held_out import HeldOut, Scores
from .text import refused


def accepted(explanation: Explanation, scores: Scores) -> tuple[Explanation, list[str]]:
    """The explanation without effects that make held-out predictions worse.

    The effect goes first whose absence costs the fit least. The others are weighed anew.

    Args:
        explanation: result of a search; it is not changed.
        scores: scores of recordings that were not fitted.

    Returns:
        The explanation, and a sentence for every set that was removed.
    """
    said, program = [], explanation.program
    while explanation.final.slugs:
        before, after = scores.held_out(explanation)
        if not rises_too_much(explanation, before, after, scores):
            break
        slugs = explanation.final.slugs
        said.append(refused(slugs, before.how, before.reduced_chi2, after.reduced_chi2))
        rest = [without(program, explanation.final, slug) for slug in slugs] if len(slugs) > 1 else []
        fewer = min(rest, key=lambda fit: fit.objective, default=explanation.base)
        known = explanation.scores
        explanation = replace(explanation, named=Named(fewer), contending=[])
        explanation.scores = known
        if fewer.slugs and explanation.weigh_effects is not None:
            explanation.named = explanation.weigh_effects(explanation, fewer)
    return explanation, said


def rises_too_much(explanation: Explanation, before: HeldOut, after: HeldOut, scores: Scores) -> bool:
    """True if held-out values contradict the effects, by more than chance and than left-out parts outweigh.

    A validation recording in which an effect hardly acts is missed a little more or less by chance. Whole
    recordings that are left out in turn are extrapolated: there, the predictions' own uncertainty counts.
    """
    lost = 0.5 * after.values * (after.reduced_chi2 - before.reduced_chi2)
    if lost > 0.0 and after.how == "left out in turn":
        lost = scores.lost(explanation)
    program, parts = explanation.program, explanation.left_out
    fell = parts[0] - parts[1] if parts[0] > parts[1] else 0.0  # also where they are NaN, not computed
    return outweighs(program, lost, fell, inflation_of(program, explanation.final))
