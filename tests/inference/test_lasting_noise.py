"""Zeros that are off or wander: errors of a straight line with them hold, and without them stay as they are."""

import numpy as np
import pytest

from fitting.inference import lasting_noise
from fitting.inference.lasting_noise import Series, lasting

TIME = np.linspace(0.0, 1.0, 60)
SLOPES = np.column_stack([np.ones(60), TIME])
PRECISION = np.full(2, 1e-4)
CAMPAIGNS = 32


def campaign(random, drift, offset):
    """Errors of the two constants over what white noise would give, and the variances that are found."""
    series = []
    for _ in range(4):
        walk = drift * np.cumsum(random.standard_normal(60)) / 60**0.5
        series.append(random.standard_normal(60) + walk + offset * random.standard_normal())
    normal = 4 * SLOPES.T @ SLOPES + np.diag(PRECISION)
    found = np.linalg.solve(normal, SLOPES.T @ np.sum(series, axis=0))
    left = [Series(TIME, SLOPES @ found - one, SLOPES, "y") for one in series]
    return found / np.sqrt(np.diag(np.linalg.inv(normal))), lasting(left, PRECISION, found)


@pytest.mark.parametrize("drift, offset, plain", [pytest.param(1.0, 0.0, 0.65, marks=pytest.mark.slow), (2.0, 1.0, 0.5)])
def test_beside_zeros_that_last_errors_hold(drift, offset, plain):
    """Of 90 % intervals; those of white noise hold far less. A share of 64 has an error of 4 %."""
    random = np.random.default_rng(1)
    z, held = zip(*(campaign(random, drift, offset) for _ in range(CAMPAIGNS)), strict=True)
    z, variance = np.array(z), np.array([one.variance for one in held])
    assert np.mean(np.abs(z) < 1.645) < plain
    assert 0.82 < np.mean(np.abs(z) < 1.645 * np.sqrt(variance)) < 0.98


def test_without_them_errors_stay_nearly_as_they_are():
    random = np.random.default_rng(2)
    variance = np.array([campaign(random, 0.0, 0.0)[1].variance for _ in range(20)])
    assert np.all(variance >= 1.0) and np.median(variance) < 1.3


def test_what_is_found_are_the_sizes():
    random = np.random.default_rng(3)
    found = [campaign(random, 4.0, 0.0)[1] for _ in range(10)]
    assert 2.5 < np.mean([one.drift["y"] for one in found]) < 5.5


def test_what_errors_have_already_is_not_counted_twice():
    random = np.random.default_rng(4)
    series = [Series(TIME, 2.0 * random.standard_normal(60), SLOPES, "y") for _ in range(4)]
    assert np.all(lasting(series, PRECISION, np.zeros(2), inflation=2.0).variance < 1.3)
    assert np.all(lasting(series, PRECISION, np.zeros(2)).variance > 3.0)


def test_an_interval_is_that_of_the_mixture_and_not_of_its_variance():
    """A drift as probable as 3 % but six times as wide as the noise: the variance is 2.05."""
    random = np.random.default_rng(0)
    drawn = np.abs(random.standard_normal(400000)) * np.where(random.random(400000) < 0.03, 6.0, 1.0)
    found = lasting_noise._ratios(np.array([[1.0, 4.0], [36.0, 4.0]]), np.array([0.97, 0.03]))
    for percent, gaussian in ((50, 0.67449), (90, 1.644854)):
        wanted = np.quantile(drawn, percent / 100.0) / gaussian
        np.testing.assert_allclose(np.sqrt(found[percent]), [wanted, 2.0], rtol=0.01)
    assert found[90][0] < 1.2 and found[50][0] < found[90][0]


def test_instruments_mix_independently():
    one = (np.array([[1.0], [9.0]]), np.array([0.5, 0.5]))
    variance, weight = lasting_noise._mixed(np.zeros(1), [one, one])
    shares = [float(weight[np.isclose(variance[:, 0], v)].sum()) for v in (2.0, 10.0, 18.0)]
    np.testing.assert_allclose(shares, [0.25, 0.5, 0.25], atol=0.03)


def test_without_a_series_errors_are_those_of_the_fit():
    np.testing.assert_array_equal(lasting([], np.array([4.0, 1.0]), np.zeros(2)).variance, [1.0, 1.0])
