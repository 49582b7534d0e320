"""Starting points of walkers: around the fit, with another centre for each ensemble."""

import numpy as np
from jaxtyping import Float

from pneusma_jax.errors import InputError

from .chart import Chart
from .laplace import Laplace
from .target import LogDensity, Target

TRIES = 40
"""Maximum number of draws of starting points before a target is given up."""
CLOSER = 0.7
"""Factor on the distance from the fit of points that are drawn again [1]; after `TRIES` draws it is 6e-7."""
INSIDE = 1e-3
"""Least distance of starting points from two finite bounds, as part of the distance between these [1]."""


def no_start(who: str) -> InputError:
    """The error for walkers or chains that find no starting point, such as "a chain finds"."""
    return InputError(
        f"{who} no starting point near the fit at which the model has an answer; tighten bounds or priors, or"
        " start elsewhere"
    )


def dispersed_ball(
    target: Target,
    found: Laplace,
    spread: Float[np.ndarray, "n n"],
    chart: Chart,
    evaluator: LogDensity,
    walkers: int,
    random: np.random.RandomState,
) -> Float[np.ndarray, "walkers n"]:
    """Starting points of one ensemble around the mode, in the coordinates of the chart.

    The ensemble's centre lies about one standard error from the mode, its walkers another one around the
    centre. Ensembles thus start as far apart as the posterior is wide, which makes their agreement
    meaningful. Points outside the bounds are mirrored inside, and kept a little away from them. Points
    without an answer of the model are drawn again, closer to the mode: offset and ensemble's centre shrink.

    Args:
        target: target to sample.
        found: Laplace approximation of the target.
        spread: root of the covariance of the target's coordinates, see `start_spread`.
        chart: chart in which walkers move.
        evaluator: evaluator of the log-probability.
        walkers: number of points.
        random: random number generator of this ensemble.

    Raises:
        InputError: if no starting points with a finite log-probability are found.
    """
    root, mode = chart.scaled_root(found, spread), chart.to_chart(found.mode)
    centre = root @ random.standard_normal(target.dimension)
    points = np.empty((walkers, target.dimension))
    wanted, closeness = np.arange(walkers), 1.0
    for _ in range(TRIES):
        offset = centre + random.standard_normal((len(wanted), target.dimension)) @ root.T
        inside = _mirrored(target, chart.to_target(mode + closeness * offset))
        points[wanted] = chart.to_chart(inside)
        wanted = wanted[~np.isfinite(evaluator(inside))]
        if not len(wanted):
            return points
        closeness *= CLOSER
    raise no_start(f"{len(wanted)} of {walkers} walkers find")


def _mirrored(target: Target, points: np.ndarray) -> np.ndarray:
    """Points reflected at the bounds that they cross, and put inside where they would cross the other one.

    Once is enough of draws about the mode. `unbounded` folds without end, since chains may go anywhere.
    """
    lower, upper = np.asarray(target.lower), np.asarray(target.upper)
    with np.errstate(invalid="ignore"):
        points = np.where(points < lower, 2.0 * lower - points, points)
        points = np.where(points > upper, 2.0 * upper - points, points)
    edge = INSIDE * np.where(np.isfinite(upper - lower), upper - lower, 0.0)
    return np.clip(points, lower + edge, upper - edge)
