"""Rows of statistics that no word names, and words of a table of results beside the measurements."""

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_file

N = 60
TIME = 0.5 * np.arange(N)
STRAIN = np.round(0.6 * (1.0 - np.abs(np.linspace(-1.0, 1.0, N))) + 0.02 * TIME / TIME[-1], 5)
STRESS = np.round(40.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2) + 0.05 * np.sin(1.7 * np.arange(N)), 4)
COLUMNS = np.stack([TIME, STRAIN, STRESS], axis=1)
HEAD = ["Time (s)", "Strain (-)", "Stress (kPa)"]


def text(head, rows):
    return "\n".join(",".join(row) for row in [head, *rows]) + "\n"


def written(rows, digits=4):
    return [[f"{x:.{digits}f}" for x in row] for row in np.atleast_2d(rows)]


OF_ALL = {
    "mean and deviation": [np.mean(COLUMNS, 0), np.std(COLUMNS, 0, ddof=1)],
    "deviation of all": [np.mean(COLUMNS, 0), np.std(COLUMNS, 0)],
    "five of them": [np.min(COLUMNS, 0), np.max(COLUMNS, 0), np.mean(COLUMNS, 0), np.median(COLUMNS, 0), np.std(COLUMNS, 0, ddof=1)],
    "mean": [np.mean(COLUMNS, 0)],
}  # fmt: skip


@pytest.mark.parametrize("place", ["bottom", "top"])
@pytest.mark.parametrize("clock", [True, False])
@pytest.mark.parametrize("name", OF_ALL)
def test_rows_that_are_statistics_by_their_numbers_are_left_out_and_said(put, name, clock, place):
    """They were read as measurements without a word."""
    first = 0 if clock else 1
    body, foot = written(COLUMNS[:, first:], 5), written(np.array(OF_ALL[name])[:, first:], 3)
    rows = [*body, *foot] if place == "bottom" else [*foot, *body]
    recording = import_file(put("a.csv", text(HEAD[first:], rows)))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, atol=1e-5)
    (said,) = [note for note in checks(recording) if "without a label" in note]
    assert f"(row {N + 2 if place == 'bottom' else 2})" in said


def test_the_least_and_the_largest_alone_are_kept_and_asked_about(put):
    """A reading may be the least or the largest in all columns."""
    foot = written([np.min(COLUMNS, 0)[1:], np.max(COLUMNS, 0)[1:]], 5)
    recording = import_file(put("a.csv", text(HEAD[1:], [*written(COLUMNS[:, 1:], 5), *foot])))
    assert len(recording) == N + 2
    assert [note for note in checks(recording) if "may be statistics" in note]


REST, PEAK = [[0.0, 0.0]], [[0.5, 25.0]]
RAMP = [[0.005 * k, round(0.25 * k + 0.02 * np.sin(k), 2)] for k in range(1, 100)]
READINGS = {
    "square wave": 4 * (10 * REST + 10 * PEAK) + 13 * REST + PEAK,
    "square wave from its peak": PEAK + 13 * REST + 4 * (10 * PEAK + 10 * REST),
    "rests at zero": 10 * REST + RAMP + RAMP[::-1] + 9 * REST + PEAK,
}


@pytest.mark.parametrize("name", READINGS)
def test_readings_at_rest_and_at_the_peak_are_no_statistics(put, name):
    """Up to eight rows at rest were left out as medians or minima."""
    rows = written(READINGS[name], 3)
    assert len(import_file(put("a.csv", text(HEAD[1:], rows)))) == len(rows)


def test_a_last_reading_above_statistics_is_kept(put):
    """A specimen at rest again repeats the least reading."""
    body = np.vstack([COLUMNS[:, 1:], np.min(COLUMNS, 0)[1:]])
    foot = written([np.mean(body, 0), np.std(body, 0, ddof=1)], 5)
    assert len(import_file(put("a.csv", text(HEAD[1:], [*written(body, 5), *foot])))) == N + 1


def test_a_clock_may_have_no_statistic(put_sheet):
    rows = [HEAD, *COLUMNS.tolist(), [], [None, *np.mean(COLUMNS, 0)[1:].tolist()]]
    recording = import_file(put_sheet("a.xlsx", rows))
    np.testing.assert_allclose(recording.columns["time_s"], TIME)
    assert len(recording) == N


@pytest.mark.parametrize(
    "last",
    [COLUMNS[0, 1:], COLUMNS[-1, 1:], [0.3, 28.0], np.mean(COLUMNS, 0)[1:] + [0.002, 0.0], np.max(COLUMNS, 0)[1:] * [1.0, 1.02]],
    ids=["at rest again", "held", "another reading", "near the mean", "beyond the largest"],
)
def test_a_last_reading_is_kept(put, last):
    body = written(np.vstack([COLUMNS[:, 1:], last]), 5)
    assert len(import_file(put("a.csv", text(HEAD[1:], body)))) == N + 1


def test_numbers_of_few_digits_tell_no_statistic(put):
    """A reading of two digits agrees with a mean too easily."""
    body = written(COLUMNS[:, 1:] * [100.0, 1.0], 0)
    mean = written(np.mean(COLUMNS, 0)[1:] * [100.0, 1.0], 0)
    recording = import_file(put("a.csv", text(["Strain (%)", "Stress (kPa)"], [*body, *mean])))
    assert len(recording) == N + 1


def test_a_table_of_results_beside_the_measurements_costs_no_row(put_sheet):
    """`Max stress` to the right of the first reading took that reading for a statistic."""
    results = [["Max stress (kPa)", 64.2], ["Modulus (kPa)", 120.0], ["Mean", 0.3]]
    rows = [[*row, *([None, *results[i]] if i < len(results) else [])] for i, row in enumerate(COLUMNS.tolist())]
    recording = import_file(put_sheet("a.xlsx", [[*HEAD, None, "Result", "Value"], *rows]))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS)


@pytest.mark.parametrize("place", ["first", "last"])
def test_a_row_of_statistics_with_an_unknown_label_is_told_with_it(put, place):
    """It was told as a row without a label."""
    foot = written(np.mean(COLUMNS, 0))[0]
    if place == "first":
        head, rows = ["Point", *HEAD], [*([f"p{k}", *row] for k, row in enumerate(written(COLUMNS, 5))), ["Overall", *foot]]
    else:
        head, rows = [*HEAD, "Remark"], [*([*row, ""] for row in written(COLUMNS, 5)), [*foot, "Overall"]]
    recording = import_file(put("a.csv", text(head, rows)))
    assert len(recording) == N
    (said,) = [note for note in checks(recording) if "statistic of all others" in note]
    assert said.endswith(f"mean (row {N + 2}, labelled 'Overall')") and "without a label" not in said
