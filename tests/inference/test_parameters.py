"""Parameters: what they refuse, how they tie, and the vectors they become."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.inference.parameters import Parameter, Parameters, Prior, format_estimate
from fitting.inference.parameters.transforms import to_bounded, to_unconstrained
from pneusma_jax.errors import InputError


def small_set():
    return Parameters(
        Parameter("mu", 0.085, min=0.0, unit="MPa"),
        Parameter("alpha", 2.0, vary=False),
        Parameter("c_10", tie="mu/2", unit="MPa"),
        Parameter("stiffness", 3.0e9, min=1e8, max=1e11, scale="log", unit="Pa"),
        Parameter("both", tie="c_10 + sqrt(alpha)*stiffness"),
    )


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (dict(value=2.0, max=1.0), r"value 2 lies outside its bounds \[-inf, 1\]"),
        (dict(value=1.0, min=1.0, max=1.0), "min 1 must be below max 1"),
        (dict(value=1.0, min=3.0, max=2.0), "min 3 must be below max 2"),
        (dict(value=float("nan")), "must be a number, not NaN"),
        (dict(value=1.0, min=float("nan")), "min must be a number, not NaN"),
        (dict(value=float("inf")), "must be a finite number"),
        (dict(value=None), "must be a finite number, not None"),
        (dict(value="two"), "must be a number, not 'two'"),
        (dict(value=-1.0, scale="log"), "must be positive"),
        (dict(value=1.0, scale="cubic"), "'linear' or 'log'"),
        (dict(value=1.0, prior=Prior(1.0, 0.0)), "sd > 0"),
        (dict(value=2.0, prior=Prior(1.0, 0.1, 0.6, 1.4)), r"outside its bounds \[0.6, 1.4\]"),
        (dict(tie="2*"), "not an expression"),
        (dict(tie="y = 3"), "not an expression"),
        (dict(tie="[1, 2]"), "may only hold numbers"),
        (dict(tie="mu.real"), "may only hold numbers"),
        (dict(tie="sqr(mu)"), "did you mean 'sqrt'"),
        (dict(tie="sqrt + 1"), r"write sqrt\(...\)"),
    ],
)
def test_unusable_parameters_are_refused_in_one_line(fields, message):
    with pytest.raises(InputError, match=message) as caught:
        Parameter("x", **fields)
    assert "\n" not in str(caught.value) and "'x'" in str(caught.value)


@pytest.mark.parametrize("name", ["2a", "a b", "lambda", "exp", "pi", ""])
def test_names_are_identifiers_that_ties_can_use(name):
    with pytest.raises(InputError, match="name must be a Python identifier"):
        Parameter(name, 1.0)


def test_setting_checks_and_leaves_nothing_half_changed():
    parameter = Parameter("x", 1.0, min=0.0, max=2.0)
    with pytest.raises(InputError, match="outside its bounds"):
        parameter.value = 3.0
    with pytest.raises(InputError, match="must be below"):
        parameter.set(value=0.5, min=5.0)
    with pytest.raises(InputError, match="did you mean 'value'"):
        parameter.set(valeu=0.5)
    assert (parameter.value, parameter.min, parameter.max) == (1.0, 0.0, 2.0)
    parameter.set(value=5.0, min=4.0, max=6.0)
    assert (parameter.value, parameter.min, parameter.max) == (5.0, 4.0, 6.0)


def test_a_copy_at_other_values_stays_within_bounds_and_leaves_the_first_alone():
    first = Parameters(Parameter("a", 1.0, min=0.0, max=2.0), Parameter("b", 3.0))
    moved = first.at({"a": 5.0})
    assert (moved["a"].value, moved["b"].value, first["a"].value) == (2.0, 3.0, 1.0)
    with pytest.raises(InputError, match="no parameter 'c'"):
        first.at({"c": 1.0})


def test_a_prior_gives_the_bounds_that_are_not_stated():
    cut = Prior(1.0, 0.1, 0.6, 1.4)
    assert (Parameter("x", 1.0, prior=cut).min, Parameter("x", 1.0, prior=cut).max) == (0.6, 1.4)
    assert Parameter("x", 1.0, prior=cut, min=0.9).min == 0.9


def test_behaves_as_an_ordered_mapping():
    parameters = small_set()
    assert list(parameters) == ["mu", "alpha", "c_10", "stiffness", "both"]
    assert len(parameters) == 5 and "mu" in parameters and "nu" not in parameters
    assert parameters.get("nu") is None and parameters.get("mu").value == 0.085
    with pytest.raises(InputError, match="did you mean 'stiffness'"):
        parameters["stifness"]
    with pytest.raises(InputError, match="'mu' is defined twice"):
        parameters.add("mu", 1.0)
    assert parameters.add("extra", 1.0, min=0.0).min == 0.0


def test_copy_and_update_are_independent():
    parameters = small_set()
    other = parameters.copy()
    other["mu"].value = 0.2
    other.add("new", 5.0)
    assert parameters["mu"].value == 0.085 and "new" not in parameters
    parameters.update(other)
    assert list(parameters)[0] == "mu" and parameters["mu"].value == 0.2 and parameters["new"].value == 5.0
    other["mu"].value = 0.3
    assert parameters["mu"].value == 0.2


def test_ties_follow_what_they_depend_on():
    parameters = small_set()
    parameters["mu"].value = 0.1
    assert parameters["c_10"].value == 0.05
    assert parameters.valuesdict()["both"] == 0.05 + np.sqrt(2.0) * 3e9


@pytest.mark.parametrize(
    ("ties", "message"),
    [
        (dict(b="2*muu"), "'b': tie '2\\*muu' names 'muu', which is no parameter; did you mean 'mu'"),
        (dict(b="c", c="b + mu"), r"run in a circle \(b -> c -> b\)"),
        (dict(b="b"), r"run in a circle \(b -> b\)"),
        (dict(b="1/(mu - 1)"), "cannot be evaluated: ZeroDivisionError"),
        (dict(b="log(mu - 2)"), "gives nan, which is not a finite number"),
    ],
)
def test_ties_that_cannot_work(ties, message):
    parameters = Parameters(Parameter("mu", 1.0), *(Parameter(name, tie=tie) for name, tie in ties.items()))
    with pytest.raises(InputError, match=message):
        parameters.valuesdict()


def test_vectors_round_trip_and_compile():
    parameters = small_set()
    vector = parameters.pack()
    assert vector.shape == (2,)
    values = jax.jit(parameters.unpack)(vector)
    for name, number in parameters.valuesdict().items():
        assert float(values[name]) == pytest.approx(number, rel=1e-14)
    lower, upper = parameters.box()
    np.testing.assert_allclose(lower, [0.0, np.log(1e8)])
    np.testing.assert_allclose(upper, [np.inf, np.log(1e11)])


def test_ties_differentiate_through_the_vector():
    slopes = jax.jit(jax.jacfwd(small_set().unpack))(small_set().pack())
    np.testing.assert_allclose(slopes["c_10"], [0.5, 0.0])
    np.testing.assert_allclose(slopes["both"], [0.5, np.sqrt(2.0) * 3e9])
    np.testing.assert_allclose(slopes["alpha"], [0.0, 0.0])


def test_unconstrained_coordinates_stay_inside_with_a_slope():
    parameters = Parameters(
        Parameter("low", 2.0, min=1.0),
        Parameter("high", -5.0, max=1e3),
        Parameter("both", 0.3, min=0.0, max=1.0),
        Parameter("decades", 2e9, min=1e8, max=1e10, scale="log"),
        Parameter("none", 7.0),
    )
    start = parameters.pack(unconstrained=True)
    values = parameters.unpack(start, unconstrained=True)
    for name, number in parameters.valuesdict().items():
        assert float(values[name]) == pytest.approx(number, rel=1e-9)
    for far in (-30.0, 30.0):
        point = parameters.unpack(jnp.full(5, far), unconstrained=True)
        for name, parameter in parameters.items():
            assert parameter.min <= float(point[name]) <= parameter.max
        slopes = jax.jacfwd(lambda u: parameters.unpack(u, unconstrained=True))(jnp.full(5, far))
        for i, name in enumerate(parameters):
            assert np.isfinite(slopes[name][i]) and slopes[name][i] > 0


def test_a_point_on_a_bound_has_a_finite_coordinate():
    lower, upper, scale = jnp.array([0.0, 1.0]), jnp.array([1.0, jnp.inf]), jnp.ones(2)
    coordinate = jax.jit(to_unconstrained)(jnp.array([0.0, 1.0]), lower, upper, scale)
    assert np.all(np.isfinite(coordinate))
    np.testing.assert_allclose(jax.jit(to_bounded)(coordinate, lower, upper, scale), [0.0, 1.0], atol=2e-9)
    gradient = jax.jit(jax.jacfwd(to_unconstrained))(jnp.array([0.5, 2.0]), lower, upper, scale)
    assert np.all(np.isfinite(gradient))


@pytest.mark.parametrize(
    ("value", "at_bound"), [(0.0, True), (1.0, True), (1e-12, True), (1e-6, False), (0.5, False)]
)
def test_at_bound(value, at_bound):
    assert Parameter("x", value, min=0.0, max=1.0).at_bound is at_bound


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.08853, 0.0012, "0.0885 +/- 0.0012"),
        (-1.5, 0.25, "-1.50 +/- 0.25"),
        (1288.1397, 4.66, "1288.1 +/- 4.7"),
        (3.0123e9, 2.1e7, "(3.012 +/- 0.021)e+09"),
        (5.6e-9, 6.1e-9, "(5.6 +/- 6.1)e-09"),
        (120.0, 4000.0, "120 +/- 4000"),
        (2.0, None, "2"),
        (2.5, 0.0, "2.5"),
    ],
)
def test_estimates_show_two_digits_of_the_error(value, error, text):
    assert format_estimate(value, error) == text


def test_the_table_says_what_is_what():
    parameters = small_set()
    parameters["mu"].set(standard_error=0.0012, initial_value=0.05, correlations={"stiffness": -0.98})
    parameters["stiffness"].set(value=1e11, initial_value=2e9, correlations={"mu": -0.98})
    lines = {line.split()[0]: line for line in str(parameters).splitlines() if line}
    assert "0.0850 +/- 0.0012" in lines["mu"] and "1.4 %" in lines["mu"] and "MPa" in lines["mu"]
    assert "0.05" in lines["mu"] and "[0, inf]" in lines["mu"]
    assert "fixed" in lines["alpha"] and "= mu/2" in lines["c_10"]
    assert "AT BOUND" in lines["stiffness"] and "standard error not determined" in lines["stiffness"]
    assert "mu, stiffness  -0.980" in str(parameters)
    assert "mu, stiffness" not in parameters.table(correlations_above=0.99)


def test_without_a_prior_a_parameter_spreads_over_its_bounds():
    assert Parameter("x", 1.0, prior=Prior(1.0, 0.2)).prior_sd == 0.2
    assert Parameter("x", 1.0, 0.0, 6.0).prior_sd == pytest.approx(np.std(np.linspace(0.0, 6.0, 100001)), rel=1e-4)
    assert Parameter("x", 1.0).prior_sd == np.inf
