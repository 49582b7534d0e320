"""Fitted constants as a table that simulations load by path."""

import re
from collections.abc import Iterable, Mapping

import numpy as np

from fitting.calibrate.result import Estimate
from fitting.data.recordings.named_tables import ON_A_STAND
from fitting.inference.parameters import Parameter, Parameters
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.records import Prior, Quantity
from pneusma_jax.units import constant_to_si, from_si, is_difference, to_si

DIGITS = 10  # Number of significant digits of a fitted number


def slug(title: str) -> str:
    """A name for other files to use."""
    return re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_") or "alloy"


def alloy_table(
    title: str,
    base: Mapping[str, Quantity],
    parameters: Parameters,
    simulated: bool,
    quoted: Mapping[str, Estimate] | None = None,
    prestrains: Iterable[float] = (),
) -> Calibration:
    """Table of an alloy: what was fitted, with its quoted error as prior, and the rest as it was taken.

    Args:
        title: title of the campaign.
        base: constants that the fit started from.
        parameters: free ones at the values found, in SI.
        simulated: true if the recordings were simulated.
        quoted: errors and intervals of those, in the unit of files; the standard errors where there are none.
        prestrains: shear strains at which springs on a stand began [1]; empty of other specimens.
    """
    begun = ", ".join(f"{strain:g}" for strain in sorted(set(prestrains)))
    source = f"Fitted to {title}{', simulated data' if simulated else ''}"
    quantities = {}
    for name, taken in base.items():
        if name in parameters:
            quantities[name] = _fitted(parameters[name], taken, source, (quoted or {}).get(name))
        else:
            quantities[name] = taken
    return Calibration(
        name=slug(title),
        kind="alloy",
        description=f"Alloy of {title}, characterised from tests{f' {ON_A_STAND} {begun}' if begun else ''}",
        path=None,
        quantities=quantities,
    )


def _fitted(entry: Parameter, taken: Quantity, source: str, quoted: Estimate | None) -> Quantity:
    """A constant as it was fitted, in SI, with its quoted error and interval."""
    value, sd, interval = _rounded(entry.value, taken.unit), entry.standard_error, None
    if quoted is not None and not quoted.interval:
        sd = None
    elif quoted is not None and np.isfinite(quoted.sd):
        sd = float(to_si(quoted.sd, taken.unit, True))
    if quoted is not None and np.isfinite(quoted.interval.get(90, np.nan)).all():
        ends = (float(constant_to_si(end, taken.unit)) for end in quoted.interval[90])
        interval = tuple(_rounded(end, taken.unit) for end in ends)
    prior = None if not sd else Prior(mean=value, sd=_rounded(sd, taken.unit, width=True))
    without = "; its error is not known" if entry.standard_error else "; not determined by these tests"
    note = "" if sd else "; at a bound" if entry.at_bound else without
    return Quantity(entry.name, value, taken.unit, "fitted", source + note, prior, interval)


def _rounded(value: float, unit: str, width: bool = False) -> float:
    """A constant in SI, or the width of its distribution, that has few digits in the unit of the file."""
    difference = width or is_difference(unit)
    digits = f"{float(from_si(value, unit, difference)):.{DIGITS}g}"
    return float(to_si(float(digits), unit, difference))
