"""The evaluation of a run, with latent trajectories projected out."""

from collections.abc import Sequence

import numpy as np

from fitting.inference.channels import Channel

from ..settings import DEFAULT
from .evaluation import TRAJECTORY, Evaluation, Raw, trajectories_of
from .trajectory_search import Search
from .variable_projection import Projection

TRAJECTORIES = DEFAULT.trajectories


def projected(
    here: Raw,
    u: np.ndarray,
    columns: np.ndarray,
    channels: Sequence[Sequence[Channel]],
    chosen: np.ndarray,
    failed: float,
    projections: list[Projection | None],
    search: Search | None,
) -> Evaluation:
    """The evaluation of a run.

    A recording whose trajectories would still move far keeps the misfit of where they are.

    Args:
        here: the run.
        u: scaled numbers, (unknowns,).
        columns: unknowns that the run's derivatives are by.
        channels: channels that count, by recording.
        chosen: mask of the recordings that were asked for, (recordings,).
        failed: standard deviations that a row without an answer counts for.
        projections: linear problem of every recording's trajectories, None for one without.
        search: search for the trajectories, which ended at this run; None if there was none.
    """
    found, moved, drivers = [], trajectories_of(here.stacked), dict(here.drivers)
    slopes = np.zeros((len(columns), *moved.shape))
    for k, (own, one) in enumerate(zip(channels, projections, strict=True)):
        if not chosen[k]:
            nothing = np.zeros(sum(len(channel.measured) for channel in own))
            unknown = [np.full(len(channel.measured), np.nan) for channel in own]
            found.append((nothing, np.zeros((len(columns), len(nothing))), unknown))
            continue
        misfit, jacobian, raw = here.whitened(k, own, failed)
        if one is not None:
            answer = one.answer(misfit, jacobian)
            jacobian = answer.jacobian
            believed = np.max(np.abs(answer.steps)) < TRAJECTORIES.maximum_believed_step
            believed &= not search.overshot[k]
            misfit = answer.misfit if believed else misfit
            for j, trajectory in enumerate(one.trajectories):
                slopes[:, k, trajectory.number] = answer.slopes[:, j]
                if believed:
                    moved[k, trajectory.number] += answer.steps[j]
                    raw = [x + dx for x, dx in zip(raw, trajectory.change(answer.steps[j]), strict=True)]
        found.append((misfit, jacobian, raw))
    for j, number in enumerate(here.stacked.extra["layout"].spring_numbers if search else ()):
        drivers[f"{TRAJECTORY}_{number}"] = moved[:, j]
    parts = (list(x) for x in zip(*found, strict=True))
    return Evaluation(*parts, drivers, u, columns, moved, slopes, projections, chosen)
