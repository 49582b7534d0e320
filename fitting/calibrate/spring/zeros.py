"""Zeros of the instruments of a stand that are off or wander, and what they add to the errors of a fit."""

import numpy as np

from fitting.calibrate.information import Information
from fitting.inference.lasting_noise import Lasting, Series, lasting
from fitting.inference.parameters import Parameters
from fitting.specimens import residual_of
from fitting.specimens.spring_trajectory import OUTPUTS, decided

from .problem import Problem, jacobian, values_of


def zeros(problem: Problem, parameters: Parameters, told: Information) -> Lasting:
    """Contribution of zeros of force and resistance, which are off or wander, to the errors.

    Args:
        problem: the fitted problem.
        parameters: free parameters at the values found.
        told: Fisher information of the fitted tests.
    """
    point = values_of(problem.parameters, parameters.valuesdict())
    data = problem.data()
    data["rows"] = decided(point, data["rows"])
    misfit = np.asarray(residual_of("spring")(point, data["rows"]))
    found = jacobian(point, data)
    slopes = np.stack([np.asarray(found[name]) for name in problem.parameters], axis=-1)
    slopes = np.where(np.isfinite(slopes), slopes, 0.0) * ~told.fixed
    size, series = problem.stacked.mask.shape[1], []
    for k in problem.fitted:
        for place, name in enumerate(OUTPUTS):
            held = np.asarray(problem.stacked.weight[name][k]) > 0.0
            rows = slice(place * size, (place + 1) * size)
            if held.any():
                time = np.asarray(problem.stacked.time[k])[held]
                stated = problem.inflation  # zeros are counted in the noise as it was stated
                left, by = stated * misfit[k, rows][held], stated * slopes[k, rows][held]
                series.append(Series(time, left, by, name))
    entries = [parameters[name] for name in problem.parameters]
    pull = np.array([0.0 if e.prior is None else e.value - e.prior.mean for e in entries])
    return lasting(series, told.prior, pull, problem.inflation)
