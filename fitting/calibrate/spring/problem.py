"""A campaign of springs as one least-squares problem, which all stages of a fit solve by one program.

A stage fits some tests and some parameters. The other tests get weights of zero. The other parameters are
held by soft constraints: each is one more residual, the distance from a value over a small standard
deviation. So stages, further starts, profiles and the joint fit differ in their data alone.

**Fits of a law that misses the tests.** A law may leave more than noise (`MISFIT`). Differences of chi-square
then count in the unit of the noise as found, the square of `Problem.found`. The errors that are quoted count
that noise, too. So a fit ends where further steps, or further rounds of decisions, would lower chi-square by
less than `SAME` of that unit. Without this rule a fit crept along kinks for all its steps. In one
campaign of five tests the reduced chi-square was 530. The unit was 5,488, and twelve rounds of 200 steps
lowered chi-square by 1.6 of it. Where a law leaves only noise, the unit is 1 and the rule is off.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from fitting.calibrate.soft_constraints import constrained_residual_of, constraint_table
from fitting.inference.lasting_noise import Size
from fitting.inference.least_squares import FitResult, Status, fit_least_squares
from fitting.inference.parameters import Parameters
from fitting.inference.serial_correlation import inflation_of
from fitting.specimens import Rows, stack
from fitting.specimens.correlated_noise import correlated_stack
from fitting.specimens.process_noise import walks_of, with_process_noise, with_steady_walks, with_walks
from fitting.specimens.spring_rows import OUTPUTS
from fitting.specimens.spring_trajectory import decided, undecided

from .residuals import residuals_and_freedom, values_of
from .stand_tests import StandTest

RTOL = 1e-3
"""A fit has converged when its next step would be this many standard errors."""
MAX_STEPS = 200
"""Maximum number of steps of a fit."""
FEW_STEPS = 50
"""Maximum number of steps of a fit with a constant held, for a profile. Of 43 such fits of one alloy 20 took
more, up to 200. Ended after 50, their chi-square is higher by 0.1 at most, for a quarter of the time."""
MOST_ROUNDS = 6
"""Maximum number of rounds of a fit; each decides on the residual strain, then fits."""
MISFIT = 1.3
"""Minimum reduced chi-square that counts as misfit."""
SAME = 0.05
"""Maximum change of chi-square from round to round at which a fit ends, in units of `Problem.unit`."""
CONSTRAINT_SD = 1e-4
"""Standard deviation of a soft constraint, as a share of the parameter's scale (`scale_of`)."""
FIRM = 0.01
"""Maximum standard deviation of a soft constraint, as a share of the parameter's standard error."""


residual = constrained_residual_of("spring")
"""Residual of all recordings, then of the soft constraints. Its data come from `Problem.data`."""


