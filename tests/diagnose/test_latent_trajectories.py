"""Latent trajectories of actuators: linear algebra that takes them out of a misfit."""

import numpy as np
import pytest

from fitting.diagnose.evaluate.latent_trajectories import LatentTrajectory, averaging, remembered_rows
from fitting.diagnose.evaluate.process_noise import estimated_process_noise, process_noise_of
from fitting.diagnose.evaluate.variable_projection import Projection
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.probabilities import weights_of
from fitting.inference.channels import Channel

ROWS = 24
TIME = np.arange(ROWS) * 0.5


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def channels(rng):
    sigma = np.full(ROWS, 0.2)
    sigma[5] = np.inf
    return [
        Channel("curvature", rng.normal(size=ROWS), sigma, 0.4),
        Channel("resistance_2", rng.normal(size=ROWS), np.full(ROWS, 0.05), 0.0),
    ]


def course(rng, fraction, process_noise=1e-3, number=0):
    moved, memory = rng.normal(size=(2, 2, ROWS))
    return LatentTrajectory.of(number, fraction, moved, memory, process_noise, TIME)


def smooth(rng):
    return 0.5 + 0.2 * np.sin(TIME / 3.0) + 0.01 * rng.normal(size=ROWS)


def test_the_design_is_the_derivative_of_what_the_courses_change(rng):
    members, one = channels(rng), course(rng, smooth(rng))
    step = rng.normal(size=ROWS)
    plain = one.change(step)
    whole = np.concatenate([c.whitened(x) for c, x in zip(members, plain, strict=True)])
    np.testing.assert_allclose(Projection([one], members).change(step[None]), whole, atol=1e-12)


def test_rows_remember_the_hottest_before_them(rng):
    fraction = np.array([1.0, 0.8, 0.9, 0.5, 0.7, 0.4])
    np.testing.assert_array_equal(remembered_rows(fraction), [True, True, False, True, False, True])
    moved, memory = np.ones((1, 6)), np.full((1, 6), 0.25)
    one = LatentTrajectory.of(0, fraction, moved, memory, 1e-3, np.arange(6.0))
    np.testing.assert_array_equal(one.source, [0, 1, 1, 3, 3, 5])
    np.testing.assert_allclose(one.own[0], [1.0, 1.0, 0.75, 1.0, 0.75, 1.0])
    np.testing.assert_allclose(one.remembered[0], [0.0, 0.0, 0.25, 0.0, 0.25, 0.0])


@pytest.mark.parametrize("count", [1, 2])
def test_the_answer_is_the_least_squares_solution(rng, count):
    members = channels(rng)
    free = [course(rng, smooth(rng), number=n) for n in range(count)]
    projection = Projection(free, members)
    misfit, jacobian = rng.normal(size=2 * ROWS), rng.normal(size=(3, 2 * ROWS))
    answer = projection.answer(misfit, jacobian)

    def cost(step):
        walks = sum(
            0.5 * np.sum(c.precision * np.diff(c.fraction + s, prepend=(c.fraction + s)[:1]) ** 2)
            for c, s in zip(free, np.split(step, count), strict=True)
        )
        return 0.5 * np.sum((misfit + projection.change(step.reshape(count, ROWS))) ** 2) + walks + 0.5e-6 * step @ step

    best = answer.steps.ravel()
    least = cost(best)
    assert all(cost(best + 1e-3 * rng.normal(size=best.size)) > least for _ in range(50))
    np.testing.assert_allclose(answer.misfit, misfit + projection.change(answer.steps))
    shift = 1e-4 * np.array([1.0, -2.0, 0.5])
    again = projection.answer(misfit + shift @ jacobian, jacobian)
    np.testing.assert_allclose(again.misfit, answer.misfit + shift @ answer.jacobian, atol=1e-9)
    np.testing.assert_allclose(
        again.steps, answer.steps + np.tensordot(shift, answer.slopes, axes=1), atol=1e-9
    )


