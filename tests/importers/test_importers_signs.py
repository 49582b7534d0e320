"""Signs and zeros: compression counted positive, slack, preload, true stress, absolute pressure, cross-checks."""

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_file, make_options
from fitting.data.slack import find_slack
from pneusma_jax.errors import InputError

MU = 200.0


def law(stretch):
    return MU * (stretch - stretch**-2)


def modulus(recording):
    """Neo-Hookean modulus of a recording by least squares [kPa]."""
    stretch = 1.0 + recording.columns["strain"]
    shape = stretch - stretch**-2
    there = np.isfinite(recording.columns["stress_kPa"])
    return float(shape[there] @ recording.columns["stress_kPa"][there] / (shape[there] @ shape[there]))


def table(head, *columns, delimiter=","):
    rows = (delimiter.join(f"{float(x)!r}" for x in row) for row in np.transpose(columns))
    return "\n".join([head, *rows]) + "\n"


def refusal(path, **named):
    with pytest.raises(InputError) as caught:
        import_file(path, make_options(**named))
    assert "\n" not in str(caught.value)
    return str(caught.value)


# Compression written positive.

PRESSED = np.linspace(0.0, 0.3, 31)
POSITIVE = -law(1.0 - PRESSED)
SIZES = {"dimensions": ["gauge_length_mm=10", "area_mm2=100"]}


def headings_that_say_so():
    return "a.csv", table("Compressive strain (%),Compressive stress (kPa)", 100 * PRESSED, POSITIVE), {}


def bluehill_headings():
    return "a.csv", table("Compressive extension (mm);Compressive load (N)", 10 * PRESSED, 0.1 * POSITIVE, delimiter=";"), SIZES


def one_heading_says_so():
    return "a.csv", table("Compression (mm),Load (N)", 10 * PRESSED, 0.1 * POSITIVE), SIZES


def a_line_above_says_so():
    return "a.csv", "Test type: Compression\nOperator: Ada\n\n" + table("Strain (%),Stress (kPa)", 100 * PRESSED, POSITIVE), {}


def mapped_headings_that_say_so():
    text = table("My compress. strain (%),My compressive stress (kPa)", 100 * PRESSED, POSITIVE)
    return "a.csv", text, {"columns": ["strain=1", "stress=2"], "kind": "elastomer"}


@pytest.mark.parametrize(
    "shape", [headings_that_say_so, bluehill_headings, one_heading_says_so, a_line_above_says_so, mapped_headings_that_say_so]
)
def test_what_is_called_compression_becomes_negative_and_that_is_said(put, shape):
    name, text, named = shape()
    recording = import_file(put(name, text), make_options(**named))
    assert recording.columns["strain"].min() == pytest.approx(-0.3) and modulus(recording) == pytest.approx(MU)
    assert any("turned negative, because the file speaks of compression" in note for note in recording.notices)
    pulled = import_file(put(name, text), make_options(**named, compression=False))
    assert pulled.columns["strain"].max() == pytest.approx(0.3)


def plain_headings(sign=1.0):
    return table("Strain (%),Stress (kPa)", 100 * PRESSED, sign * POSITIVE)


def machine_columns():
    return table("Time (s),Position (mm),Load (N)", np.arange(31), 10 * PRESSED, 0.1 * POSITIVE)


def there_and_back():
    path = np.concatenate([PRESSED, PRESSED[::-1]])
    return table("Strain (%),Stress (kPa)", 100 * path, -law(1.0 - path))


@pytest.mark.parametrize(("text", "sizes"), [(plain_headings(), {}), (machine_columns(), SIZES), (there_and_back(), {})])
def test_a_test_that_only_stiffens_is_asked_about(put, follow, text, sizes):
    path = put("a.csv", text)
    args = [arg for size in sizes.get("dimensions", ()) for arg in ("--dimension", size)] + ["--kind", "elastomer"]
    output, (asked,) = follow(path, *args)
    question = next(line for line in output.splitlines() if "only stiffens" in line)
    assert asked.columns["strain"].max() > 0.0
    advised = follow.options_in(question)
    assert advised == ["--compression", "--tension"]
    output, (mended,) = follow(path, *args, advised[0])
    assert modulus(mended) == pytest.approx(MU) and mended.columns["strain"].max() <= 0.0 and "only stiffens" not in output
    output, (kept,) = follow(path, *args, advised[1])
    assert kept.columns["strain"].max() > 0.0 and "only stiffens" not in output


