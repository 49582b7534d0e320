"""Random walks and ramps behind readings, against the dense Gaussian that they are."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fitting.simulate.walks import (
    CORNER,
    CORNERS,
    FIRST,
    NOISES,
    RAMPS,
    cold_rows,
    kinds_of,
    linear_readings,
    smoothed,
)

ROWS = 7
WALK, RAMP = np.flatnonzero(~RAMPS), np.flatnonzero(RAMPS)


def world(count, seed=0, kinds=WALK):
    """Times, slopes, kinds of steps, and readings of unit noise; `count` fractions."""
    random = np.random.default_rng(seed)
    time, slope = np.cumsum(random.uniform(0.5, 2.0, ROWS)), random.normal(size=(ROWS, count, count))
    return time, slope, random.choice(kinds[-4:], (ROWS, count)), random.normal(size=(ROWS, count))


def steps_of(time, kind):
    """The matrix that turns one fraction's course into its independent steps, the first row included."""
    found, step = np.eye(len(time)), np.diff(time)
    for t in range(1, len(time)):
        gain = RAMPS[kind[t]] * step[t - 1] / step[t - 2] if t > 1 else 0.0
        found[t, t - 1] -= 1.0 + gain
        if t > 1:
            found[t, t - 2] += gain
    return found


@pytest.mark.parametrize("kinds", [WALK, RAMP, np.arange(len(NOISES))], ids=["walks", "ramps", "both"])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_smoothed_fractions_are_the_mean_of_the_gaussian_and_their_evidence_its_density(count, kinds):
    time, slope, kind, target = world(count, kinds=kinds)
    prior = np.zeros((ROWS, count, ROWS, count))
    for k in range(count):
        back = np.linalg.inv(steps_of(time, kind[:, k]))
        begins = (kind[1:, k] != kind[:-1, k]) & CORNERS[kind[1:, k]]
        sizes = np.insert(np.where(begins, CORNER, NOISES[kind[1:, k]]) * np.diff(time), 0, FIRST)
        prior[:, k, :, k] = back @ np.diag(sizes) @ back.T
    prior = prior.reshape(ROWS * count, ROWS * count)
    design = np.zeros((ROWS, count, ROWS, count))
    design[np.arange(ROWS), :, np.arange(ROWS), :] = slope
    design = design.reshape(ROWS * count, ROWS * count)
    mean, spread = np.full(ROWS * count, 0.5), design @ prior @ design.T + np.eye(ROWS * count)
    exact = mean + prior @ design.T @ np.linalg.solve(spread, target.ravel() - design @ mean)

    found, evidence = smoothed(time, target, slope, kind, np.zeros((ROWS, count), bool))

    np.testing.assert_allclose(found.ravel(), exact, atol=1e-7)
    density = multivariate_normal(design @ mean, spread).logpdf(target.ravel())
    assert evidence - 0.5 * ROWS * count * np.log(2.0 * np.pi) == pytest.approx(density, abs=1e-6)


def test_a_cold_spring_is_exactly_cold_and_ties_no_earlier_row_to_later_ones():
    time, slope, kind, target = world(2)
    slope = slope * np.eye(2)  # each reading is of one spring
    cold = np.zeros((ROWS, 2), bool)
    cold[2:5, 0] = True
    found, evidence = smoothed(time, target, slope, kind, cold)
    np.testing.assert_allclose(found[2:5, 0], 1.0, atol=1e-12)
    moved, _ = smoothed(time, np.where(np.arange(ROWS)[:, None] == 6, target + 3.0, target), slope, kind, cold)
    assert np.isfinite(evidence) and np.all(np.isfinite(found)) and np.abs(moved[1, 0] - found[1, 0]) < 1e-9


def test_the_evidence_beside_cold_rows_is_the_density_of_what_is_free():
    """With one spring cold throughout, the evidence is that of the other one alone."""
    time, slope, kind, target = world(2, kinds=RAMP)
    cold = np.zeros((ROWS, 2), bool)
    cold[:, 0] = True
    _, both = smoothed(time, target, slope * np.eye(2), kind, cold)
    one = (slice(None), slice(1, 2))
    _, alone = smoothed(time, target[one], slope[:, 1:, 1:], kind[one], cold[one])
    misses = np.sum((target[:, 0] - slope[:, 0, 0]) ** 2)
    assert both == pytest.approx(alone - 0.5 * misses, abs=1e-9)


def test_kinds_follow_a_spring_that_is_heated_and_then_held_still():
    """A fraction falls by half in the first third of a recording, and stays: a ramp, and a walk of small steps."""
    random, rows = np.random.default_rng(3), 150
    time = np.arange(rows) * 1.0
    x = 1.0 - 0.5 * np.clip(time / 50.0, 0.0, 1.0)[:, None]
    slope = np.full((rows, 1, 1), 1e3)
    target = linear_readings(slope, x) + random.normal(size=(rows, 1))
    cold = np.zeros((rows, 1), bool)
    kind = kinds_of(time, target, slope, cold)
    assert np.all(RAMPS[kind[5:45]]) and np.median(NOISES[kind[60:]]) < 1e-7
    found, _ = smoothed(time, target, slope, kind, cold)
    assert np.sqrt(np.mean((found - x) ** 2)) < 0.5e-3  # half of the readings' noise


def test_the_corner_between_two_ramps_is_a_step_of_its_own():
    """A fraction falls and rises again; a corner between ramps of one noise is a change of kind."""
    random, rows = np.random.default_rng(4), 120
    time = np.arange(rows) * 1.0
    x = 0.2 + 0.01 * np.abs(time - 60.0)[:, None]
    slope, cold = np.full((rows, 1, 1), 1e3), np.zeros((rows, 1), bool)
    target = linear_readings(slope, x) + random.normal(size=(rows, 1))
    kind = kinds_of(time, target, slope, cold)
    assert np.any(kind[57:64] != kind[56:63])
    found, _ = smoothed(time, target, slope, kind, cold)
    assert np.max(np.abs(found - x)) < 2e-3


def test_rows_before_a_heating_are_found_cold_and_a_steady_warm_spring_is_not():
    """Readings of a spring that is cold for 40 rows and then heated, and of one that is warm by 5 noises."""
    random, rows = np.random.default_rng(5), 120
    time = np.arange(rows) * 1.0
    slope = np.full((rows, 1, 1), 1e3)
    for x, expected in ((1.0 - 0.01 * np.clip(time - 40.0, 0.0, None), 41), (np.full(rows, 0.995), 0)):
        target = linear_readings(slope, x[:, None]) + random.normal(size=(rows, 1))
        found = cold_rows(time, (target, slope), (target, slope), np.zeros((rows, 1), bool), 0)
        assert abs(int(np.sum(found)) - expected) <= 1 and not np.any(found[expected + 1 :])


def test_held_rows_stay_where_they_are_held():
    time, slope, kind, target = world(2)
    near, precision = np.full((ROWS, 2), 0.3), np.where(np.arange(ROWS) == 3, 1e12, 0.0)
    free = np.zeros((ROWS, 2), bool)
    found, _ = smoothed(time, target, slope, kind, free, (near, precision))
    alone, _ = smoothed(time, target, slope, kind, free)
    np.testing.assert_allclose(found[3], 0.3, atol=1e-5)
    assert np.max(np.abs(alone[3] - 0.3)) > 0.01
