"""The fit against SciPy and against answers known by construction, and its honesty where it cannot answer."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize

from fitting.inference.least_squares import Box, FitError, Status, fit_least_squares, solve
from fitting.inference.least_squares.covariance import propagate
from fitting.inference.parameters import Parameter, Parameters, Prior
from pneusma_jax.errors import InputError

X = np.linspace(0.0, 4.0, 60)
NOISE = np.random.default_rng(7).normal(size=X.size)
DECAY = 2.5 * np.exp(-1.3 * X) + 0.5 + 0.02 * NOISE


def decay(values, data):
    x, y = data
    return values["amplitude"] * jnp.exp(-values["rate"] * x) + values["offset"] - y


def decay_parameters(start=1.0, **rate):
    return Parameters(Parameter("amplitude", 1.0), Parameter("rate", start, **rate), Parameter("offset", 0.0))


def decay_function(x, amplitude, rate, offset):
    return amplitude * np.exp(-rate * x) + offset


def line(values, data):
    x, y = data
    return values["slope"] * x + values["intercept"] - y


def vector(result, names):
    return [result.values[name] for name in names], [result.standard_errors[name] for name in names]


NAMES = ("amplitude", "rate", "offset")


def test_agrees_with_curve_fit():
    result = fit_least_squares(decay, decay_parameters(), data=(X, DECAY))
    expected, covariance = scipy.optimize.curve_fit(
        decay_function, X, DECAY, p0=[1, 1, 0], ftol=1e-14, xtol=1e-14, gtol=1e-14
    )
    values, errors = vector(result, NAMES)
    np.testing.assert_allclose(values, expected, rtol=1e-7)
    np.testing.assert_allclose(errors, np.sqrt(np.diag(covariance)), rtol=1e-5)
    np.testing.assert_allclose(result.uncertainty.covariance, covariance, rtol=1e-4)
    assert result.status is Status.CONVERGED and result.degrees_of_freedom == 57
    correlation = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert result.parameters["amplitude"].correlations["rate"] == pytest.approx(correlation, rel=1e-4)


def test_absolute_sigma():
    sigma = 0.02
    result = fit_least_squares(
        lambda values, data: decay(values, data) / sigma,
        decay_parameters(),
        data=(X, DECAY),
        scale_covariance=False,
    )
    _, covariance = scipy.optimize.curve_fit(
        decay_function, X, DECAY, p0=[1, 1, 0], sigma=np.full(X.size, sigma), absolute_sigma=True
    )
    np.testing.assert_allclose(vector(result, NAMES)[1], np.sqrt(np.diag(covariance)), rtol=1e-5)
    assert result.chi_square == pytest.approx(57, rel=0.5)
    assert result.aic == pytest.approx(result.chi_square + 6)
    assert result.bic == pytest.approx(result.chi_square + 3 * np.log(60))


def test_information_criteria_of_an_estimated_sigma_are_lmfits():
    result = fit_least_squares(decay, decay_parameters(), data=(X, DECAY))
    deviance = 60 * np.log(result.chi_square / 60)
    assert result.aic == pytest.approx(deviance + 6)
    assert result.bic == pytest.approx(deviance + 3 * np.log(60))


@pytest.mark.parametrize("start", [0.2, 0.9, 0.5])
def test_a_bound_is_reached_exactly_and_the_others_are_right(start):
    result = fit_least_squares(decay, decay_parameters(start, min=0.2, max=0.9), data=(X, DECAY))
    expected = scipy.optimize.least_squares(
        lambda p: decay_function(X, *p) - DECAY,
        [1, 0.5, 0],
        bounds=([-9, 0.2, -9], [9, 0.9, 9]),
        xtol=1e-14,
        ftol=1e-14,
    )
    assert result.values["rate"] == 0.9 and result.parameters["rate"].at_bound
    assert not result.parameters["amplitude"].at_bound
    assert result.chi_square == pytest.approx(2 * expected.cost, rel=1e-7)
    # The others' errors are those of a fit with the rate held there; only the degrees of freedom differ by one.
    _, covariance = scipy.optimize.curve_fit(
        lambda x, amplitude, offset: decay_function(x, amplitude, 0.9, offset), X, DECAY, p0=[1, 0]
    )
    errors = np.sqrt(np.diag(covariance) * 58 / 57)
    np.testing.assert_allclose(vector(result, ("amplitude", "offset"))[1], errors, rtol=1e-5)
    assert result.standard_errors["rate"] is None
    assert any("rate is at its bound 0.9" in note for note in result.notes) and "AT BOUND" in result.report()


@pytest.mark.parametrize("start", [0.2, 9.0])
def test_a_fit_leaves_the_bound_it_starts_on(start):
    result = fit_least_squares(decay, decay_parameters(start, min=0.2, max=9.0), data=(X, DECAY))
    free = fit_least_squares(decay, decay_parameters(), data=(X, DECAY))
    np.testing.assert_allclose(vector(result, NAMES)[0], vector(free, NAMES)[0], rtol=1e-7)
    np.testing.assert_allclose(vector(result, NAMES)[1], vector(free, NAMES)[1], rtol=1e-6)


def test_many_bounds_at_once_against_scipy():
    """Linear problems with scales over six decades: the box's optimality conditions, and SciPy's minimum."""
    random = np.random.default_rng(3)
    run = jax.jit(
        lambda start, lower, upper, args: solve(
            lambda p, a: a[0] @ p - a[1], start, args, box=Box(lower, upper), max_steps=200
        )
    )
    touched = 0
    for _ in range(20):
        matrix = random.normal(size=(20, 6)) * 10.0 ** random.uniform(-3, 3, 6)
        unit = 1 / np.linalg.norm(matrix, axis=0)
        target = matrix @ (random.normal(size=6) * unit) + 0.5 * random.normal(size=20)
        lower, upper = -random.uniform(0, 1, 6) * unit, random.uniform(0, 1, 6) * unit
        outcome = run(random.uniform(lower, upper), lower, upper, (matrix, target))
        expected = scipy.optimize.lsq_linear(matrix, target, (lower, upper), method="bvls", tol=1e-14)
        assert bool(outcome.converged)
        assert float(outcome.chi_square) == pytest.approx(2 * expected.cost, rel=1e-9)
        assert np.all((outcome.vector >= lower) & (outcome.vector <= upper))
        touched += int(np.sum((outcome.vector == lower) | (outcome.vector == upper)))
    assert touched > 20


def test_a_tied_fit_is_the_same_fit_with_fewer_parameters():
    """`offset` tied to `amplitude/5`: SciPy fits the reduced model, and the delta method is exact for a factor."""
    parameters = Parameters(
        Parameter("offset", tie="amplitude/5"), Parameter("amplitude", 1.0), Parameter("rate", 1.0)
    )
    result = fit_least_squares(decay, parameters, data=(X, DECAY))
    expected, covariance = scipy.optimize.curve_fit(
        lambda x, amplitude, rate: decay_function(x, amplitude, rate, amplitude / 5),
        X, DECAY, p0=[1, 1], ftol=1e-14, xtol=1e-14, gtol=1e-14,
    )  # fmt: skip
    values, errors = vector(result, ("amplitude", "rate"))
    np.testing.assert_allclose(values, expected, rtol=1e-7)
    np.testing.assert_allclose(errors, np.sqrt(np.diag(covariance)), rtol=1e-5)
    assert result.values["offset"] == pytest.approx(expected[0] / 5, rel=1e-7)
    assert result.standard_errors["offset"] == pytest.approx(errors[0] / 5, rel=1e-9)


def test_delta_method_of_a_nonlinear_tie_uses_correlations():
    parameters = decay_parameters()
    parameters.add("initial_slope", tie="-amplitude*rate")
    result = fit_least_squares(decay, parameters, data=(X, DECAY))
    gradient = np.array([-result.values["rate"], -result.values["amplitude"], 0.0])
    expected = np.sqrt(gradient @ result.uncertainty.covariance @ gradient)
    assert result.standard_errors["initial_slope"] == pytest.approx(expected, rel=1e-9)


def test_the_logarithm_changes_nothing_but_the_coordinates():
    plain = fit_least_squares(decay, decay_parameters(), data=(X, DECAY))
    scaled = fit_least_squares(decay, decay_parameters(scale="log"), data=(X, DECAY))
    np.testing.assert_allclose(vector(scaled, NAMES), vector(plain, NAMES), rtol=1e-6)


def test_fixed_parameters_stay_and_have_no_error():
    parameters = decay_parameters(vary=False)
    result = fit_least_squares(decay, parameters, data=(X, DECAY))
    assert result.values["rate"] == 1.0 and result.standard_errors["rate"] is None
    assert "fixed" in result.report() and parameters["amplitude"].value == 1.0


def test_a_direction_the_data_do_not_see_is_named():
    def sum_only(values, data):
        return line({"slope": values["a"] + values["b"], "intercept": values["intercept"]}, data)

    y = 3 * X + 1 + 0.1 * NOISE
    parameters = Parameters(
        Parameter("a", 1.0), Parameter("b", 1.0), Parameter("intercept", 0.0), Parameter("total", tie="a + b")
    )
    result = fit_least_squares(sum_only, parameters, data=(X, y))
    expected, covariance = np.polyfit(X, y, 1, cov=True)
    assert result.success
    assert result.standard_errors["a"] is None and result.standard_errors["b"] is None
    assert any("do not determine one combination of a, b" in note for note in result.notes)
    # What the data do determine keeps its value and error.
    assert result.values["total"] == pytest.approx(expected[0], rel=1e-9)
    freedom = 58 / 57
    assert result.standard_errors["total"] == pytest.approx(np.sqrt(covariance[0, 0] * freedom), rel=1e-6)
    assert result.standard_errors["intercept"] == pytest.approx(np.sqrt(covariance[1, 1] * freedom), rel=1e-6)


def test_a_parameter_without_effect_is_named():
    result = fit_least_squares(
        line,
        Parameters(Parameter("slope", 1.0), Parameter("intercept", 0.0), Parameter("idle", 4.0)),
        data=(X, X),
    )
    assert result.values["idle"] == 4.0 and result.standard_errors["idle"] is None
    assert any("does not depend on idle" in note for note in result.notes)


def test_priors_are_residuals():
    """A Gaussian prior on the slope of a line: the posterior is known in closed form."""
    sigma, prior = 0.5, Prior(2.0, 0.05)
    y = 3 * X + 1 + sigma * NOISE
    design = np.stack([X, np.ones_like(X)], axis=1)
    precision = design.T @ design / sigma**2 + np.diag([1 / prior.sd**2, 0])
    expected = np.linalg.solve(precision, design.T @ y / sigma**2 + [prior.mean / prior.sd**2, 0])

    def weighted(values, data):
        return line(values, data) / sigma

    parameters = Parameters(Parameter("slope", 1.0, prior=prior), Parameter("intercept", 0.0))
    result = fit_least_squares(weighted, parameters, data=(X, y), use_priors=True)
    np.testing.assert_allclose(vector(result, ("slope", "intercept"))[0], expected, rtol=1e-9)
    np.testing.assert_allclose(result.uncertainty.covariance, np.linalg.inv(precision), rtol=1e-9)
    assert (
        result.observations == 61 and result.prior_residual.shape == (1,) and result.residual.shape == (60,)
    )
    with pytest.raises(ValueError, match="`scale_covariance` must be False"):
        fit_least_squares(weighted, parameters, data=(X, y), use_priors=True, scale_covariance=True)


@pytest.mark.slow
def test_coverage_of_standard_errors():
    """1000 noisy lines: two standard errors of Student's t with 8 degrees of freedom hold 95 % of the truth."""
    x = np.linspace(-1, 1, 10)
    random = np.random.default_rng(11)
    ys = 2.0 * x + 0.5 + 0.3 * random.normal(size=(1000, 10))
    outcomes = jax.jit(jax.vmap(lambda y: solve(lambda p, y: p[0] * x + p[1] - y, jnp.zeros(2), y)))(ys)
    assert np.all(outcomes.converged | outcomes.precise)
    layout = Parameters(Parameter("slope", 0.0), Parameter("intercept", 0.0)).layout()
    limit = 2.306  # 97.5 % quantile of Student's t with 8 degrees of freedom
    hits = np.zeros(2)
    for i in range(1000):
        variance = float(outcomes.chi_square[i]) / 8
        found = propagate(np.asarray(outcomes.triangle[i]), np.eye(2), layout, (), variance)
        errors = np.array([found.standard_errors["slope"], found.standard_errors["intercept"]])
        hits += np.abs(np.asarray(outcomes.vector[i]) - [2.0, 0.5]) < limit * errors
    # Binomial(1000, 0.95) has a standard deviation of 0.7 %.
    assert np.all(np.abs(hits / 1000 - 0.95) < 0.021)


