"""Profiles of wires, tubes and actuators: parabolas where recordings cover a curve, a warning where they do not."""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.general import profiles as profiling
from fitting.calibrate.general.fit import continued_from, fit_campaign
from fitting.calibrate.profile_likelihood import WIDTH_90
from fitting.inference.parameters import Parameters, Prior
from fitting.specimens import Model, Rows
from pneusma_jax.errors import InputError

TIME = np.linspace(0.0, 1.0, 40)
SIGMA = 0.05


class Curve(Model):
    """A model of one output over time with parameters a and b; counts how often it is traced."""

    def __init__(self, law):
        self.law, self.traced = law, 0
        self.kind, self.outputs = "curve", ("y",)

    specimen = None

    def rows_for(self, campaign, **tables):
        return []

    def parameters_for(self, campaign, **tables):
        return Parameters()

    def predict(self, values, rows):
        return {"y": self.law(values["a"], values["b"], rows.time)}

    def residual(self, values, rows):
        self.traced += 1
        return rows.weight["y"] * (self.predict(values, rows)["y"] - rows.measured["y"])


@pytest.fixture
def fitted():
    """A fit of a law to what it gives at a = 1 and b = 0.5 with noise, begun elsewhere."""

    def of(law, a=1.2, b=0.4, truth=(1.0, 0.5)):
        model = Curve(law)
        noise = SIGMA * np.random.default_rng(0).standard_normal(len(TIME))
        rows = Rows(
            mask=np.ones(len(TIME), bool), time=TIME, inputs={}, measured={"y": np.asarray(law(*truth, TIME)) + noise},
            weight={"y": np.full(len(TIME), 1.0 / SIGMA)}, base={}, extra={}, specimen=np.asarray(1),
        )  # fmt: skip
        parameters = Parameters()
        for name, value in (("a", a), ("b", b)):
            parameters.add(name, value, prior=Prior(value, 5.0))
        recording = SimpleNamespace(role="fit", kind="curve", has=lambda name: True, noise_si=lambda name: SIGMA)
        return fit_campaign([recording], [rows], parameters, 1, 0, lambda _: None, model)

    return of


def line(a, b, t):
    return a * t + b


def bent(a, b, t):
    """Fades in the time b, later than it is looked at: only where it begins to bend is seen."""
    return a * (1.0 - jnp.exp(-0.3 * t * jnp.exp(b)))


def test_of_a_straight_line_profiles_are_parabolas(fitted):
    for profile in profiling.profiles(fitted(line), ["a", "b"]).values():
        np.testing.assert_allclose(profile.rise, profile.parabola, atol=0.01)
        assert len(profile.value) == 5 and not profile.curved and profile.below < 1e-6
        wide = WIDTH_90 * profile.sd
        np.testing.assert_allclose(profile.quoted(90), profile.value[2] + np.array([-wide, wide]), rtol=0.01)


def test_a_curved_valley_shows(fitted):
    found = profiling.profiles(fitted(bent), ["a"])["a"]
    assert found.curved and found.rise.min() == 0.0
    low, high = found.quoted(90)
    assert high - found.value[np.argmin(found.rise)] > 1.5 * (found.value[np.argmin(found.rise)] - low)


def test_all_pins_share_the_program_of_the_fit(fitted):
    fit = fitted(line)
    before = fit.model.traced
    profiling.profiles(fit, ["a", "b"])
    continued_from(fit, {"a": 3.0})
    assert fit.model.traced == before


def test_what_cannot_be_profiled_is_refused_in_a_line(fitted):
    fit = fitted(line)
    with pytest.raises(InputError, match="no free parameter 'c'"):
        profiling.profiles(fit, ["c"])["c"]
    fit.result.parameters["a"].set(standard_error=None)
    with pytest.raises(InputError, match="no standard error"):
        profiling.profiles(fit, ["a"])["a"]