@pytest.mark.parametrize("most", [0.3, 0.9, 3.0])
def test_a_pulled_rubber_is_not_asked_about(put, most):
    strain = np.linspace(0.0, most, 60)
    stiffening = law(1.0 + strain) * (1.0 + 0.1 * strain**2)
    assert not checks(import_file(put("a.csv", table("Strain (-),Stress (kPa)", strain, stiffening))))


def test_signs_that_contradict_each_other_are_refused(put, follow):
    path = put("a.csv", plain_headings(sign=-1.0))
    message, _ = follow(path, "--kind", "elastomer")
    assert "one of them is counted the other way" in message
    advised = follow.options_in(message)
    assert advised == ["--scale", "stress=-1", "--scale", "strain=-1"]
    _, (pulled,) = follow(path, "--kind", "elastomer", *advised[:2])
    assert pulled.columns["stress_kPa"].max() > 0.0 and pulled.columns["strain"].max() > 0.0
    _, (pressed,) = follow(path, "--kind", "elastomer", *advised[2:])
    assert modulus(pressed) == pytest.approx(MU)


def test_a_crosshead_that_counts_down(put, follow):
    strain = np.linspace(0.0, 0.5, 40)
    path = put("a.csv", table("Position (mm),Load (N)", -10 * strain, 0.1 * law(1.0 + strain)))
    args = ("--kind", "elastomer", "--dimension", "gauge_length_mm=10", "--dimension", "area_mm2=100")
    message, _ = follow(path, *args)
    advised = follow.options_in(message)
    assert advised[:2] == ["--scale", "elongation=-1"]
    _, (mended,) = follow(path, *args, *advised[:2])
    assert modulus(mended) == pytest.approx(MU)


# Slack and zeros.

NOISE = 0.3


def slack_curve(start, zero, seed, rows=201, most=1.0):
    """A strip that was longer than its grips' gap: taut from a strain on, over a load cell's zero."""
    strain = np.linspace(0.0, most, rows)
    stretch = np.maximum((1.0 + strain) / (1.0 + start), 1.0)
    return strain, law(stretch) + zero + NOISE * np.random.default_rng(seed).normal(size=rows)


def as_strain(strain, stress):
    return table("Time (s),Strain (%),Stress (kPa)", np.arange(len(strain)), 100 * strain, stress), {}


def as_extension(strain, stress):
    return table("Extension (mm)\tLoad (N)", 50 * strain, 0.018 * stress, delimiter="\t"), {"dimensions": ["gauge_length_mm=50", "area_mm2=18"]}


def as_stretch_and_return(strain, stress):
    back = slice(None, None, -1)
    strain, stress = np.concatenate([strain, strain[back]]), np.concatenate([stress, stress[back]])
    return table("Stretch ratio,Nominal stress (MPa)", 1.0 + strain, stress / 1e3), {}


@pytest.mark.parametrize("shape", [as_strain, as_extension, as_stretch_and_return])
@pytest.mark.parametrize(("start", "zero", "seed"), [(0.05, 4.0, 0), (0.1, 0.0, 1), (0.03, -6.0, 2)])
def test_slack_is_seen_and_taken_off(put, follow, shape, start, zero, seed):
    text, named = shape(*slack_curve(start, zero, seed))
    path = put("a.csv", text)
    args = [arg for size in named.get("dimensions", ()) for arg in ("--dimension", size)] + ["--kind", "elastomer"]
    output, (seen,) = follow(path, *args)
    question = next(line for line in output.splitlines() if "is flat at" in line)
    assert abs(modulus(seen) / MU - 1.0) > 0.02
    advised = follow.options_in(question)
    assert advised == ["--slack", "auto", "--slack", "keep", "--slack", "fit"]
    output, (mended,) = follow(path, *args, *advised[:2])
    assert modulus(mended) == pytest.approx(MU, rel=0.01) and "slack rows left out" in output
    assert abs(mended.columns["strain"].min()) < 0.01 and any("--slack" in note for note in mended.source["notes"])
    output, (kept,) = follow(path, *args, *advised[2:4])
    assert len(kept) == len(seen) and "is flat at" not in output