def test_perfect_data_are_recovered_to_rounding():
    exact = decay_function(X, 2.5, 1.3, 0.5)
    result = fit_least_squares(decay, decay_parameters(), data=(X, exact))
    np.testing.assert_allclose(vector(result, NAMES)[0], [2.5, 1.3, 0.5], rtol=1e-12)
    assert result.success and all(error < 1e-12 for error in result.standard_errors.values())


def test_several_starts_find_the_deeper_minimum():
    def wave(values, data):
        return jnp.sin(values["frequency"] * data[0]) - data[1]

    y = np.sin(3.1 * X)
    parameters = Parameters(Parameter("frequency", 0.5, min=0.1, max=8.0))
    assert fit_least_squares(wave, parameters, data=(X, y)).chi_square > 1
    result = fit_least_squares(wave, parameters, data=(X, y), starts=20, seed=1)
    assert result.values["frequency"] == pytest.approx(3.1, rel=1e-9)
    assert result.start_chi_squares.shape == (20,) and any("of 20 starts" in note for note in result.notes)
    given = fit_least_squares(wave, parameters, data=(X, y), starts=[{"frequency": 3.0}])
    assert given.values["frequency"] == pytest.approx(3.1, rel=1e-9)
    assert given.parameters["frequency"].initial_value == 3.0


