"""The hidden phase of a spring in a diagnosis, and what folds and floors count."""

from functools import partial
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from linear_world import World
from one_column import Column
from scipy.linalg import block_diag, toeplitz

from fitting.diagnose.evaluate.inputs import input_noise
from fitting.diagnose.evaluate.latent_trajectories import remembered_rows as hottest
from fitting.diagnose.fit.cross_validation import gain
from fitting.diagnose.fit.misfit import floor
from fitting.diagnose.fit.refit import Refitter
from fitting.specimens.rows import Rows
from fitting.specimens.spring_course import HELD, best_course

COUNT = 12


def _rows(rng, process_noise=1e-3, correlation=(0.6, 0.0)):
    sigma = {"force": rng.uniform(0.02, 0.04, COUNT), "resistance": rng.uniform(0.01, 0.02, COUNT)}
    sigma["resistance"][5] = np.inf
    extra = {"process_noise": jnp.asarray(process_noise)}
    for name, rho in zip(sigma, correlation, strict=True):
        extra |= {f"weight_{name}": jnp.asarray(1.0 / sigma[name]), f"correlation_{name}": jnp.asarray(rho)}
    measured = {name: jnp.asarray(0.5 + 0.1 * rng.standard_normal(COUNT)) for name in sigma}
    time = jnp.cumsum(jnp.full(COUNT, 0.5))
    return SimpleNamespace(time=time, extra=extra, measured=measured, weight=dict.fromkeys(sigma)), sigma


def _course(outputs, read, rows, frozen=None):
    still = lambda x, decided_by: ((frozen or outputs)(x), hottest(x), None)  # noqa: E731
    found = best_course(lambda x, *_: outputs(x), still, read, ("force", "resistance"), rows)
    return found.course, found.taken, found.local


def _precision(sigma, correlation):
    """Inverse covariance of both channels' errors, (values, values)."""
    blocks = []
    for name, rho in zip(sigma, correlation, strict=True):
        there = np.isfinite(sigma[name])
        precision = np.zeros((COUNT, COUNT))
        runs = np.split(np.arange(COUNT), np.flatnonzero(~there))
        for run in (r[there[r]] for r in runs):
            if run.size:
                covariance = toeplitz(rho ** np.arange(run.size)) * np.outer(sigma[name][run], sigma[name][run])
                precision[np.ix_(run, run)] = np.linalg.inv(covariance)
        blocks.append(precision)
    return block_diag(*blocks)


def _walk(rows):
    steps = np.diff(np.eye(COUNT), axis=0)
    return steps.T @ steps / (float(rows.extra["process_noise"]) * 0.5) + HELD * np.eye(COUNT)


def _dense(rows, sigma, slopes, correlation):
    """The same by generalised least squares with full matrices."""
    precision, A = _precision(sigma, correlation), np.concatenate([np.diag(s) for s in slopes])
    y = np.concatenate([np.asarray(rows.measured[name]) for name in sigma])
    return np.linalg.solve(A.T @ precision @ A + _walk(rows), A.T @ precision @ y)


def test_the_course_is_that_of_generalised_least_squares():
    rng = np.random.default_rng(2)
    rows, sigma = _rows(rng)
    slopes = rng.uniform(0.8, 1.2, (2, COUNT))
    course, taken, local = jax.jit(lambda read: _course(lambda x: jnp.asarray(slopes) * x, read, rows))(jnp.full(COUNT, 0.5))
    assert course == pytest.approx(_dense(rows, sigma, slopes, (0.6, 0.0)), abs=1e-5)
    assert local.slope == pytest.approx(np.asarray(slopes), rel=1e-9)
    assert local.remembered == pytest.approx(0.0, abs=1e-9)  # slopes are differences
    assert np.all((np.asarray(taken) > 0.0) & (np.asarray(taken) <= 1.0))


