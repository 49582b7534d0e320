"""Zeros that are off or drift: errors of a straight line with them hold, and without them stay as they are."""

from dataclasses import replace

import numpy as np
import pytest

from fitting.inference.lasting_noise import (
    SURE_OF_WHITE,
    Series,
    covariance_beside_zeros,
    intervals,
    lasting,
    zeros,
)
from fitting.inference.lasting_noise.sizes import decided, sizes_of

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


def width(found):
    """Width of the 90 % intervals over that of white noise, shape (parameters,)."""
    return np.mean(np.sqrt(found.variance[:, None] * found.side_variances[90]), axis=1)


@pytest.mark.parametrize(
    "drift, offset, plain", [pytest.param(1.0, 0.0, 0.65, marks=pytest.mark.slow), (2.0, 1.0, 0.5)]
)
def test_beside_zeros_that_last_errors_hold(drift, offset, plain):
    """Of 90 % intervals; those of white noise hold far less. A share of 64 has an error of 4 %."""
    random = np.random.default_rng(1)
    z, held = zip(*(campaign(random, drift, offset) for _ in range(CAMPAIGNS)), strict=True)
    z, variance = np.array(z), np.array([one.variance for one in held])
    assert np.mean(np.abs(z) < 1.645) < plain
    assert 0.82 < np.mean(np.abs(z) < 1.645 * np.sqrt(variance)) < 0.98


def test_the_error_of_a_sum_of_constants_holds_beside_zeros_that_are_off():
    """An offset moves the whole line: its end is as wrong as its begin, though its slope is right."""
    random, plain = np.random.default_rng(5), np.linalg.inv(4 * SLOPES.T @ SLOPES + np.diag(PRECISION))
    anew, kept = [], []
    for _ in range(10):
        _, found = campaign(random, 0.0, 6.0)
        for ratios, zeros_found in ((anew, found), (kept, replace(found, correlation=None))):
            covariance = covariance_beside_zeros(zeros_found, "ab", plain, "ab")
            ratios.append(np.sqrt(covariance.sum() / covariance[0, 0]))
    assert np.median(anew) == pytest.approx(1.0, abs=0.03)
    assert np.median(kept) < 0.96  # with the correlation of the fit


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
    read = [2.0 * random.standard_normal(60) for _ in range(4)]
    found = np.linalg.solve(4 * SLOPES.T @ SLOPES, SLOPES.T @ np.sum(read, axis=0))
    series = [Series(TIME, SLOPES @ found - one, SLOPES, "y") for one in read]
    known, unknown = (lasting(series, PRECISION, np.zeros(2), inflation=x) for x in (2.0, 1.0))
    assert np.all(width(known) < 1.15) and np.all(width(unknown) > 1.7)


def test_an_interval_is_that_of_the_mixture_and_not_of_its_variance():
    """A drift as probable as 3 % but six times as wide as the noise: the variance is 2.05."""
    random = np.random.default_rng(0)
    drawn = np.abs(random.standard_normal(400000)) * np.where(random.random(400000) < 0.03, 6.0, 1.0)
    sd = np.array([[1.0, 2.0], [6.0, 2.0]])
    for even in (False, True):
        found = intervals.sides_of(np.zeros((2, 2)), sd, np.array([0.97, 0.03]), even)
        for percent, gaussian in ((50, 0.67449), (90, 1.644854)):
            wanted = np.quantile(drawn, percent / 100.0) / gaussian
            np.testing.assert_allclose(found[percent], [[wanted, wanted], [2.0, 2.0]], rtol=0.01)
        assert found[90][0, 0] < 1.1 and found[50][0, 0] < found[90][0, 0]


