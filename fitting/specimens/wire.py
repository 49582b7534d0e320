"""Recordings of a straight wire as functions of the parameters: its strain under stress, or its stress.

The phase follows the temperature on one reversible curve (the base law): no hysteresis, no shift by stress.
Of strain and stress the steadier one drives the wire, the other is predicted.
"""

import dataclasses
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign, Recording
from fitting.inference.driven import by_stress
from fitting.inference.parameters import Parameters
from pneusma_jax.calibration import Calibration, load_calibration
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import SpringState, WireAlloy, simulate_wire

from . import priors
from .input_noise import carried_over, noisy, with_drivers
from .row_builders import columns_of, measured_and_weight, smooth
from .rows import Rows, numbers
from .thermal_runs import FirstHeating, first_heating, half_way, moved_prior

OUTPUTS = ("strain", "stress")
ALLOY = tuple(field.name for field in dataclasses.fields(WireAlloy) if field.name != "name")
NEW_WIRE = "niti_wire"
"""Table that an alloy starts from that is to be identified."""
AMPLITUDE = "gR_amplitude"
RESIDUAL = (AMPLITUDE, "gR_slope", "gR_shift", "gR_decay")
"""Constants of what is left when a load is taken off."""
UNLOADED = 0.5
"""Part of its largest stress below which a wire must come for those constants to be seen. Under a steady load
their only trace would be a loop between heating and cooling, which is another physics."""
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


def unloads(recording: Recording) -> bool:
    """Whether a load is taken off after it was largest, so that a residual strain would show."""
    stress = recording.si("stress")
    stress = np.abs(stress[np.isfinite(stress)])
    return bool(stress.size and np.min(stress[int(np.argmax(stress)) :]) < UNLOADED * np.max(stress))


def unseen(campaign: Campaign, base: str | Path | None = None) -> dict[str, Quantity]:
    """Constants of an alloy that is to be identified which no recording of the campaign shows, so that they
    are held: those of the residual strain, where no load is taken off."""
    quantities, identify = wire_quantities(campaign, base)
    if not identify or any(unloads(recording) for recording in campaign.recordings):
        return {}
    return {name: q for name, q in quantities.items() if name in RESIDUAL and q.prior is not None}


def without_residual(campaign: Campaign, base: str | Path | Calibration | None = None) -> Calibration:
    """The table that an alloy is identified from, with no residual strain at all.

    Args:
        campaign: recordings of kind wire.
        base: as for `rows_for`.
    """
    table = load_calibration(base or NEW_WIRE, "alloy")
    quantities, _ = wire_quantities(campaign, table)
    said = (
        "Left out: no load was taken off, and a loop that it drew under the steady load was not the "
        "recorded one"
    )
    none = replace(quantities[AMPLITUDE], value=0.0, status="assumed", source=said)
    return replace(table, quantities={**table.quantities, AMPLITUDE: none})


def bracket(campaign: Campaign) -> tuple[float, float] | None:
    """Lowest and highest temperature [degC] at which a fitted wire is half-way through its transformation, as
    heating and cooling runs under steady loads show it; None where none does."""
    found = [
        T for recording in campaign.recordings if recording.role == "fit" for T in _half_way(recording)
    ]
    return (min(found), max(found)) if found else None


def _half_way(recording: Recording) -> tuple[float, ...]:
    return half_way(recording, *_driver_and_output(recording))


def set_apart(recording: Recording) -> FirstHeating | None:
    """A first heating unlike the later ones, which is not fitted; None where there is none."""
    return first_heating(recording, *_driver_and_output(recording))


def _driver_and_output(recording: Recording) -> tuple[str, str]:
    return ("stress", "strain") if by_stress(recording) else ("strain", "stress")


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
    begun = set_apart(recording)
    if begun is not None:
        weight[output] = np.where(columns["time"] > _time_of(recording, begun.rows), weight[output], 0.0)
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


def _time_of(recording: Recording, row: int) -> float:
    """Time [s] of a row, counted from 1; its number from 0 without a clock."""
    return float(recording.si("time")[row - 1]) if recording.has("time") else row - 1.0


def decides(recordings: list[Rows]) -> bool:
    """Whether weights change with the parameters, as noise of a driver matters more or less."""
    return noisy(recordings)


def decided(values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
    """Recordings weighted by the noise of temperature and of stress or strain, too, at these parameters."""
    return carried_over(sys.modules[__name__], values, recordings)


def parameters_for(campaign: Campaign, base: str | Path | None = None) -> Parameters:
    """Free constants of a campaign's wire with their priors.

    Of an alloy that is to be identified those of the residual strain are held where no load is ever taken off
    (`RESIDUAL`), and the prior of `T_mid` is moved to where the recordings are half-way through their
    transformation, if they show it: a table says little of that, and misfits far from it have no slope.

    Args:
        campaign: recordings of kind wire.
        base: as for `rows_for`.
    """
    quantities, identify = wire_quantities(campaign, base)
    parameters = Parameters()
    if identify:
        held = unseen(campaign, base)
        for quantity in quantities.values():
            if quantity.prior is not None and quantity.name not in held:
                parameters.add(priors.tabulated(quantity))
        between = bracket(campaign)
        if between is not None and "T_mid" in parameters:
            moved_prior(parameters["T_mid"], 0.5 * sum(between))
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
