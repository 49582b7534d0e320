"""Recordings of an actuator as arrays, with the inputs that only effects use: currents, air temperature,
gravity."""

from collections.abc import Mapping
from pathlib import Path

import equinox as eqx
import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording
from fitting.inference.readings import noise_found, stated_noise
from pneusma_jax.actuator.designs import GEOMETRY_KEYS
from pneusma_jax.errors import InputError

from . import actuator_phase, priors, silicones
from .actuator_phase import OUTPUTS, UNSETTLED
from .model_objects import geometry_of, gravity_of
from .row_builders import columns_of, interpolated, measured_and_weight, smooth
from .rows import Rows
from .specimen import FITTED, RowOptions
from .spring_rows import ALLOY

FIXED = ("gamma_max", "poisson_ratio", "T_mid", "T_width", "density", "heat_capacity", "convection")
"""Constants that a pressurised actuator does not identify: conventions, and constants of heating."""
TUBE = ("outer_diameter", "wall_thickness", "length")
RECORDED = ("current_1", "current_2", "current_3", "temperature")
"""Recorded quantities that only effects use."""
AIR = 22.0
"""Assumed temperature of the air where none was recorded [degC]."""


def layout_of(campaign: Campaign) -> pj.Layout:
    """Arrangement that all actuators of a campaign share.

    Raises:
        InputError: if there are several designs.
    """
    named = {str(r.full_geometry()["design"]): r.name for r in campaign.recordings}
    if len(named) > 1:
        words = " and ".join(f"{design} ({name})" for design, name in list(named.items())[:2])
        raise InputError(f"{campaign.path}: recordings are of different designs: {words}; fit one at a time")
    return pj.layout(next(iter(named)))


def dimensions(recording: Recording) -> dict[str, float]:
    """Dimensions of a recording's actuator, SI, and the factor on its silicone's stress [1]."""
    geometry = geometry_of(recording)
    return {name: float(getattr(geometry, name)) for name in GEOMETRY_KEYS} | {silicones.FACTOR: 1.0}


def undecided_rows_for(
    campaign: Campaign,
    base: str | Path | None = None,
    material: str | Path | None = None,
    options: RowOptions = FITTED,
) -> list[Rows]:
    """Recordings of a campaign as arrays, in their order, with every spring fully martensitic (cold).

    Arguments and errors are those of `BendingActuator.rows_for`.
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
    members = campaign.recordings
    rows = [_rows_of(r, common, wired, extra, number[r.specimen], options) for r in members]
    shared = [name for name in RECORDED if any(r.has(name) for r in members)]
    return [
        eqx.tree_at(lambda x: x.extra, one, one.extra | _recorded(recording, one, shared))
        for recording, one in zip(members, rows, strict=True)
    ]


def _rows_of(
    recording: Recording,
    common: Mapping[str, float],
    wired: tuple[int, ...],
    extra: Mapping[str, object],
    specimen: int,
    options: RowOptions,
) -> Rows:
    recorded = [f"resistance_{n}" for n in wired if recording.has(f"resistance_{n}")]
    columns, block = columns_of(recording, ("pressure", *recorded), OUTPUTS, options)
    measured, weight = measured_and_weight(recording, OUTPUTS, columns, block, options)
    inputs = {"pressure": smooth(columns, "pressure", options)}
    noise = {}
    for name in (f"resistance_{n}" for n in wired):
        inputs[name] = columns.get(name, np.ones(len(columns["time"])))
        noise[f"noise_{name}"] = np.asarray(0.0)  # not measured: taken as cold
        if name in recorded:
            sigma = stated_noise(recording, name) or noise_found(recording, name)
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


def _recorded(recording: Recording, rows: Rows, names: list[str]) -> dict[str, np.ndarray]:
    springs = len(rows.extra["xi0"])
    found = {
        name: tuple(np.zeros(len(rows.mask)) for _ in range(springs)) for name in ("gamma", "coupled_gain")
    }
    found |= {"gravity": gravity_of(recording), UNSETTLED: np.asarray(False)}
    for name in names:
        nominal = AIR if name == "temperature" else 0.0
        column, known = np.full(len(rows.mask), nominal), False
        if recording.has(name):
            read = interpolated(np.asarray(rows.time), recording.si("time"), recording.si(name))
            if known := bool(np.isfinite(read).any()):
                column = read
        found[f"recorded_{name}"] = column
        if name != "temperature":
            found[f"has_{name}"] = np.full(len(rows.mask), float(known))
    return found
