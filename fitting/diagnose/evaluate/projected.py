"""The evaluation of a run, with latent trajectories projected out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.inference.channels import Channel

from ..settings import DEFAULT
from .evaluation import TRAJECTORY, Evaluation, Raw, trajectories_of
from .trajectory_search import Search
from .variable_projection import Projection

TRAJECTORIES = DEFAULT.trajectories


@dataclass(frozen=True)
class Asked:
    """What an evaluation is asked for.

    Attributes:
        u: scaled numbers, (unknowns,).
        columns: unknowns that derivatives are asked by, any number.
        chosen: mask of the recordings that are asked for, (recordings,).
    """

    u: np.ndarray
    columns: np.ndarray
    chosen: np.ndarray


def projected(
    run: Raw,
    asked: Asked,
    channels: Sequence[Sequence[Channel]],
    failed: float,
    projections: list[Projection | None],
    search: Search | None,
) -> Evaluation:
    """The evaluation of a run.

    A recording whose trajectories would still move far keeps the misfit of where they are.

    Args:
        run: the run, with derivatives by all columns.
        asked: what was asked for.
        channels: channels that count, by recording.
        failed: standard deviations that a row without an answer counts for.
        projections: linear problem of every recording's trajectories, None for one without.
        search: search for the trajectories, which ended at this run; None if there was none.
    """
    found, moved, drivers = [], trajectories_of(run.stacked), dict(run.drivers)
    slopes = np.zeros((len(asked.columns), *moved.shape))
    for k, (own, projection) in enumerate(zip(channels, projections, strict=True)):
        if not asked.chosen[k]:
            found.append(_not_asked(own, len(asked.columns)))
            continue
        misfit, jacobian, predicted = run.whitened(k, own, failed)
        if projection is not None:
            answer = projection.answer(misfit, jacobian)
            jacobian = answer.jacobian
            believed = np.max(np.abs(answer.steps)) < TRAJECTORIES.maximum_believed_step
            believed &= not search.overshot[k]
            misfit = answer.misfit if believed else misfit
            for j, trajectory in enumerate(projection.trajectories):
                slopes[:, k, trajectory.number] = answer.slopes[:, j]
                if believed:
                    moved[k, trajectory.number] += answer.steps[j]
                    change = trajectory.change(answer.steps[j])
                    predicted = [x + dx for x, dx in zip(predicted, change, strict=True)]
        found.append((misfit, jacobian, predicted))
    for j, number in enumerate(run.stacked.extra["layout"].spring_numbers if search else ()):
        drivers[f"{TRAJECTORY}_{number}"] = moved[:, j]
    parts = (list(x) for x in zip(*found, strict=True))
    return Evaluation(*parts, drivers, asked.u, asked.columns, moved, slopes, projections, asked.chosen)


def _not_asked(channels: Sequence[Channel], columns: int) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Misfit, its derivatives and predictions of a recording that was not asked for: zeros, and NaN."""
    nothing = np.zeros(sum(len(channel.measured) for channel in channels))
    unknown = [np.full(len(channel.measured), np.nan) for channel in channels]
    return nothing, np.zeros((columns, len(nothing))), unknown