@pytest.mark.parametrize("jump", [0.0, pytest.param(1e-4, marks=pytest.mark.slow), 0.02])
def test_no_course_is_credited_with_a_slope_across_a_jump(jump):
    """A last small step over a jump of all later rows is made if that is better, and predicts what is there."""
    rows, _ = _rows(np.random.default_rng(4))
    rows.measured = {name: jnp.full(COUNT, 0.5005) for name in rows.measured}

    def law(x):
        return jnp.stack([x, x]) + jump * jnp.cumsum(x > 0.5)

    laws = [lambda x, *_: law(x), lambda x, decided_by: (law(x), hottest(x), None)]
    found = jax.jit(lambda read: best_course(*laws, read, ("force", "resistance"), rows))(jnp.full(COUNT, 0.4985))
    assert found.predicted == pytest.approx(np.asarray(jax.jit(law)(found.course)), abs=1e-9)
    assert np.all(np.asarray(found.course) > 0.5) == (jump < 0.01)


def test_the_course_follows_a_constant_of_the_law_as_the_implicit_function_does():
    rng = np.random.default_rng(3)
    rows, _ = _rows(rng)
    true = 0.5 + 0.1 * jnp.sin(rows.time)
    rows.measured = {"force": true, "resistance": 0.9 * true}  # Gauss-Newton leaves out what misfit adds

    def course(gain):
        laws = [lambda x, gain=g: jnp.stack([gain * x, 0.9 * x]) for g in (gain, jax.lax.stop_gradient(gain))]
        return _course(laws[0], jnp.full(COUNT, 0.5), rows, laws[1])[0]

    slope = np.asarray(jax.jit(lambda gain: jax.jvp(course, (gain,), (1.0,))[1])(1.0))
    course = jax.jit(course)
    apart = np.asarray((course(1.0 + 1e-4) - course(1.0 - 1e-4)) / 2e-4)
    assert slope == pytest.approx(apart, abs=0.05 * np.max(np.abs(apart)))


@pytest.mark.parametrize("memory", [pytest.param(0.5, marks=pytest.mark.slow), 2.0])
def test_the_course_follows_a_constant_through_what_rows_remember_and_noise_that_lasts(memory):
    rng = np.random.default_rng(7)
    rows, sigma = _rows(rng, process_noise=1e-3, correlation=(0.7, 0.3))
    true = jnp.asarray(np.r_[0.6, 0.5, 0.4, 0.3, 0.4 + 0.01 * np.arange(COUNT - 4)])
    law = lambda x, theta: jnp.stack([0.5 * x + memory * jax.lax.cummin(x) + theta * rows.time, x])  # noqa: E731
    rows.measured = dict(zip(sigma, law(true, 0.0), strict=True))

    def solved(theta):
        return _course(partial(law, theta=theta), true, rows, partial(law, theta=0.0))

    (_, _, local), (slope, *_) = jax.jit(lambda theta: jax.jvp(solved, (theta,), (1.0,)))(0.0)
    D = np.concatenate([np.diag(np.asarray(own)) for own in local.slope])
    for j, remembered in enumerate(np.asarray(local.remembered)):
        np.add.at(D, (j * COUNT + np.arange(COUNT), np.asarray(local.source)), remembered)
    precision, moved = _precision(sigma, (0.7, 0.3)), np.r_[np.asarray(rows.time), np.zeros(COUNT)]
    expected = -np.linalg.solve(D.T @ precision @ D + _walk(rows), D.T @ precision @ moved)
    assert np.any(local.remembered)
    assert slope == pytest.approx(expected, abs=5e-3 * np.max(np.abs(expected)))


def test_a_resistance_beyond_the_law_is_left_over_where_force_knows_the_phase():
    """What stalled fits: a resistance just below the hot wire's stood for no martensite at all."""
    rows, _ = _rows(np.random.default_rng(4), correlation=(0.0, 0.0))
    rows.measured = {"force": jnp.full(COUNT, 0.35), "resistance": jnp.full(COUNT, -0.05)}
    course, *_ = jax.jit(lambda read: _course(lambda x: jnp.stack([x, x**7]), read, rows))(jnp.zeros(COUNT))
    assert course == pytest.approx(np.full(COUNT, 0.35), abs=0.02)


