"""Recordings of a spring on a test stand as arrays, and the spring that their numbers describe."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import equinox as eqx
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign, Recording
from fitting.inference.channels import channel_weight
from fitting.inference.latent_trajectory.denoise import denoised
from fitting.inference.readings import measurements
from pneusma_jax.errors import InputError, counted
from pneusma_jax.nitinol import Alloy, Spring, SpringGeometry

from . import priors
from .model_objects import geometry_of
from .reduction import reduced
from .row_builders import interpolated
from .rows import Rows
from .specimen import FITTED, RowOptions

OUTPUTS = ("force", "resistance")
HELD_LENGTH_RANGE = 5e-4
"""Maximum range of the length of a spring that is held [m]."""
ALLOY = tuple(field.name for field in dataclasses.fields(Alloy) if field.name != "name")
GEOMETRY = ("wire_diameter", "mandrel_diameter", "initial_pitch", "active_coils", "free_length")
SPREAD = 0.5
"""Prior standard deviation of the first martensite fraction, about one half [1]."""
MARGIN = 0.03
"""Maximum deviation of a turning point from the rule, as part of the residual strain."""
FIXED = ("gamma_max", "poisson_ratio", "T_mid", "T_width", "density", "heat_capacity", "convection")
"""Constants that tests on a stand do not identify: conventions, and constants of heating."""
RECORDED_TEMPERATURE = "recorded_temperature"
"""Entry of rows for the recorded temperature of the spring [degC], which effects alone depend on."""
INITIAL_PROCESS_NOISE = 1e-6
"""Initial process-noise variance of the martensite fraction per second, until `with_process_noise` finds
it."""


def rows_of(
    recording: Recording,
    alloy: Mapping[str, float],
    specimen: int = 1,
    held_at: float | None = None,
    options: RowOptions = FITTED,
    with_temperature: bool = False,
) -> Rows:
    """A recording of kind spring as arrays.

    Args:
        recording: checked recording.
        alloy: base constants by name, SI.
        specimen: number of the specimen in the campaign.
        held_at: constant martensite fraction of the whole recording (1 cold, 0 hot); None to find it.
        options: selection of rows.
        with_temperature: true for an entry `RECORDED_TEMPERATURE`, NaN where none was recorded.

    Raises:
        InputError: if fewer than four rows have both time and elongation.
    """
    recording = recording if options.most is None else reduced(recording, options.most)
    columns = {name: recording.si(name) for name in ("time", "elongation")}
    columns |= {name: measurements(recording, name) for name in OUTPUTS}
    driven = np.isfinite(columns["time"]) & np.isfinite(columns["elongation"])
    if driven.sum() < 4:
        raise InputError(
            f"{recording.path or recording.name}: {counted(int(driven.sum()), 'row')} with both time and"
            " elongation, and a test needs four or more"
        )
    driven_columns = {name: values[driven] for name, values in columns.items()}
    weight = {name: channel_weight(recording, name, driven_columns, recording.block) for name in OUTPUTS}
    smooth = denoised(driven_columns["time"], driven_columns["resistance"])
    finite = np.isfinite(smooth)
    size = len(driven_columns["time"])
    warm = {RECORDED_TEMPERATURE: _temperature(recording, driven_columns["time"])} if with_temperature else {}
    return Rows(
        mask=np.ones(size, bool),
        time=driven_columns["time"],
        inputs={
            "elongation": driven_columns["elongation"],
            "resistance": np.interp(driven_columns["time"], driven_columns["time"][finite], smooth[finite])
            if finite.any()
            else np.full(size, np.nan_to_num(alloy["rho_mean"])),
        },
        measured={name: np.nan_to_num(driven_columns[name]) for name in OUTPUTS},
        weight=weight,
        base={**{name: np.asarray(float(alloy[name])) for name in ALLOY}, **dimension_numbers(recording)},
        extra={
            "process_noise": np.asarray(INITIAL_PROCESS_NOISE),
            "implied_process_noise": np.asarray(INITIAL_PROCESS_NOISE),
            "level": np.asarray(0.5 if held_at is None else held_at),
            "level_sd": np.asarray(SPREAD if held_at is None else 0.0),
            "force_informs": np.asarray(1.0),
            "margin": np.asarray(MARGIN),
            "loading": _loading(driven_columns["elongation"]),
            **warm,
        },
        specimen=np.asarray(specimen),
    )


def _temperature(recording: Recording, time: np.ndarray) -> np.ndarray:
    """Recorded temperature at these times [degC], linear between readings; NaN where there is none."""
    if not recording.has("temperature"):
        return np.full(len(time), np.nan)
    return interpolated(time, recording.si("time"), recording.si("temperature"))


def _loading(elongation: np.ndarray) -> np.ndarray:
    """Mask of the rows at which the spring is longer than ever before: one, the others zero."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(elongation)[:-1]])
    return (elongation > before).astype(float)


def dimensions(recording: Recording) -> SpringGeometry:
    """Dimensions that a recording states for its spring, SI."""
    geometry = geometry_of(recording)
    return SpringGeometry(**{name: getattr(geometry, name) for name in GEOMETRY})


def stated_strain_and_stress(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Shear strain [1] and shear stress [Pa] of the wire by the stated dimensions, each of shape (rows,)."""
    strain, force = _strain_and_force(dimensions(recording), recording.si("elongation"))
    return np.asarray(strain), recording.si("force") / float(force)


@eqx.filter_jit
def _strain_and_force(geometry: SpringGeometry, elongation: Array) -> tuple[Array, Array]:
    """Shear strain of the wire [1], and the force of the spring per stress of the wire [m2]."""
    return geometry.shear_strain(elongation), geometry.force(1.0)


def dimension_numbers(recording: Recording) -> dict[str, np.ndarray]:
    """Dimensions and pre-strain of a recording's spring by name, SI."""
    geometry = geometry_of(recording)
    return {name: np.asarray(float(getattr(geometry, name))) for name in (*GEOMETRY, "prestrain")}


def rows_for(
    campaign: Campaign,
    options: RowOptions = FITTED,
    base: str | Path | None = None,
    held_at: Mapping[str, float] | None = None,
) -> list[Rows]:
    """Recordings of a campaign as arrays, in their order.

    Args:
        campaign: recordings of kind spring.
        options: selection of rows.
        base: name or path of the alloy's prior table, where `alloy = "fit"`; see
            `specimens.priors.alloy_quantities`.
        held_at: constant martensite fractions of recordings, by name.
    """
    quantities, _ = priors.alloy_quantities(campaign, ALLOY, base)
    alloy = {name: quantity.value for name, quantity in quantities.items()}
    number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
    levels, warm = held_at or {}, any(r.has("temperature") for r in campaign.recordings)
    return [
        rows_of(r, alloy, number[r.specimen], levels.get(r.name), options, warm) for r in campaign.recordings
    ]


def spring_of(parameters: Mapping[str, Array]) -> Spring:
    """The spring with these parameters. On a stand its elongation counts from the free length."""
    alloy = Alloy(**{name: parameters[name] for name in ALLOY})
    geometry = SpringGeometry(**{name: parameters[name] for name in GEOMETRY})
    return Spring(geometry, alloy, geometry.free_length)
