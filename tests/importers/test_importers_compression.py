"""Pressed or pulled: which texts of a file decide it, which are only asked about, and what the user states."""

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_file, make_options
from pneusma_jax.errors import InputError

STRAIN = np.linspace(0.0, 0.4, 33)


def law(stretch):
    return 90.0 * (stretch - stretch**-2)


def rows(strain, stress, mark=","):
    return "".join(f"{100 * x:.6g}{mark}{y:.7g}\n" for x, y in zip(strain, stress, strict=True))


PULLED = "Strain (%),Stress (kPa)\n" + rows(STRAIN, law(1.0 + STRAIN))
PRESSED = "Strain (%),Stress (kPa)\n" + rows(STRAIN, -law(1.0 - STRAIN))


@pytest.mark.parametrize(
    "line",
    [
        "Grips: pneumatic, with compressed air at 4 bar", "Load frame: 2 kN in tension or compression", "Sensor: S-beam (tension & compression)",
        "Log compression: off", "Machine: universal tension and compression testing machine", "compression: none", "Stored with gzip, image compression 3",
        "Load cell, 200 N compression", "Test type: not compression", "Method: tensile, without compression preload",
    ],
)  # fmt: skip
def test_a_line_about_something_else_turns_nothing(put, line):
    recording = import_file(put("a.csv", line + "\nOperator: Ada\n" + PULLED))
    assert recording.columns["strain"].max() == pytest.approx(0.4) and recording.columns["stress_kPa"].min() >= 0.0
    assert not any("turned negative" in note for note in recording.notices)


@pytest.mark.parametrize(
    "line",
    [
        "Test type: Compression", "Method; uniaxial compression of a puck", "Compression test no. 7", "Loading: compressive", "Prüfart: Druckversuch nach Norm",
        "Foam block 3, tested in compression", "Essai: essai de compression", "Test = compression 10 mm/min",
    ],
)  # fmt: skip
def test_a_line_that_names_the_test_turns_it_and_is_to_be_checked(put, line):
    path = put("a.csv", line + "\nOperator: Ada\n" + PRESSED)
    recording = import_file(path)
    assert recording.columns["strain"].min() == pytest.approx(-0.4) and recording.columns["stress_kPa"].max() <= 0.0
    (check,) = checks(recording)
    assert "turned negative, because the file speaks of compression" in check
    kept = import_file(path, make_options(compression=False))
    assert kept.columns["strain"].max() == pytest.approx(0.4) and not checks(kept)


@pytest.mark.parametrize("line", ["Specimen holder for compression of gels", "Compressive modulus by secant", "Compression rate 3 mm/min"])
def test_a_line_that_may_mean_it_is_a_question_whose_answers_work(put, follow, line):
    path = put("a.csv", line + "\nOperator: Ada\n" + PULLED)
    output, (asked,) = follow(path)
    question = next(text for text in output.splitlines() if "a line speaks of compression" in text)
    assert asked.columns["strain"].max() == pytest.approx(0.4)
    assert follow.options_in(question) == ["--compression", "--tension"]
    output, (pressed,) = follow(path, "--compression")
    assert pressed.columns["strain"].min() == pytest.approx(-0.4) and "a line speaks" not in output
    output, (pulled,) = follow(path, "--tension")
    assert pulled.columns["strain"].max() == pytest.approx(0.4) and "a line speaks" not in output


def test_what_cannot_be_pressed_or_curves_as_a_pull_is_said_whatever_the_line_says(put, follow):
    far = np.linspace(0.0, 3.0, 40)
    recording = import_file(put("a.csv", "Test type: compression\n\nStrain (%),Stress (kPa)\n" + rows(far, law(1.0 + far))))
    assert recording.columns["strain"].max() == pytest.approx(3.0)
    assert any("strain reaches more than can be pressed" in check for check in checks(recording))
    output, (turned,) = follow(put("b.csv", "Test type: compression\n\n" + PULLED))
    assert turned.columns["strain"].min() == pytest.approx(-0.4)
    question = next(text for text in output.splitlines() if "stress softens over strain" in text)
    assert follow.options_in(question)[0] == "--tension"


def test_two_lines_that_contradict_each_other_turn_nothing(put):
    recording = import_file(put("a.csv", "Project: compression test of seals\nTest type: Tensile\n" + PULLED))
    assert recording.columns["strain"].max() == pytest.approx(0.4) and not checks(recording)


@pytest.mark.parametrize(("strain_sign", "stress_sign"), [(-1, -1), (1, -1), (-1, 1), (1, 1)])
def test_tension_counts_a_pull_positive(put, strain_sign, stress_sign):
    path = put("a.csv", "Strain (%),Stress (kPa)\n" + rows(strain_sign * STRAIN, stress_sign * law(1.0 + STRAIN)))
    recording = import_file(path, make_options(compression=False))
    assert recording.columns["strain"].max() == pytest.approx(0.4) and recording.columns["strain"].min() >= 0.0
    assert recording.columns["stress_kPa"].max() > 50.0
    assert any("turned positive, as stated with --tension" in n for n in recording.notices) == (strain_sign + stress_sign < 2)


BAR = np.linspace(0.0, 0.03, 40)


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        ("Compressive strain (%),Compressive stress (MPa),Temperature (C)", (100 * BAR, 2e4 * BAR, 22 + 0 * BAR)),
        ("Compression strain (-);Stress (MPa);Temperature (C)", (BAR, 2e4 * BAR, 22 + 0 * BAR)),
        ("Strain compressive (-)\tCompressive stress (MPa)\tTemperature (C)", (BAR, 300 + 0 * BAR, 20 + 3000 * BAR)),
    ],
)
def test_a_wire_that_was_pressed_is_turned_and_told_what_its_law_is_of(put, head, columns):
    mark = next(m for m in ";\t," if m in head)
    text = head + "\n" + "".join(mark.join(f"{x:.6g}" for x in row) + "\n" for row in np.transpose(columns))
    path = put("a.csv", text)
    named = {"kind": "wire", "columns": [f"strain={head.split(mark)[0]}"]}
    recording = import_file(path, make_options(**named))
    assert recording.kind == "wire" and recording.columns["stress_MPa"].max() <= 0.0 and recording.columns["strain"].max() <= 0.0
    assert any("the law of a wire is that of one in tension" in check for check in checks(recording))
    pulled = import_file(path, make_options(**named, compression=False))
    assert pulled.columns["strain"].max() == pytest.approx(0.03) and not any("tension" in check for check in checks(pulled))


def test_compression_can_be_stated_of_a_wire_and_of_nothing_that_has_no_strain(put):
    text = "Strain (%),Stress (MPa),Temperature (C)\n" + "".join(f"{0.1 * k:.1f},{30 * k},22\n" for k in range(20))
    recording = import_file(put("a.csv", text), make_options(compression=True))
    assert recording.columns["stress_MPa"].min() == pytest.approx(-570.0)
    tube = "Time (s),Pressure (kPa),Length (mm)\n" + "".join(f"{k},{k},{56 + 0.1 * k}\n" for k in range(9))
    with pytest.raises(InputError, match="turns strain and stress of a coupon or wire"):
        import_file(put("b.csv", tube), make_options(compression=True))
