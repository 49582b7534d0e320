"""Elastomer coupons: strain in, engineering stress out.

The law is the one that the recordings state; `fitting.calibrate.elastomer` is what compares laws.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

from fitting.data.recordings import Campaign, Recording, kinds
from fitting.inference.parameters import Parameters
from pneusma_jax.pipeline import Effect
from pneusma_jax.simulate.coupon import simulate_coupon

from . import silicones
from .cautions import silicone_cautions
from .registry import register
from .rows import Rows, numbers
from .specimen import FITTED, Courses, RowOptions, Specimen


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
    identified = "material"
    several_laws = True
    sized = False
    loads = "strain"
    element = "silicone"
    wall_drivers = ("time",)

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """The strain."""
        return ("strain",)

    def rows_for(
        self, campaign: Campaign, options: RowOptions = FITTED, material: str | Path | None = None
    ) -> list[Rows]:
        """See `Specimen.rows_for`.

        Args:
            campaign: recordings of kind elastomer.
            options: which rows are taken.
            material: table to start from, instead of the one that is named or, for one that is to be fitted,
                the source's silicone.

        Raises:
            InputError: if they name several materials, or one has too few complete rows.
        """
        return silicones.rows_of_silicone(campaign, options, material, self, lambda recording: {})

    def parameters_for(self, campaign: Campaign, material: str | Path | None = None) -> Parameters:
        """Free numbers with their priors: constants of the silicone, then each specimen's factor.

        Args:
            campaign: recordings of kind elastomer.
            material: as for `rows_for`.
        """
        return silicones.parameters_of_silicone(campaign, material, lambda recording: {})

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """See `Specimen.answer`. Without effects no row depends on another, and all are computed at once."""
        law = silicones.law_with(rows.extra["law"], numbers(values, rows))
        strain = rows.inputs["strain"]
        seen = {"stress": law(strain)}
        if effects:
            seen = simulate_coupon(law, strain, time=rows.time, effects=effects).seen
        rate = jnp.gradient(strain) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
        return seen, {"strain": strain, "strain_rate": rate, "max_strain": jnp.maximum.accumulate(strain)}

    def cautions(self, recording: Recording, rows: Rows, outputs: Courses, drivers: Courses) -> list[str]:
        """Where the silicone is strained beyond its tests."""
        law = silicones.law_with(rows.extra["law"], numbers({}, rows))
        return silicone_cautions(law, drivers["strain"], drivers["strain"])


COUPON = register(Coupon())
