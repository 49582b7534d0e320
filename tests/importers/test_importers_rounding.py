"""Written numbers have no rounding errors of the arithmetic behind them, and lose no digit of their own."""

import itertools
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from fitting.data.importers import import_file, make_options
from fitting.data.importers.rounding import ROUNDINGS, shortest
from fitting.data.recordings import write_recordings
from fitting.data.recordings.columns import convert
from pneusma_jax.units import UNITS


def written(path, tmp_path, **named):
    (file,) = write_recordings([import_file(path, make_options(**named))], tmp_path / "out")
    header, *lines = file.read_text().splitlines()
    return dict(zip(header.split(","), zip(*(line.split(",") for line in lines), strict=True), strict=True)), file


def test_converted_columns_are_written_with_their_own_digits(put, tmp_path):
    """`0.7 %` was written as `0.006999999999999999`."""
    text = "Time (ms),Temperature (K),Strain (%),Stress (ksi)\n" + "".join(
        f"{100 * k},{300.4 + 0.1 * k:.1f},{0.1 * k:.1f},1\n" for k in range(1, 60)
    )
    columns, _ = written(put("a.csv", text), tmp_path, kind="wire")
    for k in range(1, 60):
        expected = (Decimal(k) / 10, Decimal(k) / 1000, Decimal("27.25") + Decimal(k) / 10)
        read = (Decimal(columns[name][k - 1]) for name in ("time_s", "strain", "temperature_degC"))
        assert tuple(read) == expected


def test_quotients_are_written_with_their_own_digits(put, tmp_path):
    text = "# spring\nTime (s),Extension (mm),Force (mN),Voltage (mV),Current (mA)\n" + "".join(
        f"{k},{k / 10},{7 * k},{332 + 0.1 * k:.1f},100\n" for k in range(60)
    )
    columns, _ = written(put("a.csv", text), tmp_path)
    assert [Decimal(text) for text in columns["resistance_ohm"]] == [Decimal(3320 + k) / 1000 for k in range(60)]
    assert [Decimal(text) for text in columns["force_N"]] == [Decimal(7 * k) / 1000 for k in range(60)]


def test_a_zero_that_is_taken_off_leaves_no_rounding_error(put, tmp_path):
    text = "# spring\nTime (s),Extension (mm),Force (N),Resistance (ohm)\n" + "".join(f"{k},{k},{0.1 * k + 0.3:.1f},3\n" for k in range(30))
    columns, _ = written(put("a.csv", text), tmp_path, subtracted=["force_N=0.3"])
    assert [Decimal(text) for text in columns["force_N"]] == [Decimal(k) / 10 for k in range(30)]


def test_a_derived_size_is_written_with_its_own_digits(put, tmp_path):
    """A mandrel of 0.9 mm was written as `0.8999999999999999`."""
    head = "# wire diameter: 0.25 mm\n# mean coil diameter: 1.15 mm\n"
    text = "Time (s),Extension (mm),Force (N),Resistance (ohm)\n" + "".join(f"{k},{k},{k},3\n" for k in range(9))
    _, file = written(put("a.csv", head + text), tmp_path)
    assert "mandrel_diameter_mm = 0.9\n" in file.with_suffix(".toml").read_text()


def test_conversions_err_by_two_units_of_the_last_place():
    """The measurement that the limit rests on: all pairs of units whose factors are decimals."""
    rng = np.random.default_rng(0)
    numbers = rng.uniform(1e-3, 1e3, 40).round(5)
    worst = 0.0
    for one, other in itertools.permutations(UNITS, 2):
        same = UNITS[one].dimension == UNITS[other].dimension
        if not same or UNITS[one].offset or UNITS[other].offset:
            continue
        ratio = Fraction(repr(UNITS[one].factor)) / Fraction(repr(UNITS[other].factor))
        for number, converted in zip(numbers, convert(numbers, one, other), strict=True):
            exact = Fraction(repr(float(number))) * ratio
            worst = max(worst, float(abs(Fraction(float(converted)) - exact) / exact) / np.finfo(float).eps)
    assert 1.0 < worst < 2.5 and 2.0 * worst + 0.5 < ROUNDINGS


@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e9])
def test_a_number_keeps_its_digits(scale):
    """Fourteen digits are more than any instrument has."""
    values = np.array([float(f"{x:.13e}") for x in scale * np.random.default_rng(1).uniform(-9.0, 9.0, 500)])
    np.testing.assert_array_equal(shortest(values), values)
    assert np.isnan(shortest(np.array([np.nan, 1.0]))[0]) and shortest(np.inf) == np.inf and shortest(0.0) == 0.0
