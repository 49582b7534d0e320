"""Free parameters from the numbers of a model on disk: values, priors and scales."""

import numpy as np

from fitting.inference.parameters import Parameter, Prior
from fitting.specimens.saved_models.model import parameter_of
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.effects import Spec, find_effect

from .priors import CUT
from .saved_models import AddedEffect

WIDE = 20.0
"""Minimum ratio of its bounds from which a positive shape parameter is fitted by its logarithm."""
SHAPE_SD = 0.375
"""Standard deviation of a shape parameter's prior about its typical value, as a share of its physical
range."""


def is_logarithmic(spec: Spec) -> bool:
    """True if a fit has the logarithm of an effect's parameter: a positive shape of wide bounds."""
    return bool(spec.shape and spec.low > 0.0 and spec.high > WIDE * spec.low)


def start_from(entry: Parameter, quantity: Quantity, here: bool) -> None:
    """A base constant at the model's value, with the prior that is known beside these recordings.

    Args:
        entry: the constant; it is changed.
        quantity: the model's number.
        here: true if that comes from these recordings, so that its prior is none beside them.
    """
    value, prior = float(quantity.value), entry.prior
    if quantity.prior is not None and here:
        entry.set(value=float(np.clip(value, entry.min, entry.max)))
        return
    sd = prior.sd if quantity.prior is None else quantity.prior.sd
    low, high = value - CUT * sd, value + CUT * sd
    if prior.min > 0.0:
        low = max(low, 1e-3 * value)
    entry.set(value=value, prior=Prior(value, sd, low, high), min=low, max=high)


def effect_parameter(added: AddedEffect, key: str, name: str, here: bool) -> Parameter:
    """The parameter of an effect, from the model's number and what is known of it beside these recordings.

    Args:
        added: the effect with the numbers of the file.
        key: the parameter's name in the file; name: its name in the fit.
        here: true if the number comes from these recordings.
    """
    effect = find_effect(added.slug)
    spec, quantity = effect.specs[parameter_of(effect, key)], added.parameters[key]
    own = quantity.prior
    logarithmic = is_logarithmic(spec)
    prior = None
    if own is not None and not here:
        prior = Prior(float(quantity.value), own.sd, spec.low, spec.high)
    elif spec.shape and not logarithmic:  # undetermined for a small effect
        prior = Prior(spec.typical, SHAPE_SD * (spec.high - spec.low), spec.low, spec.high)
    return Parameter(
        name,
        value=float(np.clip(quantity.value, spec.low, spec.high)),
        min=spec.low,
        max=spec.high,
        unit=quantity.unit,
        prior=prior,
        scale="log" if logarithmic else "linear",
    )
