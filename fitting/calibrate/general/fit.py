"""Least squares of a campaign of any kind: from several starts, with errors that know about misfit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.calibrate.profile_likelihood import ALIKE
from fitting.calibrate.soft_constraints import constrained_residual_of, constraint_table
from fitting.data.recordings import Recording
from fitting.inference.lasting_noise import Size
from fitting.inference.least_squares import FitResult, Status, fit_least_squares
from fitting.inference.parameters import Parameter, Parameters
from fitting.inference.serial_correlation import correlation_time, inflation_of
from fitting.specimens import Model, Rows, derivative_of, misfit_of, predictor_of, specimen_of, stack
from fitting.specimens.correlated_noise import correlated, uncorrelated
from pneusma_jax.numerics.safe import as_arrays

from .noise import with_noise_of_residuals

RTOL = 1e-4
MAX_STEPS = 300
FEW_STEPS = 50
"""The same of a fit with a constant held, for a profile; see `fitting.calibrate.spring.problem`."""
MISFIT = 1.3
"""Reduced chi-square above which the misfit is more than noise."""
ROUNDS = 5
DRAWS = 3
"""Further draws of starts, at most, where the best fit misfits or stopped at a kink."""
NEAR = 0.1
"""Standard deviations of the priors by which starts are scattered about a fit that stopped at a kink."""
SAME = 0.05
"""Change of chi-square below which two rounds of decisions agree."""
CONSTRAINT_SD = 0.01
"""Standard deviation of a soft constraint, as a share of the parameter's standard error."""


@dataclass(frozen=True)
class GeneralFit:
    """A fitted campaign.

    Attributes:
        recordings: all of them.
        rows: the same as arrays, decided at the values found, noise as it was stated, or as residuals tell.
        model: model that predicts them.
        result: the fit, noise as it was taken.
        starts: chi-square that each start ended with, for the noise that readings tell; NaN where it failed.
        reduced_chi_square: reduced chi-square for the noise of `rows`.
        inflation: factor on the noise, and so on the standard errors.
        correlation_time: samples of misfit that make one independent one.
        zeros: sizes of the zeros of instruments that are off or drift, by output, which correlate its noise.
        noise_of_residuals: true if residuals told a noise that nobody states, and the best start was fitted
            again with it.
    """

    recordings: tuple[Recording, ...]
    rows: tuple[Rows, ...]
    model: Model
    result: FitResult
    starts: tuple[float, ...]
    reduced_chi_square: float
    inflation: float
    correlation_time: float
    zeros: Mapping[str, Size] = field(default_factory=dict)
    noise_of_residuals: bool = False

    @property
    def kind(self) -> str:
        """Kind of the recordings."""
        return self.recordings[0].kind

    @property
    def misses(self) -> bool:
        """True if the misfit is more than noise; `result` was made at noise that covers it."""
        return not self.reduced_chi_square <= MISFIT

    def predict(self, values: Mapping[str, float] | None = None) -> list[dict[str, np.ndarray]]:
        """Outputs of every recording at values, those of the fit by default; SI, without padding."""
        values = self.result.values if values is None else values
        return self._by_recording(predictor_of(self.model)(as_arrays(values), self._stacked))

    def derivative(self, name: str) -> list[dict[str, np.ndarray]]:
        """Derivative of `predict` by one parameter at the fit; SI."""
        values = as_arrays(self.result.values)
        along = {other: jnp.asarray(float(other == name)) for other in values}
        return self._by_recording(derivative_of(self.model)(values, along, self._stacked))

    @property
    def _stacked(self) -> Rows:
        """All recordings as one stack, noise left independent."""
        return stack([uncorrelated(one) for one in self.rows])

    def _by_recording(self, columns: Mapping[str, jax.Array]) -> list[dict[str, np.ndarray]]:
        """Columns of every recording, without padding."""
        found = jax.device_get(columns)
        return [
            {name: column[k][: len(rows.mask)] for name, column in found.items()}
            for k, rows in enumerate(self.rows)
        ]


