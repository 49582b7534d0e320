"""Random walks behind readings, against the dense Gaussian that they are."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fitting.simulate.walks import FIRST, PROCESS_NOISES, along, cold_rows, process_noise_of, smoothed

ROWS = 7


def world(count, seed=0):
    """Times, slopes, variances of steps, and readings of unit noise; `count` fractions."""
    random = np.random.default_rng(seed)
    time, slope = np.cumsum(random.uniform(0.5, 2.0, ROWS)), random.normal(size=(ROWS, count, count))
    process_noise = 10.0 ** random.uniform(-3.0, 0.0, (ROWS, count))
    return time, slope, process_noise, random.normal(size=(ROWS, count))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_smoothed_fractions_are_the_mean_of_the_gaussian_and_their_evidence_its_density(count):
    time, slope, process_noise, target = world(count)
    process_noise[0] = 0.0  # before the first row there is no step
    grown = FIRST + np.cumsum(process_noise * np.insert(np.diff(time), 0, 0.0)[:, None], axis=0)  # variance of each row
    prior = np.zeros((ROWS, count, ROWS, count))
    for k in range(count):
        prior[:, k, :, k] = np.minimum.outer(grown[:, k], grown[:, k])
    prior = prior.reshape(ROWS * count, ROWS * count)
    design = np.zeros((ROWS, count, ROWS, count))
    design[np.arange(ROWS), :, np.arange(ROWS), :] = slope
    design = design.reshape(ROWS * count, ROWS * count)
    mean, spread = np.full(ROWS * count, 0.5), design @ prior @ design.T + np.eye(ROWS * count)
    exact = mean + prior @ design.T @ np.linalg.solve(spread, target.ravel() - design @ mean)

    found, evidence = smoothed(time, target, slope, process_noise, np.zeros((ROWS, count), bool))

    np.testing.assert_allclose(found.ravel(), exact, atol=1e-9)
    density = multivariate_normal(design @ mean, spread).logpdf(target.ravel())
    assert evidence.sum() - 0.5 * ROWS * count * np.log(2.0 * np.pi) == pytest.approx(density, abs=1e-9)


def test_a_cold_spring_is_exactly_cold_and_ties_no_later_row():
    time, slope, process_noise, target = world(2)
    slope = slope * np.eye(2)  # each reading is of one spring
    cold = np.zeros((ROWS, 2), bool)
    cold[2:5, 0] = True
    found, evidence = smoothed(time, target, slope, process_noise, cold)
    np.testing.assert_allclose(found[2:5, 0], 1.0, atol=1e-12)
    moved, _ = smoothed(time, np.where(np.arange(ROWS)[:, None] == 6, target + 3.0, target), slope, process_noise, cold)
    assert np.all(np.isfinite(evidence)) and np.all(np.isfinite(found)) and np.abs(moved[1, 0] - found[1, 0]) < 1e-9


def test_variances_follow_a_spring_that_is_heated_and_then_held_still():
    """A fraction falls by half in the first third of a recording, and stays."""
    random, rows = np.random.default_rng(3), 150
    time = np.arange(rows) * 1.0
    x = 1.0 - 0.5 * np.clip(time / 50.0, 0.0, 1.0)[:, None]
    slope = np.full((rows, 1, 1), 1e3)
    target = along(slope, x) + random.normal(size=(rows, 1))
    process_noise = process_noise_of(time, target, slope, np.zeros((rows, 1), bool))
    assert set(np.unique(process_noise)) <= set(PROCESS_NOISES)
    assert np.median(process_noise[5:45]) > 100.0 * np.median(process_noise[60:])


def test_rows_before_a_heating_are_found_cold_and_a_steady_warm_spring_is_not():
    """Readings of a spring that is cold for 40 rows and then heated, and of one that is warm by 5 noises."""
    random, rows = np.random.default_rng(5), 120
    time = np.arange(rows) * 1.0
    slope = np.full((rows, 1, 1), 1e3)
    for x, expected in ((1.0 - 0.01 * np.clip(time - 40.0, 0.0, None), 41), (np.full(rows, 0.995), 0)):
        target = along(slope, x[:, None]) + random.normal(size=(rows, 1))
        found = cold_rows(time, (target, slope), (target, slope), np.zeros((rows, 1), bool), 0)
        assert abs(int(np.sum(found)) - expected) <= 1 and not np.any(found[expected + 1 :])


def test_held_rows_stay_where_they_are_held():
    time, slope, process_noise, target = world(2)
    near, precision = np.full((ROWS, 2), 0.3), np.where(np.arange(ROWS) == 3, 1e12, 0.0)
    free = np.zeros((ROWS, 2), bool)
    found, _ = smoothed(time, target, slope, process_noise, free, (near, precision))
    alone, _ = smoothed(time, target, slope, process_noise, free)
    np.testing.assert_allclose(found[3], 0.3, atol=1e-5)
    assert np.max(np.abs(alone[3] - 0.3)) > 0.01
