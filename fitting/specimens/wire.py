"""Forward model of straight wires: temperature and stress (or strain) in, strain (or stress) out.

The phase follows the temperature on one reversible curve (the base law), without hysteresis or shift by
stress. A residual strain may draw a loop all the same: heating takes it away, cooling under load sets it
again. Of strain and stress the steadier one drives the wire, the other is predicted.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign, Recording, kinds
from fitting.inference.driven import by_stress
from fitting.inference.parameters import Parameters
from pneusma_jax.calibration import Calibration, load_calibration
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import SpringState, WireAlloy, simulate_wire
from pneusma_jax.pipeline import Effect

from . import priors
from .input_noise import have_driver_noise, with_driver_noise, with_effective_variance
from .registry import register
from .row_builders import columns_of, measured_and_weight, smooth
from .rows import Rows, numbers
from .specimen import EVERY, FITTED, Courses, RowOptions, Specimen
from .thermal_runs import FirstHeating, centre_prior, first_heating, half_way

OUTPUTS = ("strain", "stress")
ALLOY = tuple(field.name for field in dataclasses.fields(WireAlloy) if field.name != "name")
NEW_WIRE = kinds.WIRE_ALLOY
"""Default table that an alloy starts from when it is to be identified."""
AMPLITUDE = "gR_amplitude"
RESIDUAL = (AMPLITUDE, "gR_slope", "gR_shift", "gR_decay")
"""Constants of the residual strain after a load is taken off."""
UNLOADED = 0.5
"""Maximum part of its largest stress to which a wire must unload for those constants to be identified. Under
a steady load their only trace would be a loop between heating and cooling, which has other causes."""
STILL = 5.0
"""Minimum range of a temperature for drawing outputs over it [K]."""
FAILED_RESIDUAL = 1e3
"""Residual of a row in which no strain carries the stress, in standard deviations."""


def wire_quantities(campaign: Campaign, base: str | Path | None = None) -> tuple[dict[str, Quantity], bool]:
    """Constants of a campaign's wire with their priors, and a flag that is true if they are to be identified.

    A table without residual strain gets that of `WireAlloy.from_calibration`, as an exact constant.

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
    """True if a load is taken off after its maximum, so that a residual strain would show."""
    stress = recording.si("stress")
    stress = np.abs(stress[np.isfinite(stress)])
    return bool(stress.size and np.min(stress[int(np.argmax(stress)) :]) < UNLOADED * np.max(stress))


def unseen(campaign: Campaign, base: str | Path | None = None) -> dict[str, Quantity]:
    """Constants of an alloy to be identified that no recording of the campaign shows on its own.

    They are those of the residual strain, where no load is taken off. The loop that they draw may have other
    causes.
    """
    quantities, identify = wire_quantities(campaign, base)
    if not identify or any(unloads(recording) for recording in campaign.recordings):
        return {}
    return {name: q for name, q in quantities.items() if name in RESIDUAL and q.prior is not None}


def without_residual(campaign: Campaign, base: str | Path | Calibration | None = None) -> Calibration:
    """The table that an alloy is identified from, without residual strain.

    Args:
        campaign: recordings of kind wire.
        base: name or path of a table, as for `StraightWire.rows_for`.
    """
    table = load_calibration(base or NEW_WIRE, "alloy")
    quantities, _ = wire_quantities(campaign, table)
    source = (
        "Left out: no load was taken off, and a loop that it drew under the steady load was not the "
        "recorded one"
    )
    none = replace(quantities[AMPLITUDE], value=0.0, status="assumed", source=source)
    return replace(table, quantities={**table.quantities, AMPLITUDE: none})


def bracket(campaign: Campaign) -> tuple[float, float] | None:
    """Lowest and highest temperature at which a fitted wire is half transformed [degC]. They come from
    heating and cooling runs under steady loads; None where there is none."""
    found = [T for recording in campaign.recordings if recording.role == "fit" for T in _half_way(recording)]
    return (min(found), max(found)) if found else None


def _half_way(recording: Recording) -> tuple[float, ...]:
    return half_way(recording, *_driver_and_output(recording))


