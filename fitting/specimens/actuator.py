"""Forward model of bending actuators: pressure and resistances in; curvature, bend angle, bend direction and
length out.

Without effects all rows of a recording are solved at once (`actuator_rows`). Their martensite fractions were
read from the resistances beforehand (`actuator_phase`). With effects the rows are solved one after the other
(`actuator_history`).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording, kinds
from fitting.inference.parameters import Parameters
from pneusma_jax.actuator.designs import GEOMETRY_KEYS
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.pipeline import Effect

from . import actuator_phase, priors, silicones
from .actuator_data import FIXED, OUTPUTS, TUBE, dimensions, layout_of, undecided_rows_for
from .actuator_history import EXPLAINED, SpringPhases, with_effects
from .actuator_rows import ALLOY, trajectory
from .registry import register
from .rows import Rows
from .specimen import FITTED, OF_HISTORIES, RowOptions, Specimen

OPPOSING = "opposing_spring_heating"
"""Slug of the effect that acts in the spring that is not driven."""


class BendingActuator(Specimen):
    """A bending actuator of any design."""

    recording = kinds.ACTUATOR
    outputs = OUTPUTS
    letter = "A"
    noun = "actuator"
    law = "the base model of the actuator"
    tables = ("alloy", "silicone", "actuator")
    options = ("base", "material")
    identified = ("alloy", "material")
    loads = "pressure"
    starts = 1
    starts_with_model = 1
    element = "actuator"
    wall_drivers = ("time", "current_1", "current_2", "current_3")
    output_drivers = (
        *wall_drivers, "xi0_1", "xi0_2", "xi0_3", "temperature", "pressure", "pressure_rate", "curvature",
        "bend_angle", "length", "strain", "strain_rate", "max_strain",
    )  # fmt: skip
    most_rows_with_effects = 128  # every row is an equilibrium
    each_alone = True
    compiler_options = OF_HISTORIES
    explained = EXPLAINED
    latent = SpringPhases()

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """Pressure, and the resistances of the springs that the design has."""
        springs = pj.layout(recording.full_geometry()["design"]).spring_numbers
        return ("pressure", *(f"resistance_{n}" for n in springs if recording.has(f"resistance_{n}")))

    def influences(self, recording: Recording) -> tuple[str, ...]:
        """Pressure, resistances, currents and air temperature, as far as the recording has them."""
        springs = (f"{stem}_{n}" for n in (1, 2, 3) for stem in ("resistance", "current"))
        return tuple(name for name in ("pressure", *springs, "temperature") if recording.has(name))

    def rows_for(
        self,
        campaign: Campaign,
        options: RowOptions = FITTED,
        base: str | Path | None = None,
        material: str | Path | None = None,
    ) -> list[Rows]:
        """Recordings as arrays, see `Specimen.rows_for`. Martensite fractions are those at the stated
        parameters.

        Args:
            campaign: recordings of kind actuator, of one design.
            options: selection of rows.
            base: name or path of the alloy's prior table, where `alloy = "fit"`; see
                `specimens.priors.alloy_quantities`.
            material: name or path of the silicone's table, in place of the one that the recordings name.

        Raises:
            InputError: if they name several designs, alloys or materials, or one has too few complete rows.
        """
        return actuator_phase.decided({}, undecided_rows_for(campaign, base, material, options))

    def parameters_for(
        self, campaign: Campaign, base: str | Path | None = None, material: str | Path | None = None
    ) -> Parameters:
        """Free parameters with their priors: the alloy's, the silicone's, each specimen's stiffness factor
        and dimensions.

        Args:
            campaign: recordings of kind actuator, of one design.
            base, material: names or paths of tables, as for `rows_for`.
        """
        parameters, layout = Parameters(), layout_of(campaign)
        if layout.spring_numbers:
            parameters, _ = priors.alloy_parameters(campaign, ALLOY, FIXED, base)
        law, identify = silicones.law_of(campaign, material)
        table = silicones.table_name(campaign, material)
        constants = silicones.material_parameters(campaign, law, identify, table)
        parameters.update(constants)
        free_names = {silicones.FACTOR, *(GEOMETRY_KEYS if layout.spring_numbers else TUBE)}

        def sizes(recording: Recording) -> dict[str, float]:
            return {name: value for name, value in dimensions(recording).items() if name in free_names}

        stiffness = silicones.always_open(campaign, identify, constants)
        parameters.update(priors.geometry_parameters(campaign, sizes, silicones.UNITS, stiffness))
        return parameters

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Outputs and drivers, see `Specimen.answer`; NaN where there is no equilibrium."""
        if effects or "gain" not in rows.extra:  # fractions are free: nothing was read before
            return with_effects(values, rows, effects)
        found, layout = trajectory(values, rows), rows.extra["layout"]
        drivers = {"pressure": rows.inputs["pressure"], "curvature": found.curvature}
        for k, number in enumerate(layout.spring_numbers):
            drivers |= {f"xi0_{number}": found.xi0[k], f"gamma_{number}": found.gamma[k]}
            drivers[f"ohms_{number}"] = found.ohms[k]
        return {name: getattr(found, name) for name in OUTPUTS}, drivers

    def misfit(self, found: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Weighted residual, in standard deviations. Bend directions differ by at most half a turn."""
        turned = dict(found)
        if "bend_direction" in found:
            measured = rows.measured["bend_direction"]
            missed = jnp.mod(found["bend_direction"] - measured + jnp.pi, 2.0 * jnp.pi) - jnp.pi
            turned["bend_direction"] = measured + missed
        return super().misfit(turned, rows)

    def decides(self, recordings: Sequence[Rows]) -> bool:
        """True if martensite fractions are read from resistances, since they change with the parameters."""
        return any(np.any(sd) for rows in recordings for sd in rows.extra["sd"])

    def decided(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings with the martensite fractions that their resistances imply at these parameters; see
        `actuator_phase`."""
        return actuator_phase.decided(values, recordings)

    def located(self, component: str, recordings: Sequence[Recording], slug: str) -> str:
        """Name of the misfitting component. A spring is named by its number: the heated one, unless the
        effect names another."""
        if component != "spring":
            return component
        if not slug:
            return "spring_2"
        measured = [n for n in (1, 2, 3) if any(r.has(f"resistance_{n}") for r in recordings)]
        others = [n for n in (1, 2, 3) if n not in measured]
        driven = measured[0] if measured else 2
        if slug == OPPOSING and driven in (1, 2):
            return f"spring_{3 - driven if 3 - driven in others else driven}"
        return f"spring_{driven}"

    def alloy_quantities(
        self, campaign: Campaign, base: str | Path | None = None, material: str | Path | None = None
    ) -> dict[str, Quantity]:
        """Constants of the springs' alloy with their priors; empty without springs."""
        wound = layout_of(campaign).spring_numbers
        return priors.alloy_quantities(campaign, ALLOY, base)[0] if wound else {}


ACTUATOR = register(BendingActuator())