@pytest.mark.parametrize("count", [1, 2, 3])
def test_elimination_of_rows_solves_the_whole_system(rng, count):
    """Against the dense system: rows that remember others, correlated errors, gaps, padding, rows at an end."""
    rows, there = 60, 50
    sigma = np.where(np.arange(rows) < there, 0.1, np.inf)
    sigma[7] = np.inf
    members = [Channel(name, rng.normal(size=rows), sigma, c) for name, c in (("curvature", 0.4), ("length", 0.0))]
    free = []
    for number in range(count):
        fraction = np.clip(0.5 + 0.3 * np.cumsum(rng.normal(size=rows)), 0.0, 1.0)
        slopes = rng.normal(size=(2, 2, rows))
        free.append(LatentTrajectory.of(number, fraction, *slopes, 1e3, np.arange(rows) * 0.5, there))
    projection = Projection(free, members)
    assert any(np.any(one.source != np.arange(rows)) and np.any(one.remembered) for one in free)
    misfit, jacobian = 0.005 * rng.normal(size=2 * rows), rng.normal(size=(20, 2 * rows))
    answer = projection.answer(misfit, jacobian)
    steps = projection._ordered(answer.steps)
    end = (projection.fraction + steps <= 0.0) | (projection.fraction + steps >= 1.0)
    limit = DEFAULT.trajectories.maximum_step
    held = ~projection.there | end
    assert np.any(end & projection.there)
    uncut = np.all(np.abs(steps) < limit)
    assert uncut or count == 3  # three fractions behind two channels are told by their walks alone
    # the derivatives of free rows, and what is left of the directions, by dense algebra
    D, H = projection.design.toarray(), projection.system.toarray()
    inside = np.flatnonzero(~held)
    slopes = np.zeros((20, len(held)))
    slopes[:, inside] = -np.linalg.solve(H[np.ix_(inside, inside)], (D.T @ jacobian.T)[inside]).T
    found = projection._ordered(answer.slopes)
    np.testing.assert_allclose(found[:, projection.there], slopes[:, projection.there], atol=1e-10)
    np.testing.assert_allclose(answer.jacobian, jacobian + slopes @ D.T, atol=1e-10)
    np.testing.assert_allclose(answer.misfit, misfit + projection.change(np.where(projection.there, steps, 0.0)
        .reshape(rows, count)[::-1].T), atol=1e-10)  # fmt: skip
    if uncut:  # the gradient vanishes in every free row
        walk = projection._ordered(np.stack([one.pull() for one in free]))
        np.testing.assert_allclose((D.T @ misfit + walk + H @ np.where(projection.there, steps, 0.0))[inside], 0.0, atol=1e-9)


def test_answers_may_be_written_into(rng):
    members = channels(rng)
    projection = Projection([course(rng, smooth(rng))], members)
    misfit, jacobian = rng.normal(size=2 * ROWS), rng.normal(size=(3, 2 * ROWS))
    first = projection.answer(misfit, jacobian)
    expected = [x.copy() for x in (first.steps, first.slopes, first.misfit, first.jacobian)]
    for _ in range(2):
        again = projection.answer(misfit, jacobian)
        for x, y in zip((again.steps, again.slopes, again.misfit, again.jacobian), expected, strict=True):
            np.testing.assert_array_equal(x, y)
            x[:] = 7.0


def test_the_factor_is_as_sparse_as_the_system(rng):
    """Backwards in time, hardly anything fills in; forwards, five times as much does."""
    members = channels(rng)
    projection = Projection([course(rng, smooth(rng), number=n) for n in range(2)], members)
    assert projection._factor(projection.there).L.nnz <= 1.05 * (projection.system.nnz + projection.system.shape[0]) / 2


@pytest.mark.parametrize("own", [0.0, 0.1, 1.0, 10.0])
@pytest.mark.parametrize("process_noise", [1e-15, 1e-10, 1e-6])
@pytest.mark.parametrize("interval", [1e-3, 1.0])
def test_freedom_is_that_of_the_rows_where_walks_are_as_stiff_as_numbers_can_hold(own, process_noise, interval):
    """Against the singular values of the same problem, which no rounding drowns; zero without information."""
    count = 200
    slope = np.full((1, count), own)
    one = LatentTrajectory.of(0, np.full(count, 0.5), slope, 0.0 * slope, process_noise, interval * np.arange(count))
    projection = Projection([one], [Channel("curvature", np.zeros(count), np.ones(count), 0.0)])
    rise = np.diff(np.eye(count), axis=0) / np.sqrt(process_noise * interval)
    hold = np.sqrt(DEFAULT.trajectories.hold_weight) * np.eye(count)
    Q, _ = np.linalg.qr(np.concatenate([rise, own * np.eye(count), hold]))
    assert projection.degrees_of_freedom() == pytest.approx(np.sum(Q[count - 1 : 2 * count - 1] ** 2), abs=1e-3)
    assert np.all(np.isfinite(projection.answer(np.ones(count), np.ones((1, count))).steps))


