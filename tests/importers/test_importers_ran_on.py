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


@pytest.mark.parametrize(
    ("pull", "zeros", "asks"),
    [
        (PULL[:30], 5, 1),
        (PULL[:30], 2, 0),
        (PULL, 5, 0),
        (np.concatenate([np.zeros(4), PULL[:26]]), 5, 0),
    ],
)
def test_zeros_under_a_clock_that_goes_on_are_asked_about_where_readings_fall_to_them(put, pull, zeros, asks):
    """A specimen that is unloaded, or rests at zero before the test as well, reads so."""
    time = 0.5 * np.arange(len(pull) + zeros)
    (recording,) = import_files([put("a.csv", HEAD + rows(np.append(pull, np.zeros(zeros)), time))], SIZES)
    assert len(recording) == len(pull) + zeros and len(asked(recording)) == asks
    assert not asks or "are zero in every column but the clock, and the row above is not" in asked(recording)[0]
