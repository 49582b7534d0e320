"""Recordings of an elastomer coupon as functions of the parameters: its engineering stress.

The law is the one that the recordings state; `fitting.calibrate.elastomer` is what compares laws.
"""

from collections.abc import Mapping
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign
from fitting.inference.parameters import Parameters

from . import priors, silicones
from .row_builders import columns_of, measured_and_weight
from .rows import Rows, numbers

OUTPUTS = ("stress",)


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
    base = {silicones.FACTOR: 1.0} | silicones.constants(law)
    result = []
    for recording in campaign.recordings:
        columns, block = columns_of(recording, ("strain",), OUTPUTS)
        measured, weight = measured_and_weight(recording, OUTPUTS, columns, block)
        result.append(
            Rows(
                mask=np.ones(len(columns["time"]), bool),
                time=columns["time"],
                inputs={"strain": columns["strain"]},
                measured=measured,
                weight=weight,
                base={name: np.asarray(value) for name, value in base.items()},
                extra={"law": silicones.packed(law)},
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
    return parameters


def predict(values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
    """Engineering stress [Pa] at each strain."""
    known = numbers(values, rows)
    return {"stress": silicones.law_with(rows.extra["law"], known)(rows.inputs["strain"])}


def residual(values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
    """Misfit of the stress in standard deviations."""
    found = predict(values, rows)
    return jnp.concatenate([rows.weight[name] * (found[name] - rows.measured[name]) for name in OUTPUTS])
