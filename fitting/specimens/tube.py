"""Forward model of pressurised tubes without springs: pressure in, length out (Eq. 3.10)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording, kinds
from fitting.inference.parameters import Parameters
from fitting.inference.readings import noise_of
from pneusma_jax.pipeline import Effect
from pneusma_jax.silicone import tube_length
from pneusma_jax.simulate.tracking import track_history
from pneusma_jax.simulate.tube import make_tube

from . import silicones
from .cautions import silicone_cautions
from .model_objects import dimensions_of
from .registry import register
from .rows import Rows, numbers
from .specimen import EVERY, FITTED, Courses, RowOptions, Specimen

GEOMETRY = ("length", "outer_diameter", "wall_thickness")
SLOPE_DEGREE = 5
"""Degree of the polynomial of length over pressure, whose slope propagates the noise of the pressure."""
BENT = ("curvature", "bend_angle")
"""Outputs of an actuator that a tube does not have."""


def sizes_of(recording: Recording) -> dict[str, float]:
    """Dimensions of a recording's tube by name, SI."""
    known = dimensions_of(recording)
    return {name: float(known[name]) for name in GEOMETRY}


class Tube(Specimen):
    """A fibre-wrapped tube under pressure."""

    recording = kinds.TUBE
    outputs = ("length",)
    letter = "T"
    noun = "tube"
    law = "the base law of a pressurised tube"
    over = simulated_over = "pressure"
    tables = ("silicone", "actuator")
    options = ("material",)
    identified = ("material",)
    loads = "pressure"
    profiled = EVERY
    element = "actuator"
    wall_drivers = ("time",)
    output_drivers = ("time", "pressure", "pressure_rate", "length", "strain", "strain_rate", "max_strain")
    most_rows_with_effects = 512  # every row is an equilibrium
    each_alone = True

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """The pressure."""
        return ("pressure",)

    def rows_for(
        self, campaign: Campaign, options: RowOptions = FITTED, material: str | Path | None = None
    ) -> list[Rows]:
        """Recordings as arrays, see `Specimen.rows_for`. The noise of the pressure adds to that of the
        length, so the pressure is not smoothed.

        Args:
            campaign: recordings of kind tube.
            options: selection of rows.
            material: name or path of a table, in place of the one that the recordings name. Only a material
                that is to be fitted needs it.

        Raises:
            InputError: if they name several materials, or one has too few complete rows.
        """
        return silicones.rows_of_silicone(campaign, options, material, self, sizes_of, _with_pressure)

    def parameters_for(self, campaign: Campaign, material: str | Path | None = None) -> Parameters:
        """Free parameters with their priors: constants of the silicone, then each specimen's factor and
        dimensions.

        Args:
            campaign: recordings of kind tube.
            material: name or path of a table, as for `rows_for`.
        """
        return silicones.parameters_of_silicone(campaign, material, sizes_of)

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Length and pressure; see `Specimen.answer`. Without effects the rows are independent and are solved
        at once."""
        parameters = numbers(values, rows)
        law = silicones.law_with(rows.extra["law"], parameters)
        sizes = {name: parameters[name] for name in GEOMETRY}
        pressure = rows.inputs["pressure"]
        rate = jnp.gradient(pressure) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
        if effects:
            body = make_tube(pj.Geometry(**sizes), law)
            track = track_history(body, pressure, (), (), rows.time, effects)
            length, seen = track.rows.length, {n: x for n, x in track.seen.items() if n not in BENT}
        else:
            length = jax.vmap(lambda p: tube_length(p, *sizes.values(), law, throw=False))(pressure)
            seen = {"length": length}
        return seen, {"pressure": pressure, "pressure_rate": rate, "strain": length / sizes["length"] - 1.0}

    def cautions(self, recording: Recording, rows: Rows, outputs: Courses, drivers: Courses) -> list[str]:
        """Warnings where the silicone is strained beyond its tests."""
        law = silicones.law_with(rows.extra["law"], numbers({}, rows))
        return silicone_cautions(law, drivers["strain"], drivers["strain"])


def _with_pressure(
    recording: Recording, columns: Mapping[str, np.ndarray], weight: np.ndarray, block: int
) -> np.ndarray:
    """Weight of the length with the propagated noise of the pressure, stated or estimated, by the
    recording's own slope."""
    sigma, used = noise_of(recording, "pressure"), weight > 0.0
    if not sigma > 0.0 or used.sum() < SLOPE_DEGREE + 2:
        return weight
    course = np.polynomial.Polynomial.fit(columns["pressure"][used], columns["length"][used], SLOPE_DEGREE)
    slope = np.where(used, course.deriv()(columns["pressure"]), 0.0)
    variance = 1.0 / np.where(used, weight, 1.0) ** 2 + (slope * sigma) ** 2 / block
    return np.where(used, variance**-0.5, 0.0)


TUBE = register(Tube())
