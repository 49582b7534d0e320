"""Sentences about a fit beyond its numbers."""

import numpy as np

from ..parameters import Parameters
from .covariance import Uncertainty
from .program import Outcome

SAME_MINIMUM = 1e-6
"""Maximum relative difference of chi-squares of starts that ended in the same minimum."""


def notes_on(
    fitted: Parameters,
    uncertainty: Uncertainty,
    at_bound: tuple[str, ...],
    outcome: Outcome,
    chi_squares: np.ndarray,
) -> tuple[str, ...]:
    """Sentences about non-finite residuals, bounds reached, undetermined directions, and starts.

    Args:
        fitted: parameters at the solution.
        uncertainty: uncertainty of these parameters.
        at_bound: names of free parameters on a bound.
        outcome: outcome of the best start.
        chi_squares: chi-squares of all starts.
    """
    notes = []
    broken = np.flatnonzero(~np.isfinite(outcome.residual))
    if broken.size:
        count = outcome.residual.size
        notes.append(f"{broken.size} of {count} residuals are not finite, the first in row {broken[0]}.")
    for name in at_bound:
        notes.append(
            f"{name} is at its bound {fitted[name].value:g}: it has no standard error, and the others' hold "
            "if it is truly there."
        )
    for name, parameter in fitted.items():
        if parameter.tie is not None and not parameter.min <= parameter.value <= parameter.max:
            notes.append(
                f"{name} = {parameter.tie} is {parameter.value:g}, outside its bounds: ties do not obey them."
            )
    for members in uncertainty.undetermined:
        if len(members) == 1:
            notes.append(f"The residual does not depend on {next(iter(members))}: no standard error; fix it.")
        else:
            mixture = ", ".join(f"{weight:+.2f} {name}" for name, weight in members.items())
            notes.append(
                f"The data do not determine one combination of {', '.join(members)} (by the precision of "
                f"each: {mixture}): no standard errors; fix or tie one of them."
            )
    if len(chi_squares) > 1 and np.isfinite(outcome.chi_square):
        same = int(np.sum(chi_squares <= outcome.chi_square * (1 + SAME_MINIMUM)))
        notes.append(f"{same} of {len(chi_squares)} starts ended in this minimum.")
    return tuple(notes)