def inflated(rows: Sequence[Rows], factor: float) -> list[Rows]:
    """The same recordings with noise `factor` times what is stated."""
    return [
        eqx.tree_at(lambda x: x.weight, r, {name: np.asarray(w) / factor for name, w in r.weight.items()})
        for r in rows
    ]


def fit_campaign(
    recordings: Sequence[Recording],
    rows: Sequence[Rows],
    parameters: Parameters,
    starts: int,
    seed: int,
    progress: Callable[[str], None],
    model: Model | None = None,
) -> GeneralFit:
    """Fit all free parameters to all recordings with `role = fit`.

    Args:
        recordings: recordings of one kind.
        rows: each as arrays.
        parameters: free numbers with priors; their values are the first start.
        starts: number of starts in all; all but the first are scattered over the priors.
        seed: seed of the scattered starts.
        progress: called with a word for each fit that begins.
        model: model that predicts; the base model of the kind by default.
    """
    recordings, rows, parameters = tuple(recordings), list(rows), parameters.copy()
    model = model or specimen_of(recordings[0].kind)
    progress("from all starts" if starts > 1 else "from the table's values")
    result = _fit(model, recordings, rows, parameters, starts, seed)
    further = (starts, seed, progress)
    ends = tuple(float(x) for x in result.start_chi_squares)
    more: tuple[float, ...] = ()
    undecided, first = rows, result
    rows, result = _decided(model, recordings, undecided, first)
    # the noise of drivers was taken over at these values; if they are wrong, so is that noise
    if has_misfit(result):
        other, more = _searched(model, recordings, undecided, first, *further)
        if other is not first:
            rows, result = _lower((rows, result), _decided(model, recordings, undecided, other))
    if has_misfit(result):
        begun = _begun_decided(model, recordings, undecided, parameters, progress)
        rows, result = _lower((rows, result), begun)
    if result.status is Status.STALLED:
        result, near = _searched(model, recordings, rows, result, *further)
        more += near
    return _settled(model, recordings, rows, result, ends + more, progress)


def fit_constrained(fit: GeneralFit, values: Mapping[str, float], held: Mapping[str, float]) -> FitResult:
    """The fit from other values on with some parameters held, noise and decisions as they were at it.

    Args:
        fit: any.
        values: values to start from, SI; missing ones start from the fit.
        held: parameters that are held, with their values, SI.
    """
    rows, known = inflated(fit.rows, fit.inflation), fit.result.parameters
    constraints = {name: (value, CONSTRAINT_SD * _size(known[name])) for name, value in held.items()}
    start = known.at({**values, **held})
    return _fit(fit.model, fit.recordings, rows, start, 1, 0, constraints, FEW_STEPS)


def chi_square_of(fit: GeneralFit) -> Callable[[Mapping[str, float]], float]:
    """Function that gives chi-square with priors at free parameters, SI; see `fit_constrained`."""
    stacked, known = stack(inflated(fit.rows, fit.inflation)), fit.result.parameters
    fitted = [k for k, recording in enumerate(fit.recordings) if recording.role == "fit"]
    predict, misfit = predictor_of(fit.model), misfit_of(fit.model)

    def chi_square(values: Mapping[str, float]) -> float:
        point = known.at(values).valuesdict()
        missed = np.asarray(misfit(predict(as_arrays(point), stacked), stacked))[fitted]
        priors = [(point[n] - p.prior.mean) / p.prior.sd for n, p in known.items() if p.prior is not None]
        return float(np.sum(missed**2) + np.sum(np.square(priors)))

    return chi_square


def _size(entry: Parameter) -> float:
    """Standard error of a parameter; a part of its prior's where it stopped at a bound and has none."""
    if entry.standard_error:
        return entry.standard_error
    return CONSTRAINT_SD * (entry.prior.sd if entry.prior is not None else abs(entry.value) or 1.0)


