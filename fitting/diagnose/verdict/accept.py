"""Removal of effects that recordings do not need, or with which those not fitted are predicted worse."""

from dataclasses import replace

import numpy as np

from ..fit.evidence import inflation_of
from ..fit.misfit import accurate, limit_of
from ..fit.prediction import Loss, predictive_chi_square
from ..fit.refit import Fit
from ..search.decision import counts
from ..search.pool import without
from ..search.steps import Explanation, Named
from ..settings import DEFAULT
from .held_out import Scores
from .instrument_accuracy import beyond_accuracy, excused
from .probabilities import effects_found
from .refusals import needless, refused

EVIDENCE = DEFAULT.evidence
EXCESS = DEFAULT.excess


def accepted(explanation: Explanation, scores: Scores) -> tuple[Explanation, list[str]]:
    """The explanation without effects that make held-out predictions worse.

    The effect goes first whose absence costs the fit least. The others are weighed anew. All go where the
    base model is as accurate as instruments are whose noise nobody states, unless instruments would not err
    like that: with these effects, or with a discrepancy of any form. This is asked again of effects that stay
    when others went.

    Args:
        explanation: result of a search; it is not changed.
        scores: scores of recordings that were not fitted.

    Returns:
        The explanation, and a sentence for every set that was removed.
    """
    said, program = [], explanation.program
    close = accurate(program, explanation.base)
    while explanation.final.slugs:
        if close and not beyond_instruments(explanation) and excused(program, explanation.base):
            said.append(needless([one.sized for one in effects_found(explanation, 0.0)]))
            return _with_names_of(explanation, explanation.base), said
        before, after = scores.held_out(explanation)
        if after.reduced_chi2 <= before.reduced_chi2:
            break
        slugs = explanation.final.slugs
        rest = [without(program, explanation.final, slug) for slug in slugs] if len(slugs) > 1 else []
        if not contradicts(explanation, scores.lost(program, explanation.final, [explanation.base, *rest])):
            break
        said.append(refused(slugs, before.how, before.reduced_chi2, after.reduced_chi2))
        fewer = min(rest, key=lambda fit: fit.objective, default=explanation.base)
        explanation = _with_names_of(explanation, fewer)
        if fewer.slugs and explanation.weigh_effects is not None:
            explanation.named = explanation.weigh_effects(explanation, fewer)
    return explanation, said


def beyond_instruments(explanation: Explanation) -> bool:
    """True if effects explain a misfit to the noise, and static errors of instruments do not.

    A faint misfit may be left. An inaccurate instrument errs by a function of what it reads, which is the
    same whatever else happens.
    """
    program, base, fit = explanation.program, explanation.base, explanation.final
    for mask in (program.fitted, program.unseen):
        left = predictive_chi_square(program, fit, mask)
        if np.isnan(left) or left > max(limit_of(program, mask), 1.0 + EXCESS.little):
            return False
    return bool(beyond_accuracy(program, base, fit) > EVIDENCE.minimum_settled)


def _with_names_of(explanation: Explanation, fit: Fit) -> Explanation:
    """The explanation with the effects of another fit, and what was known before."""
    fewer = replace(explanation, named=Named(fit), contending=[])
    fewer.scores = explanation.scores
    return fewer


def contradicts(explanation: Explanation, loss: Loss) -> bool:
    """True if held-out values contradict the effects, by more than chance and than left-out parts outweigh.

    A validation recording in which an effect hardly acts is missed a little more or less by chance.

    Args:
        explanation: result of a search.
        loss: of held-out values by the effects, see `Scores.lost`.
    """
    program, parts = explanation.program, explanation.left_out
    fell = parts[0] - parts[1] if parts[0] > parts[1] else 0.0  # also where they are NaN, not computed
    return counts(program, explanation.final, loss, fell, inflation_of(program, explanation.final))
