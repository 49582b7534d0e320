"""Recordings of an actuator as functions of the parameters: curvature, bend angle and direction, length."""

from collections.abc import Mapping
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording
from fitting.inference.parameters import Parameters
from fitting.inference.readings import noise_found
from pneusma_jax.actuator.designs import GEOMETRY_KEYS
from pneusma_jax.errors import InputError

from . import actuator_phase, priors, silicones
from .actuator_rows import ALLOY, trajectory
from .model_objects import geometry_of
from .row_builders import columns_of, measured_and_weight, smooth
from .rows import Rows

OUTPUTS = ("curvature", "bend_angle", "length", "bend_direction")
FIXED = ("gamma_max", "poisson_ratio", "T_mid", "T_width", "density", "heat_capacity", "convection")
"""Constants that a pressurised actuator does not identify: conventions, and those of heating."""
TUBE = ("outer_diameter", "wall_thickness", "length")
ASTRAY = 30.0
"""Standard deviations that a row without equilibrium counts for."""


def layout_of(campaign: Campaign) -> pj.Layout:
    """The one arrangement of a campaign's actuators.

    Raises:
        InputError: if there are several designs.
    """
    named = {str(r.full_geometry()["design"]): r.name for r in campaign.recordings}
    if len(named) > 1:
        words = " and ".join(f"{design} ({name})" for design, name in list(named.items())[:2])
        raise InputError(f"{campaign.path}: recordings are of different designs: {words}; fit one at a time")
    return pj.layout(next(iter(named)))


def dimensions(recording: Recording) -> dict[str, float]:
    """Every dimension of a recording's actuator in SI, and the factor on its silicone."""
    geometry = geometry_of(recording)
    return {name: float(getattr(geometry, name)) for name in GEOMETRY_KEYS} | {silicones.FACTOR: 1.0}


def rows_for(
    campaign: Campaign, base: str | Path | None = None, material: str | Path | None = None
) -> list[Rows]:
    """`undecided_rows_for`, with phases as they are at the stated numbers."""
    return actuator_phase.decided({}, undecided_rows_for(campaign, base, material))


def undecided_rows_for(
    campaign: Campaign, base: str | Path | None = None, material: str | Path | None = None
) -> list[Rows]:
    """Every recording of a campaign as arrays, in its order; every spring cold.

    Args:
        campaign: recordings of kind actuator, of one design.
        base: alloy to start from where `alloy = "fit"`; see `specimens.priors.alloy_quantities`.
        material: silicone to start from, instead of the one that is named.

    Raises:
        InputError: if they name several designs, alloys or materials, or one has too few complete rows.
    """
    layout = layout_of(campaign)
    law, _ = silicones.law_of(campaign, material)
    common = silicones.constants(law)
    if layout.spring_numbers:
        quantities, _ = priors.alloy_quantities(campaign, ALLOY, base)
        common |= {name: quantity.value for name, quantity in quantities.items()}
    number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
    extra = {"layout": layout, "law": silicones.packed(law)}
    wired = tuple(
        n for n in layout.spring_numbers if any(r.has(f"resistance_{n}") for r in campaign.recordings)
    )
    return [_rows_of(r, common, wired, extra, number[r.specimen]) for r in campaign.recordings]


def _rows_of(
    recording: Recording,
    common: Mapping[str, float],
    wired: tuple[int, ...],
    extra: Mapping[str, object],
    specimen: int,
) -> Rows:
    there = [f"resistance_{n}" for n in wired if recording.has(f"resistance_{n}")]
    columns, block = columns_of(recording, ("pressure", *there), OUTPUTS)
    measured, weight = measured_and_weight(recording, OUTPUTS, columns, block)
    inputs = {"pressure": smooth(columns, "pressure")}
    noise = {}
    for name in (f"resistance_{n}" for n in wired):
        inputs[name] = columns.get(name, np.ones(len(columns["time"])))
        noise[f"noise_{name}"] = np.asarray(0.0)  # not measured: taken as cold
        if name in there:
            sigma = recording.noise_si(name) or noise_found(recording, name)
            noise[f"noise_{name}"] = np.asarray(max(sigma, 1e-12) / np.sqrt(block))
    base = dimensions(recording) | dict(common)
    rows = Rows(
        mask=np.ones(len(columns["time"]), bool),
        time=columns["time"],
        inputs=inputs,
        measured=measured,
        weight=weight,
        base={name: np.asarray(float(value)) for name, value in base.items()},
        extra={**extra, **noise},
        specimen=np.asarray(specimen),
    )
    return actuator_phase.undecided(rows, len(extra["layout"].spring_numbers))


def decides(recordings: list[Rows]) -> bool:
    """Whether phases are read from resistances, anew as parameters change."""
    return any(np.any(sd) for rows in recordings for sd in rows.extra["sd"])


def decided(values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
    """Recordings with phases as their resistances have them at these parameters; see `actuator_phase`."""
    return actuator_phase.decided(values, recordings)


def parameters_for(
    campaign: Campaign, base: str | Path | None = None, material: str | Path | None = None
) -> Parameters:
    """Free numbers with their priors: the alloy's, the silicone's, each specimen's factor and dimensions.

    Args:
        campaign: recordings of kind actuator, of one design.
        base, material: as for `rows_for`.
    """
    parameters, layout = Parameters(), layout_of(campaign)
    if layout.spring_numbers:
        parameters, _ = priors.alloy_parameters(campaign, ALLOY, FIXED, base)
    law, identify = silicones.law_of(campaign, material)
    table = silicones.table_name(campaign, material)
    parameters.update(silicones.material_parameters(campaign, law, identify, table))
    seen = {silicones.FACTOR, *(GEOMETRY_KEYS if layout.spring_numbers else TUBE)}
    known = {
        specimen: {name: value for name, value in dimensions(members[0]).items() if name in seen}
        for specimen, members in campaign.specimens().items()
    }
    own = priors.geometry_parameters(campaign, known, silicones.UNITS, silicones.always_open(identify))
    parameters.update(own)
    return parameters


def predict(values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
    """Curvature [1/m], bend angle and its direction [rad], length [m]; NaN where there is no equilibrium."""
    found = trajectory(values, rows)
    return {name: getattr(found, name) for name in OUTPUTS}


def residual(values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
    """Misfit of what was measured in standard deviations."""
    found = predict(values, rows)
    parts = []
    for name in OUTPUTS:
        there = jnp.isfinite(found[name])
        miss = jnp.where(there, found[name], 0.0) - rows.measured[name]
        if name == "bend_direction":
            miss = jnp.mod(miss + jnp.pi, 2.0 * jnp.pi) - jnp.pi
        parts.append(jnp.where(there | (rows.weight[name] == 0.0), rows.weight[name] * miss, ASTRAY))
    return jnp.concatenate(parts)
