"""Headings that no list has: ordinary ones are recognised, and others are named with what would be right."""

import numpy as np
import pytest
from answers import refusal

from fitting.data.importers import import_file, make_options, words
from fitting.data.importers.other_headings import quantity_by_word
from fitting.data.importers.spelling import parse_heading as heading_of_spelling
from fitting.data.importers.words import WORDS, heading_of, meaning, meaning_of
from pneusma_jax.errors import InputError

X = np.linspace(0.0, 40.0, 30)
COLUMNS = (0.5 * np.arange(30.0), X, 0.012 * X, 2.1 + 0.003 * X)


def table(*heads):
    return ";".join(heads) + "\n" + "".join(";".join(f"{x:.5g}" for x in row) + "\n" for row in zip(*COLUMNS, strict=True))


@pytest.mark.parametrize(
    "heads",
    [
        ("Elapsed time (sec)", "Elongation/mm", "Pull force/N", "R_spring (Ohm)"),
        ("Time (s)", "Extension (mm)", "Pull force (N)", "Spring resistance (ohm)"),
        ("t (s)", "Spring extension [mm]", "Load [N]", "Resistance of the spring [Ω]"),
        ("Time (s)", "Displacement of the stage (mm)", "F_pull (N)", "R spring (ohm)"),
        ("Zeit (s)", "Verlängerung der Feder (mm)", "Kraft an der Feder (N)", "Widerstand der Feder (Ohm)"),
        ("Time (s)", "Actuator extension (mm)", "Axial pull force (N)", "Coil resistance (ohm)"),
    ],
)
def test_ordinary_headings_of_a_spring_are_recognised(put, heads):
    recording = import_file(put("a.csv", table(*heads)))
    assert recording.kind == "spring"
    for name, values in zip(("time_s", "elongation_mm", "force_N", "resistance_ohm"), COLUMNS, strict=True):
        np.testing.assert_allclose(recording.columns[name], values, rtol=1e-4)


def test_what_a_word_decided_is_said(put):
    recording = import_file(put("a.csv", table("Time (s)", "Extension (mm)", "Pull force (N)", "R_spring (ohm)")))
    notes = "\n".join(recording.notices)
    assert "check: 'Pull force (N)' taken as force by one of its words (--map force=... to correct)" in notes
    assert "'R_spring (ohm)' taken as resistance" in notes and "'Extension (mm)' taken" not in notes


def test_the_unit_of_such_a_heading_is_asked_for(put):
    said = refusal(put("a.csv", table("Time (s)", "Extension (mm)", "Pull force", "Spring resistance")), kind="spring")
    assert "'Pull force', 'Spring resistance' are not stated" in said and "--unit force=... --unit resistance=..." in said


@pytest.mark.parametrize(
    "heading",
    ["Force setpoint (N)", "Set force (N)", "Peak load (N)", "Load rate (N/s)", "Shunt resistance (ohm)", "Lead resistance (ohm)", "Motor current (A)", "Room temperature (degC)", "Load cell temperature (degC)", "Lateral displacement (mm)", "Pull force (mm)", "R2 (kg)", "Force and extension"],
)
def test_set_points_and_other_parts_of_a_rig_are_not_taken(heading):
    assert quantity_by_word(heading_of(heading)) is None


@pytest.mark.parametrize("words", ["{} SP", "{} goal", "{} cmd", "{} threshold", "Alarm {}", "Trigger {}", "Programmed {}", "Ziel {}", "Consigne {}", "Rated {}", "{} uncertainty", "{} drift", "Breaking {}", "{} step", "Delta {}", "Maximale {}", "Grenzwert {}", "Residual {}", "Side {}", "Normal {}", "Nominal {}"])
def test_a_column_of_what_was_wished_or_computed_is_no_measured_force(put, words):
    said = refusal(put("a.csv", table("Time (s)", "Extension (mm)", f"{words.format('force')} (N)", "Resistance (ohm)")), kind="spring")
    assert "needs force_N" in said and repr(f"{words.format('force')} (N)") in said