def test_a_mixture_off_centre_reaches_further_to_its_side_or_equally_far():
    centre, sd, weight = np.array([[2.0]]), np.array([[3.0]]), np.ones(1)
    own, even = (intervals.sides_of(centre, sd, weight, which)[90][0] * 1.644854 for which in (False, True))
    np.testing.assert_allclose(own, [3.0 * 1.644854 - 2.0, 3.0 * 1.644854 + 2.0], rtol=1e-6)
    drawn = np.abs(2.0 + 3.0 * np.random.default_rng(0).standard_normal(400000))
    np.testing.assert_allclose(even, np.quantile(drawn, 0.9), rtol=0.01)


def test_blocks_with_correlated_noise_give_the_covariance_of_all_rows():
    """The covariance from blocks is that of generalised least squares over single rows."""
    one = Series(TIME, np.ones(60), SLOPES, "y", share=np.linspace(0.3, 1.0, 60))
    share, other = one.share, np.sqrt(1.0 - one.share**2)
    alike = np.outer(share, share) + np.outer(other, other)
    noise = 1.2**2 * np.eye(60) + (1.5**2 * np.minimum.outer(TIME, TIME) + 0.5**2) * alike
    exact = SLOPES.T @ np.linalg.solve(noise, SLOPES)
    found = zeros.square(one, (1.5, 0.5, 1.2))[:2, :2]
    np.testing.assert_allclose(found, exact, rtol=0.03)


def test_a_fit_with_the_noise_that_is_found_needs_no_wider_intervals():
    """Beside a drift it is unbiased, and nearer the truth than the fit with white noise."""
    random, white, correlated, ratios = np.random.default_rng(5), [], [], []
    size = (2.0, 0.0, 1.0)
    for _ in range(40):
        walks = [size[0] * np.cumsum(random.standard_normal(60)) / 60**0.5 for _ in range(4)]
        read = [random.standard_normal(60) + walk for walk in walks]
        plain = np.linalg.solve(4 * SLOPES.T @ SLOPES, SLOPES.T @ np.sum(read, axis=0))
        left = [Series(TIME, SLOPES @ plain - one, SLOPES, "y") for one in read]
        square = sum(zeros.square(one, size) for one in left)
        better = plain - np.linalg.solve(square[:2, :2], square[:2, 2])
        left = [Series(TIME, SLOPES @ better - one, SLOPES, "y") for one in read]
        found = lasting(left, np.full(2, 1e-8), np.zeros(2), noise_sizes={"y": size})
        white.append(plain), correlated.append(better), ratios.append(np.sqrt(found.variance))
    white, correlated = (np.mean(np.square(x), axis=0) for x in (white, correlated))
    assert correlated[0] < 0.7 * white[0] and correlated[1] < white[1]
    assert 0.9 < np.median(ratios) < 1.3


def test_an_interval_reaches_to_where_a_held_constant_would_move_the_fit():
    """The slope is held at zero and is two standard deviations of its prior. The interval of the mean then reaches
    as far, on that side, as the one of a fit with both."""
    random, precision = np.random.default_rng(6), np.array([1e-8, 1.0])
    read = [random.standard_normal(60) + 2.0 * TIME for _ in range(4)]
    alone = np.array([np.mean(read), 0.0])
    left = [Series(TIME, SLOPES @ alone - one, SLOPES, "y") for one in read]
    found = lasting(left, precision, alone, held=1)
    normal = 4 * SLOPES.T @ SLOPES + np.diag(precision)
    both = np.linalg.solve(normal, SLOPES.T @ np.sum(read, axis=0))
    end = both[0] - 1.645 * np.sqrt(np.linalg.inv(normal)[0, 0])
    lower = 1.645 * np.sqrt(found.variance[0] * found.side_variances[90][0, 0]) / np.sqrt(240.0)
    assert found.variance.shape == (1,) and found.steady > 0.5 and both[0] < alone[0] - 0.5
    assert alone[0] - lower < end + 0.1 * (alone[0] - end)


