"""Zeros of the instruments of a stand that are off or drift, and what they add to the errors of a fit."""

from collections.abc import Mapping

import numpy as np

from fitting.calibrate.information import Information
from fitting.inference.lasting_noise import Lasting, Shared, courses_of, lasting_beside_trajectories
from fitting.inference.parameters import Parameters
from fitting.specimens.correlated_noise import uncorrelated
from fitting.specimens.spring_rows import OUTPUTS
from fitting.specimens.spring_trajectory import decided

from .problem import Problem
from .residuals import jacobian, residuals_and_freedom, values_of, with_readings


def zeros(problem: Problem, parameters: Parameters, fisher: Information) -> Lasting:
    """Contribution of zeros of force and resistance, which are off or drift, to the errors.

    Args:
        problem: the fitted problem.
        parameters: free parameters at the values found.
        fisher: Fisher information of the fitted tests.
    """
    entries = [parameters[name] for name in problem.parameters]
    pull = np.array([0.0 if e.prior is None else e.value - e.prior.mean for e in entries])
    recordings = residuals(problem, parameters.valuesdict(), fisher.fixed)
    return lasting_beside_trajectories(recordings, fisher.prior, pull, problem.inflation, problem.zeros)


def residuals(problem: Problem, values: Mapping[str, float], fixed: np.ndarray) -> list[Shared]:
    """Residuals of every fitted test, in units of the noise as it was stated, and what moves them.

    Trajectories are adapted as beside white noise, also where the fit had correlated noise.

    Args:
        problem: the fitted problem.
        values: values of the free parameters.
        fixed: true for parameters at a bound, which move nothing.
    """
    point = values_of(problem.parameters, values)
    rows = uncorrelated(decided(point, problem.data()["rows"]))
    (misfit, taken), found = residuals_and_freedom(point, rows), jacobian(point, rows)
    slopes = np.stack([np.asarray(found[name]) for name in problem.parameters], axis=-1)
    slopes = np.where(np.isfinite(slopes), slopes, 0.0) * ~fixed
    read = {name: np.asarray(rows.weight[name]) > 0.0 for name in OUTPUTS}
    times = [{n: np.asarray(rows.time)[k, read[n][k]] for n in OUTPUTS} for k in range(len(rows.mask))]
    courses = {
        name: np.stack([_in_rows(read[name][k], time[name]) for k, time in enumerate(times)])
        for name in OUTPUTS
    }
    noise = {name: 1.0 / np.where(read[name], np.asarray(rows.weight[name]), np.inf) for name in OUTPUTS}
    changes = {name: np.moveaxis(courses[name] * noise[name][:, :, None], -1, 0) for name in OUTPUTS}
    still, moved = {name: np.zeros_like(change) for name, change in changes.items()}, {}
    for name in OUTPUTS:
        change = np.moveaxis(with_readings(point, rows, still | {name: changes[name]}), 0, -1)
        moved[name] = np.where(np.isfinite(change), change, 0.0)  # like slopes, where there is no answer
    count = sum(np.sum(mask, axis=1) for mask in read.values()) - taken
    stated = problem.inflation
    return [
        Shared(
            stated * misfit[k],
            stated * slopes[k],
            {name: moved[name][k] for name in OUTPUTS},
            times[k],
            float(count[k]),
        )
        for k in problem.fitted
    ]


def _in_rows(read: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Courses of a zero in all rows of a recording, zero where nothing was read, shape (rows, courses)."""
    courses = courses_of(time)
    found = np.zeros((len(read), courses.shape[1]))
    found[read] = courses
    return found
