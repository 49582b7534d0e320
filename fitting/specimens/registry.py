"""The model of each kind of recording behind one interface. A new kind adds a line here and a module of its
own."""

import functools
import importlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import jax
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign
from fitting.inference.parameters import Parameters
from pneusma_jax.errors import InputError

from .rows import Rows

MODULES = {
    "spring": "fitting.specimens.spring",
    "wire": "fitting.specimens.wire",
    "elastomer": "fitting.specimens.elastomer",
    "tube": "fitting.specimens.tube",
    "actuator": "fitting.specimens.actuator",
}


class Model(Protocol):
    """What the module of a kind holds. All functions of `values` and `rows` are pure and may be traced.

    Where something depends on the parameters without being smooth in them (phases that are read, weights
    that count the noise of drivers), a module has `decides(recordings)` and `decided(values, recordings)`,
    too: fits and decisions alternate.
    """

    OUTPUTS: tuple[str, ...]

    def rows_for(self, campaign: Campaign, **options: Any) -> list[Rows]:
        """Every recording of a campaign as arrays."""

    def parameters_for(self, campaign: Campaign, **options: Any) -> Parameters:
        """Free numbers of a campaign with what is known about them."""

    def predict(self, values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
        """Outputs of one recording, by quantity, in SI."""

    def residual(self, values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Misfit of one recording in standard deviations."""


def model_of(kind: str) -> Model:
    """Model of a kind of recording.

    Raises:
        InputError: if there is none.
    """
    if kind not in MODULES:
        raise InputError(f"recordings of kind {kind} cannot be fitted; {', '.join(MODULES)} can")
    return importlib.import_module(MODULES[kind])


def parameters_for(campaign: Campaign, **options: Any) -> Parameters:
    """Free numbers of a campaign of one kind, with priors from its tolerances or its calibration table.

    Args:
        campaign: recordings of one kind.
        **options: of the kind, such as `base`, the table to start from where the alloy is to be identified.

    Raises:
        InputError: if the campaign holds several kinds, or one without a model.
    """
    return model_of(kind_of(campaign)).parameters_for(campaign, **options)


def kind_of(campaign: Campaign) -> str:
    """The one kind of a campaign.

    Raises:
        InputError: if there are several.
    """
    kinds = campaign.kinds
    if len(kinds) != 1:
        raise InputError(
            f"{campaign.path}: recordings of kinds {', '.join(kinds)} lie here together; fit one kind"
        )
    return kinds[0]


@functools.cache
def residual_of(kind: str | Model) -> Callable[[Mapping[str, Array], Rows], Float[Array, "recordings m"]]:
    """Residual of a stack of recordings of a kind: `residual(values, stacked)`, one object for each kind.

    Being one object, it is compiled once for each set of free parameters and each shape.

    Args:
        kind: of the recordings, or a model of them.
    """
    model = model_of(kind) if isinstance(kind, str) else kind

    def residual(values: Mapping[str, Array], stacked: Rows) -> Array:
        return jax.vmap(lambda rows: model.residual(values, rows))(stacked)

    return residual


@functools.cache
def predictor_of(kind: str | Model) -> Callable[[Mapping[str, Array], Rows], dict[str, Array]]:
    """Compiled prediction of a stack of recordings of a kind, or of a model: `predict(values, stacked)`."""
    model = model_of(kind) if isinstance(kind, str) else kind
    return jax.jit(jax.vmap(model.predict, in_axes=(None, 0)))


def observations(recordings: Sequence[Rows]) -> int:
    """Measured values that count."""
    return sum(rows.observations for rows in recordings)
