"""Models of recordings that take effects, by kind: how rows and effects become outputs, and drivers.

A diagnosis evaluates them, and so do fits and samplers of a model on disk (`specimens.with_saved_model`).
"""

import importlib
from collections.abc import Mapping
from typing import Any, Protocol

from jaxtyping import Array

from fitting.data.recordings import Campaign
from fitting.inference.parameters import Parameters
from fitting.specimens.rows import Rows
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.pipeline import Effect

LETTERS = {"actuator": "A", "spring": "S", "wire": "W", "elastomer": "E", "tube": "T"}


class Kind(Protocol):
    """What the module of a kind holds."""

    OUTPUTS: tuple[str, ...]

    def rows_for(self, campaign: Campaign) -> list[Rows]:
        """Every recording as arrays."""

    def parameters_for(self, campaign: Campaign) -> Parameters:
        """Free constants of the base model."""

    def predict(
        self, values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Outputs by quantity and what drives them by name (`pressure`, `xi0_2`, ...), each of shape
        (rows,)."""


def kind_module(kind: str) -> Kind:
    """Module of a kind of recording."""
    return importlib.import_module(f"{__name__}.{kind}")


def candidates(kind: str) -> list[str]:
    """Slugs of the effects that recordings of a kind can show."""
    return [slug for slug, effect in CATALOGUE.items() if LETTERS[kind] in effect.kinds]
