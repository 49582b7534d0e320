"""Quantities made of several constants: intervals by propagation, wider where zeros drift."""

import numpy as np
import pytest

from fitting.calibrate.combinations import propagated
from fitting.calibrate.profile_likelihood import WIDTH_90
from fitting.inference.least_squares.covariance import Uncertainty

COVARIANCE = np.array([[4.0, 1.0], [1.0, 9.0]])
UNCERTAINTY = Uncertainty({"a": 2.0, "b": 3.0}, ("a", "b"), COVARIANCE, np.array([[1.0, 1 / 6], [1 / 6, 1.0]]), ())


def half_width(variances):
    """Half the interval of a + 2 b, in 90 % widths."""
    law = lambda free: (free["a"] + 2.0 * free["b"])[None]  # noqa: E731
    (one,) = propagated([("sum", "1")], law, {"a": 5.0, "b": 7.0}, UNCERTAINTY, {}, variances)
    assert one.value == 19.0 and one.high - one.value == pytest.approx(one.value - one.low)
    return (one.high - one.value) / WIDTH_90


def test_the_covariance_is_propagated():
    assert half_width({}) == pytest.approx(np.sqrt(4.0 + 4.0 * 1.0 + 4.0 * 9.0))


def test_zeros_that_drift_widen_what_is_made_of_their_constants():
    wider = half_width({"b": 16.0})  # four times the error of b, the correlation stays
    assert wider == pytest.approx(np.sqrt(4.0 + 4.0 * 4.0 * 1.0 + 4.0 * 16.0 * 9.0))
    assert half_width({"a": 16.0, "b": 16.0}) == pytest.approx(4.0 * half_width({}))
