"""How far values of a joint fit miss its tests."""

from collections.abc import Mapping

import numpy as np

from fitting.specimens.spring_rows import OUTPUTS

from .problem import Problem
from .residuals import residuals_and_freedom, values_of


def missed(problem: Problem, values: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """Root mean square misfit at values over the noise as stated, by fitted test and output [1]."""
    found, _ = residuals_and_freedom(values_of(problem.parameters, values), problem.stacked)
    return {
        (problem.tests[k].name, output): float(np.sqrt(np.mean(series**2)))
        for output in OUTPUTS
        for k, series in _misfit_by_test(problem, found, output).items()
    }


def force_misfit(problem: Problem, values: Mapping[str, float]) -> dict[int, np.ndarray]:
    """Misfit of the force over its noise as stated, of every fitted test with a force, by its index.

    Each is in the order of sampling, shape (samples with a force,).
    """
    found, _ = residuals_and_freedom(values_of(problem.parameters, values), problem.stacked)
    return _misfit_by_test(problem, found, "force")


def _misfit_by_test(problem: Problem, residuals: np.ndarray, output: str) -> dict[int, np.ndarray]:
    """Misfit of an output over its noise, of every fitted test that has it, by its index.

    Args:
        problem: the problem.
        residuals: those of all tests, the outputs one after the other, shape (tests, outputs * rows).
        output: name of the output.
    """
    rows, place = problem.stacked.mask.shape[1], OUTPUTS.index(output)
    weight = np.asarray(problem.stacked.weight[output])
    series = {k: residuals[k, place * rows : (place + 1) * rows][weight[k] > 0.0] for k in problem.fitted}
    return {k: misfit for k, misfit in series.items() if misfit.size}