def continued_from(
    fit: GeneralFit, values: Mapping[str, float], progress: Callable[[str], None] = lambda _: None
) -> GeneralFit:
    """The fit from other values on, decided and with errors anew; the same fit where it ends no lower.

    Args:
        fit: any.
        values: values to start from, SI.
        progress: called with a word for each fit that begins.
    """
    progress("from the lowest place of a profile")
    rows = list(fit.rows)
    result = _fit(fit.model, fit.recordings, rows, fit.result.parameters.at(values), 1, 0)
    before = _fit(fit.model, fit.recordings, rows, fit.result.parameters.at(fit.result.values), 1, 0)
    ends = (*fit.starts, float(np.nan if result.chi_square is None else result.chi_square))
    if not (result.chi_square or np.inf) < (before.chi_square or np.inf) - ALIKE:
        return replace(fit, starts=ends)
    rows, result = _decided(fit.model, fit.recordings, rows, result)
    if fit.zeros:
        return replace(fit, rows=tuple(rows), result=result, starts=ends)
    return _settled(fit.model, fit.recordings, rows, result, ends, progress)


def beside_zeros(
    fit: GeneralFit, sizes: Mapping[str, Size], progress: Callable[[str], None] = lambda _: None
) -> GeneralFit:
    """The fit with noise that is correlated by zeros of these sizes; the same where they do not explain it.

    Args:
        fit: a fit with independent noise.
        sizes: sizes of the zeros by output.
        progress: called with a word when it begins.
    """
    progress("beside zeros of instruments")
    rows = [correlated(one, sizes) for one in fit.rows]
    begin = fit.result.parameters.at(fit.result.values)
    result = _fit(fit.model, fit.recordings, rows, begin, 1, 0)
    if has_misfit(result):
        return fit
    return replace(fit, rows=tuple(rows), result=result, inflation=1.0, zeros=dict(sizes))


def _settled(
    model: Model,
    recordings: tuple[Recording, ...],
    rows: Sequence[Rows],
    result: FitResult,
    ends: tuple[float, ...],
    progress: Callable[[str], None],
) -> GeneralFit:
    """A fit with errors that know about misfit and serial correlation.

    A noise that nobody states is told anew by what the fit leaves, and the fit is made with it.
    """
    reduced = float(result.reduced_chi_square or np.nan)
    fit = GeneralFit(recordings, tuple(rows), model, result, ends, reduced, 1.0, 1.0)
    told = with_noise_of_residuals(recordings, rows, fit.predict)
    if any(one is not other for one, other in zip(told, rows, strict=True)):
        progress("with the noise that residuals tell")
        result = _fit(model, recordings, told, result.parameters.at(result.values), 1, 0)
        reduced, rows = float(result.reduced_chi_square or np.nan), told
        fit = replace(
            fit, rows=tuple(rows), result=result, reduced_chi_square=reduced, noise_of_residuals=True
        )
    misfits = _misfits(fit)
    fit = replace(fit, correlation_time=correlation_time(misfits))
    factor = inflation_of(reduced, misfits)
    if factor > 1.0:
        progress("with the noise as found")
        begin = result.parameters.at(result.values)
        result = _fit(model, recordings, inflated(rows, factor), begin, 1, 0)
        fit = replace(fit, result=result, inflation=factor)
    return fit


def has_misfit(result: FitResult) -> bool:
    """True if the misfit is more than the noise that the fit was made with."""
    return (result.reduced_chi_square or np.inf) > MISFIT


def _searched(
    model: Model,
    recordings: tuple[Recording, ...],
    rows: list[Rows],
    result: FitResult,
    starts: int,
    seed: int,
    progress: Callable[[str], None],
) -> tuple[FitResult, tuple[float, ...]]:
    """The best minimum after further starts, and where those ended.

    While the misfit is more than noise, starts are scattered over the priors. If the best fit stopped at a
    kink of the law's memory, they are scattered about that fit. Every draw has as many starts as the first
    fit, so that nothing compiles anew. One of them is the best so far.
    """
    ends: list[float] = []
    for draw in range(1, DRAWS + 1):
        misfits = has_misfit(result)
        if starts < 2 or not (misfits or result.status is Status.STALLED):
            break
        progress("from further starts")
        begin = result.parameters.at(result.values)
        fresh = starts if misfits else _about(result, starts - 1, seed + draw)
        other = _fit(model, recordings, rows, begin, fresh, seed + draw)
        ends += [float(x) for x in other.start_chi_squares[1:]]
        if (other.chi_square or np.inf) < (result.chi_square or np.inf):
            result = other
    return result, tuple(ends)


