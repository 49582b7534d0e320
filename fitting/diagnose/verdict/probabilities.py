"""Probabilities of explanations, from the evidence of their candidates."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fitting.inference.parameters.table import format_estimate
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.units import amount

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit
from ..fit.evidence import evidence, inflation_of
from ..fit.misfit import accurate, reduced
from ..fit.refit import Fit, at_an_end, at_its_bound
from ..fit.standard_errors import standard_covariance
from ..search.decision import leaves_more
from ..search.steps import Explanation, LeaveOneOutEvidence
from ..settings import DEFAULT
from .instrument_accuracy import beyond_accuracy

CANDIDATES = DEFAULT.candidates
EVIDENCE = DEFAULT.evidence
PROBABILITY = DEFAULT.probability
SHARE = DEFAULT.share

UNMODELLED = "unmodelled"


@dataclass
class Found:
    """An effect of the final model.

    Attributes:
        slug: or `unmodelled`.
        probability: probability that it is present.
        bayes: log Bayes factor over the model without it.
        parameters: value, sd and unit by name, SI.
        confusable: slugs that the recordings do not tell it from.
        text: description for a laboratory.
        instead: probability of each candidate in its place beside the other effects, its own included.
        strength: name of the parameter that tells best how strong it is; empty where none does.
        errors: by how many standard errors that strength is from its absence [1].
        at_an_end: True if that strength ended at an end of its range, so that its error tells little.
        together: the sum of strengths of terms that may change places, where it is told better than each of
            them; None where there is no such sum.
    """

    slug: str
    probability: float
    bayes: float
    parameters: dict[str, dict]
    confusable: list[str]
    text: str
    instead: dict[str, float] = field(default_factory=dict)
    strength: str = ""
    errors: float = np.inf
    at_an_end: bool = False
    together: "Together | None" = None

    @property
    def tentative(self) -> bool:
        """True if a report says "perhaps" of the name.

        It is no likelier than tentative ones are, or the error of every strength exceeds it.
        """
        hardly = bool(self.probability <= PROBABILITY.tentative or self.errors < 1.0)
        return self.slug != UNMODELLED and hardly

    @property
    def words(self) -> str:
        """The name with its strength and the error of that; of a tentative one with its probability."""
        return self._with([f"probability {self.probability:.2f}"] if self.tentative else [])

    @property
    def sized(self) -> str:
        """The name with its strength and the error of that."""
        return self._with([])

    def _with(self, told: list[str]) -> str:
        """The name with something in brackets, and then its strength."""
        if self.together:
            told = [*told, self.together.words]
        elif self.strength:
            entry = self.parameters[self.strength]
            size = format_estimate(entry["value"], entry["sd"]).replace("+/-", "±")
            end = ", an end of its range" if self.at_an_end else ""
            told = [*told, f"{self.strength} = {amount(size, entry['unit'])}{end}"]
        return f"{self.slug} ({', '.join(told)})" if told else self.slug


@dataclass(frozen=True)
class Together:
    """The sum of strengths of terms of one form, which recordings tell better than any of them.

    Attributes:
        names: names of the strengths.
        value, sd: their sum and its standard error, SI.
        unit: their unit.
    """

    names: tuple[str, ...]
    value: float
    sd: float
    unit: str

    @property
    def words(self) -> str:
        """The sum with its error: `g_1 + g_3 = 0.312 ± 0.010`."""
        size = format_estimate(self.value, self.sd).replace("+/-", "±")
        return f"{' + '.join(self.names)} = {amount(size, self.unit)}"


def probabilities(
    explanation: Explanation, mismatch: bool, unknown: float
) -> tuple[dict[str, tuple[float, float]], float]:
    """Probability of each candidate as the strongest explanation, with its evidence; and of nothing.

    Recordings that contradict nothing do not show that nothing is missing: an effect may be too weak to be
    seen. The chance of the base's misfit does not tell the two apart.
    """
    slugs = explanation.program.unknowns.slugs
    step = explanation.leading
    candidates = {t.slug: t for t in step.candidates} if step else {}
    untried = CANDIDATES.untried
    bayes = {slug: float(candidates[slug].bayes) if slug in candidates else untried for slug in slugs}
    if not mismatch:
        nothing = PROBABILITY.tentative
        share = (1.0 - nothing) / (len(slugs) + 1)
        return {slug: (share, min(bayes[slug], 0.0)) for slug in slugs}, nothing
    worth = (
        explanation.leave_one_out[0].worth
        if explanation.leave_one_out
        else (lambda candidate: candidate.bayes)
    )
    logs = [worth(candidates[slug]) if slug in candidates else untried for slug in slugs]
    weights = (1.0 - unknown) * weights_of(np.array([*logs, -_others(explanation)]))
    bayes |= {s.slug: float(s.own.bayes) for s in explanation.leave_one_out}
    shares = {slug: (float(w), bayes[slug]) for slug, w in zip(slugs, weights, strict=False)}
    return shares, float(weights[-1])


def _others(explanation: Explanation) -> float:
    """Log Bayes factor over the base model of the effects beside the first one."""
    step = explanation.leading
    if step is None or not step.base.slugs:
        return 0.0
    inflation = inflation_of(explanation.program, explanation.final)
    return max(evidence(explanation.program, explanation.base, step.base, inflation), 0.0)


def weights_of(logs: np.ndarray) -> np.ndarray:
    """Probabilities of explanations from their log Bayes factors.

    No form is exactly nature's. A right one may leave a small share of the misfit, which is no evidence for
    another. So differences count in units of that share, where it is more than one.
    """
    weights = np.exp((logs - np.max(logs)) / imperfection_of(np.max(logs)))
    return weights / weights.sum()


def imperfection_of(best: float) -> float:
    """Log Bayes factor by which the form of the best explanation may be off."""
    return max(1.0, SHARE.small * float(best))


def told_apart(best: float, other: float) -> bool:
    """True if the best of two log Bayes factors is so much larger that recordings tell explanations apart."""
    return best - other >= max(EVIDENCE.minimum_difference, 2.0 * imperfection_of(best))


def effects_found(
    explanation: Explanation, unknown: float, moved: np.ndarray | None = None
) -> list[Found]:
    """The effects of the final model.

    Args:
        explanation: result of the search.
        unknown: probability of something else.
        moved: by how much numbers of the model move beside a smooth function, see `standard_errors`.
    """
    program, fit = explanation.program, explanation.final
    covariance = standard_covariance(program, fit, moved) if fit.slugs else np.zeros((0, 0))
    errors, found = np.sqrt(np.diag(covariance)), []
    strongest = max(explanation.leave_one_out, key=lambda one: one.net, default=None)
    by_form = _left_by_form(explanation)
    for slug in fit.slugs:
        one_out = explanation.named.leave_one_out[slug]
        candidate = one_out.own
        rivals = [t for t in one_out.candidates if t.slug not in fit.slugs]
        net = one_out.net
        weights = weights_of(np.array([net, 0.0, *(one_out.worth(t) for t in rivals)]))
        instead = dict(zip([slug, *(t.slug for t in rivals)], np.delete(weights, 1).tolist(), strict=True))
        probability = float(weights[0]) * (1.0 - unknown)
        if one_out is not strongest:
            share = _share(explanation, one_out) / by_form
            probability = min(probability, max(share, PROBABILITY.doubtful))
        if at_its_bound(fit, slug):
            probability *= PROBABILITY.tentative
        if candidate.bayes - candidate.explained_by_instruments < EVIDENCE.minimum_settled or like_accuracy(
            explanation, one_out
        ):
            probability = min(probability, PROBABILITY.tentative)
        others = [pair for pair in explanation.contending if slug not in pair]
        if others:
            probability = min(probability, PROBABILITY.doubtful)
        parameters = {}
        for k in program.unknowns.of([slug]):
            item = program.unknowns.items[k]
            sd = item.spread(fit.u[k], float(errors[k]))
            parameters[item.name] = {"value": float(item.value(fit.u[k])), "sd": float(sd), "unit": item.unit}
        own = program.unknowns.amplitudes(slug)
        distance = np.abs(fit.u[own] - program.unknowns.neutral[own])
        away = distance / np.maximum(errors[own], np.finfo(float).tiny)
        best = int(np.argmax(away))
        together = sum_of_terms(program, fit, covariance, slug)
        if together is not None and together.value <= together.sd * away[best]:
            together = None
        close = [t.slug for t in rivals if not told_apart(net, t.bayes) or _alike(program, t, one_out)]
        close += dict.fromkeys(s for pair in others for s in pair if s not in close and s not in fit.slugs)
        found.append(
            Found(
                slug,
                min(probability, 0.999),
                float(candidate.bayes),
                parameters,
                close,
                CATALOGUE[slug].sentence_for(program.specimen.letter),
                instead,
                program.unknowns.items[own[best]].name,
                float(away[best] if together is None else together.value / together.sd),
                int(own[best]) in at_an_end(program.unknowns, fit, slug),
                together,
            )
        )
    return found


def like_accuracy(explanation: Explanation, one_out: LeaveOneOutEvidence) -> bool:
    """True if errors of instruments of unstated noise explain an effect.

    A set may be clear of such errors while one of its effects, beside the others, is not. Or a discrepancy is
    clear of them, and the effect is not.
    """
    program = explanation.program
    if not accurate(program, explanation.base):
        return False
    return bool(beyond_accuracy(program, one_out.base, one_out.own.fit) < EVIDENCE.minimum_settled)


def sum_of_terms(program: Program, fit: Fit, covariance: np.ndarray, slug: str) -> Together | None:
    """Sum of the strengths of an effect's terms that may change places; None where fewer than two act.

    Terms with times that recordings hardly tell apart share one size. Each has then an error as large as
    itself, while their sum is told well.

    Args:
        program: program of the campaign.
        fit: model with the effect.
        covariance: covariance of its scaled numbers, see `standard_covariance`.
        slug: the effect.
    """
    unknowns = program.unknowns
    terms = {name for term in CATALOGUE[slug].alike for name in term}
    own = [k for k in unknowns.amplitudes(slug) if unknowns.items[k].name in terms and fit.u[k]]
    if len(own) < 2:
        return None
    items = [unknowns.items[k] for k in own]
    scale = np.array([item.scale for item in items])
    variance = float(scale @ covariance[np.ix_(own, own)] @ scale)
    value = sum(float(item.value(fit.u[k])) for item, k in zip(items, own, strict=True))
    sd = float(np.sqrt(max(variance, np.finfo(float).tiny)))
    return Together(tuple(item.name for item in items), value, sd, items[0].unit)


def none_likelier_than_acting(
    candidates: dict[str, tuple[float, float]], nothing: float, unknown: float, found: Sequence[Found]
) -> tuple[dict[str, tuple[float, float]], float, float]:
    """Probabilities of the strongest explanation, of which no effect has more than it acts at all.

    What doubts that a named effect acts leaves its place to all else. Other candidates, nothing and something
    unknown share what it loses in proportion, so a rival of far less evidence gains next to nothing.

    Args:
        candidates: probability and evidence of each as the strongest effect.
        nothing: probability that nothing is missing.
        unknown: probability of something unknown.
        found: effects with the probability that each acts.

    Returns:
        The candidates, nothing and something unknown anew, with the same sum.
    """
    acts = {one.slug: one.probability for one in found}
    kept = {slug: min(p, acts.get(slug, 1.0)) for slug, (p, _) in candidates.items()}
    lost = sum(p - kept[slug] for slug, (p, _) in candidates.items())
    others = nothing + unknown + sum(p for slug, p in kept.items() if slug not in acts)
    grown = 1.0 + lost / others if others > 0.0 else 1.0
    shares = {slug: (p if slug in acts else p * grown, candidates[slug][1]) for slug, p in kept.items()}
    return shares, nothing * grown, unknown * grown


def _left_by_form(explanation: Explanation) -> float:
    """Share of all explained misfit that the imperfect form of an effect may leave to another one.

    The strongest effect is none that such a form leaves. A form that is right to a small share leaves no more
    than that. It is told by a set that leaves noise alone. Forms that leave more may be worse.
    """
    more = leaves_more(explanation.program, explanation.final, explanation.left_out[1])
    return SHARE.minor if more else SHARE.small


def _share(explanation: Explanation, one_out: LeaveOneOutEvidence) -> float:
    """Share of all explained misfit that an effect removes beside the others."""
    whole = explanation.base.objective - explanation.final.objective
    return (one_out.base.objective - one_out.own.fit.objective) / max(whole, 1e-9)


def _alike(program: Program, rival: CandidateFit, one_out: LeaveOneOutEvidence) -> bool:
    """True if a rival explains the recordings nearly as well, down to the noise."""
    mine, other = (reduced(program, t.fit, program.fitted) for t in (one_out.own, rival))
    return (
        other < (1.0 + SHARE.alike) * max(mine, 1.0)
        and one_out.net - rival.bayes < EVIDENCE.minimum_settled
    )


def explanation_sets(
    candidates: dict[str, tuple[float, float]], unknown: float, found: Sequence[Found] = ()
) -> list[list[str]]:
    """For each effect that is there, the fewest candidates of which it is one, likely enough.

    Effects that the recordings do not tell from a named one are added to its set.

    Args:
        candidates: probability and evidence of each as the strongest effect.
        unknown: probability of something unknown.
        found: effects of the final model; none where nothing is named.

    Returns:
        The set of the strongest effect first, of which something unknown may be one.
    """
    named = [f for f in found if f.slug != UNMODELLED]

    def with_alike(chosen: list[str], whose: Sequence[Found]) -> list[str]:
        alike = [slug for f in whose if f.slug in chosen for slug in f.confusable]
        return [*chosen, *dict.fromkeys(s for s in alike if s in candidates and s not in chosen)]

    first = _fewest({slug: p for slug, (p, _) in candidates.items()} | {UNMODELLED: unknown})
    others = [f for f in named if f.slug not in first and f.instead] if len(named) > 1 else []
    return [with_alike(first, named), *(with_alike(_fewest(f.instead), [f]) for f in others)]


def _fewest(pool: dict[str, float]) -> list[str]:
    """The fewest members that together are likely enough, the likeliest first."""
    chosen, total = [], 0.0
    for slug in sorted(pool, key=lambda s: -pool[s]):
        chosen.append(slug)
        total += pool[slug]
        if total >= PROBABILITY.sure:
            break
    return chosen
