"""The course that is profiled out: found from anywhere, and differentiated in both modes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.inference.lasting_noise import modes_of
from fitting.inference.latent_trajectory import smoother
from fitting.inference.latent_trajectory.gauss_newton import CLOSE
from fitting.specimens.correlated_noise import Whitening

ROWS = 40


def _outputs(scale, xi0):
    """Two outputs, of which the second hardly knows a small fraction; nothing is remembered."""
    predicted = jnp.stack([scale * xi0, scale * xi0**4])
    slope = jnp.stack([scale * jnp.ones_like(xi0), 4.0 * scale * xi0**3])
    return smoother.Local(predicted, slope, jnp.zeros_like(slope), jnp.zeros(ROWS, int))


@pytest.fixture(scope="module")
def problem():
    """A fraction that walks, two noisy readings of it, and ten rows at the end that nobody measured."""
    random = np.random.default_rng(3)
    true = 0.5 + np.cumsum(0.01 * random.standard_normal(ROWS))
    seen = np.stack([2.0 * true, 2.0 * true**4]) + 0.02 * random.standard_normal((2, ROWS))
    weight = np.full((2, ROWS), 50.0) * (np.arange(ROWS) < 30)
    walk = smoother.Walk.over(
        jnp.arange(float(ROWS)), jnp.ones(ROWS, bool), jnp.asarray(1e-4), jnp.asarray(0.5), jnp.asarray(0.5)
    )
    return jnp.asarray(seen), jnp.asarray(weight), walk


@jax.jit
def _misfit(scale, problem, start):
    seen, weight, walk = problem
    course = smoother.profile(_outputs, scale, seen, weight, walk, start)
    left = weight * (_outputs(scale, course).predicted - seen)
    return jnp.sum(left**2) + jnp.sum(walk.residual(course) ** 2), course


@pytest.mark.parametrize("start", [0.05, 0.5, 0.95])
def test_the_course_does_not_depend_on_where_its_search_began(problem, start):
    least, course = _misfit(jnp.asarray(2.0), problem, jnp.full(ROWS, start))
    again, settled = _misfit(jnp.asarray(2.0), problem, course)
    np.testing.assert_allclose(course, settled, atol=0.1 * smoother.SETTLED)
    assert least == pytest.approx(float(again), abs=1e-3)


def test_the_profile_has_the_same_slope_forwards_backwards_and_by_differences(problem):
    start = jnp.full(ROWS, 0.5)
    cost = lambda scale: _misfit(scale, problem, start)[0]  # noqa: E731
    at, step = jnp.asarray(1.9), 1e-4
    forward = jax.jvp(cost, (at,), (jnp.ones(()),))[1]
    assert float(jax.grad(cost)(at)) == pytest.approx(float(forward), rel=1e-9)
    assert float((cost(at + step) - cost(at - step)) / (2 * step)) == pytest.approx(float(forward), rel=1e-4)


def test_beside_correlated_noise_the_course_is_that_of_generalised_least_squares():
    """Against a dense solution, for two outputs that are linear in the fraction; its derivative, too."""
    random, time, zeros = np.random.default_rng(0), np.arange(float(ROWS)), ((3.0, 0.1), (1.0, 2.0))
    slope, seen = np.stack([15.0 + np.sin(time), np.full(ROWS, 300.0)]), random.standard_normal((2, ROWS))
    weight, dense, whitenings = np.array([1.1, 0.9])[:, None] * np.ones((2, ROWS)), [], []
    for zero, w in zip(zeros, weight, strict=True):
        modes, width = modes_of(time, np.ones(ROWS), *zero)
        part = 1.0 - 1.0 / np.sqrt(1.0 + width)
        whitenings.append(Whitening(modes, modes * part, np.asarray(1.0)))
        noise = np.eye(ROWS) + modes @ np.diag(width) @ modes.T
        dense.append(np.diag(w) @ np.linalg.solve(noise, np.diag(w)))
    walk = smoother.Walk.over(
        jnp.asarray(time), jnp.ones(ROWS, bool), jnp.asarray(1e-5), jnp.asarray(0.5), jnp.asarray(0.5)
    )

    def outputs(offset, xi0):
        return smoother.Local(slope * (xi0 - 0.5) + offset, slope, 0.0 * slope, jnp.zeros(ROWS, int))

    def found(offset):
        independent = lambda x: jnp.stack([w(row) for w, row in zip(whitenings, x, strict=True)])  # noqa: E731
        return smoother.profile(outputs, offset, seen, weight, walk, jnp.full(ROWS, 0.5), independent)

    steps = np.diff(np.eye(ROWS), axis=0) * np.asarray(walk.weight)[1:, None]
    matrix = steps.T @ steps + sum(s[:, None] * p * s for s, p in zip(slope, dense, strict=True))
    matrix[0, 0] += float(walk.level_weight) ** 2

    def solved(offset):
        right = sum(s * (p @ (y - offset)) for s, p, y in zip(slope, dense, seen, strict=True))
        return np.linalg.solve(matrix, right)

    course, moved = jax.jit(lambda at: jax.jvp(found, (at,), (jnp.ones(()),)))(jnp.asarray(0.2))
    np.testing.assert_allclose(course - 0.5, solved(0.2), atol=0.01 * np.max(np.abs(solved(0.2))))
    want = solved(1.2) - solved(0.2)
    np.testing.assert_allclose(moved, want, atol=0.01 * np.max(np.abs(want)))


def _dense(local, weights, walk, state, noises=None):
    """The whole Gauss-Newton matrix of a trajectory."""
    steps = np.asarray(jax.jacobian(walk.residual)(state))
    matrix, rows = steps.T @ steps, len(state)
    for k, (slope, memory) in enumerate(zip(local.slope, local.remembered, strict=True)):
        design = np.asarray(weights[k])[:, None] * (
            np.diag(slope) + np.asarray(memory)[:, None] * np.eye(rows)[np.asarray(local.source)]
        )
        matrix += design.T @ (design if noises is None else np.linalg.solve(noises[k], design))
    return matrix


@pytest.fixture(scope="module")
def remembering():
    """A trajectory with two outputs that remember row 3 from row 4 on, and row 15 from row 16 on.

    Row 15 remembers row 3 itself. Two rows are beyond the limits, and nothing was measured in row 20.
    """
    random, number = np.random.default_rng(8), np.arange(ROWS)
    source = np.where(number < 4, 0, np.where(number < 16, 3, 15))
    slope, memory = random.standard_normal((2, 2, ROWS))
    local = smoother.Local(jnp.zeros((2, ROWS)), slope, np.where(number < 4, 0.0, memory), source)
    weight = random.uniform(1.0, 30.0, (2, ROWS)) * (number != 20)
    walk = smoother.Walk.over(
        jnp.asarray(number * 1.0), jnp.ones(ROWS, bool), jnp.asarray(1e-3), jnp.asarray(0.5), jnp.asarray(0.5)
    )
    state = np.clip(0.5 + 0.1 * random.standard_normal(ROWS), 0.0, 1.0)
    state[[5, 15]] = -0.01, 1.02
    return jax.tree.map(jnp.asarray, (local, weight, walk, state, random.standard_normal(ROWS)))


def test_a_step_solves_the_whole_system_of_rows_that_remember(remembering):
    local, weight, walk, state, right = remembering
    found = jax.jit(smoother.solve)(*remembering)
    want = np.linalg.solve(_dense(local, weight, walk, state), right)
    np.testing.assert_allclose(found, want, rtol=1e-9, atol=1e-12)
    slope = jax.jit(jax.grad(lambda right: jnp.sum(smoother.solve(local, weight, walk, state, right) ** 2)))(right)
    back = np.linalg.solve(_dense(local, weight, walk, state), 2.0 * want)
    np.testing.assert_allclose(slope, back, rtol=1e-9, atol=1e-12)


def test_beside_correlated_noise_a_step_solves_the_whole_system_nearly(remembering):
    local, weight, walk, state, right = remembering
    noises, whitenings = [], []
    for zero in ((3.0, 0.1), (1.0, 2.0)):
        modes, width = modes_of(np.arange(float(ROWS)), np.ones(ROWS), *zero)
        part = 1.0 - 1.0 / np.sqrt(1.0 + width)
        whitenings.append(Whitening(modes, modes * part, np.asarray(1.0)))
        noises.append(np.eye(ROWS) + modes @ np.diag(width) @ modes.T)
    independent = lambda x: jnp.stack([w(row) for w, row in zip(whitenings, x, strict=True)])  # noqa: E731
    found = jax.jit(lambda *parts: smoother.solve(*parts, independent))(*remembering)
    matrix = _dense(local, weight, walk, state, noises)
    want = np.linalg.solve(matrix, right)
    off = np.asarray(found) - want
    assert off @ matrix @ off < (2.0 * CLOSE) ** 2 * (want @ matrix @ want)


def _steep(middle, xi0):
    """One output that turns within a few hundredths of the fraction."""
    u = 40.0 * (xi0 - middle)
    slope = (40.0 / (1.0 + u**2))[None]
    return smoother.Local(jnp.arctan(u)[None], slope, jnp.zeros_like(slope), jnp.zeros(ROWS, int))


def test_a_search_whose_steps_would_go_round_in_circles_comes_down():
    """Full Gauss-Newton steps go from 0.588 to 0.288 and back for ever; halved ones arrive."""
    walk = smoother.Walk.over(
        jnp.arange(float(ROWS)), jnp.ones(ROWS, bool), jnp.asarray(1.0), jnp.asarray(0.5), jnp.asarray(10.0)
    )
    seen, weight = jnp.zeros((1, ROWS)), jnp.full((1, ROWS), 50.0)
    course = smoother.profile(_steep, jnp.asarray(0.5), seen, weight, walk, jnp.full(ROWS, 0.75))
    np.testing.assert_allclose(course, 0.5, atol=1e-3)


def test_the_determinant_beside_correlated_noise_is_that_of_the_full_matrix():
    """Two outputs of a trajectory, one with a zero that drifts, one of a wrong scale; against dense matrices."""
    rng, rows, sizes = np.random.default_rng(3), 12, ((2.0, 0.5, 1.0), (0.0, 0.0, 1.3))
    time, slopes = np.arange(float(rows)), rng.uniform(0.5, 2.0, (2, rows))
    walk = smoother.Walk.over(time, np.ones(rows, bool), jnp.asarray(0.03), jnp.asarray(0.5), jnp.asarray(0.4))
    local = smoother.Local(
        jnp.zeros((2, rows)), jnp.asarray(slopes), jnp.zeros((2, rows)), jnp.zeros(rows, int)
    )
    dense, columns, scaled = np.zeros((rows, rows)), [], []
    for slope, (drift, offset, scale) in zip(slopes, sizes, strict=True):
        modes, width = (x[..., :rows] for x in modes_of(time, np.ones(rows), drift, offset))
        part = 1.0 - scale / np.sqrt(scale**2 + width)
        noise = Whitening(jnp.asarray(modes), jnp.asarray(modes * part), jnp.asarray(scale))
        covariance = scale**2 * np.eye(rows) + (modes * width) @ modes.T
        dense += slope[:, None] * np.linalg.inv(covariance) * slope
        columns.append(slope[:, None] / scale * np.asarray(noise.taken))
        scaled.append(np.full(rows, 1.0 / scale))
    diagonal, upper = walk.curvature(jnp.full(rows, 0.5))
    upper = np.asarray(upper)[:-1]
    dense += np.diag(np.asarray(diagonal)) + np.diag(upper, 1) + np.diag(upper, -1)
    found = jax.jit(lambda local, scaled, columns: smoother.log_determinant_less(
        *smoother.hessian(local, scaled, walk, jnp.full(rows, 0.5)), columns
    ))(local, np.stack(scaled), np.concatenate(columns, axis=1))  # fmt: skip
    assert found == pytest.approx(np.linalg.slogdet(dense)[1], rel=1e-12)
