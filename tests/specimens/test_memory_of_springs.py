"""The memory of a spring in a diagnosis: which row it keeps, and that noise does not choose it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.inference.latent_trajectory.steady import steady_course
from fitting.specimens.spring import FACTOR, _process_noise
from fitting.specimens.spring_course import _linearised
from pneusma_jax.nitinol import load_alloy

ROWS = 120


@pytest.fixture(scope="module")
def spring():
    geometry = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    return pj.Spring(geometry, load_alloy("krl35"), 14e-3)


def _pulls():
    """Two pulls, each to its peak and back [m]."""
    up = np.linspace(0.0, 1.0, ROWS // 4, endpoint=False)
    return np.concatenate([0.05 * up, 0.05 * (1.0 - up), 0.07 * up, 0.07 * (1.0 - up)])


def _fraction():
    """Hot at first; cold during the second pull, which renews the memory; a little hotter when let go."""
    row = np.arange(ROWS)
    return np.interp(row, [0, 40, 55, 62, 95, 119], [0.90, 0.86, 0.88, 0.99, 0.985, 0.93])


def _outputs(spring, decided_by=None):
    def outputs(xi0):
        found = pj.simulate_spring(spring, jnp.asarray(_pulls()), pj.MartensiteFraction(xi0), decided_by=decided_by)
        return jnp.stack([found.seen["force"], found.seen["resistance"]]), found.kept, found.rows

    return outputs


def test_a_renewed_memory_is_linearised_about_the_row_that_renewed_it(spring):
    """The hottest row of the test is before the renewal. Its fraction no longer matters after it."""
    xi0 = jnp.asarray(_fraction())
    outputs = _outputs(spring)
    local, _ = _linearised(outputs, xi0)
    hottest = int(np.argmin(_fraction()[:60]))
    assert np.all(np.asarray(local.source)[-20:] > 60)
    assert float(_fraction()[hottest]) < float(_fraction()[-20:].min())
    kept = int(local.source[100])
    for row in (hottest, kept, 100):
        direction, step = jnp.zeros(ROWS).at[row].set(1.0), 1e-7
        up, down = (outputs(xi0 + sign * step * direction)[0] for sign in (1.0, -1.0))
        slopes = np.asarray((up - down) / (2 * step))
        scale = np.abs(slopes).max()
        np.testing.assert_allclose(local.along(direction), slopes, atol=1e-4 * scale, err_msg=str(row))


def test_decisions_along_the_course_itself_are_those_of_the_rule(spring):
    xi0 = jnp.asarray(_fraction())
    by_rule, by_itself = _outputs(spring)(xi0), _outputs(spring, xi0)(xi0)
    np.testing.assert_allclose(by_rule[0], by_itself[0], rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(by_rule[1], by_itself[1])


def test_noise_of_single_rows_does_not_choose_the_remembered_one(spring):
    """By the rule the mean force of noisy courses is off by the noise of the lowest of many rows."""
    truth, rng = np.full(ROWS, 0.95), np.random.default_rng(4)
    noisy = jnp.asarray(truth + 1e-3 * rng.standard_normal((200, ROWS)))
    exact = np.asarray(_outputs(spring)(jnp.asarray(truth))[0][0])
    let_go = slice(100, ROWS)
    off = {}
    for name, decided_by in (("rule", None), ("steady", jnp.asarray(truth))):
        force = np.asarray(jax.vmap(lambda x, by=decided_by: _outputs(spring, by)(x)[0][0])(noisy))
        off[name] = np.abs((force - exact)[:, let_go].mean())
    assert off["steady"] < 0.1 * off["rule"]


def test_a_steady_course_is_the_best_linear_estimate():
    """Against the same prior written as a full covariance, at the variance that maximises its likelihood."""
    rng, time = np.random.default_rng(2), 0.5 * np.arange(60)
    truth = 1.1 + 0.2 * np.sin(time / 4.0)
    read = truth + 0.01 * rng.standard_normal(60)
    precision = np.full(60, 1e4)
    precision[20:25] = 0.0
    found = np.asarray(steady_course(*map(jnp.asarray, (time, read, precision)), spread := 3.0))
    a, b = np.minimum.outer(time, time), np.abs(np.subtract.outer(time, time))
    told = precision > 0.0
    best = None
    for k in range(-14, 2):
        prior = spread**2 * (1.0 + np.outer(time, time) + 10.0**k * a**2 * (a / 3.0 + b / 2.0))
        total = prior[np.ix_(told, told)] + 1e-4 * np.eye(told.sum())
        evidence = -0.5 * (np.linalg.slogdet(total)[1] + read[told] @ np.linalg.solve(total, read[told]))
        if best is None or evidence > best[0]:
            best = evidence, prior[:, told] @ np.linalg.solve(total, read[told])
    np.testing.assert_allclose(found, best[1], atol=1e-6)
    assert np.std(found - truth) < 0.5 * np.std(read - truth)


def test_a_steady_course_without_any_reading_is_its_mean():
    time = jnp.arange(30.0)
    np.testing.assert_allclose(steady_course(time, jnp.full(30, 0.3), jnp.zeros(30), 3.0), 0.0, atol=1e-9)


def test_a_margin_decides_a_renewal_that_is_all_but_one(spring):
    """A row back from the peak, cooled so that its residual strain is 0.1 % more than the one before."""
    lengths, alloy = np.array([0.02, 0.04, 0.0395]), spring.alloy
    gamma = np.asarray(pj.simulate_spring(spring, jnp.asarray(lengths), pj.MartensiteFraction(0.9)).rows.gamma)
    left = lambda row, xi0: float(alloy.residual_strain(pj.SpringState.fresh(gamma[row]), xi0))  # noqa: E731
    cooled = 0.9 + np.log(1.001 * left(1, 0.9) / left(2, 0.9)) / float(alloy.gR_decay)
    fractions = jnp.asarray([0.9, 0.9, cooled])
    kept = {}
    for margin in (-3e-3, 0.0, 3e-3):
        phase = pj.MartensiteFraction(fractions)
        history = pj.simulate_spring(spring, jnp.asarray(lengths), phase, decided_by=fractions, margin=margin)
        kept[margin] = bool(history.kept[-1])
        renewed = float(history.states.prestrain[-1])
        assert renewed == pytest.approx(gamma[2 if kept[margin] else 1], rel=1e-9)
    assert kept == {-3e-3: True, 0.0: True, 3e-3: False}


@pytest.mark.parametrize("interval", [0.5, 2.0])
def test_a_pulse_of_heat_is_a_step_that_the_process_noise_allows(interval):
    """A step of 1e3 standard deviations had left nulls with pulses 0.1 N beside their force."""
    row = np.arange(120)
    pulses = {"full": np.where(row % 50 < 30, 1.0, 0.0), "short": np.where(row % 40 < 37, 0.999, 0.1)}
    for name, course in pulses.items():
        noise = np.asarray(_process_noise(interval * row, jnp.asarray(course), jnp.ones(120, bool)))
        steps = np.diff(course) / np.sqrt(noise[1:] * interval)
        assert np.abs(steps).max() == pytest.approx(FACTOR**-0.5, rel=1e-6), name
        still = np.abs(np.diff(course)) == 0.0
        assert np.sqrt(interval * noise[1:][still].max()) < 1e-4  # rows beside it stay as steady as they are


def test_a_cold_wire_does_not_move():
    row, course = np.arange(120), jnp.full(120, 1.0 - 6e-6)
    noise = np.asarray(_process_noise(0.5 * row, course, jnp.ones(120, bool)))
    assert np.sqrt(noise.max() * 60.0) < 1e-6
