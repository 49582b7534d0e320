"""A fitted law as a table of constants that simulations load by path."""

import math
import re

from pneusma_jax.calibration.records import Calibration, Prior, Quantity
from pneusma_jax.units import from_si, to_si

from .analysis import Analysis
from .samples import Samples

DIGITS = 10  # of a fitted number; its standard error needs none of them past the third


def material(analysis: Analysis, samples: Samples, title: str) -> Calibration:
    """Table of the law that an analysis has taken.

    Every constant is `fitted`, with its standard error as prior; the spread between specimens is
    `silicone_stiffness`. The strains that were tested go with them.

    Args:
        analysis: the laws fitted.
        samples: the samples that they were fitted to.
        title: title of the campaign.
    """
    fit = analysis.best
    stretch = f"strain {analysis.strain_min:.4g} to {analysis.strain_max:.4g}"
    simulated = "" if samples.real else ", simulated data" if samples.real is False else ""
    source = f"Fitted to {title}{simulated}, {stretch}"
    quantities = {}
    for constant, value, sd in zip(fit.law.constants, fit.values, fit.sd, strict=True):
        prior = None
        number = _rounded(float(value), constant.unit)
        if math.isfinite(sd) and sd > 0.0:
            prior = Prior(mean=number, sd=_rounded(float(sd), constant.unit))
        quantities[constant.name] = Quantity(constant.name, number, constant.unit, "fitted", source, prior)
    for end, strain in (("strain_min", analysis.strain_min), ("strain_max", analysis.strain_max)):
        quantities[end] = Quantity(
            end, _rounded(strain, "1"), "1", "fitted", "Ends of the strains that were fitted"
        )
    if samples.batch > 0.0:
        quantities["silicone_stiffness"] = Quantity(
            "silicone_stiffness", 1.0, "1", "assumed",
            "One factor on the stress, for the spread between specimens; 1 by definition",
            Prior(1.0, samples.batch, max(1.0 - 4.0 * samples.batch, 0.01), 1.0 + 4.0 * samples.batch),
        )  # fmt: skip
    return Calibration(
        name=re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_") or "elastomer",
        kind="silicone",
        description=f"{fit.law.label[0].upper()}{fit.law.label[1:]} law of {title}, {stretch}",
        path=None,
        quantities=quantities,
        text={"law": fit.law.law},
    )


def _rounded(value: float, unit: str) -> float:
    """A number in SI that has few digits in the unit of the file."""
    return float(to_si(float(f"{float(from_si(value, unit)):.{DIGITS}g}"), unit))
