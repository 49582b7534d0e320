"""Probabilities of explanations, from the evidence of their trials."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneusma_jax.effects import CATALOGUE

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit
from ..fit.evidence import evidence, inflation_of
from ..fit.misfit import reduced
from ..fit.refit import at_its_bound
from ..search.steps import Explanation, LeaveOneOutEvidence
from ..settings import DEFAULT

EVIDENCE = DEFAULT.evidence
VERDICT = DEFAULT.verdict

UNMODELLED = "unmodelled"


@dataclass
class Found:
    """An effect of the final model.

    Attributes:
        slug: or `unmodelled`.
        probability: that it is present.
        bayes: log Bayes factor over the model without it.
        parameters: value, sd and unit by name, SI.
        confusable: slugs that the recordings do not tell it from.
        text: for a laboratory.
    """

    slug: str
    probability: float
    bayes: float
    parameters: dict[str, dict]
    confusable: list[str]
    text: str


def probabilities(
    explanation: Explanation, mismatch: bool, unknown: float
) -> tuple[dict[str, tuple[float, float]], float]:
    """Of each candidate as the strongest explanation, with its log Bayes factor; and of nothing."""
    slugs = explanation.program.unknowns.slugs
    stage = explanation.leading
    trials = {t.slug: t for t in stage.trials} if stage else {}
    bayes = {slug: float(trials[slug].bayes) if slug in trials else VERDICT.untried for slug in slugs}
    if not mismatch:
        nothing = 0.9 + 0.09 * explanation.p_value
        share = (1.0 - nothing) / (len(slugs) + 1)
        return {slug: (share, min(bayes[slug], 0.0)) for slug in slugs}, nothing
    worth = explanation.standings[0].worth if explanation.standings else (lambda trial: trial.bayes)
    logs = [worth(trials[slug]) if slug in trials else VERDICT.untried for slug in slugs]
    weights = (1.0 - unknown) * weights_of(np.array([*logs, -_others(explanation)]))
    bayes |= {s.slug: float(s.own.bayes) for s in explanation.standings}
    shares = {slug: (float(w), bayes[slug]) for slug, w in zip(slugs, weights, strict=False)}
    return shares, float(weights[-1])


def _others(explanation: Explanation) -> float:
    """Log Bayes factor of the effects beside the first one over none: nothing at all lacks it, too."""
    stage = explanation.leading
    if stage is None or not stage.base.slugs:
        return 0.0
    inflation = inflation_of(explanation.program, explanation.final)
    return max(evidence(explanation.program, explanation.base, stage.base, inflation), 0.0)


def weights_of(logs: np.ndarray) -> np.ndarray:
    """Probabilities of explanations from their log Bayes factors.

    No form is quite that of nature: what a right one may leave of the misfit is no evidence for another. So
    differences count in units of that, where it is more than one.
    """
    weights = np.exp((logs - np.max(logs)) / _unit(np.max(logs)))
    return weights / weights.sum()


def _unit(best: float) -> float:
    """Log Bayes factor that the form of the best explanation, which has `best`, may be off by."""
    return max(1.0, VERDICT.imperfect_share * float(best))


def effects_found(explanation: Explanation, unknown: float) -> list[Found]:
    """The effects of the final model; `unknown` is the probability of something else."""
    program, fit = explanation.program, explanation.final
    found = []
    for slug in fit.slugs:
        standing = explanation.named.standings[slug]
        trial = standing.own
        rivals = [t for t in standing.trials if t.slug not in fit.slugs]
        net = standing.net
        weights = weights_of(np.array([net, 0.0, *(standing.worth(t) for t in rivals)]))
        probability = float(weights[0]) * (1.0 - unknown)
        probability = min(
            probability, max(_share(explanation, standing) / VERDICT.minor_share, VERDICT.doubtful)
        )
        if at_its_bound(fit, slug):
            probability *= VERDICT.tentative
        if trial.bayes - trial.adrift < EVIDENCE.minimum_settled:
            probability = min(probability, VERDICT.tentative)
        others = [pair for pair in explanation.contending if slug not in pair]
        if others:
            probability = min(probability, VERDICT.doubtful)
        parameters = {}
        for k in program.unknowns.of([slug]):
            item = program.unknowns.items[k]
            sd = item.spread(fit.u[k], fit.sd(k))
            parameters[item.name] = {"value": float(item.value(fit.u[k])), "sd": float(sd), "unit": item.unit}
        limit = max(EVIDENCE.minimum_difference, 2.0 * _unit(net))
        close = [t.slug for t in rivals if net - t.bayes < limit or _alike(program, t, standing)]
        close += dict.fromkeys(s for pair in others for s in pair if s not in close and s not in fit.slugs)
        found.append(
            Found(
                slug, min(probability, 0.999), float(trial.bayes), parameters, close, CATALOGUE[slug].sentence
            )
        )
    return found


def _share(explanation: Explanation, standing: LeaveOneOutEvidence) -> float:
    """Part of all misfit explained that an effect takes away beside the others."""
    whole = explanation.base.objective - explanation.final.objective
    return (standing.base.objective - standing.own.fit.objective) / max(whole, 1e-9)


def _alike(program: Program, rival: CandidateFit, standing: LeaveOneOutEvidence) -> bool:
    """Whether a rival explains the recordings nearly as well: its misfit is as good as noise, too."""
    mine, other = (reduced(program, t.fit, program.fitted) for t in (standing.own, rival))
    return (
        other < VERDICT.alike_factor * max(mine, 1.0) and standing.net - rival.bayes < VERDICT.alike_evidence
    )


def explanation_set(
    candidates: dict[str, tuple[float, float]], unknown: float, found: Sequence[Found] = ()
) -> list[str]:
    """The fewest candidates whose probabilities reach `SET`, and those that the recordings do not tell from
    one of them that is named."""
    pool = {slug: p for slug, (p, _) in candidates.items()} | {UNMODELLED: unknown}
    chosen, total = [], 0.0
    for slug in sorted(pool, key=lambda s: -pool[s]):
        chosen.append(slug)
        total += pool[slug]
        if total >= VERDICT.set_probability:
            break
    alike = [slug for f in found if f.slug in chosen and f.slug != UNMODELLED for slug in f.confusable]
    return [*chosen, *dict.fromkeys(slug for slug in alike if slug in candidates and slug not in chosen)]
