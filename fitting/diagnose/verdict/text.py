"""The text of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.data.recordings import schema
from fitting.inference.noise import ACCURACY
from fitting.inference.notes import capital, joined
from fitting.inference.numbers import number
from fitting.specimens import specimen_of
from fitting.specimens.rows import of_specimen
from pneusma_jax.errors import counted
from pneusma_jax.units import amount, constant_from_si, from_si

from ..evaluate.unknowns import Unknown
from ..fit.base_fit import told_at_bound
from ..fit.misfit import limit_of, range_of, relative_error
from ..fit.prediction import predictive_chi_square
from ..settings import DEFAULT
from .conclusion import Conclusion
from .exchangeable import Exchange
from .unexplained import missed_beyond_drift

EXCESS = DEFAULT.excess
PROBABILITY = DEFAULT.probability

REPEATING = {
    "time": "a pump, a switched heater or mains hum",
    "strain": "the error of a screw or a gear",
    "elongation": "the error of a screw or a gear",
}
"""What is known to repeat along a driver."""


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
    base, after = conclusion.before, conclusion.after
    bound = "at most " if conclusion.explanation.p_is_bound else ""
    chance = _probability(conclusion.explanation.p_value, bound)
    as_turned = "A " if conclusion.without_turns is None else "With the turning points a "
    if conclusion.within_accuracy:
        return [*_as_accurate(conclusion), *_repeating(conclusion)]
    if not conclusion.mismatch:
        return [
            f"The recordings agree with {base_named(conclusion)} within its tolerances and their noise.",
            *_at_ends(conclusion),
            f"{as_turned}misfit as large as this one would arise by chance with a probability of {chance}.",
            *_not_fitted(conclusion),
            *_repeating(conclusion),
            *_unstated_noise(conclusion),
        ]
    over = [f for f in conclusion.found[1:] if f.slug == "unmodelled"]  # beside a name that comes first
    names = [f.slug for f in conclusion.found if f not in over]
    if names and names[0] == "unmodelled":
        whole = base_named(conclusion)
        lead = unexplained(conclusion, whole)
        rival = conclusion.discrepancy
        if (
            conclusion.unknown <= PROBABILITY.tentative
            and not conclusion.explanation.final.slugs
            and rival is not None
        ):
            lead = (
                f"The recordings may contradict {whole}, but no known effect explains them. A smooth "
                f"function of {rival.driver.replace('_', ' ')} does, with a log Bayes factor of "
                f"{number(rival.bayes, '.2g')}, which is little."
            )
    else:
        lead = _named(conclusion, names)
    held = not_fitted(base.how)
    rest = conclusion.remainder
    smooth = f"a smooth function of {rest.driver} added to {rest.quantity}" if rest is not None else ""
    it = "it" if len(names) == 1 else "them"
    with_it, allowed = f"With {it}", ""
    if names[0] == "unmodelled":
        is_it = "is" if len(names) == 2 else "are"
        terms = [f"{joined(names[1:])}, which {is_it} doubtful,"] if names[1:] else []
        if smooth:
            terms.append(f"{smooth}, which names no cause,")
        if not terms:
            return [
                lead,
                "Nothing that was recorded goes with what is left closely enough to be modelled: the misfit "
                f"of {held} stays at a reduced chi-square of {number(base.reduced_chi2)}.",
                *_repeating(conclusion),
                *_in_units(conclusion),
                _by_chance(chance),
            ]
        one = len(names[1:]) + bool(smooth) == 1
        it, with_it = "it" if one else "them", f"With {' and '.join(terms)}"
    elif went(base.reduced_chi2, after.reduced_chi2).startswith("rises"):
        allowed = _excuse(conclusion)
    if smooth and names[0] != "unmodelled":
        leaves = "it leaves" if len(names) == 1 else "they leave"
        with_it += f" and, for what {leaves}, {smooth}, which names no cause,"
    return [
        lead,
        *_not_told_apart(conclusion),
        *(f.text for f in over),
        f"{with_it} the misfit of {held} {went(base.reduced_chi2, after.reduced_chi2)}{allowed}.",
        *_repeating(conclusion),
        *_in_units(conclusion, it),
        _by_chance(chance),
    ]


def _unstated_noise(conclusion: Conclusion) -> list[str]:
    """A sentence on noise that is told from the recordings themselves."""
    if conclusion.explanation.program.noise_stated:
        return []
    return [
        "The size of the noise is not stated, and was told from the recordings. What changes slowly may pass "
        "for it: state it under [noise] to have a smaller misfit judged."
    ]


def _repeating(conclusion: Conclusion) -> list[str]:
    """A sentence on the period of a misfit without a name."""
    found = conclusion.repeats
    if found is None:
        return []
    kind = conclusion.explanation.program.kind
    sizes = []
    for name, value in ((found.driver, found.period), (found.quantity, found.amplitude)):
        column = schema.column_of(kind, name)
        unit = "1" if column is None else schema.quantity_and_unit(column)[1]
        sizes.append(_sized(from_si(value, unit, difference=True), unit))
    period, amplitude = sizes
    driver, quantity = (name.replace("_", " ") for name in (found.driver, found.quantity))
    every = period if found.driver == "time" else f"{period} of {driver}"
    cause = REPEATING.get(found.driver)
    like = f", as {cause} does" if cause else ""
    said = [f"A part of the misfit of {quantity} repeats every {every}{like}. Its amplitude is {amplitude}."]
    tried = counted(found.tries, "search", "searches")
    said.append(
        f"Chance alone would confirm so clear a period with a probability of {number(found.p_value, '.2g')},"
        f" counted over {tried} along time and the load."
    )
    if found.seconds is not None:
        said.append(
            f"It repeats every {number(found.seconds)} s as well, as {REPEATING['time']} does: "
            "at another rate only one of the two stays."
        )
    return said


def _excuse(conclusion: Conclusion) -> str:
    """Reason why names stay with which the misfit of left-out recordings rises, after a comma."""
    alone, named = conclusion.explanation.left_out
    rise = conclusion.after.reduced_chi2 - conclusion.before.reduced_chi2
    if rise > EXCESS.clear and alone > named:
        parts = f", while that of parts of recordings {went(alone, named)}"
        return f"{parts}: it predicts better between what was recorded, and worse beyond it"
    return ", no more than chance and the other recordings allow"


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


def _in_units(conclusion: Conclusion, found: str = "") -> list[str]:
    """A sentence with the errors on values that were not fitted, in the units of the recordings.

    Args:
        conclusion: the conclusion.
        found: pronoun for what was found; empty where nothing was.
    """
    program, said = conclusion.explanation.program, []
    after = conclusion.after.by_column(program.kind)
    for column, before in conclusion.before.by_column(program.kind).items():
        quantity, unit = schema.quantity_and_unit(column)
        first, then = (_sized(x, unit) for x in (before, after[column]))
        share = conclusion.before.rmse[quantity] / max(range_of(program, quantity), np.finfo(float).tiny)
        size = f"{first} ({number(100.0 * share, '.2g')} % of its range)"
        both = f"{size} without {found} and {then} with {found}" if found else size
        said.append(f"of {quantity.replace('_', ' ')} is {both}")
    if not said:
        return []
    apart = [_MEASURES] if found and _opposed(conclusion, after) else []
    return [f"The root mean square error {', that '.join(said)}.", *apart]


_MEASURES = (
    "Chi-square and root mean square error go opposite ways: the first weighs every row by its noise and its "
    "correlation with neighbours, the second weighs all rows alike."
)


def _opposed(conclusion: Conclusion, after: Mapping[str, float]) -> bool:
    """True if the reduced chi-square falls while a root mean square error rises, as shown, or the reverse."""
    kind = conclusion.explanation.program.kind
    falls = number(conclusion.after.reduced_chi2) != number(conclusion.before.reduced_chi2)
    down = conclusion.after.reduced_chi2 < conclusion.before.reduced_chi2
    errors = [(number(before), number(after[c])) for c, before in conclusion.before.by_column(kind).items()]
    changed = [(float(b), float(a)) for b, a in errors if a != b]
    return falls and bool(changed) and all((a < b) is not down for b, a in changed)


def _sized(value: float, unit: str) -> str:
    """A number with its unit, if it has one."""
    return amount(number(value), unit)


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
        if f.slug != "unmodelled" and f.confusable:
            said.append(f"These recordings do not tell {f.slug} from {' or '.join(f.confusable)}.")
    return said


def not_fitted(how: str) -> str:
    """Description of the values that a model was scored on."""
    where = {
        "validation": "recordings kept for validation",
        "left out in turn": "recordings left out in turn",
    }
    return where.get(how, "parts of the one recording, left out in turn (within-recording)")


def went(before: float, after: float) -> str:
    """Change of a reduced chi-square in words, from the numbers as they are shown."""
    first, then = number(before), number(after)
    if first == then:
        return f"stays at a reduced chi-square of {first}"
    return f"{'rises' if after > before else 'falls'} from a reduced chi-square of {first} to {then}"


def _not_fitted(conclusion: Conclusion) -> list[str]:
    """Sentences on validation recordings that an accepted base model misses, and why."""
    program, left = conclusion.explanation.program, conclusion.before.reduced_chi2
    if not conclusion.missed_validation:
        return []
    less = predictive_chi_square(program, conclusion.explanation.base, program.unseen)
    times = number(float(np.sqrt(left)), ".2g")
    missed = (
        f"Recordings kept for validation are missed by {times} times their noise (reduced chi-square "
        f"{number(left)}, where noise alone would leave 1)."
    )
    leave = f"other values within their errors leave {number(less)} there"
    if less <= limit_of(program, program.unseen):
        return [f"{missed} This does not contradict the model: its constants are uncertain, and {leave}."]
    if not missed_beyond_drift(program, conclusion.explanation.base):
        return [
            f"{missed} A part of it follows from constants that are uncertain: {leave}. Instruments that "
            "drift within their noise would explain the rest."
        ]
    return [
        f"{missed} Constants that are uncertain do not explain it: {leave}. Fit one of these recordings "
        "as well before you rely on this."
    ]


def _probability(p_value: float, bound: str) -> str:
    """A probability in words. No model of noise is good enough to tell one below one in a million."""
    return f"{bound}{p_value:.3g}" if p_value >= 1e-6 else "less than one in a million"


def _by_chance(chance: str) -> str:
    return f"Chance alone would give such a misfit of the base model with a probability of {chance}."


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