def test_noise_in_the_hottest_row_does_not_bend_all_that_remember_it():
    """What made a null campaign look like a mismatch: every row after the hottest remembers its fraction."""
    rng = np.random.default_rng(6)
    rows, sigma = _rows(rng, process_noise=1e-2, correlation=(0.0, 0.0))
    true = jnp.asarray(np.r_[0.6, 0.5, 0.4, 0.3, np.full(COUNT - 4, 0.5)])
    law = lambda x: jnp.stack([x + jax.lax.cummin(x), x])  # noqa: E731
    rows.measured = dict(zip(sigma, law(true), strict=True))
    rows.measured["resistance"] = rows.measured["resistance"].at[3].add(-0.1)  # the hottest row, read too hot

    def square(x):
        missing = {n: (y - rows.measured[n]) / sigma[n] for n, y in zip(sigma, law(x), strict=True)}
        return sum(jnp.sum(m**2) for m in missing.values()) + jnp.sum(jnp.diff(x) ** 2) / (1e-2 * 0.5)

    course, _, local = jax.jit(lambda read: _course(law, read, rows))(rows.measured["resistance"])
    assert local.source[-1] == 3 and local.remembered[0, 4:] == pytest.approx(1.0, rel=1e-8)
    assert course[3] == pytest.approx(0.3, abs=0.03)
    square = jax.jit(square)
    nudged = [square(course.at[3].add(d)) for d in (-0.01, 0.01)]
    assert square(course) < min(nudged)


def test_the_fold_that_fares_worst_is_forgiven_but_no_other():
    before = np.array([1.0, 1.0, 1.0])
    assert gain(before, np.array([0.5, 9.0, 0.5]))[0] == pytest.approx(1.0)
    assert gain(before, np.array([0.5, 9.0, 9.0]))[0] == pytest.approx(-7.5)
    assert gain(before, np.array([0.5, 0.9, 0.6]))[0] == pytest.approx(1.0)


def test_a_fold_that_is_forgiven_is_no_misfit_that_an_effect_must_take_away():
    before = np.array([20.0, 2.0, 2.0])
    assert gain(before, np.array([30.0, 1.0, 1.0]))[1] == pytest.approx(2.0 / (4.0 - 2.0 / 3.0))
    assert gain(before, np.array([19.0, 1.0, 2.5]))[1] == pytest.approx(2.0 / (22.0 - 2.0 / 3.0))


def test_a_fold_in_which_every_model_goes_astray_does_not_decide_the_share_that_an_effect_takes_away():
    before = np.array([20.0, 2.0, 2.0])
    assert gain(before, np.array([19.0, 1.0, 1.0])) == (3.0, pytest.approx(2.0 / (4.0 - 2.0 / 3.0)))
    assert gain(before, np.array([1.0, 1.9, 1.9]))[1] == pytest.approx(19.2 / 23.0)
    share = gain(np.array([10.0, 1.0, 1.0, 1.0]), np.array([9.9, 6.0, 0.7, 0.7]))[1]  # one other loses
    assert share == pytest.approx(0.7 / (12.0 - 0.75))
    quiet = gain(np.array([50.0, 0.34, 0.34]), np.array([49.7, 0.3, 0.3]))[1]  # the others hold hardly any misfit
    assert quiet == pytest.approx(0.38 / 49.68)


@pytest.mark.parametrize(("slow", "least", "most"), [(False, 2.0, 6.0), (True, 1.0, 1.01)])
def test_fast_misfit_is_noise_and_slow_misfit_is_not(slow, least, most):
    rng = np.random.default_rng(5)
    r = 2.0 * np.sin(np.linspace(0.0, 9.0, 200)) if slow else 2.0 * rng.standard_normal(200)
    program = World(np.zeros((1, 200, 0))).program(r[None])
    assert least <= floor(program, Refitter(program).fit(()), program.fitted) <= most


def test_noise_of_an_input_without_a_clock_and_with_correlated_errors():
    rng = np.random.default_rng(6)
    white = rng.standard_normal(400)
    slow = np.zeros(400)
    for n in range(1, 400):
        slow[n] = 0.8 * slow[n - 1] + 0.6 * white[n]
    stacked = Rows(np.ones((1, 400), bool), np.zeros((1, 400)), {"strain": None}, {}, {}, {}, {}, 1)

    def noise(values, stated):
        return input_noise([Column("strain", values, 0.01 if stated else None)], stacked)["strain"][0]

    assert noise(0.01 * white, False) == pytest.approx(0.01, rel=0.2)
    assert noise(0.01 * white, True) == pytest.approx(0.01)
    assert noise(0.01 * slow, True) == pytest.approx(0.03, rel=0.35)