def test_slack_can_be_stated(put):
    text, _ = as_strain(*slack_curve(0.05, 4.0, 3))
    recording = import_file(put("a.csv", text), make_options(slack="0.05"))
    assert modulus(recording) == pytest.approx(MU, rel=0.01)


def test_a_pressed_puck_that_the_plate_reached_late(put):
    strain, stress = slack_curve(0.0, 0.0, 4, most=0.35)
    pressed = np.maximum((1.0 - strain) / (1.0 - 0.04), 0.0)
    stress = -law(np.minimum(pressed, 1.0)) + 1.5 + 0.1 * np.random.default_rng(4).normal(size=strain.size)
    path = put("a.csv", table("Compressive strain (-),Compressive stress (kPa)", strain, stress))
    assert any("is flat at" in note for note in import_file(path).notices)
    assert modulus(import_file(path, make_options(slack="auto"))) == pytest.approx(MU, rel=0.02)


def test_a_spring_that_hung_loose(put):
    elongation = np.linspace(0.0, 40.0, 100)
    force = 0.02 * np.maximum(elongation - 3.0, 0.0) + 0.1
    path = put("a.csv", table("Time (s),Displacement (mm),Load (N),Resistance (ohm)", np.arange(100), elongation, force, np.full(100, 3.7)))
    assert any("elongation 3" in note for note in checks(import_file(path)))
    recording = import_file(path, make_options(slack="auto"))
    assert recording.columns["elongation_mm"].max() == pytest.approx(37.0, abs=0.05)
    assert recording.columns["force_N"].max() == pytest.approx(0.74, abs=1e-3)


def test_curves_without_slack_are_left_alone(put):
    """Noise, steps and stiffening are no slack; neither is the plateau of a superelastic wire."""
    rng = np.random.default_rng(5)
    found = 0
    for step in (0.0, 1.0, 4.0):
        for rows in (30, 100, 300):
            for _ in range(10):
                strain = np.linspace(0.0, rng.uniform(0.2, 2.0), rows)
                stress = law(1.0 + strain) + rng.normal(size=rows)
                found += find_slack(strain, np.round(stress / step) * step if step else stress) is not None
    assert found <= 1
    strain = np.linspace(0.0, 0.06, 120)
    assert find_slack(strain, np.minimum(40e3 * strain, 400.0)) is None
    recording = import_file(put("a.csv", table("Strain (-),Stress (kPa)", strain * 10, law(1.0 + strain * 10))), make_options(slack="auto"))
    assert any("no slack was found" in note for note in recording.notices) and len(recording) == 120


@pytest.mark.parametrize("zero", [6.0, -5.0])
def test_a_zero_of_the_load_cell_without_slack_is_asked_about(put, follow, zero):
    strain = np.linspace(0.0, 1.0, 80)
    path = put("a.csv", table("Strain (-),Stress (kPa)", strain, law(1.0 + strain) + zero))
    output, _ = follow(path, "--kind", "elastomer")
    question = next(line for line in output.splitlines() if "the load cell's zero" in line)
    _, (mended,) = follow(path, "--kind", "elastomer", *follow.options_in(question))
    assert modulus(mended) == pytest.approx(MU, rel=1e-3)


def test_a_strain_counted_from_another_zero_is_asked_about(put, follow):
    strain = np.linspace(0.0, 1.0, 80)
    path = put("a.csv", table("Strain (-),Stress (kPa)", strain + 0.3, law(1.0 + strain)))
    output, _ = follow(path, "--kind", "elastomer")
    question = next(line for line in output.splitlines() if "strain begins at 0.3" in line)
    _, (mended,) = follow(path, "--kind", "elastomer", *follow.options_in(question))
    assert modulus(mended) == pytest.approx(MU, rel=1e-3)


# Two ways to one quantity.

STRETCH = np.linspace(1.0, 2.0, 41)


def test_stress_and_load_that_agree_are_said_to(put):
    text = "Width: 6 mm\nThickness: 3 mm\n" + table("Strain (-),Stress (kPa),Load (N)", STRETCH - 1, law(STRETCH), 0.018 * law(STRETCH))
    recording = import_file(put("a.csv", text))
    assert not checks(recording) and any("agrees with 'Load (N)'" in note for note in recording.notices)


