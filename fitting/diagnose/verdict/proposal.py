"""The experiment that a report proposes: the one that separates its two leading explanations."""

from fitting.inference.numbers import number

from ..fit.evidence import inflation_of
from ..fit.refit import Fit
from ..search.steps import Explanation
from ..settings import DEFAULT
from .next_experiment import best_design
from .probabilities import UNMODELLED, Found
from .separating import separating

EVIDENCE = DEFAULT.evidence
PROBABILITY = DEFAULT.probability


def proposed(explanation: Explanation, found: list[Found]) -> dict | None:
    """The experiment that separates the two leading explanations; None where there are none.

    Args:
        explanation: result of the search.
        found: effects and `unmodelled`, as the report names them.

    Returns:
        Its text, the names that it separates, and the log Bayes factor that it is expected to bring.
    """
    pair = leading_pair(explanation, found)
    if pair is None:
        return None
    (name, first), (other, second) = pair
    letter, program = explanation.program.specimen.letter, explanation.program
    effects = [slug for slug in (name, other) if slug != UNMODELLED]
    asked = separating(effects, letter)
    design = best_design(program, first, second)
    if design is None:
        return {"text": asked, "separates": [name, other], "expected_log_bayes_factor": 0.0}
    worth = design.log_bayes / inflation_of(program, min(first, second, key=lambda fit: fit.objective))
    tells = f"tell {name} from {other}" if len(effects) > 1 else f"tell whether {name} acts"
    demand = f" ({design.demand})" if design.demand else ""
    barred = (
        f" It would tell more {design.impossible}, but the specimen would have to cool faster than in any"
        " recording so far."
        if design.impossible
        else ""
    )
    repeat = f"Repeat {design.recording} {design.change}{demand}: it would {tells}."
    text = f"{repeat} {_enough(worth)}{barred} {asked}"
    return {"text": text, "separates": [name, other], "expected_log_bayes_factor": float(worth)}


def _enough(worth: float) -> str:
    """A sentence on the log Bayes factor that a repetition is expected to bring, beside the one that settles.

    It is of the repetition alone, so it is another number than that of the recordings so far.
    """
    settled = EVIDENCE.minimum_settled
    end = "it is expected to settle that" if worth > settled else "alone it is not expected to settle that"
    return (
        f"By a log Bayes factor of its own of about {number(worth, '.2g')}, where {number(settled)} are "
        f"enough, {end}."
    )


def leading_pair(
    explanation: Explanation, found: list[Found]
) -> tuple[tuple[str, Fit], tuple[str, Fit]] | None:
    """The two explanations that a report leaves open first, each by its name and its fit.

    A named effect that the recordings do not tell from another one comes first, with that other. Otherwise
    it is the first name with its best rival that has a chance. Where `unmodelled` comes first, it is the
    rival of the likeliest effect that has any evidence. The model without the effect then stands for it,
    since nothing says how it would act.
    """
    if not found:
        return None
    named = [f for f in found if f.slug in explanation.named.leave_one_out]
    if not named or found[0].slug == UNMODELLED:
        return _from_unmodelled(explanation, named)
    for one in named:
        beside = explanation.named.leave_one_out[one.slug]
        fits = {candidate.slug: candidate.fit for candidate in beside.candidates}
        alike = [slug for slug in one.confusable if slug in fits]
        if alike:
            return (one.slug, fits[one.slug]), (alike[0], fits[alike[0]])
    beside = explanation.named.leave_one_out[named[0].slug]
    own = named[0].slug, beside.own.fit
    likely = {slug for slug, chance in named[0].instead.items() if chance >= PROBABILITY.least}
    rivals = [(t.slug, t.fit) for t in beside.candidates if t.slug in likely - set(explanation.final.slugs)]
    return own, next(iter([*rivals, (UNMODELLED, beside.base)]))


def _from_unmodelled(
    explanation: Explanation, named: list[Found]
) -> tuple[tuple[str, Fit], tuple[str, Fit]] | None:
    """The likeliest effect, and something unmodelled in its place; None where no effect has any evidence."""
    if named:
        beside = explanation.named.leave_one_out[named[0].slug]
        return (named[0].slug, beside.own.fit), (UNMODELLED, beside.base)
    best = explanation.first
    if best is None or best.bayes <= 0.0:
        return None
    return (best.slug, best.fit), (UNMODELLED, explanation.leading.base)