def set_apart(recording: Recording) -> FirstHeating | None:
    """A first heating that deviates from the later ones and is not fitted; None where there is none."""
    return first_heating(recording, *_driver_and_output(recording))


def _driver_and_output(recording: Recording) -> tuple[str, str]:
    return ("stress", "strain") if by_stress(recording) else ("strain", "stress")


def _rows_of(
    recording: Recording,
    quantities: Mapping[str, Quantity],
    specimen: int,
    stressed: bool,
    ways: set[bool],
    options: RowOptions,
) -> Rows:
    if not recording.has("temperature"):
        raise InputError(
            f"{recording.path or recording.name}: there is no temperature_degC, and a wire's martensite "
            "fraction follows its temperature. Add the column, or state one that did not change in the"
            " sidecar: [constant] temperature_degC = ..."
        )
    driver, output = ("stress", "strain") if stressed else ("strain", "stress")
    columns, block = columns_of(recording, (driver, "temperature"), (output,), options)
    measured, weight = measured_and_weight(recording, (output,), columns, block, options)
    begun = set_apart(recording) if options.compared else None
    if begun is not None:
        weight[output] = np.where(columns["time"] > _time_of(recording, begun.rows), weight[output], 0.0)
    nothing = np.zeros(len(columns["time"]))
    inputs = {name: smooth(columns, name, options) for name in ("temperature", driver)}
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
    return with_driver_noise(rows, recording, (driver, "temperature"), block) if options.compared else rows


def _time_of(recording: Recording, row: int) -> float:
    """Time of a row, counted from 1 [s]; its number from 0 without a clock."""
    return float(recording.si("time")[row - 1]) if recording.has("time") else row - 1.0


def wire_of(parameters: Mapping[str, Array]) -> WireAlloy:
    """The wire with these parameters."""
    return WireAlloy(**{name: parameters[name] for name in ALLOY})


