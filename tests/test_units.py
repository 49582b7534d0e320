import math

import numpy as np
import pytest

from pneusma_jax import errors
from pneusma_jax.errors import InputError
from pneusma_jax.units import (
    INTERNAL_UNITS,
    UNITS,
    amount,
    constant_from_si,
    constant_to_si,
    dimension_of,
    from_si,
    to_si,
    unit_of_column,
)


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (14.0, "mm", 0.014),
        (1.0, "in", 0.0254),
        (250.0, "um", 2.5e-4),
        (3.0, "mN", 3e-3),
        (1.0, "lbf", 4.4482216152605),
        (1.0, "1/in", 1.0 / 0.0254),
        (2.0, "1pft", 2.0 / 0.3048),
        (8.7, "psi", 59984.4),
        (1.2, "bar", 1.2e5),
        (10.0, "mbar", 1e3),
        (3.0, "GPa", 3e9),
        (3900.0, "mohm", 3.9),
        (0.2, "kohm", 200.0),
        (19.9, "ohm/m", 19.9),
        (250.0, "ms", 0.25),
        (2.0, "min", 120.0),
        (1.5, "h", 5400.0),
        (0.3, "1/cm", 30.0),
        (0.3, "1pcm", 30.0),
        (0.03, "1/mm", 30.0),
        (30.0, "1pm", 30.0),
        (270.0, "deg", 1.5 * math.pi),
        (120.0, "mA", 0.12),
        (5.0, "mV", 5e-3),
        (20.0, "%", 0.2),
        (0.2, "strain", 0.2),
        (2.0, "N/mm", 2e3),
        (2.5, "g", 2.5e-3),
        (1.07, "g/cm3", 1070.0),
        (500.0, "J/(kg K)", 500.0),
        (60.0, "W/(m2 K)", 60.0),
        (5e-4, "1/K", 5e-4),
        (7.0, "MPa/K", 7e6),
    ],
)
def test_known_conversions(value, unit, expected):
    assert to_si(value, unit) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("unit", "text"), [("1pm", "3 1/m"), ("Npmm", "3 N/mm"), ("kPa", "3 kPa"), ("1", "3"), ("", "3")])
def test_text_has_units_as_people_write_them(unit, text):
    assert amount("3", unit) == text


@pytest.mark.parametrize("unit", sorted(UNITS))
def test_every_unit_converts_there_and_back(unit):
    values = np.array([-3.7, 0.0, 1e-4, 123.4])
    for difference in (False, True):
        back = from_si(to_si(values, unit, difference), unit, difference)
        np.testing.assert_allclose(back, values, rtol=1e-12, atol=1e-12)


def test_internal_units_have_factor_one():
    assert {unit.dimension for unit in UNITS.values()} | {"temperature difference"} == set(INTERNAL_UNITS)
    for dimension, unit in INTERNAL_UNITS.items():
        difference = dimension == "temperature difference"
        assert to_si(0.0, unit, difference) == 0.0
        assert to_si(1.0, unit, difference) == 1.0


def test_temperatures_stay_in_celsius_and_their_differences_have_no_offset():
    assert to_si(31.0, "degC") == 31.0
    assert to_si(304.15, "K") == pytest.approx(31.0)
    assert to_si(212.0, "degF") == pytest.approx(100.0)
    assert from_si(100.0, "degF") == pytest.approx(212.0)
    assert to_si(2.5, "K", difference=True) == 2.5
    assert to_si(9.0, "degF", difference=True) == pytest.approx(5.0)


def test_arrays_keep_their_shape():
    readings = np.array([[1.0, 2.0], [3.0, np.nan]])
    np.testing.assert_array_equal(to_si(readings, "kPa"), [[1e3, 2e3], [3e3, np.nan]])


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("force_mN", ("force", "mN")),
        ("pressure_psi", ("pressure", "psi")),
        ("curvature_1pcm", ("curvature", "1pcm")),
        ("curvature_1pm", ("curvature", "1pm")),
        ("resistance_2_ohm", ("resistance_2", "ohm")),
        ("resistance_mohm", ("resistance", "mohm")),
        ("time_ms", ("time", "ms")),
        ("bend_angle_deg", ("bend_angle", "deg")),
        ("temperature_degC", ("temperature", "degC")),
        ("current_1_A", ("current_1", "A")),
        ("strain", ("strain", "1")),
        ("strain_percent", ("strain", "percent")),
        ("max_strain", ("max_strain", "1")),
        ("model_cycle", ("model_cycle", "1")),
        ("cycle", ("cycle", "1")),
    ],
)
def test_column_names(column, expected):
    quantity, unit = unit_of_column(column)
    assert (quantity, unit) == expected
    assert to_si(0.0, unit) == 0.0 or dimension_of(unit) == "temperature"


@pytest.mark.parametrize(
    ("column", "remedy"),
    [
        ("pressure_kpa", "did you mean 'kPa'?"),
        ("force_Newton", "did you mean 'N'?"),
        ("temperature_C", "did you mean 'degC'?"),
        ("resistance_1", "must end in a unit, such as `resistance_1_ohm`"),
        ("_mm", "must end in a unit"),
    ],
)
def test_column_with_an_unknown_unit(column, remedy):
    with pytest.raises(InputError) as error:
        unit_of_column(column)
    assert str(error.value).startswith(f"column {column!r}")
    assert remedy in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("unit", "remedy"),
    [
        ("kpa", "did you mean 'kPa'?"),
        ("Ohm", "did you mean 'ohm'?"),
        ("kg/m^3", "did you mean 'kg/m3'?"),
        ("celsius", "did you mean 'degC'?"),
        ("volts", "did you mean 'V'?"),
        ("PSI", "did you mean 'psi'?"),
        ("bra", "did you mean 'bar'?"),  # it was 'rad', which is as near by its letters
        ("psig", "did you mean 'psi'?"),
        ("millimetres", "did you mean 'mm'?"),
        ("3x7", "known: 1, "),
    ],
)
def test_unknown_unit_names_the_nearest(unit, remedy):
    for convert in (to_si, from_si):
        with pytest.raises(InputError, match="unknown unit"):
            convert(1.0, unit)
    with pytest.raises(InputError) as error:
        dimension_of(unit)
    assert remedy in str(error.value)


def test_a_unit_that_is_not_text_is_refused():
    with pytest.raises(InputError, match="unknown unit"):
        dimension_of(["mm"])


@pytest.mark.parametrize(
    ("count", "words", "said"),
    [(0, ("row",), "0 rows"), (1, ("row",), "1 row"), (3, ("row",), "3 rows"), (1, ("row has", "rows have"), "1 row has"), (2, ("row has", "rows have"), "2 rows have")],
)
def test_a_count_agrees_with_its_noun(count, words, said):
    assert errors.counted(count, *words) == said


def test_a_constant_in_kelvin_is_a_difference_and_one_in_celsius_a_temperature():
    assert constant_to_si(12.0, "K") == constant_from_si(12.0, "K") == 12.0
    assert constant_to_si(45.0, "degC") == 45.0 and constant_to_si(2.0, "GPa") == 2e9
    assert to_si(12.0, "K") != 12.0