@pytest.mark.parametrize(
    ("starts", "message"),
    [
        ([{"rate": 20.0}], "outside its bounds"),
        ([{"rat": 1.0}], "did you mean 'rate'"),
        (0, "must be at least 1"),
        (3, "'amplitude' needs both bounds or a prior"),
    ],
)
def test_unusable_starts(starts, message):
    with pytest.raises(InputError, match=message):
        fit_least_squares(decay, decay_parameters(min=0.1, max=10.0), data=(X, DECAY), starts=starts)


def test_running_out_of_steps_is_said():
    result = fit_least_squares(decay, decay_parameters(), data=(X, DECAY), max_steps=3)
    assert result.status is Status.MAX_STEPS and not result.success
    assert all(error is None for error in result.standard_errors.values())
    assert "used all its steps" in result.report()
    with pytest.raises(FitError, match="used all its steps") as caught:
        fit_least_squares(decay, decay_parameters(), data=(X, DECAY), max_steps=3, throw=True)
    assert caught.value.result.status is Status.MAX_STEPS


def kinked(values, slope):
    return jnp.stack([
        1.0 + slope * jnp.abs(values["x"] - values["y"] ** 2 / 4),
        0.1 * (values["x"] + values["y"]) - 1.0,
        jnp.asarray(1.0),
    ])  # fmt: skip


