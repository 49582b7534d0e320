"""Sentences on a misfit: its size in units and by chance, its period, and where nothing was fitted."""

from collections.abc import Mapping

import numpy as np

from fitting.data.recordings import schema
from fitting.inference.numbers import number
from pneusma_jax.errors import counted
from pneusma_jax.units import amount, from_si

from ..fit.misfit import limit_of, range_of
from ..fit.prediction import predictive_chi_square
from ..search.steps import Explanation
from ..settings import DEFAULT
from .conclusion import Conclusion
from .unexplained import missed_beyond_drift

EXCESS = DEFAULT.excess

REPEATING = {
    "time": "a pump, a switched heater or mains hum",
    "strain": "the error of a screw or a gear",
    "elongation": "the error of a screw or a gear",
}
"""What is known to repeat along a driver."""
_MEASURES = (
    "Chi-square and root mean square error go opposite ways: the first weighs every row by its noise and its "
    "correlation with neighbours, the second weighs all rows alike."
)


def unstated_noise(conclusion: Conclusion) -> list[str]:
    """A sentence on noise that is told from the recordings themselves."""
    if conclusion.explanation.program.noise_stated:
        return []
    return [
        "The size of the noise is not stated, and was told from the recordings. What changes slowly may pass "
        "for it: state it under [noise] to have a smaller misfit judged."
    ]


def repeating(conclusion: Conclusion) -> list[str]:
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


def excuse(conclusion: Conclusion) -> str:
    """Reason why names stay with which the misfit of left-out recordings rises, after a comma."""
    if conclusion.left is not None and not conclusion.left.supports:
        return ", as numbers that the fit leaves open may explain"
    alone, named = conclusion.explanation.left_out
    rise = conclusion.after.reduced_chi2 - conclusion.before.reduced_chi2
    if rise > EXCESS.clear and alone > named:
        parts = f", while that of parts of recordings {went(alone, named)}"
        return f"{parts}: it predicts better between what was recorded, and worse beyond it"
    return ", no more than chance and the other recordings allow"


def in_units(conclusion: Conclusion, found: str = "") -> list[str]:
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


def missed_validation(conclusion: Conclusion) -> list[str]:
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


def chance_of(explanation: Explanation) -> str:
    """Probability of the base model's misfit in words.

    No model of noise is good enough to tell one below one in a million.
    """
    bound, p_value = "at most " if explanation.p_is_bound else "", explanation.p_value
    return f"{bound}{p_value:.3g}" if p_value >= 1e-6 else "less than one in a million"


def by_chance(explanation: Explanation) -> str:
    """A sentence on that probability."""
    chance = chance_of(explanation)
    return f"Chance alone would give such a misfit of the base model with a probability of {chance}."
