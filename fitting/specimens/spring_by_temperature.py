"""Forward model of springs without a measured resistance: elongation and temperature in, force out.

The martensite fraction follows the recorded temperature on one reversible curve (`T_mid`, `T_width`), without
hysteresis or shift by stress. Constants of the resistivity stay fixed, since only a resistance identifies
them.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording, kinds
from fitting.inference.parameters import Parameters
from pneusma_jax.calibration import load_calibration
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.pipeline import Effect

from . import priors
from .input_noise import have_driver_noise, with_driver_noise, with_effective_variance
from .row_builders import columns_of, measured_and_weight, smooth
from .rows import Rows, numbers
from .specimen import EVERY, FITTED, RowOptions, Specimen
from .spring_rows import ALLOY, FIXED, HELD_LENGTH_RANGE, dimension_numbers, spring_of
from .thermal_runs import centre_prior, half_way

OUTPUTS = ("force",)
CURVE = ("T_mid", "T_width")
"""Constants of the curve over temperature; tests with a resistance do not identify them."""
ELECTRICAL = ("km_1", "km_2", "km_3", "rho_mean", "rho_span", "alpha_1", "alpha_2", "a", "b", "c")
"""Constants that only a resistance identifies."""


def without_resistance(campaign: Campaign) -> bool:
    """True if no spring of a campaign has a resistance, and all have a temperature."""
    return all(r.has("temperature") and not r.has("resistance") for r in campaign.recordings)


def half_way_of(recording: Recording) -> tuple[float, ...]:
    """Temperatures at which a spring held at a length is half transformed [degC]."""
    return half_way(recording, "elongation", "force")


class SpringByTemperature(Specimen):
    """A spring whose phase follows its temperature."""

    recording = kinds.SPRING
    outputs = OUTPUTS
    letter = "S"
    noun = "spring"
    law = "the base law of the spring, its phase on one curve over temperature (no hysteresis)"
    profiled = EVERY
    tables = ("alloy", "actuator")
    options = ("base",)
    identified = ("alloy",)
    element = "spring"

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """Elongation and temperature."""
        return ("elongation", "temperature")

    def rows_for(
        self, campaign: Campaign, options: RowOptions = FITTED, base: str | Path | None = None
    ) -> list[Rows]:
        """Recordings of a campaign as arrays, in their order.

        Args:
            campaign: recordings of kind spring, with temperature.
            options: selection of rows.
            base: name or path of the alloy's prior table, where `alloy = "fit"`.

        Raises:
            InputError: if one has too few rows with time, elongation and temperature.
        """
        quantities, _ = priors.alloy_quantities(campaign, ALLOY, base)
        alloy = {name: np.asarray(float(quantity.value)) for name, quantity in quantities.items()}
        number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
        drivers, found = ("elongation", "temperature"), []
        for recording in campaign.recordings:
            columns, block = columns_of(recording, drivers, OUTPUTS, options)
            measured, weight = measured_and_weight(recording, OUTPUTS, columns, block, options)
            rows = Rows(
                mask=np.ones(len(columns["time"]), bool),
                time=columns["time"],
                inputs={
                    "elongation": columns["elongation"],
                    "temperature": smooth(columns, "temperature", options),
                },
                measured=measured,
                weight=weight,
                base={**alloy, **dimension_numbers(recording)},
                extra={},
                specimen=np.asarray(number[recording.specimen]),
            )
            found.append(with_driver_noise(rows, recording, drivers, block) if options.compared else rows)
        return found

    def decides(self, recordings: Sequence[Rows]) -> bool:
        """True if weights change with the parameters, through the noise of the drivers."""
        return have_driver_noise(recordings)

    def decided(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings weighted by the noise of elongation and temperature, too, at these parameters."""
        return with_effective_variance(self, values, recordings)

    def parameters_for(self, campaign: Campaign, base: str | Path | None = None) -> Parameters:
        """Free parameters of a campaign with their priors. They are those of springs without the
        resistivity's, and the curve over temperature, which a table only assumes.

        A spring may be held at a length while the temperature takes it through its transformation. Then the
        prior of an unknown alloy's `T_mid` is centred at the temperature of half the change of the force.

        Args:
            campaign: recordings of kind spring.
            base: name or path of a table, as for `rows_for`.
        """
        fixed = (*(name for name in FIXED if name not in CURVE), *ELECTRICAL)
        parameters, _ = priors.alloy_parameters(campaign, ALLOY, fixed, base)
        for name in ELECTRICAL:
            if name in parameters:
                del parameters[name]
        quantities, identify = priors.alloy_quantities(campaign, ALLOY, base)
        wide = load_calibration(kinds.WIRE_ALLOY, "alloy").quantities
        for name in CURVE:
            if name not in parameters:
                quantity = quantities[name]
                use_wide = identify or quantity.prior is None
                parameters.add(priors.tabulated(wide[name] if use_wide else quantity))
        middles = [T for r in campaign.recordings if r.role == "fit" for T in half_way_of(r)]
        if identify and middles:
            centre_prior(parameters["T_mid"], 0.5 * (min(middles) + max(middles)))
        parameters.update(priors.geometry_parameters(campaign, dimension_numbers))
        return parameters

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Force and drivers; see `Specimen.answer`."""
        parameters = numbers(values, rows)
        state = pj.SpringState(parameters["prestrain"], jnp.ones(()))
        heat = pj.Temperature(rows.inputs["temperature"])
        drive = {"time": rows.time, "effects": effects}
        found = pj.simulate_spring(spring_of(parameters), rows.inputs["elongation"], heat, state, **drive)
        seen = {name: x for name, x in found.seen.items() if name != "resistance"}
        return seen, {"xi0": found.rows.xi0, "strain": found.rows.gamma}

    def alloy_quantities(self, campaign: Campaign, base: str | Path | None = None) -> dict[str, Quantity]:
        """Constants of the spring's alloy with their priors."""
        return priors.alloy_quantities(campaign, ALLOY, base)[0]

    def plotted_over(self, rows: Rows) -> str:
        """Temperature for a spring that is held at a length, elongation for others."""
        return "temperature" if np.ptp(rows.inputs["elongation"]) < HELD_LENGTH_RANGE else "elongation"


BY_TEMPERATURE = SpringByTemperature()
"""Specimen of recordings of kind spring without a resistance; `SpringOnStand.variant` chooses it."""
