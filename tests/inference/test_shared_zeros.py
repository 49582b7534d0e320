"""Zeros of two outputs that share a hidden trajectory: the fit adapts it, and so do the squares of a zero."""

import numpy as np
import pytest

from fitting.inference.lasting_noise import (
    SURE_OF_WHITE,
    Series,
    Shared,
    courses_of,
    lasting,
    lasting_beside_trajectories,
)
from fitting.inference.lasting_noise.shared import shared_sizes_of
from fitting.inference.lasting_noise.zeros import root_of

ROWS = 30
TIME = np.linspace(0.0, 1.0, ROWS)
SEEN = np.diag((TIME > 0.3).astype(float))
STATE = np.vstack([0.5 * SEEN, 3.0 * SEEN])
"""Change of both outputs with the trajectory, each row by its own: after a while the second one tells it."""
WALK = 0.2 * (np.eye(ROWS) - np.eye(ROWS, k=-1))
"""Root of the precision of the trajectory's prior: loose."""
SLOPES = np.vstack([np.column_stack([np.ones(ROWS), TIME]), np.column_stack([TIME**2, np.sin(9.0 * TIME)])])
PRECISION = np.full(2, 1e-4)
NOISE = np.eye(2 * ROWS)


def left():
    """The map from readings to residuals, those of the prior last, and the degrees of freedom it leaves."""
    rows = np.vstack([STATE, WALK])
    away = np.eye(3 * ROWS) - rows @ np.linalg.solve(rows.T @ rows, rows.T)
    return away[:, : 2 * ROWS], float(np.trace(away[: 2 * ROWS, : 2 * ROWS]))


def recording(read, found):
    """Residuals of readings at constants."""
    away, count = left()
    course = courses_of(TIME)
    moved = {
        "y": away @ np.vstack([course, np.zeros_like(course)]),
        "z": away @ np.vstack([np.zeros_like(course), course]),
    }
    return Shared(away @ (SLOPES @ found - read), away @ SLOPES, moved, {"y": TIME, "z": TIME}, count)


def fitted(reads):
    """Constants by least squares with the trajectories adapted, and what is said of zeros."""
    columns = left()[0] @ SLOPES
    normal = len(reads) * columns.T @ columns + np.diag(PRECISION)
    found = np.linalg.solve(normal, sum(columns.T @ left()[0] @ read for read in reads))
    said = lasting_beside_trajectories([recording(r, found) for r in reads], PRECISION, found)
    return found / np.sqrt(np.diag(np.linalg.inv(normal))), said


def readings(random, walk=0.0):
    """Readings of four recordings, the true constants zero, with a drift of the first output."""
    steady = np.linalg.solve(WALK, 0.1 * random.standard_normal((ROWS, 4))).T
    drifts = walk * np.cumsum(random.standard_normal((4, ROWS)), axis=1) / ROWS**0.5
    drifts = np.hstack([drifts, np.zeros((4, ROWS))])
    return [STATE @ x + random.standard_normal(2 * ROWS) + d for x, d in zip(steady, drifts, strict=True)]


def test_squares_are_those_of_generalised_least_squares_with_the_trajectory_integrated_out():
    """Every pair of zeros, against the dense covariance of the readings."""
    random = np.random.default_rng(0)
    read, found = random.standard_normal(2 * ROWS), np.array([0.3, -0.2])
    sizes = shared_sizes_of([recording(read, found)], ["y", "z"], PRECISION, found)
    hidden = STATE @ np.linalg.solve(WALK.T @ WALK, STATE.T)
    rows = np.column_stack([SLOPES, SLOPES @ found - read])
    for pair in ((0.0, 0.0, 0.0, 0.0), (0.5, 0.0, 0.0, 1.0), (1.0, 0.5, 0.25, 0.0)):
        want = np.array([[*pair[:2], 1.0], [*pair[2:], 1.0]])
        (place,) = np.flatnonzero(np.all(np.isclose(sizes.size, want), axis=(1, 2)))
        noise = NOISE + hidden
        for k, (drift, offset) in enumerate((pair[:2], pair[2:])):
            part = slice(k * ROWS, (k + 1) * ROWS)
            noise[part, part] += drift**2 * np.minimum.outer(TIME, TIME) + offset**2
        exact = rows.T @ np.linalg.solve(noise, rows)
        np.testing.assert_allclose(sizes.information[place], exact[:2, :2], rtol=1e-6)
        np.testing.assert_allclose(sizes.slope[place], exact[:2, 2], rtol=1e-6)
        determinant = np.linalg.slogdet(noise)[1] - np.linalg.slogdet(NOISE + hidden)[1]
        np.testing.assert_allclose(sizes.loss[place], exact[2, 2] + determinant, rtol=1e-6)


