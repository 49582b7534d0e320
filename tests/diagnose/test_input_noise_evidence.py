"""Noise of inputs that an effect averages away: what it fits better by that is no physics."""

from types import SimpleNamespace

import numpy as np
import pytest
from one_column import Column

from fitting.diagnose.evaluate.inputs import shifted, white_noise
from fitting.diagnose.fit import input_noise_evidence
from fitting.inference.latent_trajectory.denoise import denoised
from fitting.specimens.rows import Rows

ROWS, STATED = 4000, 0.2


def stand(course, stated=STATED):
    """A program whose output, in 1-sigmas, is five times the temperature of a row, or its mean with the row before.

    Rows `course` are what smoothing left of the readings; a second recording is for validation, a third is padding.
    """
    blank = np.zeros((3, ROWS))
    stacked = Rows(
        base={}, inputs={"temperature": np.stack([course, 3.0 * course, 0.0 * course])}, time=blank + np.arange(float(ROWS)),
        measured={}, weight={}, mask=np.array([[True], [True], [False]]) & (blank == 0.0), specimen=np.zeros(3, int), extra={},
    )  # fmt: skip

    def evaluate(u, columns, rows):
        there = 5.0 * np.asarray(rows.inputs["temperature"])[:2]
        late = 0.5 * (there + np.concatenate([there[:, :1], there[:, :-1]], axis=1))
        return SimpleNamespace(misfit=list(late if u[0] else there))

    fits = [SimpleNamespace(u=np.array([x]), evaluation=None) for x in (0.0, 1.0)]
    program = SimpleNamespace(
        recordings=[Column("temperature", course, stated)] * 2, stacked=stacked, unknowns=SimpleNamespace(base=np.zeros(0, int)),
        fitted=np.array([True, False]), evaluate=evaluate, begun=lambda rows, near, u: rows, followed=lambda near: [None, None],
    )  # fmt: skip
    return program, *fits


def wandering(rho, size, rng):
    kicks, found = rng.standard_normal(ROWS), np.zeros(ROWS)
    found[0] = kicks[0]
    for k in range(1, ROWS):
        found[k] = rho * found[k - 1] + np.sqrt(1.0 - rho**2) * kicks[k]
    return size * found


@pytest.mark.parametrize("stated", [STATED, 5.0 * STATED])
def test_a_mean_of_two_noisy_rows_gains_half_of_what_the_noise_makes(stated):
    """Not of what a gauge is said to be good for."""
    program, current, late = stand(np.arange(float(ROWS)) + STATED * np.random.default_rng(1).standard_normal(ROWS), stated)
    made = 0.5 * ROWS * (5.0 * STATED) ** 2
    assert input_noise_evidence.explained_by_input_noise(program, current, late) == pytest.approx(0.5 * made, rel=0.1)
    assert input_noise_evidence.explained_by_input_noise(program, late, current) == 0.0  # what passes on more earns nothing


@pytest.mark.parametrize("rho", [0.3, 0.6, 0.9])
def test_errors_that_last_are_hardly_averaged_away(rho):
    readings = np.arange(float(ROWS)) + wandering(rho, STATED, np.random.default_rng(2))
    program, current, late = stand(readings)
    truth = 0.5 * ROWS * (5.0 * STATED) ** 2 * 0.5 * (1.0 - rho)
    assert 0.6 * truth < input_noise_evidence.explained_by_input_noise(program, current, late) < 1.2 * truth


@pytest.mark.parametrize(("slope", "most"), [(0.0, 0.01), (0.05, 0.1)])
def test_noise_that_smoothing_took_is_averaged_away_by_nobody(slope, most):
    time, rng = np.arange(float(ROWS)), np.random.default_rng(1)
    readings = slope * time + STATED * rng.standard_normal(ROWS)
    program, current, late = stand(denoised(time, readings))
    gained = input_noise_evidence.explained_by_input_noise(program, current, late)
    assert gained < most * 0.25 * ROWS * (5.0 * STATED) ** 2  # of what it would be, had nothing been smoothed


def test_a_row_that_loses_its_answer_counts_for_nothing():
    program, current, late = stand(np.arange(float(ROWS)) + STATED * np.random.default_rng(1).standard_normal(ROWS))
    whole, evaluate = input_noise_evidence.explained_by_input_noise(program, current, late), program.evaluate

    def failing(u, columns, rows):
        found = evaluate(u, columns, rows)
        if rows is not program.stacked and not u[0]:
            found.misfit[0][7] += 30.0
        return found

    program.evaluate = failing
    assert input_noise_evidence.explained_by_input_noise(program, current, late) == pytest.approx(whole, rel=0.01)


def test_what_hidden_courses_follow_is_passed_on_by_nobody():
    program, current, late = stand(np.arange(float(ROWS)) + STATED * np.random.default_rng(1).standard_normal(ROWS))
    program.followed = lambda near: [SimpleNamespace(projected=lambda rows: (0.0 * rows, None)), None]
    assert input_noise_evidence.explained_by_input_noise(program, current, late) == 0.0


def test_inputs_move_by_a_number_for_each_recording_or_for_each_row():
    program, *_ = stand(np.zeros(ROWS))
    each = np.ones((3, 1)) * np.arange(float(ROWS))
    assert np.array_equal(shifted(program.stacked, "temperature", each).inputs["temperature"], each)
    assert np.all(np.asarray(shifted(program.stacked, "temperature", np.array([2.0, 1.0, 0.0])).inputs["temperature"])[0] == 2.0)


def test_noise_is_none_of_padding_and_not_more_than_an_input_is_said_to_have():
    program, *_ = stand(np.arange(float(ROWS)) + 2.0 * np.random.default_rng(1).standard_normal(ROWS))
    sigma = white_noise(program.recordings, program.stacked)["temperature"]
    assert sigma[2] == 0.0 and sigma[0] == pytest.approx(STATED) and sigma[1] == pytest.approx(STATED)
