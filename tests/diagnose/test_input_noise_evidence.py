"""Noise of inputs that an effect averages away: what it fits better by that is no physics."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from linear_world import DELAY, SIGMA, World

from fitting.diagnose.evaluate.evaluation import Raw
from fitting.diagnose.evaluate.inputs import shifted, white_noise
from fitting.diagnose.fit import input_noise_evidence
from fitting.diagnose.fit.refit import Fit
from fitting.inference.latent_trajectory.denoise import denoised

ROWS, STATED = 4000, 0.2


class Stand(World):
    """An output, in 1-sigmas, of five times the pressure of a row in Pa, or its mean with the row before."""

    def run(self, u, columns, stacked, chosen=None):
        there = 5.0 * np.asarray(stacked.inputs["pressure"])
        late = 0.5 * (there + np.concatenate([there[:, :1], there[:, :-1]], axis=1))
        found = SIGMA * (late if u[0] else there)
        if u[0] == 0.0 and self.stated and not np.array_equal(stacked.inputs["pressure"], self.effects["course"]):
            found[0, 7] += 30.0 * SIGMA * len(self.effects["lost"])
        slopes = np.zeros((len(columns), *found.shape))
        return Raw(stacked, {"length": found}, {"length": slopes}, {"length": slopes[:0]}, {})


def stand(course, stated=STATED, lost=()):
    """A campaign of it with one recording to fit and one for validation, and fits without and with the delay.

    Rows `course` are what smoothing left of the readings.
    """
    inputs = np.stack([course, 3.0 * course])
    world = Stand(np.zeros((2, ROWS, 0)), {DELAY: np.zeros((2, ROWS, 1))}, ("fit", "validation"))
    program = world.program(np.zeros((2, ROWS)))
    world.effects.update(course=inputs, lost=lost)
    stacked = dataclasses.replace(program.stacked, inputs={"pressure": jnp.asarray(inputs)})
    columns = [{"time_s": np.arange(float(ROWS)), "pressure_kPa": row / 1e3} for row in inputs]
    recordings = [
        dataclasses.replace(r, columns=c | {"length_mm": r.columns["length_mm"]}, noise=r.noise | {"pressure_kPa": stated / 1e3})
        for r, c in zip(program.recordings, columns, strict=True)
    ]  # fmt: skip
    program = dataclasses.replace(program, stacked=stacked, recordings=recordings)
    empty = program.unknowns.base[:0]
    fits = []
    for delay in (0.0, 1.0):
        u = np.array([delay])
        fits.append(Fit(u, empty, (), 0.0, np.zeros((0, 0)), program.evaluate(u, empty), ()))
    return program, *fits


def drifting(rho, size, rng):
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
    readings = np.arange(float(ROWS)) + drifting(rho, STATED, np.random.default_rng(2))
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
    readings = np.arange(float(ROWS)) + STATED * np.random.default_rng(1).standard_normal(ROWS)
    whole = input_noise_evidence.explained_by_input_noise(*stand(readings))
    program, current, late = stand(readings, lost=("a row",))
    assert input_noise_evidence.explained_by_input_noise(program, current, late) == pytest.approx(whole, rel=0.01)


def test_inputs_move_by_a_number_for_each_recording_or_for_each_row():
    program, *_ = stand(np.zeros(ROWS))
    each = np.ones((2, 1)) * np.arange(float(ROWS))
    assert np.array_equal(shifted(program.stacked, "pressure", each).inputs["pressure"], each)
    assert np.all(np.asarray(shifted(program.stacked, "pressure", np.array([2.0, 1.0])).inputs["pressure"])[0] == 2.0)


def test_noise_is_none_of_padding_and_not_more_than_an_input_is_said_to_have():
    program, *_ = stand(np.arange(float(ROWS)) + 2.0 * np.random.default_rng(1).standard_normal(ROWS))
    sigma = white_noise(program.recordings, program.stacked)["pressure"]
    assert sigma[0] == pytest.approx(STATED) and sigma[1] == pytest.approx(STATED)
