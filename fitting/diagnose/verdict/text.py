"""The text of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence

from fitting.inference.noise import ACCURACY
from fitting.inference.notes import capital, joined
from fitting.inference.numbers import number
from fitting.specimens import specimen_of
from fitting.specimens.rows import of_specimen
from pneusma_jax.units import amount, constant_from_si

from ..evaluate.unknowns import Unknown
from ..fit.base_fit import told_at_bound
from ..fit.misfit import accurate, relative_error
from ..settings import DEFAULT
from .conclusion import Conclusion
from .exchangeable import Exchange
from .instrument_accuracy import beyond_accuracy
from .misfit_text import (
    by_chance,
    chance_of,
    excuse,
    in_units,
    missed_validation,
    not_fitted,
    repeating,
    unstated_noise,
    went,
)
from .probabilities import UNMODELLED

EVIDENCE = DEFAULT.evidence
PROBABILITY = DEFAULT.probability


def verdict_sentences(conclusion: Conclusion) -> list[str]:
    """The verdict first, in a few short sentences, then what stands behind it.

    What named effects leave qualifies the verdict, so its sentence follows directly.
    """
    verdict, *behind = _verdict(conclusion)
    verdict, rival = _or_without_turns(conclusion, verdict)
    other = ["No [geometry] is stated: another specimen than the source's looks like this, too."]
    other = other if unstated(conclusion) else []
    near = [one for one in conclusion.exchanges if one.named or not conclusion.named]  # the page has all
    exchanged = exchange_sentences(conclusion, near)[:1]
    return [verdict, *_open(conclusion), *other, *rival, *behind, *exchanged]


def _or_without_turns(conclusion: Conclusion, verdict: str) -> tuple[str, list[str]]:
    """The verdict, and sentences on effects that explain the recordings as well without turning points.

    If the recordings agree with the base model, the verdict names both explanations.
    """
    rival = conclusion.without_turns
    if rival is None:
        return verdict, []
    whole, names = base_named(conclusion), joined([f.slug for f in rival.found])
    told = (
        f"Turning points have a log Bayes factor of {rival.turns:.0f}, {names} without them of "
        f"{rival.effects:.0f}. That is too small a difference beside what either explains to tell which acts."
    )
    effects = joined([f"{f.slug} ({f.probability:.2f})" for f in rival.found])
    if conclusion.mismatch:
        acts = "acts" if len(rival.found) == 1 else "act"
        return verdict, [f"Or the drive did not turn between rows, and {effects} {acts}.", told]
    both = (
        f"One of two acts. Either the drive turned between rows (probability {rival.probability:.2f}), and "
        f"the recordings agree with {whole}. Or it did not, and that model leaves out {effects}."
    )
    return both, [told, *(f.text for f in rival.found)]


def exchange_sentences(conclusion: Conclusion, chosen: Sequence[Exchange]) -> list[str]:
    """Sentences on constants and errors of instruments that explain the same, the largest move first.

    Args:
        conclusion: the conclusion.
        chosen: those of its `exchanges` that are told.
    """
    program, fit = conclusion.model
    specimens, said = [r.specimen for r in program.recordings], []

    def sized(item: Unknown, value: float) -> str:
        return amount(number(float(constant_from_si(value, item.unit)), ".4g"), item.unit)

    for one in sorted(chosen, key=lambda x: -abs(fit.u[x.constant])):
        constant, strength = (program.unknowns.items[k] for k in (one.constant, one.strength))
        name = of_specimen(constant.name, specimens)
        nominal, now = (sized(constant, float(constant.value(u))) for u in (0.0, fit.u[one.constant]))
        there = sized(strength, float(strength.value(one.value)))
        if one.named:
            here = sized(strength, float(strength.value(fit.u[one.strength])))
            said.append(
                f"The recordings do not tell {strength.effect} from {name} being off within its tolerance. "
                f"Fitted together, {name} is {now} and {strength.name} is {here}. With {name} as stated, "
                f"{nominal}, {strength.name} is {there}. Measure {name} again."
            )
        else:
            said.append(
                f"Within its tolerance {name} went from {nominal} to {now}. With {name} as stated, "
                f"{strength.effect} with {strength.name} = {there} explains the same. These recordings do "
                f"not tell which it is. Measure {name} again, or check the instrument."
            )
    return said


def unstated(conclusion: Conclusion) -> list[str]:
    """Names of recordings that contradict the model and do not state their specimen where its size counts."""
    recordings = conclusion.explanation.program.recordings if conclusion.mismatch else []
    return [r.name for r in recordings if not r.geometry and specimen_of(r.kind).sized]


def _verdict(conclusion: Conclusion) -> list[str]:
    """The verdict, and what stands behind it."""
    if conclusion.within_accuracy:
        return [*_as_accurate(conclusion), *repeating(conclusion)]
    return _contradicted(conclusion) if conclusion.mismatch else _agreed(conclusion)


def _agreed(conclusion: Conclusion) -> list[str]:
    """Sentences where the recordings agree with the base model."""
    as_turned = "A " if conclusion.without_turns is None else "With the turning points a "
    return [
        f"The recordings agree with {base_named(conclusion)} within its tolerances and their noise.",
        *_at_ends(conclusion),
        f"{as_turned}misfit as large as this one would arise by chance with a probability of "
        f"{chance_of(conclusion.explanation)}.",
        *missed_validation(conclusion),
        *repeating(conclusion),
        *unstated_noise(conclusion),
    ]


def _contradicted(conclusion: Conclusion) -> list[str]:
    """Sentences where the recordings contradict the base model, with names that explain it or without."""
    base, after = conclusion.before, conclusion.after
    over = [f for f in conclusion.found[1:] if f.slug == UNMODELLED]  # beside a name that comes first
    names = [f.slug for f in conclusion.found if f not in over]
    unnamed = names[0] == UNMODELLED
    lead = _unnamed(conclusion) if unnamed else _named(conclusion, names)
    it, with_it = _with_doubtful(conclusion, names[1:]) if unnamed else _with_named(conclusion, names)
    held, chance = not_fitted(base.how), by_chance(conclusion.explanation)
    if not with_it:
        return [
            lead,
            "Nothing that was recorded goes with what is left closely enough to be modelled: the misfit "
            f"of {held} stays at a reduced chi-square of {number(base.reduced_chi2)}.",
            *_within_accuracy(conclusion, it),
            *repeating(conclusion),
            *in_units(conclusion),
            chance,
        ]
    change = went(base.reduced_chi2, after.reduced_chi2)
    allowed = excuse(conclusion) if change.startswith("rises") and not unnamed else ""
    return [
        lead,
        *_not_told_apart(conclusion),
        *(f.text for f in over),
        f"{with_it} the misfit of {held} {change}{allowed}.",
        *_within_accuracy(conclusion, it),
        *repeating(conclusion),
        *in_units(conclusion, it),
        chance,
    ]


def _within_accuracy(conclusion: Conclusion, it: str) -> list[str]:
    """Sentences where a misfit is as small as instruments of unstated noise may make it, and counts."""
    program, base = conclusion.explanation.program, conclusion.explanation.base
    if not accurate(program, base):
        return []
    beyond = "But errors that depend on readings, and slow drifts, do not explain what it misses."
    final = conclusion.explanation.final
    if conclusion.named and beyond_accuracy(program, base, final) > EVIDENCE.minimum_settled:
        beyond = f"But no error that depends on a reading, and no slow drift, explains as much as {it}."
    share, most = (number(100.0 * x, ".2g") for x in (relative_error(program, base), ACCURACY))
    return [
        f"The base model misses no output by more than {share} % of its range in a recording "
        "(root mean square).",
        f"Nobody states the noise, and ordinary instruments are accurate to {most} %. {beyond}",
    ]


def _unnamed(conclusion: Conclusion) -> str:
    """The first sentences where no name comes first."""
    whole, rival = base_named(conclusion), conclusion.discrepancy
    if conclusion.unknown > PROBABILITY.tentative or conclusion.explanation.final.slugs or rival is None:
        return unexplained(conclusion, whole)
    return (
        f"The recordings may contradict {whole}, but no known effect explains them. A smooth "
        f"function of {rival.driver.replace('_', ' ')} does, with a log Bayes factor of "
        f"{number(rival.bayes, '.2g')}, which is little."
    )


def _smooth(conclusion: Conclusion) -> str:
    """The remainder of the augmented model in words; empty without one."""
    rest = conclusion.remainder
    return "" if rest is None else f"a smooth function of {rest.driver} added to {rest.quantity}"


def _with_named(conclusion: Conclusion, names: Sequence[str]) -> tuple[str, str]:
    """Pronoun of names, and the beginning of a sentence about the model with them."""
    it, leaves = ("it", "it leaves") if len(names) == 1 else ("them", "they leave")
    smooth = _smooth(conclusion)
    beside = f" and, for what {leaves}, {smooth}, which names no cause," if smooth else ""
    return it, f"With {it}{beside}"


def _with_doubtful(conclusion: Conclusion, names: Sequence[str]) -> tuple[str, str]:
    """The same of names behind an unknown cause, and of a remainder; empty where there is neither."""
    smooth, is_it = _smooth(conclusion), "is" if len(names) == 1 else "are"
    terms = [f"{joined(names)}, which {is_it} doubtful,"] if names else []
    if smooth:
        terms.append(f"{smooth}, which names no cause,")
    it = "it" if len(names) + bool(smooth) == 1 else "them"
    return it, f"With {' and '.join(terms)}" if terms else ""


def _as_accurate(conclusion: Conclusion) -> list[str]:
    """Sentences where nobody states the noise, and the base model misses no more than instruments do."""
    error = relative_error(conclusion.explanation.program, conclusion.explanation.base)
    share, most = (number(100.0 * x, ".2g") for x in (error, ACCURACY))
    return [
        f"The recordings agree with {base_named(conclusion)}: it misses no output by more than {share} % of "
        "its range in a recording (root mean square).",
        *_at_ends(conclusion),
        f"Nobody states their noise, and ordinary instruments are accurate to {most} %. State it, under "
        "[noise], to have a smaller misfit judged.",
    ]


def _at_ends(conclusion: Conclusion) -> list[str]:
    """A sentence on constants of an accepted base model that nothing but their bounds held."""
    program, fit = conclusion.model
    names = told_at_bound(program, fit)
    if not names:
        return []
    ends = "the end of what is known of it" if len(names) == 1 else "the ends of what is known of them"
    return [f"It does so with {joined(names)} at {ends}, which may hide what the model leaves out."]


def unexplained(conclusion: Conclusion, whole: str) -> str:
    """The first sentences where nothing that has a name explains the recordings: that, and what is left."""
    left, what = conclusion.left, "no effect that is known here explains them"
    misread, rest = conclusion.explanation.misread, conclusion.remainder
    if misread is not None:
        return f"{misread.text} Until that is known, trust no name."
    if left is None or left.open:
        return f"The recordings contradict {whole}, and {what}."
    smooth = [] if rest is None else [f"a smooth function of {rest.driver.replace('_', ' ')}"]
    if left.names:
        what = "something unknown is likelier than any name" if left.trusted else "no name is to be trusted"
    beside = [*left.names, *smooth]
    fitted = [f"This is with {joined(beside)} fitted."] if beside else []
    return " ".join([f"The recordings contradict {whole}, and {what}.", *fitted, left.text])


def _named(conclusion: Conclusion, names: Sequence[str]) -> str:
    """The first sentences where effects are named: these, and what they leave beyond noise and uncertainty.

    Names that are hardly likelier than not come last, after "perhaps".
    """
    left = "" if conclusion.left is None or conclusion.left.open else f". {conclusion.left.text}"
    named = [f for f in conclusion.found if f.slug in names]
    sure, perhaps = (joined([f.words for f in named if f.tentative is doubt]) for doubt in (False, True))
    whole = capital(base_named(conclusion))
    if not perhaps:
        lead = f"{whole} leaves out {sure}"
    elif sure:
        lead = f"{whole} leaves out {sure}, and perhaps {perhaps}"
    else:
        lead = f"{whole} perhaps leaves out {perhaps}"
    if len(names) > 1:
        return f"{lead}{left}" if left else f"{lead}."
    return f"{lead}{left} {named[0].text}" if left else f"{lead}: {named[0].text}"


def _open(conclusion: Conclusion) -> list[str]:
    """Sentences on what a model leaves, where the uncertainty of fitted numbers explains it."""
    left = conclusion.left
    if left is None or not left.open or conclusion.explanation.misread is not None:
        return []
    return [left.text]


def base_named(conclusion: Conclusion) -> str:
    """The base model, and in brackets what it is where that is not the published one as it stands."""
    what = conclusion.start.words
    return f"the base model ({what})" if what else "the base model"


def _not_told_apart(conclusion: Conclusion) -> list[str]:
    """Effects that explain the recordings as well as those that are named."""
    said = []
    for f in conclusion.found:
        if f.slug != UNMODELLED and f.confusable:
            said.append(f"These recordings do not tell {f.slug} from {' or '.join(f.confusable)}.")
    return said


def place_text(conclusion: Conclusion) -> str:
    """Paragraph about the place of the misfit."""
    place = conclusion.place
    if conclusion.within_accuracy:
        return (
            "What the base model misses is less than instruments of unstated noise do, so no place is told."
        )
    if not conclusion.mismatch:
        return "No part of the recordings departs from the base model by more than its noise."
    drivers = ", ".join(place.drivers) or "nothing that was recorded"
    text = f"The misfit of the refitted base model goes with {drivers} (strongest first). "
    if any(driver.startswith("xi0") for driver in place.drivers):
        text += "xi0 is the martensite fraction of a spring: 1 cold, 0 fully heated. "
    if place.regions:
        text += f"It is where {place.regions[0]}. "
    if place.like_time:
        also = place.like_time.replace("_", " ")
        text += f"Time goes with {also} in the fitted recordings: a change with time would look the same. "
    return text + f"The part of the model that is concerned: {conclusion.component.replace('_', ' ')}."