def test_fractions_stay_within_their_limits_and_take_nothing_up_there(rng):
    members = channels(rng)
    one = LatentTrajectory.of(0, np.full(ROWS, 0.999), -np.ones((2, ROWS)), np.zeros((2, ROWS)), 1e-3, TIME)
    projection = Projection([one], members)
    answer = projection.answer(np.full(2 * ROWS, 3.0), np.ones((1, 2 * ROWS)))
    assert np.max(one.fraction + answer.steps[0]) <= 1.0
    assert not np.any(answer.slopes)
    np.testing.assert_allclose(answer.jacobian, 1.0)


def test_what_courses_take_up_is_one_value_a_row_where_they_are_loose(rng):
    members = channels(rng)
    loose = Projection([course(rng, smooth(rng), process_noise=1e6)], members)
    stiff = Projection([course(rng, smooth(rng), process_noise=1e-14)], members)
    assert loose.leverage().sum() == pytest.approx(ROWS, rel=1e-3)
    assert stiff.leverage().sum() == pytest.approx(1.0, rel=1e-2)
    for fraction in (smooth(rng), np.where(np.arange(ROWS) < 9, 1.0, 0.4), np.ones(ROWS)):
        one = Projection([course(rng, fraction, process_noise=1e-3)], members)
        assert one.degrees_of_freedom() == pytest.approx(one.leverage().sum(), rel=1e-9)


def test_rows_that_only_pad_do_not_drown_the_others_in_rounding():
    """A hundred rows that say little each, padded with ones in which time stands still."""
    time = np.concatenate([np.arange(100.0) * 0.5, np.full(28, 49.5)])
    own = np.where(np.arange(128) < 100, 0.3, 0.0)[None]
    sigma = np.where(np.arange(128) < 100, 0.03, np.inf)
    channel = Channel("resistance_2", np.zeros(128), sigma, 0.0)
    one = LatentTrajectory.of(0, np.full(128, 0.5), own, np.zeros((1, 128)), min(DEFAULT.instruments.process_noise_variances), time)
    answer = Projection([one], [channel]).answer(channel.whitened(np.where(own[0] > 0, -0.03, 0.0)), np.zeros((0, 128)))
    np.testing.assert_allclose(answer.steps[0], 0.1, rtol=1e-3)


def test_a_resistance_that_says_nothing_takes_the_process_noise_of_the_others(rng):
    time = np.arange(200) * 0.5
    blind = Channel("resistance_2", 1e-3 * rng.normal(size=200), np.full(200, 1e-3), 0.0)
    start = np.full(200, 0.5)
    assert np.isnan(process_noise_of(blind, np.full(200, 1e-6), -blind.measured, start, time))
    np.testing.assert_allclose(estimated_process_noise(np.array([[0.0, np.nan], [1e-4, 1e-6]])), [[0.0, 1e-5], [1e-4, 1e-6]])
    np.testing.assert_allclose(estimated_process_noise(np.array([[np.nan]])), DEFAULT.instruments.usual_process_noise_variance)


def test_no_form_is_natures():
    """Two explanations of nearly all of a large misfit are not told apart; of a small one they are."""
    assert weights_of(np.array([1000.0, 960.0, 0.0]))[0] < 0.8
    assert weights_of(np.array([20.0, 12.0, 0.0]))[0] > 0.99
    assert weights_of(np.array([1000.0, 500.0, 0.0]))[0] > 0.99


def test_the_process_noise_is_that_of_the_walk(rng):
    time = np.arange(400) * 0.5
    walk = 0.5 + np.cumsum(rng.normal(size=400)) * np.sqrt(1e-6 * 0.5)
    reading = Channel("resistance_2", 3.0 * walk + 1e-3 * rng.normal(size=400), np.full(400, 1e-3), 0.0)
    start = np.full(400, 0.5)
    found = process_noise_of(reading, np.full(400, 3.0), 3.0 * start - reading.measured, start, time)
    assert found == pytest.approx(1e-6)


def test_averaging_over_a_fast_change_is_half_the_bend_times_its_variance():
    time = np.linspace(0.0, 1.0, 101)
    fraction, block = 1.0 - 0.5 * time, 4
    slope = 2.0 * fraction  # of the square
    found = averaging(slope, fraction, block)
    within = 0.005 * (np.arange(block) - 1.5) / block
    np.testing.assert_allclose(found[50], np.mean(within**2), rtol=1e-6)
