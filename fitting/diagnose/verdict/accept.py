"""Removal of effects with which recordings that were not fitted are predicted worse."""

from dataclasses import replace

from ..fit.evidence import inflation_of
from ..search.decision import outweighs
from ..search.pool import without
from ..search.steps import Explanation, Named
from .held_out import Scores
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
        if after.reduced_chi2 <= before.reduced_chi2:
            break
        slugs = explanation.final.slugs
        rest = [without(program, explanation.final, slug) for slug in slugs] if len(slugs) > 1 else []
        if not contradicts(explanation, scores.lost(program, explanation.final, [explanation.base, *rest])):
            break
        said.append(refused(slugs, before.how, before.reduced_chi2, after.reduced_chi2))
        fewer = min(rest, key=lambda fit: fit.objective, default=explanation.base)
        known = explanation.scores
        explanation = replace(explanation, named=Named(fewer), contending=[])
        explanation.scores = known
        if fewer.slugs and explanation.weigh_effects is not None:
            explanation.named = explanation.weigh_effects(explanation, fewer)
    return explanation, said


def contradicts(explanation: Explanation, lost: float) -> bool:
    """True if held-out values contradict the effects, by more than chance and than left-out parts outweigh.

    A validation recording in which an effect hardly acts is missed a little more or less by chance.

    Args:
        explanation: result of a search.
        lost: log predictive density of held-out values that the effects cost, see `Scores.lost`.
    """
    program, parts = explanation.program, explanation.left_out
    fell = parts[0] - parts[1] if parts[0] > parts[1] else 0.0  # also where they are NaN, not computed
    return outweighs(program, lost, fell, inflation_of(program, explanation.final))
