"""Information of the tests of a spring about each parameter, and the tests that could give more."""

from collections.abc import Mapping, Sequence

import numpy as np

from fitting.calibrate.information import Information
from fitting.inference.notes import joined
from fitting.inference.parameters import Parameters
from fitting.specimens import Rows
from fitting.specimens.spring_trajectory import decided

from .problem import Problem, scale_of
from .residuals import jacobian, values_of
from .stages import BETWEEN, COLD, HOT, UNLOADING
from .stand_tests import StandTest

_TESTS_OF = (
    (COLD, ("cold",), "cold tests"),
    (HOT, ("hot",), "hot tests"),
    (BETWEEN, ("intermediate",), "tests between cold and hot"),
    (UNLOADING, ("cold", "intermediate", "hot"), "tests with unloading"),
)


def fisher(problem: Problem, values: Mapping[str, float], stacked: Rows | None = None) -> np.ndarray:
    """Information of each recording of a stack, shape (recordings, n, n), SI.

    Args:
        problem: the fitted problem.
        values: values at which the information is computed.
        stacked: the stack; that of all fitted tests by default.
    """
    stacked = problem.data()["rows"] if stacked is None else stacked
    point = values_of(problem.parameters, values)
    slopes = jacobian(point, decided(point, stacked))
    rows = np.stack([np.asarray(slopes[name]) for name in problem.parameters], axis=-1)
    rows = np.where(np.isfinite(rows), rows, 0.0)
    return np.einsum("kmi,kmj->kij", rows, rows)


def information(problem: Problem, parameters: Parameters) -> Information:
    """Information of the fitted tests.

    Args:
        problem: the fitted problem.
        parameters: free parameters at the values found.
    """
    values = parameters.valuesdict()
    each = fisher(problem, values)
    entries = [parameters[name] for name in problem.parameters]
    return Information(
        names=tuple(problem.parameters),
        matrix=each[problem.fitted].sum(axis=0),
        scale=np.array([scale_of(entry) for entry in entries]),
        prior=np.array([0.0 if entry.prior is None else entry.prior.sd**-2 for entry in entries]),
        fixed=np.array([entry.at_bound for entry in entries]),
    )


def informing_tests(tests: Sequence[StandTest], names: Sequence[str]) -> str:
    """The tests that inform some parameters and how far they go: `cold tests up to 200 % spring strain`."""
    phases, words = [], []
    for members, wanted, word in _TESTS_OF:
        if any(name in members for name in names):
            phases += wanted
            words.append(word)
    reached = [test.strain for test in tests if test.phase in phases]
    if not reached:
        return "these tests"
    return f"{joined(words)} up to {100.0 * max(reached):.0f} % spring strain"


def why_not_shown(tests: Sequence[StandTest], name: str) -> str:
    """The reason why tests do not show a parameter, as the middle of a sentence."""
    for members, phases, word in _TESTS_OF:
        if name in members:
            there = [test for test in tests if test.phase in phases]
            if name in UNLOADING:
                there = [test for test in there if test.unloads]
            return f"no {word} were made" if not there else f"{informing_tests(tests, [name])} do not show it"
    return "these tests do not show it"


def spread_given_geometry(found: Information, names: Sequence[str]) -> dict[str, float]:
    """Standard deviations if the dimensions were exactly as stated: what the tests themselves leave open."""
    kept = [k for k, name in enumerate(found.names) if name in set(names) and not found.fixed[k]]
    total = (found.matrix + np.diag(found.prior)) * np.outer(found.scale, found.scale)
    inverse = np.linalg.pinv(total[np.ix_(kept, kept)], rcond=1e-14, hermitian=True)
    return {
        found.names[k]: float(np.sqrt(max(inverse[i, i], 0.0)) * found.scale[k]) for i, k in enumerate(kept)
    }
