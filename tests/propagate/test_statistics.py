"""Sums of parts merge to those of the whole, and bounds hold what failed rows can have been."""

import numpy as np
import pytest
from scipy import stats

from fitting.propagate.statistics.correlation import Correlation
from fitting.propagate.statistics.failures import (
    BINS,
    Failures,
    level_bounds,
    mean_bounds,
    sd_bounds,
    share_bounds,
)
from fitting.propagate.statistics.moments import Moments, Sketches
from fitting.propagate.statistics.summary import Summary, merge_all

RNG = np.random.default_rng(5)
Y = np.stack([RNG.gamma(2.0, 3.0, 50_000), 1e6 + RNG.normal(size=50_000)], axis=1)
PARTS = np.split(Y, [1, 700, 20_000])


def merged(kind, parts=PARTS):
    first, *rest = [kind(part) for part in parts]
    for part in rest:
        first = first.merge(part)
    return first


def test_moments_of_parts_are_those_of_the_whole():
    found = merged(Moments.of)
    np.testing.assert_allclose(found.mean, Y.mean(0), rtol=1e-13)
    np.testing.assert_allclose(found.variance, Y.var(0, ddof=1), rtol=1e-9)
    np.testing.assert_allclose(found.skewness, stats.skew(Y), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(found.kurtosis, stats.kurtosis(Y, fisher=False), rtol=1e-6)
    assert np.all(found.smallest == Y.min(0)) and np.all(found.largest == Y.max(0))


def test_no_rows_merge_with_some():
    empty = Moments.of(Y[:0])
    assert np.array_equal(empty.merge(Moments.of(Y)).mean, Y.mean(0))
    assert np.array_equal(Moments.of(Y).merge(empty).second, Moments.of(Y).second)
    assert np.all(np.isnan(empty.variance))


def test_quantiles_of_a_merged_sketch_have_the_right_ranks():
    levels = np.array([0.001, 0.05, 0.5, 0.95, 0.999])
    found = merged(Sketches.of).quantiles(levels)
    for column, values in zip(found.T, Y.T, strict=True):
        ranks = np.searchsorted(np.sort(values), column) / len(values)
        np.testing.assert_allclose(ranks, levels, atol=1e-3)
    assert np.all(np.isnan(Sketches.of(Y[:0]).quantiles(levels)))


def test_correlations_of_parts_are_those_of_the_whole():
    z = RNG.normal(size=(len(Y), 2))
    y = Y + np.stack([2.0 * z[:, 0], 0.5 * z[:, 1]], axis=1)
    centre = np.array([5.0, 1e6])
    cuts = [1, 700, 20_000]
    parts = [Correlation.of(a, b, centre) for a, b in zip(np.split(z, cuts), np.split(y, cuts), strict=True)]
    whole = parts[0].merge(parts[1]).merge(parts[2]).merge(parts[3])
    expected = np.corrcoef(z, y, rowvar=False)[:2, 2:]
    np.testing.assert_allclose(whole.coefficients, expected, atol=1e-9)


def test_failed_rows_are_counted_where_they_are():
    z = RNG.normal(size=(20_000, 3))
    good = z[:, 1] < stats.norm.ppf(0.95)
    found = Failures.of(z, np.where(good, 0, 2).astype(np.uint8), good)
    assert found.count == np.sum(~good) and found.reasons[2] == found.count
    assert np.argmax(found.uneven) == 1 and found.uneven[1] > 0.9 and max(found.uneven[[0, 2]]) < 0.1
    assert found.shares[1, BINS - 1] == 1.0 and found.shares[1, :-1].max() == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_bounds_hold_whatever_the_failed_rows_were(seed):
    random = np.random.default_rng(seed)
    y = random.normal(size=400)
    hidden = random.random(400) < 0.08
    seen, share = y[~hidden], hidden.mean()
    low, high = seen.min(), seen.max()
    fate = [np.full(hidden.sum(), x) for x in (low, high, seen.mean())]
    fate.append(np.where(random.random(hidden.sum()) < 0.5, low, high))
    for lost in fate:
        whole = np.concatenate([seen, lost])
        least, most = mean_bounds(seen.mean(), low, high, share)
        assert least - 1e-12 <= whole.mean() <= most + 1e-12
        least, most = sd_bounds(seen.mean(), seen.std(), low, high, share)
        assert least - 1e-12 <= whole.std() <= most + 1e-12
        least, most = share_bounds(np.mean(seen > 1.0), share)
        assert least - 1e-12 <= np.mean(whole > 1.0) <= most + 1e-12
        least, most = np.quantile(seen, level_bounds(0.9, share))
        assert least - 0.15 <= np.quantile(whole, 0.9) <= most + 0.15


def test_the_largest_standard_deviation_is_reached():
    seen = np.random.default_rng(0).normal(size=1000)
    low, high, share = seen.min(), seen.max(), 0.1
    most = sd_bounds(seen.mean(), seen.std(), low, high, share)[1]
    count = int(share / (1.0 - share) * len(seen))
    best = max(
        np.concatenate([seen, np.full(k, low), np.full(count - k, high)]).std() for k in range(count + 1)
    )
    assert most == pytest.approx(best, rel=1e-2)


def test_a_summary_survives_its_arrays():
    z, good = RNG.normal(size=(500, 2)), np.ones(500, bool)
    part = Summary(
        Moments.of(Y[:500]), Sketches.of(Y[:500]), Correlation.of(z, Y[:500], np.zeros(2)),
        {"y above 3": np.array([4, 5])}, Failures.of(z, np.zeros(500, np.uint8), good),
    )  # fmt: skip
    again = Summary.from_arrays(part.arrays())
    assert again.arrays().keys() == part.arrays().keys()
    for name, array in part.arrays().items():
        np.testing.assert_array_equal(again.arrays()[name], array)
    assert again.merge(part).moments.count[0] == 1000


def part_of(rows):
    y, nothing = Y[rows], np.zeros((len(Y[rows]), 1))
    failures = Failures.of(nothing, np.zeros(len(y), np.uint8), np.ones(len(y), bool))
    return Summary(Moments.of(y), Sketches.of(y), Correlation.of(nothing, y, np.zeros(2)), {}, failures)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 100])
def test_many_parts_merge_to_the_whole(count):
    edges = np.linspace(0, len(Y), count + 1).astype(int)
    whole = merge_all(part_of(slice(a, b)) for a, b in zip(edges[:-1], edges[1:], strict=True))
    assert whole.moments.count[0] == len(Y)
    np.testing.assert_allclose(whole.moments.mean, Y.mean(0), rtol=1e-13)
    levels = np.array([0.01, 0.25, 0.5, 0.75, 0.99])
    for column, values in zip(whole.sketches.quantiles(levels).T, Y.T, strict=True):
        ranks = np.searchsorted(np.sort(values), column) / len(values)
        np.testing.assert_allclose(ranks, levels, atol=7e-4)


def test_nothing_cannot_be_merged():
    with pytest.raises(ValueError, match="at least one summary"):
        merge_all([])
