"""Turning points between rows: exact where the drive is piecewise linear, none where nothing tells them."""

from dataclasses import replace

import numpy as np
import pytest

from fitting.data.recordings import Recording, Reduction
from fitting.specimens.reduction import reduced
from fitting.specimens.unsampled_turns import unsampled_turns, with_unsampled_turns

CORNERS = [0.0, 10.0, 17.0, 30.0], [0.0, 8.0, 2.0, 11.0]


def test_turns_of_a_piecewise_linear_drive_are_found_exactly():
    time = np.linspace(0.0, 30.0, 35)
    turns = unsampled_turns(time, np.interp(time, *CORNERS))
    assert turns.time == pytest.approx([10.0, 17.0], rel=1e-9) and turns.drive == pytest.approx([8.0, 2.0], rel=1e-9)
    assert np.all((time[turns.row] < turns.time) & (turns.time < time[turns.row + 1]))


@pytest.mark.parametrize(
    "drive",
    [
        lambda t: np.sin(0.9 * t),
        lambda t: np.interp(t, [0.0, 10.3, 20.1, 30.0], [0.0, 8.0, 8.0, 0.0]),
        lambda t: np.interp(t, *CORNERS) + 0.1 * np.random.default_rng(0).standard_normal(len(t)),
        lambda t: np.where(t < 12.0, t, np.nan),
        lambda t: np.full(len(t), 3.0),
    ],
    ids=["sine", "hold", "noise", "missing", "still"],
)
def test_no_turn_is_made_up(drive):
    time = np.linspace(0.0, 30.0, 35)
    assert len(unsampled_turns(time, drive(time)).row) == 0


def test_rows_at_the_turns_need_none():
    time = np.linspace(0.0, 30.0, 31)
    assert len(unsampled_turns(time, np.interp(time, *CORNERS)).row) == 0


def spring(time):
    elongation = np.interp(time, *CORNERS)
    columns = {
        "time_s": time, "elongation_mm": elongation, "temperature_degC": 20.0 + time, "force_N": 0.1 * elongation,
        "resistance_ohm": 3.0 + 0.0 * time,
    }  # fmt: skip
    return Recording("r", None, "spring", columns=columns)


def test_an_added_row_has_drives_and_no_readings():
    recording = spring(np.linspace(0.0, 30.0, 35))
    found = with_unsampled_turns(recording)
    added = np.isnan(found.columns["force_N"])
    assert added.sum() == 2 and np.array_equal(added, np.isnan(found.columns["resistance_ohm"]))
    assert found.columns["elongation_mm"][added] == pytest.approx([8.0, 2.0])
    assert found.columns["temperature_degC"][added] == pytest.approx(20.0 + found.columns["time_s"][added])
    kept = {name: column[~added] for name, column in found.columns.items()}
    assert all(np.array_equal(kept[name], column) for name, column in recording.columns.items())
    assert found.whole is recording and "elongation_mm turns between rows 12 and 13" in found.reduction.text
    assert reduced(found, 1024) is found  # a fit takes it as it is


def test_rows_on_both_sides_of_a_turn_are_named_by_their_places_in_the_file():
    whole = spring(np.linspace(0.0, 30.0, 71))
    rows = np.arange(0, 71, 2)
    columns = {name: column[rows] for name, column in whole.columns.items()}
    found = with_unsampled_turns(replace(whole, columns=columns, reduction=Reduction(whole, rows, 1, "")))
    assert "turns between rows 23 and 25, 39 and 41, beyond both" in found.reduction.text


@pytest.mark.parametrize("rows", [35, 36])
def test_a_recording_with_as_many_rows_as_fit_keeps_its_turning_points(rows):
    found = with_unsampled_turns(reduced(spring(np.linspace(0.0, 30.0, rows)), 35))
    assert found.reduction.added == 2 and np.isnan(found.columns["force_N"]).sum() == 2
    assert reduced(found, 35) is found
    assert reduced(found, 20).reduction.added == 0  # a shorter one is made of the original


def test_nothing_is_added_where_the_rows_are_means_or_nothing_is_remembered():
    long = reduced(spring(np.linspace(0.0, 30.0, 5000)), 100)
    assert with_unsampled_turns(long) is long or long.reduction.rows is not None
    time = np.linspace(0.0, 30.0, 35)
    columns = {"time_s": time, "pressure_kPa": np.interp(time, *CORNERS), "curvature_1pm": time}
    actuator = Recording("r", None, "actuator", columns=columns)
    assert with_unsampled_turns(actuator) is actuator


def test_rows_are_told_by_their_places_in_the_file():
    """Beside added rows, chosen rows and means."""
    whole = spring(np.linspace(0.0, 30.0, 35))
    turned = with_unsampled_turns(whole)
    assert turned.rows_of_whole(0, len(turned) - 1) == (0, 34) == whole.rows_of_whole(0, 34)
    chosen = replace(whole, reduction=Reduction(whole, np.arange(0, 35, 5), 1, ""))
    assert chosen.rows_of_whole(1, 3) == (5, 15)
    assert replace(whole, reduction=Reduction(whole, None, 4, "")).rows_of_whole(1, 8) == (4, 34)
