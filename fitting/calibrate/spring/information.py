"""What these tests say about each parameter and each combination of them, beside what was known before."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fitting.inference.least_squares import FitResult
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameters
from fitting.specimens.spring_trajectory import decided

from .problem import Problem, jacobian, scale_of, values_of
from .stages import BETWEEN, COLD, HOT, UNLOADING
from .stand_tests import StandTest

HARDLY = 0.7
"""Posterior over prior 1-sigma from which a test has said next to nothing."""
SHARE = 0.4
"""Parameters with less than this share of the largest entry of a direction are left out of its sentence."""
STAYED = 0.02
"""Distance from its start, in prior 1-sigmas, within which a parameter has not moved."""
TOGETHER = 0.97
"""Correlation from which parameters are known only together."""


@dataclass(frozen=True)
class Information:
    """Fisher information of the tests about the free parameters, at the values found.

    Attributes:
        names: names of the free parameters.
        matrix: information of the data alone, in SI, shape (n, n).
        scale: 1-sigma of each parameter's prior, shape (n,); its magnitude where it has none.
        prior: precision of the priors, shape (n,).
        fixed: parameters that stand at a bound, of shape (n,); they are left out of covariances.
    """

    names: tuple[str, ...]
    matrix: np.ndarray
    scale: np.ndarray
    prior: np.ndarray
    fixed: np.ndarray

    def covariance(self, more: np.ndarray | float = 0.0) -> np.ndarray:
        """Covariance with the priors, and with further information if there is any; SI."""
        scaled = (self.matrix + more + np.diag(self.prior)) * np.outer(self.scale, self.scale)
        scaled = np.where(
            self.fixed[:, None] | self.fixed[None, :], np.diag(np.full(len(self.names), 1e12)), scaled
        )
        return np.linalg.pinv(scaled, rcond=1e-14, hermitian=True) * np.outer(self.scale, self.scale)

    def sd(self, more: np.ndarray | float = 0.0) -> np.ndarray:
        """Standard deviations with the priors, shape (n,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance(more)), 0.0))

    def alone(self) -> np.ndarray:
        """Standard deviations with the priors if all other parameters were known, shape (n,)."""
        return self.scale / np.sqrt((np.diag(self.matrix) + self.prior) * self.scale**2 + 1e-300)

    def gain(self, more: np.ndarray) -> float:
        """Expected information of further data [nats]."""
        before, after = (
            np.linalg.slogdet((self.matrix + m + np.diag(self.prior)) * np.outer(self.scale, self.scale))[1]
            for m in (0.0, more)
        )
        return 0.5 * float(after - before)


def fisher(problem: Problem, values: Mapping[str, float], data: Any = None) -> np.ndarray:
    """Information of each recording of a stack, shape (recordings, n, n), SI.

    Args:
        problem: the fitted problem.
        values: values at which the information is computed.
        data: data of the residual; those of all fitted tests by default.
    """
    data = problem.data() if data is None else data
    point = values_of(problem.parameters, values)
    data = {**data, "rows": decided(point, data["rows"])}
    slopes = jacobian(point, data)
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


def with_errors(result: FitResult, inform: Callable[[Parameters], Information]) -> FitResult:
    """A fit that ended without standard errors, with those of the information where it ended.

    If a rule decides otherwise from one row to the next, the misfit has small steps. A fit can stop on one of
    them; its status still says so.

    Args:
        result: result of the fit.
        inform: information at parameters; not called where the fit has errors.
    """
    if result.uncertainty.names or result.chi_square is None:
        return result
    parameters = result.parameters.copy()
    told = inform(parameters)
    kept = [k for k, fixed in enumerate(told.fixed) if not fixed]
    names = tuple(told.names[k] for k in kept)
    covariance = told.covariance()[np.ix_(kept, kept)]
    sd = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    errors = dict.fromkeys(parameters) | dict(zip(names, map(float, sd), strict=True))
    for name, error in errors.items():
        parameters[name].set(standard_error=error)
    uncertainty = Uncertainty(errors, names, covariance, covariance / np.outer(sd, sd), (), 1.0)
    return replace(result, parameters=parameters, uncertainty=uncertainty)


def sentences(
    found: Information, parameters: Parameters, starts: Mapping[str, float], tests: Sequence[StandTest]
) -> list[dict[str, Any]]:
    """What cannot be known from these tests, in words.

    Args:
        found: Fisher information of the tests.
        parameters: free parameters at the values found.
        starts: values before any fit.
        tests: the fitted tests.

    Returns:
        Entries with `kind`, `parameters`, a number that says how bad, and `text`. The kinds are `at_bound`,
        `at_start`, `not_informed`, `loose_direction` and `known_together`.
    """
    entries = _at_bounds(found, parameters)
    alone, covered = _alone(found, parameters, starts, tests)
    return entries + alone + _directions(found, covered, tests) + _together(found, tests)


def _at_bounds(found: Information, parameters: Parameters) -> list[dict[str, Any]]:
    entries = []
    for name, fixed in zip(found.names, found.fixed, strict=True):
        if fixed:
            text = (
                f"{name} stopped at its bound: the data, or another cause of misfit, pull it further than "
                "it may go. "
                "It has no error, and the other errors hold if it is truly there."
            )
            entries.append({"kind": "at_bound", "parameters": [name], "text": text})
    return entries