@dataclass(frozen=True)
class Problem:
    """The problem that is fitted.

    Attributes:
        tests: the recordings, classified, in the order of `rows`.
        rows: each recording as arrays; those that are not fitted too.
        stacked: the same along one axis, padded.
        parameters: free numbers at their starting values, with priors.
        inflation: factor by which all noise is taken larger than stated, for misfit and serial correlation.
        found: factor on the noise as stated by which the last fit missed the tests; 1 where it left noise
            only, and before any fit.
        zeros: sizes of zeros that correlate the noise of `stacked`, by output; none for white noise.
    """

    tests: tuple[StandTest, ...]
    rows: tuple[Rows, ...]
    stacked: Rows
    parameters: Parameters
    inflation: float = 1.0
    found: float = 1.0
    zeros: Mapping[str, Size] = field(default_factory=dict)

    @classmethod
    def of(cls, tests: Sequence[StandTest], rows: Sequence[Rows], parameters: Parameters) -> "Problem":
        """Problem of a campaign."""
        return cls(tuple(tests), tuple(rows), stack(rows), parameters)

    @property
    def unit(self) -> float:
        """Chi-square, for the noise as taken, that counts as 1 by the noise as found; at least 1."""
        return max(self.found / self.inflation, 1.0) ** 2

    @property
    def fitted(self) -> list[int]:
        """Indices of the tests that may be fitted."""
        return [k for k, test in enumerate(self.tests) if test.fitted]

    def at(self, values: Mapping[str, float]) -> "Problem":
        """The same problem started from other values, brought inside the bounds."""
        known = {name: value for name, value in values.items() if name in self.parameters}
        return replace(self, parameters=self.parameters.at(known))

    def with_process_noise(self, values: Mapping[str, float]) -> "Problem":
        """The same problem with new process-noise variances of the martensite fraction, from these values."""
        return replace(self, stacked=with_process_noise(values_of(self.parameters, values), self.stacked))

    def with_steady_cold_tests(self) -> "Problem":
        """The same problem, the martensite fraction of cold wires as steady as any candidate has it."""
        cold = jnp.asarray([k for k, test in enumerate(self.tests) if test.phase == "cold"], int)
        return replace(self, stacked=with_steady_walks(self.stacked, cold))

    def with_phases(self, levels: Mapping[int, float]) -> "Problem":
        """The same problem with tests held at one martensite fraction throughout, by their indices.

        They are then tests at full cold or full heat, whatever they were taken for before.
        """
        chosen, extra = jnp.asarray(list(levels), int), self.stacked.extra
        level = extra["level"].at[chosen].set(jnp.asarray(list(levels.values())))
        held = {**extra, "level": level, "level_sd": extra["level_sd"].at[chosen].set(0.0)}
        tests = tuple(test.held(levels[k]) if k in levels else test for k, test in enumerate(self.tests))
        return replace(self, tests=tests, stacked=replace(self.stacked, extra=held))

    @property
    def free_tests(self) -> list[int]:
        """Indices of the fitted tests whose martensite fraction is found."""
        free = np.asarray(self.stacked.extra["level_sd"]) > 0.0
        return [k for k in self.fitted if free[k]]

    def with_walks_of(self, other: "Problem") -> "Problem":
        """The same problem with the process-noise variances of another one, of the same tests."""
        return replace(self, stacked=with_walks(self.stacked, walks_of(other.stacked)))

    def with_turning_margin(self, margin: float) -> "Problem":
        """The same problem with another maximum deviation of turning points from the residual strain's rule.

        Args:
            margin: maximum deviation, as part of the residual strain.
        """
        margins = jnp.full_like(self.stacked.extra["margin"], margin)  # it has rows for padding, too
        return replace(self, stacked=eqx.tree_at(lambda r: r.extra["margin"], self.stacked, margins))

    def undecided(self) -> "Problem":
        """The same problem without the decisions of earlier fits."""
        return replace(self, stacked=undecided(self.stacked))

    def with_zeros(self, zeros: Mapping[str, Size]) -> "Problem":
        """The same problem with noise that zeros of these sizes correlate, by output, and no fit yet."""
        correlated = correlated_stack(self.stacked, zeros)
        return replace(self, stacked=correlated, zeros=dict(zeros), found=1.0)

    def inflated(self, factor: float) -> "Problem":
        """The same problem with all noise taken `factor` times what is stated."""
        return replace(self, inflation=factor)

    def data(
        self,
        tests: Iterable[int] | None = None,
        loading: bool = False,
        constraints: Mapping[str, tuple[float, float]] | None = None,
    ) -> dict[str, Any]:
        """Data of the residual, and the indices of the tests that any fit may count.

        Args:
            tests: indices that count; every fitted one by default.
            loading: count only rows on which a spring goes further than before.
            constraints: value and 1-sigma of parameters that are held.
        """
        chosen = set(self.fitted if tests is None else tests)
        counts = jnp.asarray([[k in chosen] for k in range(self.stacked.mask.shape[0])])
        share = counts * (self.stacked.extra["loading"] if loading else 1.0) / self.inflation
        weight = {name: w * share for name, w in self.stacked.weight.items()}
        rows = eqx.tree_at(lambda r: (r.weight, r.mask), self.stacked, (weight, self.stacked.mask & counts))
        fitted = np.asarray(self.fitted, int)
        return {"rows": rows, "constraints": constraint_table(self.parameters, constraints), "fitted": fitted}

    def with_decisions(self, values: Mapping[str, float]) -> list[Rows]:
        """Every recording with the noise as taken, and with the rule's decisions at these values.

        Args:
            values: free parameters, SI.
        """
        weight = {name: w / self.inflation for name, w in self.stacked.weight.items()}
        inflated = eqx.tree_at(lambda r: r.weight, self.stacked, weight)
        found, size = decided(values_of(self.parameters, values), inflated), self.stacked.mask.shape[1]

        def part(k: int, count: int) -> Rows:
            return jax.tree.map(lambda x: x[k, :count] if x.shape[1:2] == (size,) else x[k], found)

        return [part(k, len(rows.mask)) for k, rows in enumerate(self.rows)]

    def held(
        self, names: Iterable[str], values: Mapping[str, float] | None = None
    ) -> dict[str, tuple[float, float]]:
        """Soft constraints that hold parameters at values.

        Args:
            names: parameters to hold.
            values: values in SI, by name; a parameter without one is held at its starting value.

        Returns:
            Value and standard deviation of each constraint, SI, by name.
        """
        result = {}
        for name in names:
            entry = self.parameters[name]
            result[name] = ((values or {}).get(name, entry.value), CONSTRAINT_SD * scale_of(entry))
        return result

    def fit(self, **options: Any) -> FitResult:
        """Fit from the starting values.

        The rule of the residual strain decides at the starting values, and again at the values of each fit.
        Rounds end when chi-square changes by less than `SAME` units, or after `MOST_ROUNDS`.

        Args:
            **options: options of `data`.
        """
        return self.fitted_with(**options)[0]

    def fitted_with(self, **options: Any) -> tuple[FitResult, "Problem"]:
        """Result as of `fit`, and the problem with the decisions that the result was found with."""
        problem, before = self, None
        for _ in range(MOST_ROUNDS):
            result, problem = problem._fit_once(**options)
            if before is not None and _same(before, result, problem.unit):
                break
            before = result
        return result, problem

    def _fit_once(self, **options: Any) -> tuple[FitResult, "Problem"]:
        data = self.data(**options)
        data["rows"] = decided(values_of(self.parameters), data["rows"])
        result = solve(self.parameters, data, least=self.least)
        known = {**self.stacked.extra, "decisions": data["rows"].extra["decisions"]}
        stacked = replace(self.stacked, extra=known)
        return result, replace(self.at(result.values), stacked=stacked, found=self._noise_found(result, data))

    def _noise_found(self, result: FitResult, data: Mapping[str, Any]) -> float:
        """`found` after a fit of these data: 1 where the reduced chi-square, as stated, is no misfit."""
        reduced = result.reduced_chi_square or np.nan
        if not self.inflation**2 * reduced > MISFIT:
            return 1.0
        return self.inflation * inflation_of(reduced, _force_left(result, data))

    @property
    def least(self) -> float:
        """Chi-square by which a fit must fall to go on, see `fit_least_squares`; 0 without a misfit."""
        return SAME * self.unit if self.found > 1.0 else 0.0


