"""Recordings of an elastomer coupon as functions of the parameters: its engineering stress.

The law is the one that the recordings state; `fitting.calibrate.elastomer` is what compares laws.
"""

from collections.abc import Mapping
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign
from fitting.inference.parameters import Parameter, Parameters

from . import priors, silicones
from .row_builders import columns_of, measured_and_weight
from .rows import MARK, Rows, numbers
from .zeros import taut, zeros_of

OUTPUTS = ("stress",)
ZEROS = {"strain": "1", "stress": "kPa"}
"""Quantities whose zero a fit may find, with the unit in which it is shown."""


def rows_for(campaign: Campaign, material: str | Path | None = None) -> list[Rows]:
    """Every recording of a campaign as arrays, in its order.

    Args:
        campaign: recordings of kind elastomer.
        material: table to start from, instead of the one that is named or, for one that is to be fitted,
            the source's silicone.

    Raises:
        InputError: if they name several materials, or one has too few complete rows.
    """
    law, _ = silicones.law_of(campaign, material)
    number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
    base = {silicones.FACTOR: 1.0} | silicones.constants(law) | {f"{q}_zero": 0.0 for q in ZEROS}
    result = []
    for recording in campaign.recordings:
        columns, block = columns_of(recording, ("strain",), OUTPUTS)
        measured, weight = measured_and_weight(recording, OUTPUTS, columns, block)
        zeros = zeros_of(recording)
        weight = {name: np.where(zeros.unsure(columns["strain"]), 0.0, w) for name, w in weight.items()}
        result.append(
            Rows(
                mask=np.ones(len(columns["time"]), bool),
                time=columns["time"],
                inputs={"strain": columns["strain"]},
                measured=measured,
                weight=weight,
                base={name: np.asarray(value) for name, value in base.items()},
                extra={"law": silicones.packed(law), "flat": zeros.flat(columns["strain"])},
                specimen=np.asarray(number[recording.specimen]),
            )
        )
    return result


def parameters_for(campaign: Campaign, material: str | Path | None = None) -> Parameters:
    """Free numbers with their priors: constants of the silicone, then each specimen's factor.

    Args:
        campaign: recordings of kind elastomer.
        material: as for `rows_for`.
    """
    law, identify = silicones.law_of(campaign, material)
    table = silicones.table_name(campaign, material)
    parameters = silicones.material_parameters(campaign, law, identify, table)
    known = {specimen: {silicones.FACTOR: 1.0} for specimen in campaign.specimens()}
    own = priors.geometry_parameters(campaign, known, silicones.UNITS, silicones.always_open(identify))
    parameters.update(own)
    for parameter in _zeros(campaign):
        parameters.add(parameter)
    return parameters


def _zeros(campaign: Campaign) -> list[Parameter]:
    """Zeros of each specimen's recordings that the fit is to find: one of each, by the widest doubt."""
    specimens, found = campaign.specimens(), []
    for number, recordings in enumerate(specimens.values(), start=1):
        known = [zeros_of(recording) for recording in recordings]
        for quantity, unit in ZEROS.items():
            doubt = [zeros for zeros in known if quantity in zeros.sd]
            if doubt:
                widest = max(doubt, key=lambda zeros: zeros.sd[quantity])
                name = f"{quantity}_zero" + (f"{MARK}{number}" if len(specimens) > 1 else "")
                prior = widest.prior(quantity)
                found.append(Parameter(name, value=widest.begin(quantity), unit=unit, prior=prior))
    return found


def predict(values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
    """Engineering stress [Pa] at each strain."""
    known = numbers(values, rows)
    law = silicones.law_with(rows.extra["law"], known)
    return {"stress": law(strain_of(known, rows)) + known["stress_zero"]}


def strain_of(known: Mapping[str, Array], rows: Rows) -> Float[Array, " rows"]:
    """Strain of the taut specimen at each reading."""
    return taut(rows.inputs["strain"], known["strain_zero"], rows.extra["flat"])


def residual(values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
    """Misfit of the stress in standard deviations."""
    found = predict(values, rows)
    return jnp.concatenate([rows.weight[name] * (found[name] - rows.measured[name]) for name in OUTPUTS])