def test_a_root_gives_the_covariance_of_a_walk_and_an_offset():
    course, root = courses_of(TIME), root_of(TIME, 2.0, 0.5)
    np.testing.assert_allclose(course.T @ course, np.diag(np.r_[np.ones(ROWS), 0.0, 0.0]), atol=1e-12)
    want = 4.0 * np.minimum.outer(TIME, TIME) + 0.25
    np.testing.assert_allclose(course @ root @ root.T @ course.T, want, atol=1e-9)
    assert not courses_of(TIME[:0]).size and not root_of(TIME[:0], 2.0, 0.5).any()


def test_clean_readings_leave_intervals_as_they_are_and_rows_for_themselves_do_not():
    """The second output's residuals are small, as the trajectory follows it. Taken for its noise they would
    move the ends of intervals by a third of an error, and more."""
    random, together, apart = np.random.default_rng(1), [], []
    sd = np.sqrt(np.diag(np.linalg.inv(4 * (left()[0] @ SLOPES).T @ (left()[0] @ SLOPES))))
    for _ in range(3):
        reads = readings(random)
        z, said = fitted(reads)
        parts = [recording(r, z * sd) for r in reads]
        rows = {"y": slice(0, ROWS), "z": slice(ROWS, 2 * ROWS)}
        series = [Series(TIME, p.misfit[k], p.slopes[k], name) for p in parts for name, k in rows.items()]
        alone = lasting(series, PRECISION, z * sd)
        for some, one in ((together, said), (apart, alone)):
            sides = np.sqrt(one.variance[:, None] * one.side_variances[90])
            some.append(np.abs(sides[:, 1] - sides[:, 0]))
        assert said.steady > SURE_OF_WHITE and np.all(said.variance < 2.0)
    assert np.median(together) < 0.1 and np.median(apart) > 0.25


@pytest.mark.slow
@pytest.mark.parametrize("drift", [0.0, 2.0])
def test_intervals_hold_beside_a_drift_and_without(drift):
    """90 % intervals of 40 campaigns; a share of 80 has an error of 3 % and more."""
    random, held = np.random.default_rng(2), []
    for _ in range(40):
        z, said = fitted(readings(random, drift))
        sides = 1.645 * np.sqrt(said.variance[:, None] * said.side_variances[90])
        held.append((-z <= sides[:, 1]) & (z <= sides[:, 0]))
    assert 0.8 < np.mean(held) < 0.98


def test_a_zero_that_drifts_is_found_in_its_output():
    random = np.random.default_rng(3)
    found = [fitted(readings(random, 4.0))[1] for _ in range(3)]
    assert np.median([one.steady for one in found]) < SURE_OF_WHITE
    assert np.mean([one.drift["y"] for one in found]) > 2.0 > 2.0 * np.mean([one.drift["z"] for one in found])
    assert sum(one.told[:1] == ["y"] for one in found) >= 2 and sum("z" in one.told for one in found) <= 1


def test_the_zero_of_an_output_without_readings_is_not_told():
    """What is said of the others is what recordings with that output alone say."""
    random = np.random.default_rng(4)
    found, parts = np.zeros(2), []
    for read in readings(random):
        whole = recording(np.r_[read[:ROWS], np.zeros(ROWS)], found)
        moved = {"y": whole.moved["y"], "z": np.zeros_like(whole.moved["z"])}
        parts.append(Shared(whole.misfit, whole.slopes, moved, {"y": TIME, "z": TIME[:0]}, whole.count - ROWS))
    alone = [Shared(p.misfit, p.slopes, {"y": p.moved["y"]}, {"y": TIME}, p.count) for p in parts]
    said, want = (lasting_beside_trajectories(some, PRECISION, found) for some in (parts, alone))
    assert set(said.drift) == set(said.scale) == {"y"}
    assert said.steady == want.steady and said.drift == want.drift
    np.testing.assert_array_equal(said.side_variances[90], want.side_variances[90])
    unread = [Shared(p.misfit, p.slopes, p.moved, {"y": TIME[:0], "z": TIME[:0]}, p.count) for p in parts]
    assert not lasting_beside_trajectories(unread, PRECISION, found).drift
