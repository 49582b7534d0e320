"""Noise of several recordings of one channel: one where they agree, one each where they clearly differ."""

import numpy as np
import pytest

from fitting.inference.channels import unstated_noise_of_several
from fitting.inference.noise import robust_noise
from fitting.inference.partial_pooling import LEVEL, SPREAD, SYSTEMATIC, pooled_by_difference


def drawn(rng, sizes, count, correlation=0.0):
    """First-order errors of each of several recordings, (count,) each."""
    found = []
    for size in sizes:
        kicks = rng.standard_normal(count)
        for k in range(1, count):
            kicks[k] = correlation * kicks[k - 1] + np.sqrt(1.0 - correlation**2) * kicks[k]
        found.append(size * kicks)
    return found


def told(pieces):
    white = [robust_noise(np.arange(len(p) * 1.0), p) for p in pieces]
    return unstated_noise_of_several(pieces, white, np.zeros(len(pieces)))


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_one_noisy_recording_widens_no_other(correlation):
    """All pieces tell one correlation, so sizes are compared with each other."""
    sizes = told(drawn(np.random.default_rng(1), [5.0, 1.0, 1.0, 1.0], 200, correlation))
    assert sizes / np.median(sizes) == pytest.approx([5.0, 1.0, 1.0, 1.0], rel=0.2)


def test_recordings_of_one_noise_tell_one():
    pieces = drawn(np.random.default_rng(2), [1.0] * 4, 60)
    sizes = told(pieces)
    assert np.ptp(sizes) == 0.0 and sizes[0] == pytest.approx(1.0, rel=0.2)


def test_equal_sizes_are_said_to_differ_as_often_as_the_level_says():
    """Logarithms with exactly the errors that the function assumes."""
    rng, counts = np.random.default_rng(3), np.array([20.0, 50.0, 100.0, 400.0])
    error = np.sqrt(SPREAD**2 / counts + SYSTEMATIC**2)
    said = [pooled_by_difference(np.exp(error * rng.standard_normal(4)), counts) is not None for _ in range(4000)]
    assert np.mean(said) == pytest.approx(LEVEL, abs=3.0 * np.sqrt(LEVEL / 4000))


def test_posterior_means_are_those_of_two_recordings_by_hand():
    """The scatter of two is half their squared difference less their variance."""
    counts, apart = np.array([50.0, 50.0]), 2.0
    variance = SPREAD**2 / 50.0 + SYSTEMATIC**2
    share = (0.5 * apart**2 - variance) / (0.5 * apart**2)
    found = np.log(pooled_by_difference(np.exp([0.0, apart]), counts))
    assert found == pytest.approx([0.5 * apart * (1.0 - share), 0.5 * apart * (1.0 + share)])


def test_a_recording_that_tells_nothing_has_the_noise_of_all():
    found = pooled_by_difference([1.0, 9.0, 0.0, 7.0], [400.0, 400.0, 400.0, 0.0])
    assert found[2] == found[3] == pytest.approx(3.0)
    assert pooled_by_difference([1.0, 0.0], [400.0, 400.0]) is None
