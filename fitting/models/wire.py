"""Recordings of a straight wire as functions of the parameters: its strain under stress, or its stress.

The phase follows the temperature on one reversible curve (the base law): no hysteresis, no shift by stress.
Of strain and stress the steadier one drives the wire, the other is predicted.
"""

import dataclasses
import sys
from collections.abc import Mapping
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.parameters import Parameters
from fitting.recordings import Campaign, Recording
from pneusma_jax.calibration_model import Quantity
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import SpringState, WireAlloy, simulate_wire

from . import priors
from .building import columns_of, measured_and_weight, smooth
from .driven import by_stress
from .driver_noise import carried_over, noisy, with_drivers
from .rows import Rows, numbers

OUTPUTS = ("strain", "stress")
ALLOY = tuple(field.name for field in dataclasses.fields(WireAlloy) if field.name != "name")
NEW_WIRE = "niti_wire"
"""Table that an alloy starts from that is to be identified."""
ASTRAY = 1e3
"""Standard deviations that a row counts for in which no strain carries the stress."""


def wire_quantities(campaign: Campaign, base: str | Path | None = None) -> tuple[dict[str, Quantity], bool]:
    """Constants of a campaign's wire with what is known of them, and whether they are to be identified.

    A table without residual strain gets that of `WireAlloy.from_calibration`, as an exact number.

    Raises:
        InputError: if the recordings name several alloys, or one without a wire's constants.
    """
    named = campaign.recordings[0].table("alloy")
    start = base or (NEW_WIRE if str(named) == priors.FIT else None)
    table, identify = priors.table_of(campaign, "alloy", start)
    wire = WireAlloy.from_calibration(table)
    assumed = "Eqs. 3.1 and 3.2 in tension; the table has none"
    found = {name: Quantity(name, float(getattr(wire, name)), "1", "assumed", assumed) for name in ALLOY}
    return found | {name: q for name, q in table.quantities.items() if name in found}, identify


def rows_for(campaign: Campaign, base: str | Path | None = None) -> list[Rows]:
    """Every recording of a campaign as arrays, in its order.

    Args:
        campaign: recordings of kind wire.
        base: table to start from where `alloy = "fit"`; `niti_wire` if None.

    Raises:
        InputError: if the recordings name several alloys, lack a temperature, or have too few complete rows.
    """
    quantities, _ = wire_quantities(campaign, base)
    number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
    ways = [by_stress(recording) for recording in campaign.recordings]
    return [
        _rows_of(recording, quantities, number[recording.specimen], way, set(ways))
        for recording, way in zip(campaign.recordings, ways, strict=True)
    ]


def _rows_of(
    recording: Recording, quantities: Mapping[str, Quantity], specimen: int, stressed: bool, ways: set[bool]
) -> Rows:
    if not recording.has("temperature"):
        raise InputError(
            f"{recording.path or recording.name}: there is no temperature_degC, and a wire's martensite "
            "fraction follows its temperature; add the column, or state one that did not change in the"
            " sidecar: [constant] temperature_degC = ..."
        )
    driver, output = ("stress", "strain") if stressed else ("strain", "stress")
    columns, block = columns_of(recording, (driver, "temperature"), (output,))
    measured, weight = measured_and_weight(recording, (output,), columns, block)
    nothing = np.zeros(len(columns["time"]))
    inputs = {"temperature": smooth(columns, "temperature"), driver: smooth(columns, driver)}
    extra = {}
    if len(ways) > 1:  # one structure for all recordings, so that they stack
        inputs.setdefault(output, nothing)
        extra["by_stress"] = np.asarray(float(stressed))
    base = {name: quantity.value for name, quantity in quantities.items()}
    base["prestrain"] = recording.full_geometry()["prestrain"]
    rows = Rows(
        mask=np.ones(len(columns["time"]), bool),
        time=columns["time"],
        inputs=inputs,
        measured={name: measured.get(name, nothing) for name in OUTPUTS},
        weight={name: weight.get(name, nothing) for name in OUTPUTS},
        base={name: np.asarray(float(value)) for name, value in base.items()},
        extra=extra,
        specimen=np.asarray(specimen),
    )
    return with_drivers(rows, recording, (driver, "temperature"), block)


def decides(recordings: list[Rows]) -> bool:
    """Whether weights change with the parameters, as noise of a driver matters more or less."""
    return noisy(recordings)


def decided(values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
    """Recordings weighted by the noise of temperature and of stress or strain, too, at these parameters."""
    return carried_over(sys.modules[__name__], values, recordings)


def parameters_for(campaign: Campaign, base: str | Path | None = None) -> Parameters:
    """Free constants of a campaign's wire with their priors.

    Args:
        campaign: recordings of kind wire.
        base: as for `rows_for`.
    """
    quantities, identify = wire_quantities(campaign, base)
    parameters = Parameters()
    if identify:
        for quantity in quantities.values():
            if quantity.prior is not None:
                parameters.add(priors.tabulated(quantity))
        return parameters
    for name, relative in priors.tolerances(campaign.recordings, ALLOY).items():
        quantity = quantities[name]
        parameters.add(priors.toleranced(name, quantity.value, relative, quantity.unit))
    return parameters


def wire_of(known: Mapping[str, Array]) -> WireAlloy:
    """The wire that numbers describe."""
    return WireAlloy(**{name: known[name] for name in ALLOY})


def predict(values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
    """Strain [1] and stress [Pa] of every row, the driver as given; NaN where no strain carries a stress."""
    known = numbers(values, rows)
    wire, state = wire_of(known), SpringState.fresh(known["prestrain"])
    drive = {"temperature": rows.inputs["temperature"], "state": state}
    found = {}
    for name in ("stress", "strain"):
        if name in rows.inputs:
            found[name] = simulate_wire(wire, **{name: rows.inputs[name]}, **drive).rows
    if len(found) == 1:
        (one,) = found.values()
        return {name: getattr(one, name) for name in OUTPUTS}
    stressed = rows.extra["by_stress"] > 0.0
    return {
        name: jnp.where(stressed, getattr(found["stress"], name), getattr(found["strain"], name))
        for name in OUTPUTS
    }


def residual(values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
    """Misfit of what is predicted in standard deviations."""
    found = predict(values, rows)
    parts = []
    for name in OUTPUTS:
        there = jnp.isfinite(found[name])
        misfit = rows.weight[name] * (jnp.where(there, found[name], 0.0) - rows.measured[name])
        parts.append(jnp.where(there | (rows.weight[name] == 0.0), misfit, ASTRAY))
    return jnp.concatenate(parts)
