"""Rows of zeros at the end of a file, which a logger wrote as it ran on, are noticed and make no test."""

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_files, make_options

N = 60
TIME = 0.5 * np.arange(N)
PULL = 20.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, N)))
HEAD = "Time (s),Extension (mm),Load (N)\n"
SIZES = make_options(kind="elastomer", dimensions=["gauge_length_mm=25", "area_mm2=20"])


def rows(pull, time=TIME):
    return "".join(f"{t:.1f},{x:.4f},{0.05 * x:.4f}\n" for t, x in zip(time, pull, strict=False))


def asked(recording):
    return [note for note in checks(recording) if "did the logger run on" in note]


@pytest.mark.parametrize("kept", [30, N])
@pytest.mark.parametrize(("zeros", "where", "were"), [(5, "rows {} to {} at the end are", "They were"), (1, "row {} at the end is", "It was")])
def test_rows_of_zeros_whose_clock_is_zero_are_left_out(put, kept, zeros, where, were):
    """They became a test of their own."""
    path = put("a.csv", HEAD + rows(PULL[:kept]) + "0.0,0.0000,0.0000\n" * zeros)
    (recording,) = import_files([path], SIZES)
    np.testing.assert_allclose(recording.columns["time_s"], TIME[:kept])
    (note,) = asked(recording)
    assert where.format(kept + 2, kept + 1 + zeros) in note and "the clock included: did the logger run on" in note
    assert f"{were} left out" in note


def test_a_count_of_rows_may_go_on_beside_zeros(put):
    numbered = "".join(f"{k},{line}\n" for k, line in enumerate((rows(PULL) + "0.0,0.0,0.0\n" * 5).splitlines()))
    (recording,) = import_files([put("a.csv", f"No.,{HEAD}{numbered}")], SIZES)
    assert len(recording) == N and len(asked(recording)) == 1


def test_the_shorter_one_of_two_tests_side_by_side_may_end_in_zeros(put):
    whole, short = rows(PULL).splitlines(), [*rows(PULL[:40]).splitlines(), *["0.0,0.0,0.0"] * 20]
    text = f"{HEAD.strip()},{HEAD}" + "".join(f"{one},{two}\n" for one, two in zip(whole, short, strict=True))
    recordings = import_files([put("a.csv", text)], SIZES)
    assert [len(one) for one in recordings] == [N, 40] and [len(asked(one)) for one in recordings] == [0, 1]


def test_a_test_that_begins_again_at_zero_is_one_of_its_own(put):
    recordings = import_files([put("a.csv", HEAD + rows(PULL) + rows(PULL[:30]))], SIZES)
    assert [len(one) for one in recordings] == [N, 30] and not any(map(asked, recordings))


def at_end(put, pull, zeros, temperature=25.0, heads=HEAD, sizes=SIZES):
    """Import of a test with rows of zeros below it, under a clock that goes on, beside a column in degrees."""
    lines = rows(np.append(pull, np.zeros(zeros)), 0.5 * np.arange(len(pull) + zeros)).splitlines()
    beside = [temperature] * len(pull) + [0.0] * zeros
    text = "".join(f"{line},{t}\n" for line, t in zip(lines, beside, strict=True))
    (recording,) = import_files([put("a.csv", f"{heads.strip()},Temperature (degC)\n{text}")], sizes)
    assert len(recording) == len(pull) + zeros
    return recording


@pytest.mark.parametrize(
    ("pull", "zeros", "asks"),
    [
        (PULL[:30], 5, 1),
        (PULL[:30], 2, 0),
        (np.concatenate([np.zeros(4), PULL[:26]]), 5, 1),
    ],
)
def test_zeros_under_a_clock_that_goes_on_are_asked_about_where_a_column_is_not_zero_at_rest(put, pull, zeros, asks):
    """No specimen at rest has 0 degrees where it had 25 before."""
    recording = at_end(put, pull, zeros)
    assert len(asked(recording)) == asks
    assert not asks or "are zero in every column but the clock, and the row above is not" in asked(recording)[0]


@pytest.mark.parametrize("pull", [PULL, PULL[:30], PULL[20:40], np.tile(PULL[::6], 3)[:24]])
def test_a_specimen_that_rests_at_the_end_is_no_logger_that_ran_on(put, pull):
    """Each column is near zero where the drive is, and the test ends there."""
    text = rows(np.append(pull, np.zeros(5)), 0.5 * np.arange(len(pull) + 5))
    (recording,) = import_files([put("a.csv", HEAD + text)], SIZES)
    assert len(recording) == len(pull) + 5 and not asked(recording)


def test_a_vented_actuator_with_coarse_readings_is_at_rest(put):
    steps = np.repeat(np.arange(12), 6)
    drive, angle = np.append(5 + steps, np.zeros(8, int)), np.append(5 + 3 * steps, np.zeros(8, int))
    text = "".join(f"{k},{p},{a}\n" for k, (p, a) in enumerate(zip(drive, angle, strict=True)))
    (recording,) = import_files([put("a.csv", "Time (s),Pressure (kPa),Bend angle (deg)\n" + text)], make_options(kind="actuator"))
    assert len(recording) == len(drive) and not asked(recording)


@pytest.mark.parametrize(
    ("heads", "options"),
    [
        ("Strain (%),Stress (kPa),Force (N)", {"kind": "elastomer"}),
        ("Temperature (degC),Strain (%),Stress (MPa)", {"kind": "wire"}),
        ("Pressure (kPa),Elongation (mm),Force (N)", {"kind": "tube", "dimensions": ["length_mm=56"]}),
        ("Applied strain (%),Stress (kPa),Force (N)", {"kind": "elastomer", "columns": ["strain=1"]}),
    ],
)
def test_a_quantity_in_steps_of_one_is_no_count_of_rows(put, heads, options):
    """What breaks or bursts while it is driven on reads zero in all other columns."""
    text = "".join(f"{k},{0.1 * k:.1f},{0.2 * k:.1f}\n" if k < 54 else f"{k},0,0\n" for k in range(60))
    (recording,) = import_files([put("a.csv", f"{heads}\n{text}")], make_options(**options))
    assert len(recording) == 60 and not asked(recording)


def test_rows_that_are_dropped_for_want_of_a_time_are_not_asked_about(put):
    text = rows(PULL[:30]).replace("\n", ",25\n") + ",0,0,0\n" * 4
    (recording,) = import_files([put("a.csv", f"{HEAD.strip()},Temperature (degC)\n{text}")], SIZES)
    assert len(recording) == 30 and not asked(recording)
