"""How often designs fail: draws of what is uncertain, and failures on draws that the search has not seen."""

from collections.abc import Mapping

import numpy as np

from .bodies import Plan
from .program import Model
from .result import Chance
from .study import Study
from .uncertain import Draws, interval, sampler_of

FRESH_SEED = 1_000_003
"""Added to the seed for the draws of the final probability, which the search has not seen."""


def chances_of(model: Model, places: Mapping[str, np.ndarray]) -> dict[str, Chance]:
    """Failures of designs on the same fresh draws.

    Args:
        model: model of the study.
        places: place in the box of each design, by its name.
    """
    given = model.study.uncertainty
    fresh = sampler_of(model.study, model.plan, fresh=True)
    draws = fresh.draw(given.fresh, model.study.seed + FRESH_SEED, spread_out=False)
    return {name: chance_of(model, place, draws) for name, place in places.items()}


def notes_on_draws(study: Study, plan: Plan) -> list[str]:
    """Cautions about the draws of a posterior."""
    given, notes = study.uncertainty, []
    if given.posterior is None:
        return notes
    left_out = sampler_of(study, plan).left_out
    if left_out:
        notes.append(
            f"of {given.posterior.name} the study has no use for {', '.join(left_out)}: none of them is a "
            "constant of alloy or silicone, or a dimension"
        )
    if given.fresh_posterior is None:
        notes.append(
            "search and fresh draws come from the same run of the sampler, so what that run has wrong is in "
            "both; `fresh_posterior` takes another run"
        )
    return notes


def chance_of(model: Model, place: np.ndarray, fresh: Draws) -> Chance:
    """Failures of a design under given draws."""
    values, margins = model.spread(place, fresh)
    owners = np.array([row.constraint for row in model.rows], dtype=int)
    lost = ~np.all(np.isfinite(margins), axis=1) | ~np.all(np.isfinite(values), axis=1)
    bad = [lost | np.any(margins[:, owners == k] > 0.0, axis=1) for k in range(len(model.study.constraints))]
    failed = np.any(np.stack(bad), axis=0) if bad else lost
    first = model.study.objectives[0]
    return Chance(
        draws=fresh.count,
        failures=int(failed.sum()),
        interval=interval(int(failed.sum()), fresh.count),
        by_constraint=tuple(int((b & ~lost).sum()) for b in bad),
        lost=int(lost.sum()),
        values=first.sign * values[~lost, 0],
    )
