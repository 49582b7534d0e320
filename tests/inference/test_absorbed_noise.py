"""What a fit takes up of correlated noise: exact sums, and noise drawn anew."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from fitting.inference.absorbed_noise import Absorbed, _Sums, with_absorbed
from fitting.inference.serial_correlation import correlation_time

SIZES = (80, 80, 60)


def straight(sizes=SIZES):
    """Derivatives of smooth curves by four constants, and by a factor of each recording."""
    along = [np.linspace(0.0, 1.0, n) for n in sizes]
    own = np.eye(len(sizes))
    return [
        np.column_stack([*(x**p for p in range(1, 4)), *(own[i, k] * x for k in range(len(sizes)))])
        for i, x in enumerate(along)
    ]


def drawn(rng, memory, size):
    """First-order noise of unit variance."""
    white = rng.standard_normal(size)
    white[1:] *= np.sqrt(1.0 - memory**2)
    return lfilter([1.0], [1.0, -memory], white)


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.95])
@pytest.mark.parametrize("lag", [0, 1, 12, 200])
def test_sums_are_those_of_the_whole_covariance(memory, lag):
    directions = straight()
    q, _ = np.linalg.qr(np.concatenate(directions)[:, :-1])
    blocks = np.split(q, np.cumsum(SIZES)[:-1])
    noise, near = (np.zeros((sum(SIZES),) * 2) for _ in range(2))
    ends = np.cumsum((0, *SIZES))
    for a, b in zip(ends[:-1], ends[1:], strict=True):
        noise[a:b, a:b] = toeplitz(memory ** np.arange(b - a))
        near[a:b, a:b] = toeplitz(np.arange(b - a) <= lag)
    keep = np.eye(sum(SIZES)) - q @ q.T
    before, after = _Sums(blocks, (lag,))(memory)
    assert before[0] == pytest.approx(np.sum(near * noise))
    assert after[0] == pytest.approx(np.sum(near * (keep @ noise @ keep)))


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.8])
def test_what_is_left_of_drawn_noise_is_brought_back_to_its_size(memory):
    """The variance of a slow curve through noise is its mean square times its correlation time."""
    rng, directions = np.random.default_rng(2), straight()
    q, _ = np.linalg.qr(np.concatenate(directions)[:, :-1])
    seen, told = [], []
    for _ in range(200):
        y = np.concatenate([drawn(rng, memory, n) for n in SIZES])
        series = np.split(y - q @ (q.T @ y), np.cumsum(SIZES)[:-1])
        size, found = np.mean(np.concatenate(series) ** 2), with_absorbed(series, directions)
        assert found.mean_square >= 1.0 and found.correlation_time >= 1.0
        seen.append(size * correlation_time(series))
        told.append(size * found.mean_square * found.correlation_time)
    true = (1.0 + memory) / (1.0 - memory)
    assert np.median(told) == pytest.approx(true, rel=0.25)
    if memory > 0.0:
        assert np.median(seen) < 0.8 * true


def test_two_directions_that_are_one_count_once_and_none_takes_nothing():
    rng = np.random.default_rng(3)
    series = [drawn(rng, 0.5, n) for n in SIZES]
    once = [block[:, :2] for block in straight()]
    twice = [np.column_stack([block, block]) for block in once]
    one, two = with_absorbed(series, once), with_absorbed(series, twice)
    assert one.mean_square == pytest.approx(two.mean_square) and one.mean_square > 1.0
    assert one.correlation_time == pytest.approx(two.correlation_time)
    nothing = with_absorbed(series, [np.zeros((n, 0)) for n in SIZES])
    assert nothing.mean_square == 1.0 and nothing.correlation_time == pytest.approx(correlation_time(series))


def test_noise_that_never_ends_has_a_finite_factor():
    slow = [np.linspace(-1.0, 1.0, n) ** 2 for n in SIZES]
    found = with_absorbed(slow, straight())
    assert np.isfinite(found.mean_square) and np.isfinite(found.correlation_time)


@pytest.mark.parametrize("spoilt", [np.nan, np.inf])
@pytest.mark.parametrize("place", ["series", "directions"])
def test_a_fit_that_failed_tells_nothing_of_noise(spoilt, place):
    """The decomposition of derivatives that overflow did not converge, and ended the comparison of all laws."""
    given = {"series": [np.ones(n) for n in SIZES], "directions": straight()}
    given[place][1][3] = spoilt
    assert with_absorbed(**given) == Absorbed(1.0, 1.0)


@pytest.mark.parametrize("count", [1, 4])
def test_a_fit_that_follows_every_sample_has_finite_factors(count):
    """Nothing is left of the noise then; a division by that was infinite."""
    rng = np.random.default_rng(5)
    found = with_absorbed([1e-16 * rng.standard_normal(count)], [rng.standard_normal((count, 5))])
    assert found == Absorbed(count, 1.0)