@pytest.mark.parametrize(("written", "quantity"), [("F_cmd (N)", None), ("F_goal (N)", None), ("F_lim (N)", None), ("F_pull (N)", "force")])
def test_a_symbol_of_a_set_point_is_not_taken(written, quantity):
    assert quantity_by_word(heading_of(written)) == quantity


def test_a_word_that_begins_like_a_number_of_a_test_is_none():
    assert meaning(heading_of("Normal force (N)")) is None and meaning(heading_of("Running force (N)")) is None
    assert meaning(heading_of("no 2 force (N)")).tag == "no 2" and meaning(heading_of("testA force (N)")).tag == "testa"


def test_two_headings_of_one_quantity_are_not_taken_and_named(put):
    said = refusal(put("a.csv", table("Time (s)", "Pull force (N)", "Spring force (N)", "R_spring (ohm)")), kind="spring")
    assert "needs force_N, elongation_mm" in said.replace("elongation_mm, force_N", "force_N, elongation_mm")
    assert "not recognised: 'Pull force (N)', 'Spring force (N)'" in said and "--map force='Pull force (N)'" in said


def test_a_known_heading_comes_before_one_with_a_further_word(put):
    recording = import_file(put("a.csv", table("Pull force (N)", "Extension (mm)", "Force (N)", "Resistance (ohm)")), make_options(interval_s=0.5))
    np.testing.assert_allclose(recording.columns["force_N"], COLUMNS[2], rtol=1e-4)


@pytest.mark.parametrize("kind", [None, "spring"])
def test_a_refusal_names_the_columns_that_were_not_recognised_and_names_that_would_be(put, follow, kind):
    heads = ("Time (s)", "Extension (mm)", "Zug [N]", "Spule [Ohm]")
    path = put("a.csv", table(*heads))
    said = refusal(path, **({"kind": kind} if kind else {}))
    assert "not recognised: 'Zug [N]', 'Spule [Ohm]'" in said
    assert "--map force='Zug [N]' --map resistance='Spule [Ohm]'" in said and "'Force (N)', 'Resistance (ohm)'" in said
    mapped = import_file(path, make_options(columns=["force=Zug [N]", "resistance=Spule [Ohm]"]))
    assert mapped.kind == "spring"


def test_a_file_with_one_known_heading_names_the_others(put):
    said = refusal(put("a.csv", table("Time (s)", "Weg der Bühne (mm)", "Zug [N]", "Spule [Ohm]")))
    assert "name its columns ('Time (s)', 'Weg der Bühne (mm)', 'Zug [N]', 'Spule [Ohm]')" in said and "--map elongation='Weg der Bühne (mm)'" in said


DECORATED = [
    "{}", "{} (N)", "{} [-]", "{}_mm", "{} %", "{}, kPa", "{}s", "{}es", "{} 2", "{}2", "{} #3", "Specimen 2 {}", "s1 {}",
    "{} - sample B", "{} measured", "max {}", "5 {}", "-{}", "[1] {}", "percent {}", "{} C", "({})", "{}-a (s)", "x{}", "{}x",
]  # fmt: skip


def test_a_text_has_the_meaning_of_its_heading():
    """The guards against long tables pass over no heading, in any decoration of a known word."""
    texts = [form.format(write(w)) for ws in WORDS.values() for w in ws for form in DECORATED for write in (str, str.title)]
    assert sum(meaning_of(text) is not None for text in texts) > len(texts) // 3
    assert [text for text in texts if meaning_of(text) != meaning(heading_of(text))] == []


@pytest.mark.parametrize(
    "row", ["{0},{1:.5f},{1:.4e}", "2024-05-31 12:00:00.{0:06d},{1:.5f},ok", "{0}x,{1:.3f}%,high;low|far", "note {0},valve {0};next {0}"]
)
def test_the_rows_of_a_long_file_are_not_parsed_as_headings(put, monkeypatch, row):
    """A long file would take minutes otherwise."""
    asked = []
    words._meaning_of.cache_clear()
    monkeypatch.setattr(words, "parse_heading", lambda text: asked.append(text) or heading_of_spelling(text))
    path = put("a.csv", "Time (s),Strain (%),Stress (kPa)\n" + "".join(row.format(k, 0.01 * k) + "\n" for k in range(3000)))
    try:
        import_file(path)
    except InputError:
        pass
    assert 0 < len(asked) < 100