def _alone(
    found: Information, parameters: Parameters, starts: Mapping[str, float], tests: Sequence[StandTest]
) -> tuple[list[dict[str, Any]], set[str]]:
    """Parameters about which the tests say next to nothing, each by itself."""
    entries, covered = [], set()
    marginal = found.sd() / found.scale
    with np.errstate(divide="ignore"):
        best = 1.0 / np.sqrt(np.diag(found.matrix) * found.scale**2 + found.prior * found.scale**2)
    for k, name in enumerate(found.names):
        if found.fixed[k] or best[k] < HARDLY:
            continue
        covered.add(name)
        stayed = abs(parameters[name].value - starts[name]) < STAYED * found.scale[k]
        kind = "at_start" if stayed else "not_informed"
        where = "is still at the value it started from" if stayed else "is hardly informed"
        text = (
            f"{name} {where}: {_needed(name, tests)}. Its error of {100.0 * marginal[k]:.0f} % of the "
            "prior's "
            "comes from the prior."
        )
        entries.append({
            "kind": kind, "parameters": [name], "posterior_over_prior": float(marginal[k]), "text": text,
        })  # fmt: skip
    return entries, covered


def _directions(found: Information, covered: set[str], tests: Sequence[StandTest]) -> list[dict[str, Any]]:
    """Combinations along which the tests say less than the priors, from the information in units of them."""
    kept = [k for k, name in enumerate(found.names) if not found.fixed[k] and name not in covered]
    if not kept:
        return []
    scaled = (found.matrix * np.outer(found.scale, found.scale))[np.ix_(kept, kept)]
    width, axes = np.linalg.eigh(scaled)
    entries = []
    for value, axis in zip(width, axes.T, strict=True):
        ratio = 1.0 / np.sqrt(1.0 + max(value, 0.0))
        if ratio < HARDLY:
            break
        main = [i for i in np.argsort(-np.abs(axis)) if abs(axis[i]) >= SHARE * np.abs(axis).max()]
        names = [found.names[kept[i]] for i in main]
        senses = " while ".join(
            f"{n} {'rises' if axis[i] > 0 else 'falls'}" for n, i in zip(names, main, strict=True)
        )
        text = (
            f"{_list(names)} cannot be separated by {_reach(names, tests)}: {senses}, by as much as the "
            "priors allow, "
            f"and the fit stays as good (error along it {100.0 * ratio:.0f} % of the priors')."
        )
        entries.append({
            "kind": "loose_direction", "parameters": names, "posterior_over_prior": float(ratio),
            "text": text,
        })  # fmt: skip
    return entries


def _together(found: Information, tests: Sequence[StandTest]) -> list[dict[str, Any]]:
    """Groups of parameters whose correlations with each other exceed `TOGETHER`."""
    covariance = found.covariance()
    spread = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    correlation = np.abs(covariance / np.outer(spread, spread))
    correlation[found.fixed] = correlation[:, found.fixed] = 0.0
    left, entries = set(range(len(spread))), []
    while left:
        group, grown = {min(left)}, True
        while grown:
            more = {j for j in left - group if any(correlation[i, j] > TOGETHER for i in group)}
            grown, group = bool(more), group | more
        left -= group
        if len(group) > 1:
            names = [found.names[k] for k in sorted(group)]
            strongest = max(correlation[i, j] for i in group for j in group if i != j)
            text = (
                f"{_list(names)} are known only together (correlations up to {strongest:.3f}) from "
                f"{_reach(names, tests)}: the curve they make was measured, not each of them."
            )
            entries.append({
                "kind": "known_together", "parameters": names, "correlation": float(strongest), "text": text,
            })  # fmt: skip
    return entries


_TESTS_OF = (
    (COLD, ("cold",), "cold tests"),
    (HOT, ("hot",), "hot tests"),
    (BETWEEN, ("intermediate",), "tests between cold and hot"),
    (UNLOADING, ("cold", "intermediate", "hot"), "tests with unloading"),
)


def _reach(names: Sequence[str], tests: Sequence[StandTest]) -> str:
    """The tests that speak of some parameters and how far they go: `cold tests below 200 % spring strain`."""
    phases, words = [], []
    for members, wanted, word in _TESTS_OF:
        if any(name in members for name in names):
            phases += wanted
            words.append(word)
    reached = [test.strain for test in tests if test.phase in phases]
    if not reached:
        return "these tests"
    return f"{' and '.join(words)} up to {100.0 * max(reached):.0f} % spring strain"


def _needed(name: str, tests: Sequence[StandTest]) -> str:
    for members, phases, word in _TESTS_OF:
        if name in members:
            there = [test for test in tests if test.phase in phases]
            if name in UNLOADING:
                there = [test for test in there if test.unloads]
            return f"no {word} were made" if not there else f"{_reach([name], tests)} do not show it"
    return "these tests do not show it"


def _list(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def spread_given_geometry(found: Information, names: Sequence[str]) -> dict[str, float]:
    """Standard deviations if the dimensions were exactly as stated: what the tests themselves leave open."""
    kept = [k for k, name in enumerate(found.names) if name in set(names) and not found.fixed[k]]
    total = (found.matrix + np.diag(found.prior)) * np.outer(found.scale, found.scale)
    inverse = np.linalg.pinv(total[np.ix_(kept, kept)], rcond=1e-14, hermitian=True)
    return {
        found.names[k]: float(np.sqrt(max(inverse[i, i], 0.0)) * found.scale[k]) for i, k in enumerate(kept)
    }
