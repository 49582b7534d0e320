"""Forward model of elastomer coupons: strain in, engineering stress out.

The law is the one that the recordings state. `fitting.calibrate.elastomer` compares several laws.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign, Recording, kinds
from fitting.inference.parameters import Parameter, Parameters
from pneusma_jax.pipeline import Effect
from pneusma_jax.simulate.coupon import simulate_coupon

from . import silicones
from .cautions import silicone_cautions
from .registry import register
from .rows import MARK, Rows, numbers
from .specimen import FITTED, Courses, RowOptions, Specimen
from .zeros import strain_from_taut, zeros_of

ZEROS = {"strain": "1", "stress": "kPa"}
"""Quantities whose zero a fit may find, with the unit that reports show."""


class Coupon(Specimen):
    """A coupon of an elastomer in tension or compression."""

    recording = kinds.ELASTOMER
    outputs = ("stress",)
    letter = "E"
    noun = "silicone"
    law = "the law of the silicone"
    over = simulated_over = "strain"
    tables = ("silicone",)
    options = ("material",)
    identified = ("material",)
    several_laws = True
    sized = False
    loads = "strain"
    element = "silicone"
    wall_drivers = ("time",)
    output_drivers = ("time", "strain", "strain_rate", "max_strain", "stress")

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """The strain."""
        return ("strain",)

    def rows_for(
        self, campaign: Campaign, options: RowOptions = FITTED, material: str | Path | None = None
    ) -> list[Rows]:
        """Recordings as arrays; see `Specimen.rows_for`.

        Args:
            campaign: recordings of kind elastomer.
            options: selection of rows.
            material: name or path of a table, in place of the one that the recordings name. By default a
                material that is to be fitted starts from the source's silicone.

        Raises:
            InputError: if they name several materials, or one has too few complete rows.
        """
        made = silicones.rows_of_silicone(campaign, options, material, self, _exact_zeros)
        return [_with_zeros(*pair) for pair in zip(made, campaign.recordings, strict=True)]

    def parameters_for(self, campaign: Campaign, material: str | Path | None = None) -> Parameters:
        """Free parameters with their priors: constants of the silicone, each specimen's stiffness factor,
        then zeros.

        Args:
            campaign: recordings of kind elastomer.
            material: name or path of a table, as for `rows_for`.
        """
        parameters = silicones.parameters_of_silicone(campaign, material, lambda recording: {})
        for parameter in _zeros(campaign):
            parameters.add(parameter)
        return parameters

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Stress and strain; see `Specimen.answer`. Without effects the rows are independent and are computed
        at once."""
        parameters = numbers(values, rows)
        law = silicones.law_with(rows.extra["law"], parameters)
        strain = strain_from_taut(rows.inputs["strain"], parameters["strain_zero"], rows.extra["flat"])
        seen = {"stress": law(strain)}
        if effects:
            seen = simulate_coupon(law, strain, time=rows.time, effects=effects).seen
        seen = seen | {"stress": seen["stress"] + parameters["stress_zero"]}
        rate = jnp.gradient(strain) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
        return seen, {"strain": strain, "strain_rate": rate, "max_strain": jnp.maximum.accumulate(strain)}

    def cautions(self, recording: Recording, rows: Rows, outputs: Courses, drivers: Courses) -> list[str]:
        """Warnings where the silicone is strained beyond its tests."""
        law = silicones.law_with(rows.extra["law"], numbers({}, rows))
        return silicone_cautions(law, drivers["strain"], drivers["strain"])


def _exact_zeros(recording: Recording) -> dict[str, float]:
    """Zeros of both quantities at none, exactly as the recording states them."""
    return {f"{quantity}_zero": 0.0 for quantity in ZEROS}


def _with_zeros(rows: Rows, recording: Recording) -> Rows:
    """A recording with the mask of rows at which its coupon hung slack. Rows that cannot be assigned do not
    count."""
    zeros, strain = zeros_of(recording), rows.inputs["strain"]
    weight = {name: np.where(zeros.unsure(strain), 0.0, w) for name, w in rows.weight.items()}
    extra = rows.extra | {"flat": zeros.flat(strain)}
    return dataclasses.replace(rows, weight=weight, extra=extra)


def _zeros(campaign: Campaign) -> list[Parameter]:
    """Zeros that the fit is to find, per specimen; each has the widest prior among its recordings."""
    specimens, found = campaign.specimens(), []
    for number, recordings in enumerate(specimens.values(), start=1):
        stated = [zeros_of(recording) for recording in recordings]
        for quantity, unit in ZEROS.items():
            doubt = [zeros for zeros in stated if quantity in zeros.sd]
            if doubt:
                widest = max(doubt, key=lambda zeros: zeros.sd[quantity])
                name = f"{quantity}_zero" + (f"{MARK}{number}" if len(specimens) > 1 else "")
                prior = widest.prior(quantity)
                found.append(Parameter(name, value=widest.begin(quantity), unit=unit, prior=prior))
    return found


COUPON = register(Coupon())
