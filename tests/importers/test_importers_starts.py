"""How a test begins: stated slack, missing first rows, zeros of springs, zeros left to fits."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options
from pneusma_jax.errors import InputError

STRAIN = np.linspace(0.0, 0.6, 50)


def law(stretch):
    return 150.0 * (stretch - stretch**-2)


def table(head, *columns, mark=","):
    return head + "\n" + "".join(mark.join(f"{x:.7g}" for x in row) + "\n" for row in np.transpose(columns))


HOT = np.linspace(20.0, 120.0, 40)


@pytest.mark.parametrize("slack", ["auto", "fit", "0.01", "0"])
@pytest.mark.parametrize(
    "text",
    [
        table("Temperature (C),Strain (-),Stress (MPa)", HOT, 0.04 / (1 + np.exp((HOT - 70) / 5)), 0 * HOT + 150),
        table("Time (s);Strain (%);Stress (MPa);Temperature (K)", HOT, 4 - 0.02 * HOT, 0 * HOT + 80, HOT + 273.15, mark=";"),
    ],
)
def test_slack_of_a_wire_under_heat_is_refused_with_a_reason(put, text, slack):
    path = put("a.csv", text)
    assert "the temperature of this wire changes" in refusal(path, slack=slack)
    assert len(import_file(path, make_options(slack="keep"))) == 40


CONSTANT = table("Temperature (C),Strain (-)", HOT, 0.04 / (1 + np.exp((HOT - 70) / 5)))
COLD = table("Strain (%),Stress (MPa)", 10 * STRAIN, np.minimum(300 * 10 * STRAIN, 500 + STRAIN))


@pytest.mark.parametrize(
    ("text", "constant", "option"),
    [
        (CONSTANT, "stress_MPa=150", {"scales": ["stress=2"]}), (CONSTANT, "stress_MPa=150", {"subtracted": ["stress_MPa=2"]}),
        (COLD, "temperature_degC=25", {"scales": ["temperature=2"]}), (COLD, "temperature_K=298", {"subtracted": ["temperature_degC=2"]}),
    ],
)  # fmt: skip
def test_nothing_acts_on_a_stated_constant(put, text, constant, option):
    assert "is what --constant states" in refusal(put("a.csv", text), constants=[constant], **option)


def test_a_constant_time_is_refused():
    with pytest.raises(InputError, match="--interval"):
        make_options(constants=["time_s=3"])


@pytest.mark.parametrize(
    ("text", "named", "words"),
    [
        (table("Strain (%),Stress (kPa)", 100 * STRAIN, law(1 + STRAIN)), {"slack": "0.7"}, "strain goes from 0 to 0.6 here"),
        (table("Strain (%),Stress (kPa)", 100 * STRAIN, law(1 + STRAIN)), {"slack": "5"}, "5 % is 0.05"),
        (COLD, {"slack": "0.1", "constants": ["temperature_degC=25"]}, "strain goes from 0 to 0.06 here"), (COLD, {"slack": "0.06"}, "1 row lies beyond it"),
        (table("Time (s),Displacement (mm),Load (N),Resistance (ohm)", STRAIN, 10 * STRAIN, STRAIN, 0 * STRAIN + 4), {"slack": "6.5"}, "elongation goes from 0 to 6 mm"),
        (table("Compressive strain (-),Stress (kPa)", STRAIN, -law(1 - STRAIN)), {"slack": "0.8"}, "strain goes from -0.6 to"),
    ],
)  # fmt: skip
def test_a_slack_that_leaves_no_test_is_refused_with_the_range(put, text, named, words):
    assert words in refusal(put("a.csv", text), **named)


def test_a_stated_slack_that_was_a_rise_is_asked_about(put):
    path = put("a.csv", table("Strain (%),Stress (kPa)", 100 * STRAIN, law(1 + STRAIN)))
    assert any("is not flat but changes by" in check for check in checks(import_file(path, make_options(slack="0.2"))))
    loose = np.maximum(STRAIN - 0.2, 0.0)
    path = put("b.csv", table("Strain (%),Stress (kPa)", 100 * STRAIN, 3.0 + law(1 + loose)))
    assert not checks(import_file(path, make_options(slack="0.2")))


def test_a_column_without_a_number_is_named(put):
    path = put("a.csv", "A,B,C\n" + "".join(f"{k},,{k}\n" for k in range(12)))
    assert "stress_kPa" in refusal(path, columns=["strain=1", "stress=2"], kind="elastomer", units=["stress=kPa", "strain=percent"])


@pytest.mark.parametrize("rows", [31, 60, 400])
@pytest.mark.parametrize("zero", [0.0, -7.0])
def test_a_zero_that_fits_find_is_read_where_there_is_no_strain_and_not_from_the_rise(put, rows, zero):
    strain = np.linspace(0.0, 0.8, rows)
    recording = import_file(put("a.csv", table("Strain (-),Stress (kPa)", strain, law(1 + strain) + zero)), make_options(slack="fit"))
    largest = np.max(np.abs(law(1 + strain) + zero))
    assert recording.zero["stress_kPa"] == pytest.approx(max(2.0 * abs(zero), 0.01 * largest), rel=0.1)


@pytest.mark.parametrize("blank", ["", "---", "NaN"])
@pytest.mark.parametrize("which", [(0, 1), (1,)])
def test_missing_first_rows_are_no_other_zero(put, blank, which):
    lines = []
    for k, (x, y) in enumerate(zip(STRAIN, law(1 + STRAIN), strict=True)):
        cells = [f"{100 * x:.5g}", f"{y:.6g}"]
        lines.append(",".join([f"{k}", *(blank if k < 8 and i in which else cell for i, cell in enumerate(cells))]))
    recording = import_file(put("a.csv", "Time (s),Strain (%),Stress (kPa)\n" + "\n".join(lines) + "\n"))
    assert not any("--subtract" in check for check in checks(recording))


# Springs.

LONGER = np.linspace(0.0, 15.0, 45)


def spring(elongation, force, **further):
    named = {"Time (s)": np.arange(len(elongation)), "Elongation (mm)": elongation, "Force (N)": force, **further}
    return table(",".join(named), *named.values())


COOL = {"Temperature (degC)": 21.0 + 0.01 * LONGER}
WITH_CURRENT = {"Resistance (ohm)": 3.0 + 0.02 * LONGER, "Current (A)": 0.0 * LONGER}
HEATED = {"Temperature (degC)": 20.0 + 5.0 * LONGER}
UNTOLD = {"Resistance (ohm)": 3.0 + 0.02 * LONGER}


@pytest.mark.parametrize("further", [COOL, WITH_CURRENT, UNTOLD])
@pytest.mark.parametrize("zero", [0.4, -0.3])
def test_a_springs_force_at_no_elongation_is_asked_about(put, follow, further, zero):
    path = put("a.csv", spring(LONGER, 0.1 * LONGER + zero, **further))
    output, _ = follow(path)
    question = next(line for line in output.splitlines() if "at elongation 0" in line)
    output, (mended,) = follow(path, *follow.options_in(question))
    np.testing.assert_allclose(mended.columns["force_N"], 0.1 * LONGER, atol=1e-3)
    assert "at elongation 0" not in output
    clean = import_file(put("b.csv", spring(LONGER, 0.1 * LONGER, **further)))
    assert not checks(clean)


@pytest.mark.parametrize("further", [COOL, WITH_CURRENT])
@pytest.mark.parametrize(("x", "y"), [(1, -1), (-1, 1)])
def test_a_springs_force_against_its_elongation_is_refused_in_one_phase(put, follow, further, x, y):
    path = put("a.csv", spring(x * LONGER, y * 0.1 * LONGER, **further))
    message, _ = follow(path)
    assert "of them is counted the other way" in message
    _, (mended,) = follow(path, *follow.options_in(message))
    assert np.all(mended.columns["force_N"] * mended.columns["elongation_mm"] >= 0.0)


def test_a_spring_that_contracts_against_a_load_is_left_alone(put):
    stretched = 15.0 - LONGER
    assert not checks(import_file(put("a.csv", spring(stretched + 2.0, 0.5 + 0.05 * LONGER, **HEATED))))
    asked = import_file(put("b.csv", spring(LONGER, -0.1 * LONGER, **HEATED)))
    assert any("of opposite signs" in check and "--scale force=-1" in check for check in checks(asked))


def test_a_metal_that_settles_in_its_grips_has_the_stress_of_its_first_readings(put):
    rise = np.linspace(0.0, 0.1, 4000)
    stress = 500.0 * (1.0 - np.exp(-np.maximum(rise - 0.002, 0.0) / 0.004)) + 40.0 * rise
    heads = "Strain (-),Stress (MPa)"
    assert not [c for c in checks(import_file(put("a.csv", table(heads, rise, stress)), make_options(kind="wire"))) if "at strain 0" in c]
    preloaded = import_file(put("b.csv", table(heads, rise, stress + 30.0)), make_options(kind="wire"))
    (said,) = [c for c in checks(preloaded) if "at strain 0" in c]
    assert 29.0 < float(said.split("stress is ")[1].split()[0]) < 31.0
