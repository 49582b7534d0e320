"""Tables in an order that reads well, axes along which something moves, and intervals that can be."""

import numpy as np
import pytest

from fitting.calibrate.quoted import of_prior_alone
from fitting.diagnose.verdict.probabilities import Found
from fitting.report.diagnosis.tables import in_order
from fitting.specimens.rows import held
from pneusma_jax.calibration.records import Prior, Quantity


def test_terms_of_a_relaxation_stand_together_the_shortest_time_first():
    sizes = {"g_1": 0.08, "g_2": 0.2, "g_3": 0.06, "tau_1": 85.0, "tau_2": 0.3, "tau_3": 15.0}
    found = Found("viscoelastic_relaxation", 0.9, 9.0, {n: {"value": x} for n, x in sizes.items()}, [], "")
    assert in_order(found) == ["g_2", "tau_2", "g_3", "tau_3", "g_1", "tau_1"]
    found.parameters["g_2"]["value"] = 0.0
    assert in_order(found)[-2:] == ["g_2", "tau_2"]
    plain = Found("strain_stiffening", 0.9, 9.0, {"c_2": {"value": 1.0}, "c_3": {"value": 0.0}}, [], "")
    assert in_order(plain) == ["c_2", "c_3"]
    assert in_order(Found("unmodelled", 0.9, 9.0, {}, [], "")) == []


def rows(strain, time):
    there = {"inputs": {"strain": np.asarray(strain)}, "time": np.asarray(time), "mask": np.ones(len(strain), bool)}
    return type("Rows", (), there)()


def test_a_hold_is_drawn_over_the_clock():
    """Over the strain it had been one vertical line."""
    ramp, hold = np.linspace(0.0, 0.5, 20), np.full(80, 0.5)
    clock = np.arange(100.0)
    assert held(rows(np.concatenate([ramp, hold]), clock), "strain")
    assert held(rows(np.full(100, 0.5), clock), "strain")
    assert not held(rows(np.linspace(0.0, 0.5, 100), clock), "strain")
    assert not held(rows(np.abs(np.sin(clock / 9.0)), clock), "strain")
    assert not held(rows(np.concatenate([ramp, hold]), np.zeros(100)), "strain"), "without a clock there is no other axis"


@pytest.mark.parametrize(("least", "lower"), [(0.0, 0.0), (-np.inf, 0.03 - 1.645 * 0.04)])
def test_the_interval_of_a_constant_that_nothing_shows_ends_where_its_prior_does(least, lower):
    """A residual strain that cannot be negative had been told as -0.04 to 0.1."""
    quantity = Quantity("gR_amplitude", 0.03, "1", "assumed", "a test", Prior(0.03, 0.04, least, 0.07))
    low, high = of_prior_alone(quantity).interval[90]
    assert (low, high) == (pytest.approx(lower, abs=1e-4), pytest.approx(0.07))
