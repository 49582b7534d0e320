"""Statements of a study that could not act, and tolerances of which no specimen can be made."""

from collections.abc import Mapping, Sequence
from typing import Any

from pneusma_jax.calibration.keys import POSITIVE, QUANTITIES
from pneusma_jax.errors import InputError
from pneusma_jax.units import INTERNAL_UNITS, from_si

from .bodies import Plan
from .study import Free, Uncertainty

CUT = 4.0
"""Number of standard deviations at which draws of a tolerance end on either side, as in `uncertain` [1]."""


def check_alloy(
    document: Mapping[str, Any], priors: Sequence[str], plans: Sequence[Plan], path: object
) -> None:
    """Refuse an alloy, or its priors, in a study whose designs have no spring.

    Raises:
        InputError: with the statement that is of no use.
    """
    if any(plan.springs for plan in plans):
        return
    if "alloy" in document:
        stated = f"alloy = {document['alloy']!r}"
        raise InputError(f"{path}: {stated} is of no use, since no design has a spring; leave it out")
    if "alloy" in priors:
        raise InputError(f"{path}: [uncertainty]: priors of the alloy are of no use: no design has a spring")


def check_tolerances(given: Uncertainty, free: Sequence[Free], plans: Sequence[Plan], path: object) -> None:
    """Refuse a tolerance that makes a size of zero or less from the smallest that is ordered.

    Raises:
        InputError: with that size.
    """
    for one in given.tolerances:
        if one.name.rpartition(".")[2] not in POSITIVE:
            continue
        ordered = _least_ordered(one.name, free, plans)
        made = ordered - (one.half_width or CUT * one.sd)
        if made <= 0.0:
            unit = INTERNAL_UNITS[QUANTITIES["actuator"][one.name]]
            unit = "mm" if unit == "m" else unit
            worded = [f"{from_si(size, unit):.4g} {unit}" for size in (made, ordered)]
            raise InputError(
                f"{path}: [uncertainty] tolerance.{one.name}: it makes {' of '.join(worded)}, but"
                f" {one.name} must be positive; state a smaller tolerance, or a larger lower end"
            )


def _least_ordered(name: str, free: Sequence[Free], plans: Sequence[Plan]) -> float:
    """Least value of a size that a study orders, SI; infinite where another free number alone bounds it."""
    own = [one for one in free if one.name == name]
    if not own:
        return min(plan.tables[0].values()[name] for plan in plans)
    return min((one.low.value for one in own if one.low.parameter is None), default=float("inf"))