@pytest.mark.parametrize(
    ("heading", "scale"),
    [("Bending curvature [1/cm]", 0.01), ("Centreline curvature (m^-1)", 1.0), ("Krümmung 1/mm", 1e-3), ("Curvature 1/m", 1.0)],
)
def test_a_curvature_is_recognised_by_its_word_and_unit(put, heading, scale):
    """`Bending curvature [1/cm]` was refused."""
    text = f"Time (s);Tube pressure (kPa);{heading}\n" + "".join(f"{t:.1f};{p:.4f};{1.2 * scale * p:.8f}\n" for t, p in zip(*COLUMNS[:2], strict=True))
    recording = import_file(put("a.csv", text))
    assert recording.kind == "actuator"
    np.testing.assert_allclose(recording.columns["curvature_1pm"], 1.2 * X, atol=1e-3)


@pytest.mark.parametrize("heading", ["Tank pressure (kPa)", "Pressure of the line (bar)", "Curvature of the mould (mm)", "Barometric pressure (kPa)", "Sample curvature"])
def test_pressures_of_the_rig_and_words_without_their_unit_are_not_taken(heading):
    assert quantity_by_word(heading_of(heading)) is None


@pytest.mark.parametrize(("text", "name", "unit"), [("Stress N/mm2", "stress", "N/mm2"), ("Strain mm/mm", "strain", "1"), ("Weg 1/mm", "weg 1", "mm")])
def test_a_unit_with_a_mark_of_division_stands_behind_a_space(text, name, unit):
    """The first two were read as `Stress N` in mm2 and `Strain mm` in mm."""
    assert (heading_of(text).name, heading_of(text).unit) == (name, unit)


@pytest.mark.parametrize(("mark", "delimiter"), [("#", ","), ("#", ";"), ("%", "\t")])
@pytest.mark.parametrize("remarks", ["", "Remarks"])
def test_a_mark_heads_the_row_numbers_where_the_numbers_have_a_column_for_it(put, mark, delimiter, remarks):
    """The mark was dropped, so that every number stood under the heading to its right."""
    heads = [mark, "Time (s)", "Strain (-)", "Stress (kPa)", *([remarks] if remarks else [])]
    rows = [[f"{i + 1}", f"{0.1 * i:.1f}", f"{0.01 * i:.2f}", f"{1.5 * i:.1f}", *([""] if remarks else [])] for i in range(30)]
    recording = import_file(put("a.csv", "\n".join(delimiter.join(row) for row in [heads, *rows]) + "\n"))
    for name, step in (("time_s", 0.1), ("strain", 0.01), ("stress_kPa", 1.5)):
        np.testing.assert_allclose(recording.columns[name], step * np.arange(30), atol=1e-9)


@pytest.mark.parametrize("heads", [["#", "Time (s)", "Strain (-)", "Stress (kPa)"], ["# Time (s)", "Strain (-)", "Stress (kPa)"]])
def test_a_mark_before_as_many_names_as_numbers_is_a_comment(put, heads):
    rows = [[f"{i}", f"{0.01 * i:.2f}", f"{1.5 * i:.1f}"] for i in range(30)]
    recording = import_file(put("a.csv", "\n".join(",".join(row) for row in [heads, *rows]) + "\n"))
    np.testing.assert_allclose(recording.columns["stress_kPa"], 1.5 * np.arange(30), atol=1e-9)


@pytest.mark.parametrize("head", ["时间（s）,应变（％）,应力（kPa）", "Time（s）,Strain［％］,Stress／kPa"])
def test_marks_of_wide_letters_hold_a_unit(put, head):
    """Headings of Chinese and Japanese machines were not recognised."""
    rows = "".join(f"{0.1 * i:.1f},{i:.2f},{1.5 * i:.1f}\n" for i in range(30))
    recording = import_file(put("a.csv", f"{head}\n{rows}"))
    np.testing.assert_allclose(recording.columns["strain"], 0.01 * np.arange(30), atol=1e-9)
    np.testing.assert_allclose(recording.columns["stress_kPa"], 1.5 * np.arange(30), atol=1e-9)
