"""Numbers as texts: what is not finite is never silent."""

import math

import numpy as np
import pytest

from fitting.calibrate.result import Estimate
from fitting.data.csv_text import csv_rows, csv_text
from fitting.inference.notes import joined
from fitting.report.cells import number, percent, relative, with_error, with_unit
from fitting.report.characterisation import parameter_table, parameters_csv, subtitle
from fitting.report.elastomer.payload import estimates_json


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (1.23456, "1.23"), (np.float64(2.0), "2"), (3824.1, "3820"), (math.nan, "n/a"), (math.inf, "infinite"), (-math.inf, "-infinite")],
)
def test_a_number(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("fraction", "text"),
    [(None, ""), (0.0123, "1.2 %"), (0.994, "99 %"), (0.999, "100 %"), (2.34, "234 %"), (-1.5, "-150 %"), (math.nan, "n/a")],
)
def test_a_fraction(fraction, text):
    assert percent(fraction) == text


@pytest.mark.parametrize(
    ("value", "sd", "text"),
    [
        (1.2345, 0.021, "1.234 ± 0.021"),
        (3.0e-7, 1.0e-8, "(3.00 ± 0.10)e-07"),
        (1.2345, None, "1.2345"),
        (1.2345, 0.0, "1.2345"),
        (1.2345, math.nan, "1.2345 ± n/a"),
        (1.2345, math.inf, "1.2345 ± infinite"),
        (math.nan, 0.1, "n/a"),
    ],
)
def test_a_number_with_its_error(value, sd, text):
    assert with_error(value, sd) == text


def test_names_units_and_relative_errors():
    assert with_unit("T", "degC") == "T [degC]" and with_unit("a", "1") == "a"
    assert [joined(list(names)) for names in ("", "a", "ab", "abc")] == ["", "a", "a and b", "a, b and c"]
    assert relative(2.0, 0.1) == "5 %" and relative(0.051, 0.06) == "120 %" and relative(0.0, 0.1) == "" and relative(1.0, math.nan) == ""


def test_an_error_that_is_not_known_shows_in_table_and_files():
    parameters = {
        "a": Estimate(1.5, math.nan, "1", False),
        "b": Estimate(2.5, math.nan, "kPa", True),
        "c": Estimate(3.5, 0.5, "kPa", False),
    }
    rows = parameter_table(parameters, {"a": 1.0}, {"c": 0.5}).rows
    assert [row[1] for row in rows] == ["1.5 ± n/a", "2.5", "3.50 ± 0.50"]
    assert [row[-1] for row in rows] == ["", "at bound", ""] and rows[2][5] == "50 %" and rows[0][6] == "1"
    assert parameters_csv(parameters).splitlines()[1:] == ["a,1.5,,1,no,,", "b,2.5,,kPa,yes,,", "c,3.5,0.5,kPa,no,,"]
    assert list(estimates_json(parameters)["b"]) == ["value", "sd", "unit", "at_bound"]


def test_csv_reads_back_equal_or_has_the_digits_asked_for():
    third = 1.0 / 3.0
    text = csv_text({"a": [1.0, third, math.nan], "b": ["x, y", None, math.inf]}, ["made here"])
    assert text == f'# made here\na,b\n1,"x, y"\n{third!r},\n,inf\n'
    assert csv_rows(["a"], [[third], [math.inf], [math.nan], [2]], digits=4) == "a\n0.3333\n\"\"\n\"\"\n2\n"
    with pytest.raises(ValueError, match="shorter"):
        csv_text({"a": [1.0], "b": []})


def test_a_subtitle_names_recordings_up_to_a_dozen():
    assert subtitle("Wire", "recording", ["a"], []) == "Wire, 1 recording fitted (a)"
    assert subtitle("Spring", "test", ["a", "b"], ["c"]) == "Spring, 2 tests fitted (a, b), 1 held out (c)"
    assert subtitle("Wire", "test", [str(k) for k in range(30)], []).endswith("10, 11 and 18 more)")
