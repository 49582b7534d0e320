"""Noise of inputs that an effect averages away: what it fits better by that is no physics."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import averaging, drift
from fitting.diagnosis.inputs import readings_kept, shifted
from fitting.models.rows import Rows

ROWS, STATED = 4000, 0.2


class Thermometer:
    """A recording that is noisy where it is asked for its readings."""

    def __init__(self, values):
        self.values = values

    def has(self, name):
        return name == "temperature"

    def noise_si(self, name):
        return STATED

    def si(self, name):
        return self.values

    def __len__(self):
        return len(self.values)


def stand(readings, course):
    """A program whose output, in 1-sigmas, is five times the temperature of a row, or its mean with the row before."""
    stacked = Rows(
        base={}, inputs={"temperature": course[None]}, time=np.arange(float(ROWS))[None], measured={}, weight={},
        mask=np.ones((1, ROWS), bool), specimen=np.zeros(1, int), extra={},
    )  # fmt: skip

    def evaluate(u, columns, rows):
        there = 5.0 * np.asarray(rows.inputs["temperature"])[0]
        late = 0.5 * (there + np.concatenate([there[:1], there[:-1]]))
        return SimpleNamespace(misfit=[late if u[0] else there])

    fits = [SimpleNamespace(u=np.array([x]), evaluation=SimpleNamespace(courses=np.zeros((1, 0, ROWS)))) for x in (0.0, 1.0)]
    program = SimpleNamespace(
        recordings=[Thermometer(readings)], stacked=stacked, unknowns=SimpleNamespace(base=np.zeros(0, int)),
        fitted=np.ones(1, bool), evaluate=evaluate,
    )  # fmt: skip
    return program, *fits


def test_a_mean_of_two_noisy_rows_gains_half_of_what_the_noise_makes():
    readings = np.cumsum(np.full(ROWS, 1.0)) + STATED * np.random.default_rng(1).standard_normal(ROWS)
    program, current, late = stand(readings, readings)
    made = 0.5 * ROWS * (5.0 * STATED) ** 2
    assert averaging.averaged_away(program, current, late) == pytest.approx(0.5 * made, rel=0.1)
    assert averaging.averaged_away(program, late, current) == 0.0  # what passes on more earns nothing


def test_noise_that_smoothing_took_is_averaged_away_by_nobody():
    course = np.sin(np.arange(ROWS) / 300.0)
    program, current, late = stand(course + STATED * np.random.default_rng(1).standard_normal(ROWS), course)
    assert readings_kept(program.recordings, program.stacked, "temperature")[0] < 0.01
    assert averaging.averaged_away(program, current, late) < 0.01


def test_inputs_move_by_a_number_for_each_recording_or_for_each_row():
    program, *_ = stand(np.zeros(ROWS), np.zeros(ROWS))
    each = np.arange(float(ROWS))
    assert np.array_equal(shifted(program.stacked, "temperature", each[None]).inputs["temperature"][0], each)
    assert np.all(np.asarray(shifted(program.stacked, "temperature", np.array([2.0])).inputs["temperature"]) == 2.0)


def test_what_is_averaged_away_counts_as_what_drift_explains_does(monkeypatch):
    monkeypatch.setattr(drift, "explained_by_drift", lambda *_: 3.0)
    monkeypatch.setattr(drift, "averaged_away", lambda *_: 9.0)
    monkeypatch.setattr(drift, "inflation_of", lambda *_: 2.0)
    assert drift.adrift(None, None, None) == 6.0
