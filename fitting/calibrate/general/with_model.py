"""`--model`: a campaign fitted with a model on disk, its numbers and its effects."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fitting.calibrate.result import Characterisation
from fitting.calibrate.spring import characterise_spring
from fitting.data.recordings import Campaign
from fitting.specimens import SPRING, kind_of, priors, specimen_of
from fitting.specimens.saved_model_notes import check_kind
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.with_saved_model import Augmented
from pneusma_jax.units import from_si

from .pipeline import characterise_general


def characterise_with(
    campaign: Campaign,
    *,
    model: AugmentedModel,
    base: str | Path | None = None,
    material: str | Path | None = None,
    adjust: Mapping[str, Mapping[str, Any]] | None = None,
    starts: int | None = None,
    profile: int | Sequence[str] | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> Characterisation:
    """Fit a model on disk to a campaign: base numbers as far as tolerances leave them open, and its effects.

    Springs go through their own stages, at the model's numbers, if nothing else of the model acts on a stand.
    Everything else goes through the general pipeline.

    Args:
        campaign: recordings of one kind.
        model: model as `load_model` reads it.
        base, material: alloy and silicone to start from, instead of the model's.
        adjust: changes to free parameters by name, those of effects too: `wrap_friction_constant`.
        starts: fits in all; fewer for springs and actuators by default.
        profile: parameters to profile, or how many of the loosest; by default as many as without a model.
        seed: seed of the scattered starts.
        progress: called with a word for each step that begins.

    Raises:
        InputError: if the recordings cannot be used, or nothing in the model acts in their kind.
    """
    kind = kind_of(campaign)
    check_kind(model, kind)
    augmented, specimen = Augmented(kind, model, campaign.title), specimen_of(kind)
    given = {"base": base, "material": material}
    if specimen is SPRING and not augmented.more_than_base:
        return _staged(augmented, campaign, base, adjust, starts, profile, seed, progress)
    return characterise_general(
        augmented.described(campaign),
        specimen,
        model=augmented,
        adjust=adjust,
        starts=starts or specimen.starts_with_model,
        profile=specimen.profiled if profile is None else profile,
        seed=seed,
        progress=progress,
        **augmented.options(campaign, given),
    )


def _staged(
    augmented: Augmented,
    campaign: Campaign,
    base: str | Path | None,
    adjust: Mapping[str, Mapping[str, Any]] | None,
    starts: int | None,
    profile: int | Sequence[str] | None,
    seed: int,
    progress: Callable[[str], None],
) -> Characterisation:
    """Springs by their own pipeline, from the model's numbers."""

    model = augmented.model
    named = base or model.tables.get("alloy") or campaign.recordings[0].table("alloy")
    moved = dataclasses.replace(
        campaign,
        recordings=[
            dataclasses.replace(r, geometry={**r.geometry, **model.geometry(r.specimen)})
            for r in campaign.recordings
        ],
    )
    changes = {name: dict(change) for name, change in (adjust or {}).items()}
    own = model.quantities("alloy")
    if str(named) == priors.FIT:  # nothing to put the numbers into: they are where the fit begins
        for name, entry in _free(moved).items():
            if name in own:
                changes.setdefault(name, {}).setdefault("value", float(from_si(own[name].value, entry.unit)))
        table = None
    else:
        table = model.table("alloy", named)
    more = {name: x for name, x in (("starts", starts), ("profile", profile)) if x is not None}
    return characterise_spring(
        moved, base=table, adjust=changes or None, seed=seed, progress=progress, **more
    )


def _free(campaign: Campaign) -> Mapping[str, Any]:

    return SPRING.parameters_for(campaign)
