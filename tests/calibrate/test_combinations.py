"""Quantities made of several constants: intervals by propagation, wider where zeros drift."""

import numpy as np
import pytest

from fitting.calibrate.combinations import propagated
from fitting.calibrate.profile_likelihood import WIDTH_90
from fitting.inference.lasting_noise import Lasting, covariance_beside_zeros
from fitting.inference.least_squares.covariance import Uncertainty

COVARIANCE = np.array([[4.0, 1.0], [1.0, 9.0]])
UNCERTAINTY = Uncertainty({"a": 2.0, "b": 3.0}, ("a", "b"), COVARIANCE, np.array([[1.0, 1 / 6], [1 / 6, 1.0]]), ())


def half_width(zeros=None):
    """Half the interval of a + 2 b, in 90 % widths."""
    law = lambda free: (free["a"] + 2.0 * free["b"])[None]  # noqa: E731
    wider = None if zeros is None else covariance_beside_zeros(zeros, ("b", "a"), COVARIANCE, ("a", "b"))
    (one,) = propagated([("sum", "1")], law, {"a": 5.0, "b": 7.0}, UNCERTAINTY, {}, wider)
    assert one.value == 19.0 and one.high - one.value == pytest.approx(one.value - one.low)
    return (one.high - one.value) / WIDTH_90


def test_the_covariance_is_propagated():
    assert half_width() == pytest.approx(np.sqrt(4.0 + 4.0 * 1.0 + 4.0 * 9.0))


def test_zeros_that_drift_widen_what_is_made_of_their_constants():
    of_b = Lasting(np.array([16.0, 1.0]), {}, {})  # four times the error of b, the correlation stays
    assert half_width(of_b) == pytest.approx(np.sqrt(4.0 + 4.0 * 4.0 * 1.0 + 4.0 * 16.0 * 9.0))
    assert half_width(Lasting(np.array([16.0, 16.0]), {}, {})) == pytest.approx(4.0 * half_width())


def test_zeros_that_drift_correlate_their_constants_anew():
    """A zero that moves a and b against each other leaves a + 2 b as it was, however far it moves them."""
    sizes, opposed = np.array([4.0, 16.0]), np.array([[1.0, -1.0], [-1.0, 1.0]])
    found = half_width(Lasting(sizes, {}, {}, correlation=opposed))
    assert found == pytest.approx(abs(np.sqrt(16.0 * 4.0) - 2.0 * np.sqrt(4.0 * 9.0)))
