"""Starting points of a fit: given, or scattered over the range of bounds and priors."""

from collections.abc import Mapping, Sequence
from statistics import NormalDist

import numpy as np

from pneusma_jax.errors import InputError

from ..parameters import Parameters


def starting_vectors(
    parameters: Parameters, starts: int | Sequence[Mapping[str, float]] | None, seed: int
) -> np.ndarray:
    """Starting points in fitting coordinates, shape (k, n).

    Args:
        parameters: parameters whose own values are the first start.
        starts: None for that one alone; total number of starts; or further starts, each with values of some
            free parameters.
        seed: seed of the scattered ones.

    Raises:
        InputError: if a start names no free parameter or lies outside its bounds, or cannot be scattered.
    """
    own = np.asarray(parameters.pack())[None]
    if starts is None:
        return own
    if isinstance(starts, int):
        if starts < 1:
            raise InputError(f"starts must be at least 1, not {starts}")
        return np.concatenate([own, _scattered(parameters, starts - 1, seed)])
    rows = []
    for start in starts:
        trial = parameters.copy()
        for name, value in start.items():
            if not trial[name].free:
                raise InputError(f"parameter {name!r} is fixed or tied, so a start cannot set it")
            trial[name].set(value=value)
        rows.append(np.asarray(trial.pack()))
    return np.concatenate([own, *(row[None] for row in rows)])


def _scattered(parameters: Parameters, count: int, seed: int) -> np.ndarray:
    """Latin hypercube over priors (Gaussian, truncated at the bounds) or, without one, between the bounds."""
    random = np.random.default_rng(seed)
    lower, upper = (np.asarray(side) for side in parameters.box())
    columns = []
    for i, name in enumerate(parameters.layout().free):
        parameter = parameters[name]
        quantile = (random.permutation(count) + random.uniform(size=count)) / max(count, 1)
        if parameter.prior is not None:
            normal = NormalDist(parameter.prior.mean, parameter.prior.sd)
            low, high = normal.cdf(parameter.min), normal.cdf(parameter.max)
            value = np.array(
                [normal.inv_cdf(np.clip(low + q * (high - low), 1e-12, 1 - 1e-12)) for q in quantile]
            )
            value = np.clip(value, parameter.min, parameter.max)
            if parameter.scale == "log":
                value = np.log(np.where(value > 0, value, parameter.value))
            columns.append(value)
        elif np.isfinite(lower[i]) and np.isfinite(upper[i]):
            columns.append(lower[i] + quantile * (upper[i] - lower[i]))
        else:
            raise InputError(
                f"parameter {name!r} needs both bounds or a prior, from which starts can be drawn"
            )
    return np.stack(columns, axis=1)