def test_a_fit_that_creeps_along_a_kink_ends_where_it_falls_by_too_little():
    """Without `least` it refuses forty ever shorter steps before it gives up, for a gain below 1e-5."""
    parameters = Parameters()
    parameters.add("x", 9.0, min=-20.0, max=20.0)
    parameters.add("y", 5.0, min=-20.0, max=20.0)
    options = {"data": jnp.asarray(3.0), "scale_covariance": False, "max_steps": 500}
    patient = fit_least_squares(kinked, parameters, **options)
    early = fit_least_squares(kinked, parameters, least=0.01, **options)
    assert patient.status is Status.STALLED and early.status is Status.LINGERING and not early.success
    assert early.steps < patient.steps / 2
    assert patient.chi_square <= early.chi_square < patient.chi_square + 0.01
    assert "lowered chi-square by less than was asked for" in early.report()


def test_a_fit_that_converges_is_the_same_with_a_least_fall():
    plain = fit_least_squares(decay, decay_parameters(), data=(X, DECAY))
    asked = fit_least_squares(decay, decay_parameters(), data=(X, DECAY), least=1e-3)
    assert asked.status is plain.status and asked.values == plain.values and asked.steps == plain.steps


def test_a_residual_that_is_not_finite_is_said():
    y = DECAY.copy()
    y[4] = np.nan
    result = fit_least_squares(decay, decay_parameters(), data=(X, y))
    assert result.status is Status.NON_FINITE and result.values["rate"] == 1.0
    assert result.chi_square is None and result.aic is None and result.reduced_chi_square is None
    assert "1 of 60 residuals are not finite, the first in row 4" in result.report()


