"""The entry point of least squares: from a residual function and parameters to a result with standard
errors."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Array, PyTree

from pneusma_jax.errors import InputError
from pneusma_jax.precision import require_float64

from ..parameters import Parameters
from .covariance import Uncertainty, propagate
from .notes import SAME_MINIMUM, notes_on
from .program import Outcome, Problem, run
from .result import FitError, FitResult, Status
from .starts import starting_vectors
from .trust_region import Box

UNCONVERGED = (Status.MAX_STEPS, Status.LINGERING, Status.STALLED)
"""Ends at finite values that need not be a minimum."""
TRUSTED = 0.1
"""Maximum distance from a minimum, in standard errors, at which the covariance is still valid."""


def fit_least_squares(
    residual: Callable[[dict[str, Array], PyTree], Array],
    parameters: Parameters,
    *,
    data: PyTree = None,
    max_steps: int = 2000,
    rtol: float = 1e-8,
    least: float = 0.0,
    starts: int | Sequence[Mapping[str, float]] | None = None,
    seed: int = 0,
    use_priors: bool = False,
    scale_covariance: bool | None = None,
    observations: int | Callable[[Mapping[str, float]], int] | None = None,
    in_turn: bool = False,
    throw: bool = False,
) -> FitResult:
    """Fit parameters by nonlinear least squares.

    The program is compiled once per residual function, set of free and tied names and shape of the data. Pass
    changing numbers as `data`, and the same function object again (a new lambda compiles anew). Without known
    sigma the residual may be unweighted. Standard errors are then scaled by the misfit, as in lmfit and
    `curve_fit`.

    Args:
        residual: function `residual(values, data)` to an array of any shape, differentiable by JAX: model
            less data, divided by sigma where that is known. `values` holds every parameter by name, ties
            computed.
        parameters: start values and free parameters; not changed.
        data: data for the residual.
        max_steps: maximum number of evaluations of the residual from each start.
        rtol: maximum undamped step at convergence, in standard errors.
        least: minimum fall of chi-square in `LINGERING` steps, else the fit ends unconverged; 0 for no such
            end.
        starts: total number of starts, or further starting points, see `starting_vectors`; the best minimum
            wins.
        seed: seed of scattered starts.
        use_priors: true to append `(value - mean) / sd` for every parameter with a prior. Sigma must then be
            known.
        scale_covariance: true to estimate sigma from the misfit, false for a residual in units of sigma; by
            default true without priors, false with them.
        observations: number of residuals that count, if some rows only pad the data to a common shape (with
            zeros). It may be a function of the values of all parameters at the end.
        in_turn: true to solve from one start after the other, with the program of a single start. Together,
            all take as long as the slowest, and each step takes the Jacobian's time even where it is refused.
        throw: true to raise if the fit fails, instead of returning a result that says so.

    Returns:
        The result; check its `status`.

    Raises:
        InputError: if nothing is free, there are no residuals, or a start is unusable.
        ValueError: if the covariance is to be scaled although priors fix the scale of sigma.
        FitError: on request, if the fit fails.
    """
    require_float64()
    if scale_covariance and use_priors:
        raise ValueError(
            "Argument `scale_covariance` must be False with `use_priors`, but both ask for another sigma."
        )
    scaled = not use_priors if scale_covariance is None else scale_covariance
    problem = _problem(residual, parameters, data, use_priors, (rtol, least))
    ended = _solved(problem, np.asarray(starting_vectors(parameters, starts, seed)), max_steps, in_turn)
    result = _described(ended, problem, parameters, observations, scaled)
    if throw and not result.success:
        raise FitError(result)
    return result


@dataclass(frozen=True)
class _Ended:
    """End of the best start.

    Attributes:
        outcome: outcome of the engine.
        begin: start values of the free parameters, in the order of the layout.
        values: values of all parameters, in the order of the layout.
        slopes: their derivatives by the free unknowns.
        chi_squares: chi-square at the end of every start.
    """

    outcome: Outcome
    begin: np.ndarray
    values: np.ndarray
    slopes: np.ndarray
    chi_squares: np.ndarray


def _solved(problem: Problem, vectors: np.ndarray, max_steps: int, in_turn: bool) -> _Ended:
    """End of the best of several starts.

    Args:
        problem: the problem.
        vectors: start values of the free parameters, (starts, free).
        max_steps, in_turn: see `fit_least_squares`.
    """
    groups, most = vectors[:, None] if in_turn else vectors[None], np.asarray(max_steps)
    ends = [jax.device_get(run(problem, group, most)) for group in groups]
    outcomes, values, slopes = jax.tree.map(lambda *parts: np.concatenate(parts), *ends)
    best, chi_squares = _best(outcomes)
    outcome = jax.tree.map(lambda leaf: leaf[best], outcomes)
    return _Ended(outcome, vectors[best], values[best], slopes[best], chi_squares)


def _described(
    ended: _Ended,
    problem: Problem,
    parameters: Parameters,
    observations: int | Callable[[Mapping[str, float]], int] | None,
    scaled: bool,
) -> FitResult:
    """The result: values, status, errors and remarks."""
    outcome, rows, priors = ended.outcome, ended.outcome.residual.size, len(problem.prior_names)
    initial = dict(zip(problem.layout.free, ended.begin, strict=True))
    reached = dict(zip(problem.layout.names, ended.values, strict=True))
    stated = observations(reached) if callable(observations) else observations
    counted = (rows - priors if stated is None else stated) + priors
    freedom = counted - len(problem.layout.free)
    status = _status(outcome, freedom, scaled)
    fitted = _with_values(parameters, reached, status, initial)
    at_bound = tuple(name for name in problem.layout.free if fitted[name].at_bound)
    uncertainty = Uncertainty.none(fitted)
    if status.success or (outcome.offset < TRUSTED and status in UNCONVERGED):
        variance = float(outcome.chi_square) / freedom if scaled else 1.0
        uncertainty = propagate(outcome.triangle, ended.slopes, problem.layout, at_bound, variance)
    _write_uncertainty(fitted, uncertainty)
    return FitResult(
        parameters=fitted,
        status=status,
        notes=notes_on(fitted, uncertainty, at_bound, outcome, ended.chi_squares),
        residual=outcome.residual[: rows - priors],
        prior_residual=outcome.residual[rows - priors :],
        observations=counted,
        degrees_of_freedom=freedom,
        uncertainty=uncertainty,
        scaled=scaled,
        steps=int(outcome.steps),
        start_chi_squares=ended.chi_squares,
    )


def _problem(
    residual: Callable, parameters: Parameters, data: PyTree, use_priors: bool, ends: tuple[float, float]
) -> Problem:
    """The fit as numbers and structure. `ends` are `rtol` and `least` of `fit_least_squares`."""
    layout = parameters.layout()
    if not layout.free:
        raise InputError("no parameter is free; set vary=True and no tie for those to be fitted")
    parameters.valuesdict()  # refuses a tie without a finite value
    names = tuple(
        name for name, p in parameters.items() if use_priors and p.prior is not None and (p.free or p.tie)
    )
    lower, upper = parameters.box()
    bounded = bool(np.isfinite(lower).any() or np.isfinite(upper).any())
    return Problem(
        residual=residual,
        # Python floats would be compiled in as constants.
        data=jax.tree.map(
            lambda leaf: np.asarray(leaf) if isinstance(leaf, float | np.number) else leaf, data
        ),
        stored=parameters.stored(),
        prior_mean=np.asarray([parameters[name].prior.mean for name in names], float),
        prior_sd=np.asarray([parameters[name].prior.sd for name in names], float),
        box=Box(lower, upper) if bounded else None,
        rtol=np.asarray(ends[0], float),
        least=np.asarray(ends[1], float),
        layout=layout,
        prior_names=names,
    )


def _best(outcomes: Outcome) -> tuple[int, np.ndarray]:
    """Index of the best start (converged, if several share the minimum), and chi-square of each start."""
    finite = outcomes.finite & np.all(np.isfinite(outcomes.residual), axis=-1)
    chi_squares = np.where(finite, outcomes.chi_square, np.nan)
    if not finite.any():
        return 0, chi_squares
    lowest = np.nanmin(chi_squares)
    sharing = chi_squares <= lowest * (1 + SAME_MINIMUM)
    return int(np.argmax(sharing * (1 + (outcomes.converged | outcomes.precise)))), chi_squares


def _status(outcome: Outcome, freedom: int, scaled: bool) -> Status:
    if not outcome.finite or not np.all(np.isfinite(outcome.residual)):
        return Status.NON_FINITE
    if freedom < 0 or (freedom == 0 and scaled):
        return Status.NO_DEGREES_OF_FREEDOM
    if outcome.converged:
        return Status.CONVERGED
    if outcome.precise:
        return Status.AT_PRECISION
    if outcome.lingering:
        return Status.LINGERING
    return Status.STALLED if outcome.stalled else Status.MAX_STEPS


def _with_values(parameters: Parameters, values: dict, status: Status, initial: dict) -> Parameters:
    fitted = parameters.copy()
    for name, parameter in parameters.items():
        start = initial.get(name, parameter.value)
        if name in initial and parameter.scale == "log":
            start = float(np.exp(start))
        changes = {"initial_value": float(start), "standard_error": None, "correlations": {}}
        if name in initial and status is not Status.NON_FINITE:
            # exp(log(bound)) may differ from the bound in the last digit.
            changes["value"] = float(np.clip(values[name], parameter.min, parameter.max))
        fitted[name].set(**changes)
    return fitted


def _write_uncertainty(fitted: Parameters, uncertainty: Uncertainty) -> None:
    correlation = uncertainty.correlation
    for name, error in uncertainty.standard_errors.items():
        fitted[name].set(standard_error=error)
    for i, name in enumerate(uncertainty.names):
        others = {other: float(correlation[i, j]) for j, other in enumerate(uncertainty.names) if i != j}
        fitted[name].set(correlations=others)
