"""Draws as netCDF-4 that ArviZ opens (`arviz.from_netcdf`): an HDF5 file with dimension scales, written by
h5py.

Groups and names are those of ArviZ's InferenceData schema. A chain is one walker, as in ArviZ's import from
emcee; `sample_stats/ensemble` names its ensemble. Values are in the units of files, given by `unit`.
"""

import io
from collections.abc import Mapping

import h5py
import numpy as np

from fitting.data.hdf5 import CAUTION
from fitting.data.sealed import sealed
from fitting.sample.campaign import CampaignPosterior

from .beside_fit import opening
from .text import library_of

PRIOR_DRAWS = 2000
ROUNDS = 200  # Maximum number of redraws of priors outside their bounds


def netcdf(result: CampaignPosterior) -> bytes:
    """The whole file as bytes."""
    posterior, problem = result.posterior, result.problem
    draws = {name: problem.shown(name, _by_walker(v)) for name, v in posterior.draws.items()}
    ensembles, _, walkers, _ = posterior.chains.shape
    ensemble = np.repeat(np.arange(ensembles), walkers)
    scores = {
        "lp": _by_walker(posterior.thinned_log_probabilities),
        "log_likelihood": _by_walker(posterior.log_likelihoods()),
    }
    units = {name: problem.unit(name) for name in draws}
    stream = io.BytesIO()
    with h5py.File(stream, "w", track_order=True) as file:
        file.attrs["title"] = f"Posterior of {problem.title}"
        file.attrs["inference_library"] = library_of(posterior.settings)
        file.attrs["converged"] = int(posterior.converged)
        if caution := " ".join(opening(problem.fit)):
            file.attrs[CAUTION] = caution
        file.attrs["burn_in"], file.attrs["thin"] = posterior.convergence.burn_in, posterior.convergence.thin
        sizes = {"chain": ensembles * walkers, "draw": next(iter(draws.values())).shape[1]}
        _group(file, "posterior", sizes, {n: (("chain", "draw"), v) for n, v in draws.items()}, units)
        stats = {name: (("chain", "draw"), values) for name, values in scores.items()}
        _group(file, "sample_stats", sizes, {**stats, "ensemble": (("chain",), ensemble)}, {})
        _observed(file, result)
        prior = {n: problem.shown(n, v)[None] for n, v in prior_draws(result).items()}
        if prior:
            sizes = {"chain": 1, "draw": PRIOR_DRAWS}
            _group(file, "prior", sizes, {n: (("chain", "draw"), v) for n, v in prior.items()}, units)
    return sealed(stream.getvalue())


def prior_draws(result: CampaignPosterior) -> dict[str, np.ndarray]:
    """Independent draws from the priors of the sampled parameters, truncated at their bounds; SI.

    A parameter that is flat over an unbounded range has none.
    """
    random = np.random.default_rng(result.posterior.settings.seed)
    found = {}
    for name in result.posterior.names:
        parameter = result.problem.parameters[name]
        low, high = parameter.min, parameter.max
        if parameter.prior is not None:
            found[name] = _truncated(random, parameter.prior.mean, parameter.prior.sd, low, high)
        elif np.isfinite(low) and np.isfinite(high) and parameter.scale == "linear":
            found[name] = random.uniform(low, high, PRIOR_DRAWS)
        elif low > 0.0 and np.isfinite(high):
            found[name] = np.exp(random.uniform(np.log(low), np.log(high), PRIOR_DRAWS))
    return found


def _truncated(random: np.random.Generator, mean: float, sd: float, low: float, high: float) -> np.ndarray:
    values = np.full(PRIOR_DRAWS, np.nan)
    for _ in range(ROUNDS):
        wanted = np.flatnonzero(~((values >= low) & (values <= high)))
        if not len(wanted):
            return values
        values[wanted] = random.normal(mean, sd, len(wanted))
    return np.clip(values, low, high)


def _by_walker(values: np.ndarray) -> np.ndarray:
    """(ensembles, draws, walkers) as (chains, draws)."""
    return np.moveaxis(values, 2, 1).reshape(-1, values.shape[1])


def _observed(file: h5py.File, result: CampaignPosterior) -> None:
    """Measured values of every curve, each with its own dimension and its horizontal axis as coordinate."""
    sizes, variables, units = {}, {}, {}
    for k, curve in enumerate(result.problem.curves):
        if curve.role != "fit":
            continue
        name, row = f"{curve.y_column}_{k}", f"row_{k}"
        sizes[row] = len(curve.x)
        variables[name] = ((row,), curve.measured)
        variables[f"{curve.x_column}_{k}"] = ((row,), curve.x)
        units[name] = curve.y_column.rpartition("_")[2]
    _group(file, "observed_data", sizes, variables, units)


def _group(
    file: h5py.File,
    name: str,
    sizes: Mapping[str, int],
    variables: Mapping[str, tuple[tuple[str, ...], np.ndarray]],
    units: Mapping[str, str],
) -> None:
    """A netCDF-4 group: dimensions are scales of their own name, variables have them attached."""
    group = file.create_group(name, track_order=True)
    scales = sum(dataset.is_scale for other in file.values() for dataset in other.values())
    for number, (dimension, size) in enumerate(
        sizes.items(), start=scales
    ):  # unique in the file, for the C library
        scale = group.create_dataset(dimension, data=np.arange(size))
        scale.make_scale(dimension)
        scale.attrs["_Netcdf4Dimid"] = np.int32(number)
    for variable, (dimensions, values) in variables.items():
        dataset = group.create_dataset(variable, data=values)
        for axis, dimension in enumerate(dimensions):
            dataset.dims[axis].attach_scale(group[dimension])
        if units.get(variable, "1") != "1":
            dataset.attrs["unit"] = units[variable]
    group.attrs["inference_library"] = file.attrs["inference_library"]