def solve(
    parameters: Parameters, data: PyTree, most: int = MAX_STEPS, least: float = 0.0
) -> FitResult:
    """One least-squares fit with everything decided, in at most so many steps.

    It ends early where it no longer lowers chi-square by `least`. Its observations are the readings less the
    degrees of freedom that the trajectories take at its end.
    """
    rows, count = data["rows"], data["rows"].observations

    def left(values: Mapping[str, float]) -> int:
        taken = float(np.sum(residuals_and_freedom(values_of(parameters, values), rows)[1]))
        return max(count - round(taken), 1)

    part = _fitted(data)
    return fit_least_squares(
        residual,
        parameters,
        data=part,
        use_priors=True,
        observations=left,
        rtol=RTOL,
        least=least,
        max_steps=most,
    )


def _force_left(result: FitResult, data: Mapping[str, Any]) -> list[np.ndarray]:
    """Residuals of the force of each test that a fit counted, each of shape (samples with a force,)."""
    rows, chosen = data["rows"], data["fitted"]
    place, count = OUTPUTS.index("force"), rows.mask.shape[1]
    left = result.residual[: result.residual.size - len(data["constraints"])].reshape(len(chosen), -1)
    counted = np.asarray(rows.weight["force"])[chosen] > 0.0
    series = left[:, place * count : (place + 1) * count]
    return [one[known] for one, known in zip(series, counted, strict=True) if known.any()]


def _fitted(data: Mapping[str, Any]) -> dict[str, Any]:
    """Data of `Problem.data` without the recordings that no fit counts: a step takes the time of all."""
    chosen = np.asarray(data["fitted"])
    rows = jax.tree.map(lambda leaf: np.asarray(leaf)[chosen], data["rows"])
    return {"rows": rows, "constraints": data["constraints"]}


def fit_constrained(
    problem: Problem, data: PyTree, values: Mapping[str, float], known: Mapping[str, Any] | None = None
) -> FitResult:
    """Fit from given values with their parameters held there; the constraints in `data` are replaced.

    Args:
        problem: problem whose other parameters start at their own values.
        data: data of the residual, from `Problem.data` and with decisions.
        values: values of the held parameters, SI.
        known: parameters with standard errors, for `constraints_of`.
    """
    held = constraints_of(problem, values, known)
    constrained = {**data, "constraints": constraint_table(problem.parameters, held)}
    return solve(problem.at(values).parameters, constrained, FEW_STEPS, problem.least)


def constraints_of(
    problem: Problem, values: Mapping[str, float], known: Mapping[str, Any] | None = None
) -> dict[str, tuple[float, float]]:
    """Soft constraints that hold parameters at values, tightly beside standard errors.

    Args:
        problem: problem of the parameters.
        values: values of the held parameters, SI.
        known: parameters by name; where one has a standard error, the constraint's is `FIRM` of it at most.
    """
    held = problem.held(values, values)
    for name, (value, sd) in held.items():
        error = known[name].standard_error if known is not None else None
        held[name] = value, min(sd, FIRM * error) if error else sd
    return held


def _same(before: FitResult, after: FitResult, unit: float) -> bool:
    """True if the later of two rounds came to an end and chi-square changed by less than `SAME` units.

    It is also true where a round has no chi-square: more rounds would not help.
    """
    if before.chi_square is None or after.chi_square is None:
        return True
    return abs(before.chi_square - after.chi_square) < SAME * unit and came_to_an_end(after)


def came_to_an_end(result: FitResult) -> bool:
    """True if a fit converged, or gained too little by the noise as found to go on."""
    return result.success or result.status is Status.LINGERING


def scale_of(entry: Any) -> float:
    """Natural size of a parameter: the 1-sigma of its prior, else its magnitude."""
    if entry.prior is not None:
        return float(entry.prior.sd)
    return abs(float(entry.value)) or 1.0
