"""Fitted constants as a table that simulations load by path."""

import re
from collections.abc import Mapping

from fitting.calibrate.result import Estimate
from fitting.inference.parameters import Parameter, Parameters
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.records import Prior, Quantity
from pneusma_jax.units import from_si, to_si

DIGITS = 10  # of a fitted number
KELVIN = "K"  # unit of differences of temperature, which have no zero to be shifted


def slug(title: str) -> str:
    """A name for other files to use."""
    return re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_") or "alloy"


def alloy_table(
    title: str, base: Mapping[str, Quantity], parameters: Parameters, simulated: bool, text: Mapping[str, str]
) -> Calibration:
    """Table of an alloy: what was fitted, with its standard error as prior, and the rest as it was taken.

    Args:
        title: of the campaign.
        base: constants that the fit started from.
        parameters: free ones at the values found, in SI.
        simulated: whether the recordings were.
        text: further strings of the table, such as `interpolation`.
    """
    source = f"Fitted to {title}{', simulated data' if simulated else ''}"
    quantities = {}
    for name, taken in base.items():
        if name in parameters:
            quantities[name] = _fitted(parameters[name], taken, source)
        else:
            quantities[name] = Quantity(
                name, taken.value, taken.unit, taken.status, taken.source, taken.prior
            )
    return Calibration(
        name=slug(title),
        kind="alloy",
        description=f"Alloy of {title}, characterised from tests",
        path=None,
        quantities=quantities,
        text=dict(text),
    )


def _fitted(entry: Parameter, taken: Quantity, source: str) -> Quantity:
    value, sd = _rounded(entry.value, taken.unit), entry.standard_error
    prior = None if not sd else Prior(mean=value, sd=_rounded(sd, taken.unit))
    note = "" if sd else "; at a bound" if entry.at_bound else "; not determined by these tests"
    return Quantity(entry.name, value, taken.unit, "fitted", source + note, prior)


def _rounded(value: float, unit: str) -> float:
    """A number in SI that has few digits in the unit of the file."""
    width = unit == KELVIN
    return float(to_si(float(f"{float(from_si(value, unit, width)):.{DIGITS}g}"), unit, width))


def estimate(entry: Parameter) -> Estimate:
    """A parameter in the unit of files."""
    sd = entry.standard_error
    return Estimate(
        value=float(from_si(entry.value, entry.unit, entry.unit == KELVIN)),
        sd=float("nan") if sd is None else float(from_si(sd, entry.unit, difference=True)),
        unit=entry.unit,
        at_bound=entry.at_bound,
    )