def fitted(read, columns, off=0.0):
    """Residuals of a least-squares fit to readings by recording and output, its first constant off by so much.

    Args:
        read: shape (recordings, outputs, rows).
        columns: slopes of all readings, shape (rows, constants).
        off: standard errors from the optimum.
    """
    count = read.shape[0] * read.shape[1]
    found = np.linalg.lstsq(columns, read.mean(axis=(0, 1)), rcond=None)[0]
    found[0] += off * np.sqrt(np.linalg.inv(count * columns.T @ columns)[0, 0])
    by = np.linspace(0.0, 1.0, read.shape[2])
    return [Series(by, columns @ found - y, columns, f"y{k}") for one in read for k, y in enumerate(one)]


@pytest.mark.parametrize("recordings, outputs", [(1, 3), (2, 4)])
def test_many_clean_outputs_are_not_said_to_have_zeros_and_one_that_drifts_is(recordings, outputs):
    random, columns = np.random.default_rng(7), np.sin(300.0 * TIME)[:, None]
    clean = random.standard_normal((6, recordings, outputs, 60))
    steady = [lasting(fitted(y, columns), np.zeros(1), np.zeros(1)).steady for y in clean]
    assert np.sum(np.less(steady, SURE_OF_WHITE)) <= 1 and np.median(steady) > 0.8
    clean[0, :, 1] += 4.0 * TIME
    found = lasting(fitted(clean[0], columns), np.zeros(1), np.zeros(1))
    assert found.steady < 0.01 and found.told == ["y1"]


def test_what_recordings_cannot_tell_is_not_decided():
    """A fit with a constant and a slope takes up any offset of a single recording."""
    random, offsets = np.random.default_rng(8), []
    for _ in range(6):
        series = fitted(random.standard_normal((1, 1, 60)), SLOPES)
        sizes = sizes_of(series, np.zeros(2), np.zeros(2))
        without = sizes.size[:, 0, 1] == 0.0
        offsets.append(sizes.weight[without].sum())
        assert np.any(np.isfinite(decided(sizes).before[without]))
        found = lasting(series, np.zeros(2), np.zeros(2))
        assert found.steady > SURE_OF_WHITE and found.told == [] and found.offset["y0"] > 0.5  # as the prior has it
    np.testing.assert_allclose(offsets, 0.5, atol=0.05)


def test_a_fit_that_stopped_early_has_the_intervals_of_its_optimum():
    """Offsets as large as the noise make the covariance far larger than the fit's own."""
    random = np.random.default_rng(9)
    read = random.standard_normal((3, 1, 60)) + random.standard_normal((3, 1, 1))
    ended, early = (lasting(fitted(read, SLOPES, off), np.zeros(2), np.zeros(2)) for off in (0.0, 0.5))
    assert ended.steady < SURE_OF_WHITE and ended.variance[0] > 4.0
    np.testing.assert_allclose(early.variance, ended.variance, rtol=1e-4)
    np.testing.assert_allclose(early.side_variances[50], ended.side_variances[50], rtol=1e-4)


@pytest.mark.parametrize("rows", [60, 2])
def test_doubt_of_a_held_constant_counts_once(rows):
    """Its column is parallel to the free one, so that recordings say nothing of it, in however many rows."""
    random, column = np.random.default_rng(10), np.sin(3.0 + 300.0 * np.linspace(0.0, 1.0, rows))
    error = 1.0 / np.sqrt(3.0 * column @ column)
    columns = np.column_stack([column, 2.6 * error * column])
    found = random.standard_normal((3, rows))
    best = np.array([found.mean(axis=0) @ column / (column @ column), 0.0])
    series = [Series(np.linspace(0.0, 1.0, rows), columns @ best - y, columns, "y") for y in found]
    wanted = np.hypot(1.0, 2.6)
    got = np.sqrt(lasting(series, np.array([0.0, 1.0]), np.zeros(2), held=1).variance)
    np.testing.assert_allclose(got, wanted, rtol=0.05)


def test_without_a_series_errors_are_those_of_the_fit():
    np.testing.assert_array_equal(lasting([], np.array([4.0, 1.0]), np.zeros(2)).variance, [1.0, 1.0])