def test_steps_into_the_undefined_are_taken_back():
    """The full step from 3 leads to a negative argument of the logarithm."""

    def logarithm(values, data):
        return jnp.log(values["x"]) - data

    result = fit_least_squares(
        logarithm, Parameters(Parameter("x", 3.0)), data=np.array([-2.0, -2.1]), scale_covariance=False
    )
    assert result.success and result.values["x"] == pytest.approx(np.exp(-2.05), rel=1e-7)


def test_a_kink_is_reported_as_such():
    def kink(values, data):
        return jnp.stack([jnp.abs(values["x"] - 1.0) + 1.0, 0.1 * values["x"]])

    result = fit_least_squares(kink, Parameters(Parameter("x", 3.0)))
    assert result.status is Status.STALLED and result.values["x"] == pytest.approx(1.0, abs=1e-6)
    assert result.standard_errors["x"] is None


def test_no_degrees_of_freedom_is_said():
    data = (np.array([0.0, 1.0]), np.array([1.0, 3.0]))
    parameters = Parameters(Parameter("slope", 1.0), Parameter("intercept", 0.0))
    result = fit_least_squares(line, parameters, data=data)
    assert result.status is Status.NO_DEGREES_OF_FREEDOM and result.reduced_chi_square is None
    assert result.standard_errors["slope"] is None
    # With a known sigma, two points and two parameters are a fit.
    known = fit_least_squares(line, parameters, data=data, scale_covariance=False)
    assert known.success and known.standard_errors["slope"] == pytest.approx(np.sqrt(2), rel=1e-9)
    assert known.values["slope"] == pytest.approx(2.0, rel=1e-12)


def test_nothing_free_and_nothing_measured_are_refused():
    with pytest.raises(InputError, match="no parameter is free"):
        fit_least_squares(line, Parameters(Parameter("slope", 1.0, vary=False)), data=(X, X))
    with pytest.raises(InputError, match="no data to fit"):
        fit_least_squares(decay, decay_parameters(), data=(X[:0], X[:0]))


def test_padding_does_not_count():
    padded = (np.concatenate([X, np.zeros(20)]), np.concatenate([DECAY, np.zeros(20)]), np.arange(80) < 60)

    def masked(values, data):
        return jnp.where(data[2], decay(values, data[:2]), 0.0)

    plain = fit_least_squares(decay, decay_parameters(), data=(X, DECAY))
    result = fit_least_squares(masked, decay_parameters(), data=padded, observations=60)
    assert result.degrees_of_freedom == 57
    np.testing.assert_allclose(vector(result, NAMES), vector(plain, NAMES), rtol=1e-7)


def test_compiles_once_per_shape():
    traced = []

    def counted(values, data):
        traced.append(1)
        return decay(values, data[:2]) / data[2]

    fit_least_squares(counted, decay_parameters(min=0.1, max=9.0), data=(X, DECAY, 1.0))
    first = len(traced)
    parameters = Parameters(
        Parameter("amplitude", 2.0), Parameter("rate", 2.0, min=0.5, max=7.0), Parameter("offset", 1.0)
    )
    fit_least_squares(counted, parameters, data=(X, DECAY + 1, 2.0))
    assert len(traced) == first


def test_the_solution_differentiates_through_the_implicit_function_theorem():
    def slope_of(y):
        return solve(lambda p, y: p[0] * X + p[1] - y, jnp.zeros(2), y).vector[0]

    weights = (X - X.mean()) / np.sum((X - X.mean()) ** 2)
    np.testing.assert_allclose(jax.grad(slope_of)(jnp.asarray(DECAY)), weights, rtol=1e-6, atol=1e-12)


def test_units_of_the_parameters_change_nothing():
    """Column scaling: the same steps in kilo and in micro, up to rounding."""
    factors = np.array([1e6, 1e-3, 1e-9])

    def model(p, units):
        return decay(dict(zip(NAMES, p * units, strict=True)), (X, DECAY))

    start = np.array([1.0, 1.0, 0.1])
    plain = solve(model, jnp.asarray(start), jnp.ones(3))
    scaled = solve(model, jnp.asarray(start / factors), jnp.asarray(factors))
    assert int(plain.steps) == int(scaled.steps) < 20
    np.testing.assert_allclose(scaled.vector * factors, plain.vector, rtol=1e-9)
