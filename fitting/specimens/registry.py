"""Registry of the kinds of specimen: the one table keyed by kind."""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign, schema
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.errors import InputError, nearest

from .rows import Rows
from .specimen import Model, Specimen

SPECIMENS: dict[str, Specimen] = {}
"""Specimens by kind, in the order of `schema.KINDS`."""


def register(specimen: Specimen) -> Specimen:
    """Register a kind of specimen. Its recordings can then be read, simulated, fitted and diagnosed.

    Args:
        specimen: the one instance of its class.

    Raises:
        ValueError: if its name or its letter is taken.
    """
    if schema.KINDS.get(specimen.kind) is not specimen.recording:
        schema.register(specimen.recording)
    for other in SPECIMENS.values():
        if other.kind == specimen.kind or other.letter == specimen.letter:
            raise ValueError(f"The kind {other.kind!r} has this name or the letter {other.letter!r} already.")
    known = SPECIMENS | {specimen.kind: specimen}
    SPECIMENS.clear()
    SPECIMENS.update((kind, known[kind]) for kind in schema.KINDS if kind in known)
    return specimen


def specimen_of(kind: str) -> Specimen:
    """Specimen of a kind of recording.

    Raises:
        InputError: if there is none.
    """
    if kind not in SPECIMENS:
        raise InputError(f"recordings of kind {kind} are not modelled, {nearest(kind, SPECIMENS)}")
    return SPECIMENS[kind]


def by_letter(letter: str) -> Specimen:
    """Specimen of a letter of `Effect.kinds`.

    Raises:
        KeyError: if there is none.
    """
    return {specimen.letter: specimen for specimen in SPECIMENS.values()}[letter]


def named_by(letters: str) -> list[str]:
    """Registered kinds of an effect's letters, in the order of the letters."""
    kind_of_letter = {specimen.letter: specimen.kind for specimen in SPECIMENS.values()}
    return [kind_of_letter[letter] for letter in letters if letter in kind_of_letter]


def candidates(kind: str) -> list[str]:
    """Slugs of the effects that recordings of a kind can show."""
    letter = specimen_of(kind).letter
    return [slug for slug, effect in CATALOGUE.items() if letter in effect.kinds]


def without_clock(campaign: Campaign, slugs: Sequence[str]) -> list[str]:
    """Those of some effects that only a clock tells apart, where every recording's clock only counts its
    rows; none otherwise."""
    if not all(recording.counts_rows for recording in campaign.recordings):
        return []
    return [slug for slug in slugs if CATALOGUE[slug].by_rate]


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


def residual_of(kind: str | Model) -> Callable[[Mapping[str, Array], Rows], Float[Array, "recordings m"]]:
    """Residual function of a stack of recordings, `residual(values, stacked)`; one object for each model.

    Because it is one object, it is compiled once for each set of free parameters and each shape.

    Args:
        kind: kind of the recordings, or a model of them.
    """
    return _residual_of(specimen_of(kind) if isinstance(kind, str) else kind)


@functools.cache
def _residual_of(model: Model) -> Callable[[Mapping[str, Array], Rows], Array]:
    def residual(values: Mapping[str, Array], stacked: Rows) -> Array:
        return of_each(model, lambda rows: model.residual(values, rows), stacked)

    return residual


def of_each(model: Model, function: Callable[[Rows], Any], stacked: Rows) -> Any:
    """Results of a function for every recording of a stack, side by side or one after another."""
    return jax.lax.map(function, stacked) if model.in_turn else jax.vmap(function)(stacked)


def predictor_of(kind: str | Model) -> Callable[[Mapping[str, Array], Rows], dict[str, Array]]:
    """Compiled prediction of a stack of recordings of a kind or of a model: `predict(values, stacked)`."""
    return _predictor_of(specimen_of(kind) if isinstance(kind, str) else kind)


@functools.cache
def _predictor_of(model: Model) -> Callable[[Mapping[str, Array], Rows], dict[str, Array]]:
    def predict(values: Mapping[str, Array], stacked: Rows) -> dict[str, Array]:
        return of_each(model, lambda rows: model.predict(values, rows), stacked)

    return jax.jit(predict)


@functools.cache
def misfit_of(model: Model) -> Callable[[Mapping[str, Array], Rows], Float[Array, "recordings m"]]:
    """Compiled misfit of predicted outputs of a stack, `misfit(found, stacked)`; see `Model.misfit`."""
    return jax.jit(jax.vmap(model.misfit))


@functools.cache
def drivers_of(model: Model) -> Callable[[Mapping[str, Array], Rows], dict[str, Array]]:
    """Compiled drivers of a stack of recordings under a model: `drivers(values, stacked)`; see
    `Specimen.answer`."""

    def drivers(values: Mapping[str, Array], stacked: Rows) -> dict[str, Array]:
        return of_each(model, lambda rows: model.answer(values, rows)[1], stacked)

    return jax.jit(drivers)


def derivative_of(
    kind: str | Model,
) -> Callable[[Mapping[str, Array], Mapping[str, Array], Rows], dict[str, Array]]:
    """Compiled derivative of the prediction of a stack along a direction of the values:
    `derivative(values, direction, stacked)`."""
    return _derivative_of(specimen_of(kind) if isinstance(kind, str) else kind)


@functools.cache
def _derivative_of(model: Model) -> Callable[..., dict[str, Array]]:
    def along(values: Mapping[str, Array], direction: Mapping[str, Array], stacked: Rows) -> dict[str, Array]:
        predicted = lambda at: of_each(model, lambda rows: model.predict(at, rows), stacked)  # noqa: E731
        return jax.jvp(predicted, (values,), (direction,))[1]

    return jax.jit(along)