def _about(result: FitResult, count: int, seed: int) -> list[dict[str, float]]:
    """Starts near a fit, scattered by a part of what is known of each parameter."""
    random = np.random.default_rng(seed)
    spread = {
        name: NEAR * p.prior.sd for name, p in result.parameters.items() if p.free and p.prior is not None
    }
    return [
        {
            name: float(np.clip(p.value + spread[name] * random.standard_normal(), p.min, p.max))
            for name, p in result.parameters.items()
            if name in spread
        }
        for _ in range(count)
    ]


def _decided(
    model: Model, recordings: tuple[Recording, ...], rows: list[Rows], result: FitResult
) -> tuple[list[Rows], FitResult]:
    """Rounds of deciding what depends on the parameters without being smooth in them, and fitting again."""
    if not model.decides(rows):
        return rows, result
    for _ in range(ROUNDS):
        rows = model.decided(result.values, rows)
        before, result = result, _fit(model, recordings, rows, result.parameters.at(result.values), 1, 0)
        if before.chi_square is None or abs((result.chi_square or 0.0) - before.chi_square) < SAME:
            break
    return rows, result


def _begun_decided(
    model: Model,
    recordings: tuple[Recording, ...],
    undecided: list[Rows],
    parameters: Parameters,
    progress: Callable[[str], None],
) -> tuple[list[Rows], FitResult] | None:
    """A fit of rows that were decided at the start; None where there is nothing to decide.

    A known model is right there. Undecided rows may be of other phases than the model's, as those read from a
    resistance without its leads. A fit to them may end where no later decision leads back.
    """
    if not model.decides(undecided):
        return None
    progress("from rows that are decided at the start")
    rows = model.decided(parameters.valuesdict(), undecided)
    return _decided(model, recordings, rows, _fit(model, recordings, rows, parameters, 1, 0))


def _lower(
    found: tuple[list[Rows], FitResult], other: tuple[list[Rows], FitResult] | None
) -> tuple[list[Rows], FitResult]:
    """The one of two fits with its rows whose chi-square is lower; the first of two alike."""
    if other is None:
        return found
    return other if (other[1].chi_square or np.inf) < (found[1].chi_square or np.inf) else found


def _fit(
    model: Model,
    recordings: tuple[Recording, ...],
    rows: Sequence[Rows],
    parameters: Parameters,
    starts: int | Sequence[Mapping[str, float]],
    seed: int,
    held: Mapping[str, tuple[float, float]] | None = None,
    most: int = MAX_STEPS,
) -> FitResult:
    pairs = zip(recordings, rows, strict=True)
    used = [one for recording, one in pairs if recording.role == "fit"]  # others would cost as much a step
    return fit_least_squares(
        constrained_residual_of(model),
        parameters,
        data={"rows": stack(used), "constraints": constraint_table(parameters, held)},
        use_priors=True,
        observations=lambda values: model.observations(values, used),
        rtol=RTOL,
        max_steps=most,
        starts=None if starts == 1 else starts,
        seed=seed,
        in_turn=True,
    )


def _misfits(fit: GeneralFit) -> list[np.ndarray]:
    """Misfit over its noise of every output of every fitted recording, in the order of sampling."""
    series = []
    for recording, rows, found in zip(fit.recordings, fit.rows, fit.predict(), strict=True):
        for name, weight in rows.weight.items():
            held = (np.asarray(weight) > 0.0) & np.isfinite(found[name])
            if recording.role == "fit" and held.sum() > 2:
                series.append((weight * (found[name] - rows.measured[name]))[held])
    return series
