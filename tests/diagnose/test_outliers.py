"""Readings that stand apart from their neighbours are no physics; what steps, bends or lags is not set aside."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_coupons import NOISE, curve, write
from linear_world import SIGMA as SIZE
from linear_world import tubes

from fitting.data.recordings import Recording, Reduction, read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.fit import base_fit
from fitting.diagnose.fit.outliers import Outliers, among_readings, outliers_of, without_outliers
from fitting.inference.channels import Channel

ROWS, SIGMA = 400, 0.1
TIME = np.arange(float(ROWS))


def apart(measured, predicted, sigma=SIGMA, clock=TIME):
    channel = Channel("force", measured, np.full(len(measured), sigma), 0.0)
    rows, far = outliers_of(channel, predicted, clock)
    return rows.tolist(), far


def noise(seed=1):
    return SIGMA * np.random.default_rng(seed).standard_normal(ROWS)


@pytest.mark.parametrize("course", [0.0 * TIME, 3.0 * TIME, np.sin(TIME / 30.0), 5.0 * np.abs(TIME - 200.0)])
def test_single_readings_far_from_both_sides_stand_apart_on_any_course(course):
    measured = course + 2.0 + noise()  # what the model misses by a slow course says nothing of single rows
    assert apart(measured, course) == ([], 0.0)
    for row, size in ((50, 12.0), (51, -15.0), (230, 20.0)):
        measured[row] += size * SIGMA
    rows, far = apart(measured, course)
    assert rows == [50, 51, 230] and 17.0 < far < 23.0


@pytest.mark.parametrize("left", [
    np.where(TIME > 200.0, 3.0, 0.0),  # a step
    5.0 * np.abs(np.sin(TIME / 40.0)),  # corners
    np.where((TIME > 100.0) & (TIME < 104.0), 3.0, 0.0),  # three rows
    3.0 * (np.arange(ROWS) % 20 == 0),  # a twentieth of all rows
])  # fmt: skip
def test_steps_corners_and_what_comes_often_do_not(left):
    assert apart(left + noise(), 0.0 * TIME)[0] == []


def test_what_a_delay_leaves_at_a_step_does_not():
    course = np.where(TIME > 200.0, 3.0, 0.0)
    late = np.concatenate([course[:1], course[:-1]])
    assert np.count_nonzero(np.abs(late - course) > 1.0) == 1
    assert apart(late + noise(), course)[0] == []


def test_what_goes_with_a_load_does_not_where_it_turns():
    """One row is at the largest strain, and those beside it are not."""
    load = 5.0 * np.abs(TIME - 200.0)
    assert apart(load + 3.0 * (load < 2.0) + noise(), load)[0] == []


def test_a_row_that_the_logger_left_out_is_no_bend_of_the_model():
    there = np.arange(ROWS) != 52  # two rows on, so the ramp rises by twice as much there
    measured, ramp = 6.0 * TIME + noise(), 6.0 * TIME
    measured[51] += 12.0 * SIGMA
    assert apart(measured[there], ramp[there], SIGMA, TIME[there])[0] == [51]
    assert apart(measured[there], ramp[there], SIGMA, np.zeros(ROWS - 1))[0] == []  # a clock that stands still


def test_outliers_are_looked_for_again_under_the_noise_that_is_found(monkeypatch):
    """The first estimate of a noise that nobody states has the outliers in it."""

    class Known:
        def __init__(self, sigma, outliers=()):
            self.sigma, self.outliers, self.process_noise = sigma, outliers, np.zeros((1, 0))

        def prepared(self, *_):
            return self

    found = {"without_outliers": lambda p, _: Known(p.sigma, (1,) if p.sigma < 0.1 else p.outliers),
             "with_noise_of": lambda p, *_: Known(0.05, p.outliers)}  # fmt: skip
    for name, instead in found.items():
        monkeypatch.setattr(base_fit, name, instead)
    fit = SimpleNamespace(u=np.zeros(1), evaluation=None, slugs=())
    monkeypatch.setattr(base_fit, "Refitter", lambda _: SimpleNamespace(fit=lambda *_: fit))
    assert base_fit.fit_with_noise(Known(0.2), fit)[0].outliers == (1,)


@pytest.mark.parametrize(("second", "left_out"), [(2, 6), (3, 4)])
def test_outliers_of_two_looks_are_told_together_and_share_one_limit(second, left_out):
    """Of 200 readings 3 % may be outliers. Each look alone had its own 3 %, and a note of its own."""
    world, spikes = tubes(recordings=1, rows=200), np.zeros((1, 200))
    spikes[0, 20 : 20 + 20 * (4 + second) : 20] = 30.0
    program = world.program(np.random.default_rng(5).standard_normal((1, 200)) + spikes)
    seen = spikes.copy()
    seen[0, :100] = 0.0  # the first look explains what the second one does not
    for explained in (seen, 0.0 * seen):
        program = without_outliers(program, SimpleNamespace(predicted=[[SIZE * explained[0]]]))
    (told,) = program.outliers
    assert told.times == tuple(20.0 * (1 + np.arange(left_out)))
    assert np.isinf(program.channels[0][0].sigma).sum() == left_out
    assert without_outliers(program, SimpleNamespace(predicted=[[0.0 * TIME[:200]]])) is program


def test_noise_that_is_larger_than_stated_does_not():
    assert apart(4.0 * noise(), 0.0 * TIME)[0] == []


def test_kept_rows_of_a_long_recording_stand_apart_only_among_its_readings():
    """A fast cycle: rows that were kept differ by all of it, readings beside them hardly."""
    time = np.arange(4000.0)
    force = 3.0 * np.sin(time / 12.0) + SIGMA * np.random.default_rng(2).standard_normal(4000)
    force[1510] += 4.0
    read = Recording("r", None, "spring", columns={"time_s": time, "elongation_mm": time, "force_N": force})
    kept = np.arange(0, 4000, 10)
    columns = {name: column[kept] for name, column in read.columns.items()}
    short = dataclasses.replace(read, columns=columns, reduction=Reduction(read, kept, 1, ""))
    channel = Channel("force", force[kept], np.full(ROWS, SIGMA), 0.0)
    assert among_readings(short, channel, np.array([7, 151, 300])).tolist() == [151]
    assert among_readings(read, channel, np.array([7, 151])).tolist() == [7, 151]


def test_missing_rows_are_nobodys_neighbours():
    measured = noise()
    measured[[10, 11, 12, 200]] = 99.0
    sigma = np.where(np.isin(TIME, [10, 11, 12]), np.inf, SIGMA)
    assert apart(measured, 0.0 * TIME, sigma)[0] == [200]


def test_spikes_of_a_load_cell_are_no_physics_and_a_note_names_them(tmp_path):
    spikes = np.zeros(200)
    spikes[[38, 52]] = -20.0 * NOISE, 15.0 * NOISE
    folder = write(tmp_path / "c", lambda e: 1.02 * curve(e) + spikes[: e.size])
    conclusion = diagnose(read_campaign(folder), seed=1)
    assert not conclusion.mismatch
    said = [note for note in conclusion.notes if "not counted" in note]
    assert said and "stress at" in said[0]


def test_a_note_names_a_few_rows():
    text = Outliers("pull_1", "stress", tuple(np.arange(9.0)), 12.3).text
    assert text == (
        "pull_1: not counted, for far from the readings on both sides (by up to 12 standard deviations): "
        "stress at 0, 1, 2, ... s"
    )
