"""Choice of a pipeline for each kind of specimen: its own, or the general one."""

import functools
import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from fitting.data.recordings import Campaign, read_campaign
from fitting.inference.notes import joined
from fitting.inference.readings import share_full_scale
from fitting.specimens import SPECIMENS, Specimen, specimen_of
from fitting.specimens.elastomer import Coupon
from fitting.specimens.priors import FIT
from fitting.specimens.saved_models import AugmentedModel, load_model
from fitting.specimens.spring import SpringOnStand
from pneusma_jax.errors import InputError

from .elastomer import characterise_elastomer
from .general import characterise_specimen
from .general.with_model import characterise_with
from .result import Characterisation, Estimate
from .spring import characterise_spring, values_found

_TABLES = {"base": "alloy", "material": "material"}
"""Key of `[geometry]` by the option that names a table to start from."""
_WRITTEN = {"base": "alloy (base)", "adjust": "fix (adjust)"}
"""Options whose name on the command line is another one than in Python, by that in Python."""


class Pipeline(Protocol):
    """Fits the recordings of one kind; options of its own are keyword arguments with defaults."""

    def __call__(
        self, campaign: Campaign, *, seed: int, progress: Callable[[str], None], **options: Any
    ) -> Characterisation:
        """Characterise a campaign.

        Args:
            campaign: recordings of its kind.
            seed: seed of all random numbers.
            progress: called with a few words at each step.
            **options: further options of this kind.

        Raises:
            InputError: if the recordings or options cannot be used.
        """


def characterise(
    campaign: str | Path | Campaign, *, model: str | Path | AugmentedModel | None = None, **options: Any
) -> Characterisation:
    """Fit the material of a campaign of recordings; float64 must be on.

    Args:
        campaign: a folder of recordings, one CSV, or what `read_campaign` returned.
        model: a model on disk (`augmented.toml`), or one in memory, whose numbers and effects are fitted.
        **options: options of the pipeline of its kind. For elastomers they are those of
            `characterise_elastomer`: `law`, `terms`, `max_strain`, `weighting`, `adjust`, `seed`, `progress`.
            None is as good as leaving one out. `base` or `material` of "fit" identifies the alloy or the
            silicone, whatever the recordings name.

    Returns:
        The result, with `report()`, `plot()` and `save(folder)`.

    Raises:
        InputError: if the recordings cannot be read, are of several kinds or of one without a pipeline, or
            that kind does not know an option.
    """
    if not isinstance(campaign, Campaign):
        campaign = read_campaign(campaign)
    share_full_scale(campaign.recordings)  # kept in the recordings' memo
    pipeline, known = pipeline_of(campaign) if model is None else _pipeline_with(campaign, model)
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in known:
            raise InputError(
                f"{campaign.path}: option {_WRITTEN.get(name, name.replace('_', '-'))} means nothing for "
                f"recordings of kind {campaign.kinds[0]}"
                f"{'' if model is None else ' with a model of its own'}{_takers(name)}"
            )
    for option, key in _TABLES.items():
        if given.get(option) == FIT:
            campaign = _identifying(campaign, key)
            del given[option]
    return pipeline(campaign, **given)


def _takers(option: str) -> str:
    """Kinds that take an option that names a table, as the end of a sentence; empty for other options."""
    takers = [kind for kind, specimen in SPECIMENS.items() if option in specimen.options]
    return f"; it is for {joined(takers)}" if takers else ""


def _identifying(campaign: Campaign, key: str) -> Campaign:
    """A campaign whose alloy or material is to be identified, whatever its recordings name."""
    recordings = [replace(r, geometry={**r.geometry, key: FIT}) for r in campaign.recordings]
    return replace(campaign, recordings=recordings)


@functools.singledispatch
def own_pipeline(specimen: Specimen) -> Pipeline | None:
    """The pipeline that a kind of specimen has of its own; None for the general one."""
    return None


@own_pipeline.register
def _(specimen: Coupon) -> Pipeline:
    return characterise_elastomer


@own_pipeline.register
def _(specimen: SpringOnStand) -> Pipeline:
    return characterise_spring


@functools.singledispatch
def own_search(specimen: Specimen) -> Callable[..., Iterator[Mapping[str, Estimate]]] | None:
    """Function that only looks for the constants of a kind with a pipeline of its own; None of other kinds.

    It takes a campaign and `progress`. It gives the constants by name, those that are found soonest first.
    """
    return None


@own_search.register
def _(specimen: SpringOnStand) -> Callable[..., Iterator[Mapping[str, Estimate]]]:
    return values_found


def _pipeline_with(
    campaign: Campaign, model: str | Path | AugmentedModel
) -> tuple[Callable[..., Characterisation], set[str]]:
    """The pipeline that fits a model on disk, and its options."""
    specimen_in(campaign)
    loaded = model if isinstance(model, AugmentedModel) else load_model(model)
    known = set(inspect.signature(characterise_with).parameters) - {"campaign", "model"}
    return functools.partial(characterise_with, model=loaded), known


def pipeline_of(campaign: Campaign) -> tuple[Pipeline, set[str]]:
    """Pipeline of a campaign's kind, and the names of its options.

    Raises:
        InputError: if it holds several kinds, or one that is not modelled.
    """
    specimen = specimen_in(campaign)
    own = own_pipeline(specimen)
    if own is not None:
        return own, set(inspect.signature(own).parameters) - {"campaign"}
    known = set(inspect.signature(characterise_specimen).parameters) - {"campaign", "specimen", "tables"}
    return functools.partial(characterise_specimen, specimen=specimen), known | set(specimen.options)


def specimen_in(campaign: Campaign) -> Specimen:
    """The specimen that models a campaign's recordings.

    Raises:
        InputError: if it holds several kinds, or one that is not modelled.
    """
    kinds = campaign.kinds
    if len(kinds) > 1:
        raise InputError(
            f"{campaign.path}: recordings of kinds {', '.join(kinds)} lie here together; "
            "characterise one kind at a time, each in its own folder"
        )
    try:
        return specimen_of(kinds[0]).variant(campaign)
    except InputError as problem:
        raise InputError(f"{campaign.path}: {problem}") from None
