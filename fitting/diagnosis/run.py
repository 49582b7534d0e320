"""`diagnose`: from a campaign to a conclusion and its documents."""

from collections.abc import Callable

import numpy as np

from fitting.augmented import AugmentedModel
from fitting.models.registry import kind_of
from fitting.recordings import Campaign
from pneusma_jax.errors import InputError

from .conclude import Conclusion, conclude
from .explain import explain
from .program import Program

FEWEST = 20
"""Measured values below which nothing can be said."""


def diagnose(
    campaign: Campaign,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    model: AugmentedModel | None = None,
    thorough: bool = False,
) -> Conclusion:
    """Compare a campaign with the base model, and say what physics it leaves out.

    Args:
        campaign: recordings of one kind.
        seed: of simulated nulls.
        progress: told what happens, in words.
        model: base model to start from, instead of the published one.
        thorough: fit twice as many candidates, and follow twice as many to the end.

    Raises:
        InputError: if the recordings cannot be used: of several kinds, without variation, or too few values.
    """
    kind = kind_of(campaign)
    _check(campaign)
    progress("building the model of the campaign")
    program = Program.of(campaign, kind, model=model)
    count = program.observations(program.fitted)
    if count < FEWEST:
        raise InputError(
            f"{campaign.path}: {count} values to fit are too few to diagnose; {FEWEST} are needed"
        )
    explanation = explain(program, np.random.default_rng(seed), progress, 2 if thorough else 1)
    progress("scoring recordings that were not fitted")
    return conclude(explanation)


def _check(campaign: Campaign) -> None:
    """Refuse recordings in which nothing happens."""
    for recording in campaign.recordings:
        varied = False
        for name in recording.known_columns:
            values = recording.columns[name]
            values = values[np.isfinite(values)]
            varied |= name != "time_s" and values.size > 1 and float(np.ptp(values)) > 0.0
        if not varied:
            raise InputError(
                f"{recording.path or recording.name}: nothing varies in this recording, so there is nothing "
                "to explain"
            )
