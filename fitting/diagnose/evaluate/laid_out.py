"""A campaign before any evaluation: rows, outputs that are compared, and numbers that may be free."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.data.recordings import Campaign, Recording, require_fitted
from fitting.inference.channels import Channel
from fitting.inference.parameters import Parameters
from fitting.specimens.reduction import thinned
from fitting.specimens.registry import without_clock
from fitting.specimens.rows import Rows, stack, with_numbers
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.specimen import Specimen
from pneusma_jax.calibration.records import Calibration

from .compared import compared_channels
from .unknowns import Unknowns


@dataclass(frozen=True)
class LaidOut:
    """A campaign before any evaluation; see `Program` for the attributes."""

    recordings: list[Recording]
    stacked: Rows
    channels: list[list[Channel]]
    unknowns: Unknowns
    fitted: np.ndarray
    untimed: tuple[str, ...]

    @classmethod
    def of(
        cls,
        campaign: Campaign,
        specimen: Specimen,
        slugs: Collection[str],
        model: AugmentedModel,
        tables: Mapping[str, str | Path | Calibration],
        held: Collection[str],
    ) -> "LaidOut":
        """Lay a campaign out.

        Args:
            campaign: recordings of one kind.
            specimen: specimen of that kind.
            slugs: effects to try. Left out are those of the model, and those that no clock tells.
            model, tables, held: see `Program.of`.

        Raises:
            InputError: if the recordings cannot be used together, or none is to be fitted.
        """
        campaign = thinned(campaign, specimen.most_rows_with_effects)
        rows = specimen.latent.rows_for(campaign, **tables)
        there = tuple(added.slug for added in model.added)
        tried = [slug for slug in slugs if slug not in there]
        untimed = without_clock(campaign, tried)
        tried = [slug for slug in tried if slug not in untimed]
        known = {name: q for table in model.base.values() for name, q in table.items()}
        rows = [with_numbers(r, known) for r in rows]
        stacked = stack(rows, coarse=True)
        constants = specimen.parameters_for(campaign, **tables).items()
        free = Parameters(*(entry for name, entry in constants if name not in held))
        unknowns = Unknowns(free, tried, specimen.letter, known)
        channels = compared_channels(campaign.recordings, rows, specimen, stacked.mask.shape[1])
        fitted = np.array([recording.role == "fit" for recording in campaign.recordings])
        require_fitted(campaign.recordings, campaign.path)
        return cls(list(campaign.recordings), stacked, channels, unknowns, fitted, tuple(untimed))
