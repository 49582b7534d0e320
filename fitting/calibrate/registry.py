"""Which pipeline serves which kind of recording. A new kind adds a line here and a module of its own."""

import functools
import importlib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from fitting.data.recordings import Campaign, read_campaign
from fitting.inference.readings import share_full_scale
from fitting.specimens.saved_models import AugmentedModel, load_model
from fitting.specimens.spring_by_temperature import without_resistance
from pneusma_jax.errors import InputError

from .general.with_model import characterise_with
from .result import Characterisation

# kind -> (module, function)
PIPELINES = {
    "elastomer": ("fitting.calibrate.elastomer", "characterise_elastomer"),
    "spring": ("fitting.calibrate.spring", "characterise_spring"),
    "wire": ("fitting.calibrate.general", "characterise_wire"),
    "tube": ("fitting.calibrate.general", "characterise_tube"),
    "actuator": ("fitting.calibrate.general", "characterise_actuator"),
}
BY_TEMPERATURE = ("fitting.calibrate.general", "characterise_spring_by_temperature")
"""Of springs whose resistance was not measured."""


class Pipeline(Protocol):
    """Fits the recordings of one kind; options of its own are keyword arguments with defaults."""

    def __call__(
        self, campaign: Campaign, *, seed: int, progress: Callable[[str], None], **options: Any
    ) -> Characterisation:
        """Characterise a campaign.

        Args:
            campaign: recordings of its kind.
            seed: of everything random.
            progress: called with a few words after each step.
            **options: what this kind can be asked for besides.

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
        **options: of the pipeline of its kind; for elastomers those of `characterise_elastomer`
            (`law`, `terms`, `max_strain`, `weighting`, `adjust`, `seed`, `progress`). None is as good as
            leaving one out.

    Returns:
        The result, with `report()`, `plot()` and `save(folder)`.

    Raises:
        InputError: if the recordings cannot be read, are of several kinds or of one without a pipeline, or
            that kind does not know an option.
    """
    if not isinstance(campaign, Campaign):
        campaign = read_campaign(campaign)
    share_full_scale(campaign.recordings)
    pipeline = pipeline_of(campaign) if model is None else _pipeline_with(campaign, model)
    given = {name: value for name, value in options.items() if value is not None}
    known = inspect.signature(pipeline).parameters
    for name in given:
        if name not in known:
            raise InputError(
                f"{campaign.path}: option {name.replace('_', '-')} means nothing for recordings of kind "
                f"{campaign.kinds[0]}{'' if model is None else ' with a model of its own'}"
            )
    return pipeline(campaign, **given)


def _pipeline_with(campaign: Campaign, model: str | Path | AugmentedModel) -> Callable[..., Characterisation]:
    """The pipeline that fits a model on disk."""

    pipeline_of(campaign)
    loaded = model if isinstance(model, AugmentedModel) else load_model(model)

    @functools.wraps(characterise_with)
    def pipeline(campaign: Campaign, **given: Any) -> Characterisation:
        return characterise_with(campaign, model=loaded, **given)

    return pipeline


def pipeline_of(campaign: Campaign) -> Pipeline:
    """Pipeline of a campaign's kind.

    Raises:
        InputError: if it holds several kinds, or one that has no pipeline.
    """
    kinds = campaign.kinds
    if len(kinds) > 1:
        raise InputError(
            f"{campaign.path}: recordings of kinds {', '.join(kinds)} lie here together; "
            "characterise one kind at a time, each in its own folder"
        )
    if kinds[0] not in PIPELINES:
        raise InputError(
            f"{campaign.path}: recordings of kind {kinds[0]} cannot be characterised; "
            f"{', '.join(PIPELINES)} can"
        )
    module, function = PIPELINES[kinds[0]]
    if kinds[0] == "spring" and without_resistance(campaign):
        module, function = BY_TEMPERATURE
    return getattr(importlib.import_module(module), function)