@pytest.mark.parametrize("factor", [1000.0, 0.5, 1.2])
def test_a_factor_between_stress_and_load_is_reported(put, factor):
    text = "Cross-section: 18 mm²\n" + table("Strain (-),Stress (kPa),Load (N)", STRETCH - 1, factor * law(STRETCH), 0.018 * law(STRETCH))
    recording = import_file(put("a.csv", text), make_options(kind="elastomer"))
    stiff, (check,) = [n for n in checks(recording) if "hard rubbers" in n], [n for n in checks(recording) if "times" in n]
    assert f"'Stress (kPa)' is {factor:.4g} times 'Load (N)'" in check and len(stiff) == (factor == 1000.0)
    stated = import_file(put("a.csv", text), make_options(kind="elastomer", dimensions=["area_mm2=18"]))
    assert modulus(stated) == pytest.approx(MU)  # what the person states about the specimen decides


@pytest.mark.parametrize("factor", [2.0, 0.8])
def test_a_factor_between_strain_and_extension_is_reported(put, factor):
    text = "Gauge length: 25 mm\n" + table("Strain (-),Extension (mm),Stress (kPa)", STRETCH - 1, 25 / factor * (STRETCH - 1), law(STRETCH))
    (check,) = checks(import_file(put("a.csv", text)))
    assert f"'Strain (-)' is {factor:.4g} times 'Extension (mm)'" in check


def test_true_stress_is_told_by_the_load_beside_it(put, follow):
    text = table("Strain (-),Stress (kPa),Load (N)", STRETCH - 1, STRETCH * law(STRETCH), 0.018 * law(STRETCH))
    path = put("a.csv", text)
    output, _ = follow(path)
    question = next(line for line in output.splitlines() if "it is true stress" in line)
    _, (mended,) = follow(path, *follow.options_in(question))
    assert modulus(mended) == pytest.approx(MU)


def test_an_unnamed_stress_is_taken_as_engineering_and_that_is_said(put, follow):
    path = put("a.csv", table("Strain (-),Stress (kPa)", STRETCH - 1, STRETCH * law(STRETCH)))
    output, _ = follow(path)
    note = next(line for line in output.splitlines() if "taken as engineering stress" in line)
    _, (mended,) = follow(path, *follow.options_in(note))
    assert modulus(mended) == pytest.approx(MU)


# Absolute and gauge pressure.

PRESSURE = np.linspace(0.0, 60.0, 31)


@pytest.mark.parametrize(
    ("heading", "factor"), [("Absolute pressure (kPa)", 1.0), ("Pressure (bar abs)", 0.01), ("Pressure (psia)", 1.0 / 6.894757293168361), ("Pressure abs / mbar", 10.0)]
)
def test_an_absolute_pressure_becomes_gauge(put, heading, factor):
    text = table(f"Time (s);{heading};Length (mm)", np.arange(31), factor * (PRESSURE + 101.325), 56 + 0.1 * PRESSURE, delimiter=";")
    recording = import_file(put("a.csv", text))
    np.testing.assert_allclose(recording.columns["pressure_kPa"], PRESSURE, atol=1e-9)
    assert recording.kind == "tube" and any("because it is absolute" in note for note in recording.notices)


def test_a_gauge_pressure_is_left_alone(put):
    text = table("Time (s),Pressure (psig),Length (mm)", np.arange(31), PRESSURE, 56 + 0.1 * PRESSURE)
    np.testing.assert_allclose(import_file(put("a.csv", text)).columns["pressure_kPa"], 6.894757293168361 * PRESSURE)


def test_a_pressure_that_begins_at_the_airs_is_asked_about(put, follow):
    path = put("a.csv", table("Time (s),Pressure (kPa),Length (mm)", np.arange(31), PRESSURE + 101.3, 56 + 0.1 * PRESSURE))
    output, _ = follow(path)
    question = next(line for line in output.splitlines() if "absolute pressure of the open air" in line)
    _, (mended,) = follow(path, *follow.options_in(question))
    np.testing.assert_allclose(mended.columns["pressure_kPa"], PRESSURE, atol=0.03)


def test_a_pull_that_begins_far_from_its_flat_start_shows_no_slack():
    """The first row is of another moment: the flat part that follows lies below it."""
    strain = np.r_[0.3, np.linspace(0.0, 0.02, 15), np.linspace(0.03, 0.6, 60)]
    stress = np.r_[np.zeros(16), 100.0 * np.linspace(0.0, 0.57, 60)]
    assert find_slack(strain, stress) is None
