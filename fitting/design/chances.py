"""How often designs fail on draws that the search has not seen, and cautions about these draws."""

from collections.abc import Mapping

import numpy as np

from fitting.data.hdf5 import uncounted

from .bodies import Plan
from .posterior_file import posterior_caution
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
    study = model.study
    sampler = sampler_of(study, model.plan, fresh=True)
    draws = sampler.draw(study.uncertainty.fresh, study.seed + FRESH_SEED, spread_out=False)
    return {name: _chance(model, place, draws) for name, place in places.items()}


def _chance(model: Model, place: np.ndarray, fresh: Draws) -> Chance:
    """Failures of the design at a place in the box, under given draws."""
    values, margins = model.spread(place, fresh)  # margins are positive where a limit is violated
    lost = ~np.all(np.isfinite(margins), axis=1) | ~np.all(np.isfinite(values), axis=1)
    constraint_of = np.array([row.constraint for row in model.rows], dtype=int)
    violated = [
        np.any(margins[:, constraint_of == k] > 0.0, axis=1) for k in range(len(model.study.constraints))
    ]
    failures = int(np.any(np.stack([lost, *violated]), axis=0).sum())
    return Chance(
        draws=fresh.count,
        failures=failures,
        interval=interval(failures, fresh.count),
        by_constraint=tuple(int((own & ~lost).sum()) for own in violated),
        lost=int(lost.sum()),
        values=model.study.objectives[0].sign * values[~lost, 0],  # as it is, not as it is minimised
    )


def notes_on_draws(study: Study, plan: Plan) -> list[str]:
    """Cautions about the draws of a posterior; none without one."""
    given = study.uncertainty
    if given.posterior is None:
        return []
    notes, left_out = [], sampler_of(study, plan).left_out
    if caution := posterior_caution(given.posterior):
        notes.append(uncounted(given.posterior, caution).rstrip("."))
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
