"""Zeros of the instruments of a stand that are off or drift, and what they add to the errors of a fit."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.calibrate.information import Information
from fitting.inference.lasting_noise import Lasting, Shared, courses_of, lasting_beside_trajectories
from fitting.inference.parameters import Parameters
from fitting.specimens import Rows, residual_of
from fitting.specimens.correlated_noise import uncorrelated
from fitting.specimens.spring_rows import OUTPUTS
from fitting.specimens.spring_trajectory import decided

from .problem import Problem, freedom_taken_by, jacobian, values_of


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
    point, data = values_of(problem.parameters, values), problem.data()
    data["rows"] = rows = uncorrelated(decided(point, data["rows"]))
    misfit, found = np.asarray(residual_of("spring")(point, rows)), jacobian(point, data)
    slopes = np.stack([np.asarray(found[name]) for name in problem.parameters], axis=-1)
    slopes = np.where(np.isfinite(slopes), slopes, 0.0) * ~fixed
    read = {name: np.asarray(rows.weight[name]) > 0.0 for name in OUTPUTS}
    times = [{n: np.asarray(rows.time)[k, read[n][k]] for n in OUTPUTS} for k in range(len(problem.tests))]
    courses = {
        name: np.stack([_in_rows(read[name][k], time[name]) for k, time in enumerate(times)])
        for name in OUTPUTS
    }
    moved = {}
    for name in OUTPUTS:
        alone = {other: course * (other == name) for other, course in courses.items()}
        change = np.asarray(_moved(point, rows, alone))
        moved[name] = np.where(np.isfinite(change), change, 0.0)  # like slopes, where there is no answer
    count = sum(np.sum(mask, axis=1) for mask in read.values()) - freedom_taken_by(point, rows)
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


@eqx.filter_jit
def _moved(values: Mapping[str, Array], rows: Rows, courses: Mapping[str, np.ndarray]) -> Array:
    """Change of the residuals with zeros of the outputs, the trajectories following.

    Args:
        values: free parameters, SI.
        rows: stack of all recordings, with decisions.
        courses: courses of the zero of each output in units of its noise, shape (recordings, rows, courses).

    Returns:
        Shape (recordings, residuals, courses).
    """
    weight = {name: rows.weight[name] for name in courses}
    noise = {name: jnp.where(w > 0.0, 1.0 / jnp.where(w > 0.0, w, 1.0), 0.0) for name, w in weight.items()}
    read = {name: rows.measured[name] for name in courses}

    def left(read: Mapping[str, Array]) -> Array:
        return residual_of("spring")(values, eqx.tree_at(lambda r: r.measured, rows, rows.measured | read))

    def along(course: Mapping[str, Array]) -> Array:
        return jax.jvp(left, (read,), ({name: course[name] * noise[name] for name in read},))[1]

    return jax.vmap(along, in_axes=-1, out_axes=-1)(courses)
