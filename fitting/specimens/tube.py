"""Recordings of a pressurised tube without springs as functions of the parameters: its length (Eq. 3.10)."""

from collections.abc import Mapping
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign, Recording
from fitting.inference.parameters import Parameters
from pneusma_jax.silicone import tube_length

from . import priors, silicones
from .model_objects import geometry_of
from .row_builders import columns_of, measured_and_weight
from .rows import Rows, numbers

OUTPUTS = ("length",)
GEOMETRY = ("length", "outer_diameter", "wall_thickness")
SLOPE_DEGREE = 5
"""Of the polynomial of length over pressure, by which the pressure's noise is carried over."""


def _numbers_of(recording: Recording) -> dict[str, float]:
    geometry = geometry_of(recording)
    return {name: float(getattr(geometry, name)) for name in GEOMETRY} | {silicones.FACTOR: 1.0}


def rows_for(campaign: Campaign, material: str | Path | None = None) -> list[Rows]:
    """Every recording of a campaign as arrays, in its order.

    Args:
        campaign: recordings of kind tube.
        material: table to start from, instead of the one that is named; needed by nobody but those who have
            one of a material that is to be fitted.

    Raises:
        InputError: if they name several materials, or one has too few complete rows.
    """
    law, _ = silicones.law_of(campaign, material)
    number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
    result = []
    for recording in campaign.recordings:
        columns, block = columns_of(recording, ("pressure",), OUTPUTS)
        measured, weight = measured_and_weight(recording, OUTPUTS, columns, block)
        weight["length"] = _with_pressure(recording, columns, weight["length"], block)
        base = _numbers_of(recording) | silicones.constants(law)
        result.append(
            Rows(
                mask=np.ones(len(columns["time"]), bool),
                time=columns["time"],
                inputs={"pressure": columns["pressure"]},
                measured=measured,
                weight=weight,
                base={name: np.asarray(value) for name, value in base.items()},
                extra={"law": silicones.packed(law)},
                specimen=np.asarray(number[recording.specimen]),
            )
        )
    return result


def _with_pressure(
    recording: Recording, columns: Mapping[str, np.ndarray], weight: np.ndarray, block: int
) -> np.ndarray:
    """Weight of the length with what noise of the pressure adds, by the recording's own slope."""
    sigma, held = recording.noise_si("pressure"), weight > 0.0
    if not sigma or held.sum() < SLOPE_DEGREE + 2:
        return weight
    course = np.polynomial.Polynomial.fit(columns["pressure"][held], columns["length"][held], SLOPE_DEGREE)
    slope = np.where(held, course.deriv()(columns["pressure"]), 0.0)
    variance = 1.0 / np.where(held, weight, 1.0) ** 2 + (slope * sigma) ** 2 / block
    return np.where(held, variance**-0.5, 0.0)


def parameters_for(campaign: Campaign, material: str | Path | None = None) -> Parameters:
    """Free numbers with their priors: constants of the silicone, then each specimen's factor and dimensions.

    Args:
        campaign: recordings of kind tube.
        material: as for `rows_for`.
    """
    law, identify = silicones.law_of(campaign, material)
    table = silicones.table_name(campaign, material)
    parameters = silicones.material_parameters(campaign, law, identify, table)
    known = {specimen: _numbers_of(members[0]) for specimen, members in campaign.specimens().items()}
    own = priors.geometry_parameters(campaign, known, silicones.UNITS, silicones.always_open(identify))
    parameters.update(own)
    return parameters


def predict(values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
    """Length [m] at each pressure."""
    known = numbers(values, rows)
    law = silicones.law_with(rows.extra["law"], known)
    sizes = [known[name] for name in GEOMETRY]
    return {"length": jax.vmap(lambda p: tube_length(p, *sizes, law))(rows.inputs["pressure"])}


def residual(values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
    """Misfit of the length in standard deviations."""
    found = predict(values, rows)
    return jnp.concatenate([rows.weight[name] * (found[name] - rows.measured[name]) for name in OUTPUTS])