class StraightWire(Specimen):
    """A wire in tension, by the reversible base law."""

    recording = kinds.WIRE
    outputs = ("strain", "stress")
    letter = "W"
    noun = "wire"
    law = (
        "the reversible base law (its phase has one curve over temperature, without hysteresis or shift by "
        "stress)"
    )
    over = "temperature"
    tables = ("alloy", "actuator")
    options = ("base",)
    identified = ("alloy",)
    new_alloy = NEW_WIRE
    sized = False
    loads = "stress"
    starts = 8  # with all constants open there is a minimum beside every kink of the residual strain
    profiled = EVERY
    element = "wire"
    output_drivers = ("time", "temperature", "xi0", "stress", "strain", "strain_rate", "max_strain")
    failed_residual = FAILED_RESIDUAL

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """Temperature, and the steadier one of stress and strain."""
        return ("temperature", _driver_and_output(recording)[0])

    def rows_for(
        self, campaign: Campaign, options: RowOptions = FITTED, base: str | Path | None = None
    ) -> list[Rows]:
        """Recordings as arrays; see `Specimen.rows_for`.

        Args:
            campaign: recordings of kind wire.
            options: selection of rows.
            base: name or path of the alloy's prior table, where `alloy = "fit"`; `niti_wire` if None.

        Raises:
            InputError: if the recordings name several alloys, lack a temperature, or have too few complete
                rows.
        """
        quantities, _ = wire_quantities(campaign, base)
        number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
        ways = [by_stress(recording) for recording in campaign.recordings]
        return [
            _rows_of(recording, quantities, number[recording.specimen], way, set(ways), options)
            for recording, way in zip(campaign.recordings, ways, strict=True)
        ]

    def parameters_for(self, campaign: Campaign, base: str | Path | None = None) -> Parameters:
        """Free constants of a campaign's wire with their priors.

        For an alloy that is to be identified two rules hold. Constants of the residual strain are left out
        where no load is ever taken off (`RESIDUAL`); a characterisation frees them by `unseen`. The prior of
        `T_mid` is centred where the recordings are half transformed, if they show it. A table is vague there,
        and misfits far from it have no slope.

        Args:
            campaign: recordings of kind wire.
            base: name or path of a table, as for `rows_for`.
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
                centre_prior(parameters["T_mid"], 0.5 * sum(between))
            return parameters
        for name, relative in priors.tolerances(campaign.recordings, ALLOY).items():
            quantity = quantities[name]
            parameters.add(priors.toleranced(name, quantity.value, relative, quantity.unit))
        return parameters

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Outputs and drivers; see `Specimen.answer`. The driver is returned unchanged, NaN where no strain
        carries a stress."""
        parameters = numbers(values, rows)
        element, state = wire_of(parameters), SpringState(parameters["prestrain"], jnp.ones(()))
        temperature = rows.inputs["temperature"]
        drive = {"temperature": temperature, "state": state, "time": rows.time, "effects": effects}
        runs = {}
        for given in ("stress", "strain"):
            if given in rows.inputs:
                run = simulate_wire(element, **{given: rows.inputs[given]}, **drive)
                within = {name: getattr(run.rows, name) for name in ("stress", "strain", "xi0")}
                runs[given] = (run.seen | {given: rows.inputs[given]}, within)
        if len(runs) == 1:
            ((found, within),) = runs.values()
        else:  # the recordings of a campaign share one structure, and each names its driver
            stressed, nothing = rows.extra["by_stress"] > 0.0, jnp.zeros_like(temperature)
            pairs = zip(runs["stress"], runs["strain"], strict=True)
            found, within = (
                {n: jnp.where(stressed, a.get(n, nothing), b.get(n, nothing)) for n in {**a, **b}}
                for a, b in pairs
            )
        return found, {"temperature": temperature} | within

    def decides(self, recordings: Sequence[Rows]) -> bool:
        """True if weights change with the parameters, through the noise of the drivers."""
        return have_driver_noise(recordings)

    def decided(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings weighted by the noise of temperature and of stress or strain, too, at these
        parameters."""
        return with_effective_variance(self, values, recordings)

    def cautions(self, recording: Recording, rows: Rows, outputs: Courses, drivers: Courses) -> list[str]:
        """Name of the wire's driver, and a warning about rows without an answer."""
        driver, free = _driver_and_output(recording)
        lost = int(np.sum(~np.isfinite(outputs[free])))
        notes = [f"{driver} drives the wire, as it was held or varies less"]
        return notes + ([f"in {lost} of {len(rows.mask)} rows no strain carries the stress"] if lost else [])

    def states(self, rows: Rows, drivers: Courses) -> dict[str, np.ndarray]:
        """The martensite fraction."""
        return {"xi0": drivers["xi0"]}

    def located(self, component: str, recordings: Sequence[Recording], slug: str) -> str:
        """The wire, for components that the catalogue places in a spring."""
        return "wire" if component == "spring" else component

    def simpler(self, campaign: Campaign, base: str | Path | None = None) -> tuple[dict[str, Any], str]:
        """The law without residual strain, where no load is taken off.

        Under a steady load a residual strain shows as a loop between heating and cooling. Where the law with
        it does not hold, that loop has another cause.
        """
        if AMPLITUDE not in unseen(campaign, base):
            return {}, ""
        return {"base": without_residual(campaign, base)}, "without residual strain"

    def unseen(self, campaign: Campaign, base: str | Path | None = None) -> dict[str, Quantity]:
        """Constants of the residual strain where no load is taken off; see `unseen`."""
        return unseen(campaign, base)

    def alloy_quantities(self, campaign: Campaign, base: str | Path | None = None) -> dict[str, Quantity]:
        """Constants of the wire with their priors."""
        return wire_quantities(campaign, base)[0]

    def plotted_over(self, rows: Rows) -> str:
        """Temperature; at one temperature, the other driver of the wire."""
        if np.ptp(np.asarray(rows.inputs["temperature"])[np.asarray(rows.mask)]) > STILL:
            return "temperature"
        moving = [n for n in ("strain", "stress") if n in rows.inputs and np.ptp(rows.inputs[n]) > 0.0]
        return moving[0] if moving else "time"

    def set_apart(self, recording: Recording) -> FirstHeating | None:
        """A first heating that deviates from the later ones; see `set_apart`."""
        return set_apart(recording)


WIRE = register(StraightWire())
