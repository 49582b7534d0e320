"""Removal of effects with which recordings that were not fitted are predicted worse."""

from dataclasses import replace

from ..search.pool import without
from ..search.steps import Explanation, Named
from .held_out import Scores
from .text import refused, went


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
        if not went(before.reduced_chi2, after.reduced_chi2).startswith("rises"):
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
