"""Specimens that one table names: each becomes a recording or is said; none is merged with another."""

import numpy as np
import pytest

from fitting.data.importers import Options, import_file, import_tests
from fitting.data.importers.size_tables import table_of_sizes
from pneusma_jax.errors import InputError

STRAIN = np.linspace(0.0, 0.5, 12)
MODULI = {"K1": 100.0, "K2": 140.0, "K3": 70.0}


def stress(mu, strain=STRAIN):
    return mu * (1.0 + strain - (1.0 + strain) ** -2)


def modulus(recording):
    shape = stress(1.0, recording.columns["strain"])
    return round(float(shape @ recording.columns["stress_kPa"] / (shape @ shape)), 2)


def block(mu, rows=12, front=()):
    pairs = list(zip(STRAIN, stress(mu), strict=True))[:rows]
    return [[*(f[k] if isinstance(f, list) else f for f in front), 100 * e, s] for k, (e, s) in enumerate(pairs)]


def table(*rows, sep=","):
    return "\n".join(sep.join(f"{x:.5f}" if isinstance(x, float) else str(x) for x in row) for row in rows) + "\n"


def checks(recordings):
    return [note for recording in recordings for note in recording.notices if note.startswith("check:")]


HEAD = ["Strain (%)", "Stress (kPa)"]


@pytest.mark.parametrize("heading", ["Specimen", "Sample ID", "Coupon", "Prüfling", "Batch", "Run"])
@pytest.mark.parametrize("short", [1, 2])
def test_a_specimen_with_too_few_rows_leaves_the_others_alone(put, heading, short):
    rows = [row for k, mu in MODULI.items() for row in block(mu, short if k == "K2" else 12, [k])]
    recordings = import_tests(put("a.csv", table([heading, *HEAD], *rows)))
    assert [modulus(r) for r in recordings] == [100.0, 70.0]
    assert all(f"'K2' of {heading!r} has {short} row" in " ".join(checks([r])) for r in recordings)
    assert not any("is text and was left out" in note for r in recordings for note in r.notices)


def test_one_specimen_and_a_stray_row_of_another(put):
    rows = [*block(100.0, front=["K1"]), *block(140.0, 1, ["K9"])]
    (recording,) = import_tests(put("a.csv", table(["Specimen", *HEAD], *rows)))
    assert modulus(recording) == 100.0 and "'K9' of 'Specimen' has 1 row (row 14)" in " ".join(checks([recording]))


@pytest.mark.parametrize("count", [61, 130])
def test_any_number_of_specimens(put, count):
    rows = [row for k in range(count) for row in block(100.0 + k, 4, [f"P-{k:03d}"])]
    recordings = import_tests(put("a.csv", table(["Specimen", *HEAD], *rows)))
    assert [modulus(r) for r in recordings] == [100.0 + k for k in range(count)]


def test_any_number_of_columns_of_stress(put):
    rows = [[100 * e, *(float(stress(100.0 + k, e)) for k in range(64))] for e in STRAIN]
    recordings = import_tests(put("a.csv", table(["Strain (%)", *(f"Stress {k} (kPa)" for k in range(64))], *rows)))
    assert len(recordings) == 64 and modulus(recordings[63]) == 163.0


@pytest.mark.parametrize("sep", [",", ";"])
def test_a_name_in_the_first_row_stands_for_those_below(put, sep):
    rows = [row for k, mu in MODULI.items() for row in block(mu, front=[[k] + [""] * 11])]
    recordings = import_tests(put("a.csv", table(["Specimen", *HEAD], *rows, sep=sep)))
    assert [modulus(r) for r in recordings] == [100.0, 140.0, 70.0]
    assert all(any("taken for the rows below it" in note for note in r.notices) for r in recordings)


def test_a_name_in_merged_cells_of_a_sheet(put_sheet):
    rows = [row for k, mu in MODULI.items() for row in block(mu, front=[[k] + [None] * 11])]
    recordings = import_tests(put_sheet("a.xlsx", [["Sample", *HEAD], *[[*r[:1], *map(float, r[1:])] for r in rows]]))
    assert [modulus(r) for r in recordings] == [100.0, 140.0, 70.0]


def test_rows_without_a_name_are_said(put):
    rows = [*block(100.0, front=["K1"]), *block(140.0, front=["K2"])]
    rows[5][0] = rows[20][0] = ""
    recordings = import_tests(put("a.csv", table(["Specimen", *HEAD], *rows)))
    assert [len(r) for r in recordings] == [11, 11]
    assert all("2 rows without a name in 'Specimen' were left out (row 7)" in " ".join(checks([r])) for r in recordings)


@pytest.mark.parametrize("heading", ["Sample", "No.", "Test", "Run"])
def test_a_count_of_rows_names_no_specimens(put, heading):
    (recording,) = import_tests(put("a.csv", table([heading, *HEAD], *block(100.0, front=[list(range(12))]))))
    assert len(recording) == 12


LINES = {
    "a word and a number": ("Specimen {}", True), "a word and a letter": ("*** Sample {} ***", True),
    "a label": ("Specimen label: {}", True), "two cells": ("Coupon,{}", True), "a run": ("Run {}", False),
}  # fmt: skip


@pytest.mark.parametrize("name", LINES)
@pytest.mark.parametrize("clock", [False, True])
def test_a_line_that_names_a_specimen_divides_the_rows(put, name, clock):
    line, own = LINES[name]
    front = [[float(k) for k in range(12)]] if clock else []
    names = "ABC" if name == "a word and a letter" else ("1", "2", "3")
    head = [["Time (s)", *HEAD] if clock else HEAD]
    parts = [[[line.format(n)], *(head if k == 0 else []), *block(mu, front=front)] for k, (n, mu) in enumerate(zip(names, MODULI.values(), strict=True))]
    recordings = import_tests(put("a.csv", table(*(row for part in parts for row in part))))
    assert [modulus(r) for r in recordings] == [100.0, 140.0, 70.0]
    assert len({r.specimen for r in recordings}) == (3 if own else 1)


def test_sizes_below_the_line_are_those_of_its_specimen(put):
    rows = [[20 * e, 0.01 * s] for e, s in zip(STRAIN, stress(100.0), strict=True)]
    wide = [[40 * e, 0.03 * s] for e, s in zip(STRAIN, stress(100.0), strict=True)]
    text = table(["Specimen 1"], ["Gauge length: 20 mm"], ["Area: 10 mm2"], ["Extension (mm)", "Load (N)"], *rows,
                 ["Specimen 2"], ["Gauge length: 40 mm"], ["Area: 30 mm2"], *wide)  # fmt: skip
    assert [modulus(r) for r in import_tests(put("a.csv", text))] == [100.0, 100.0]


def test_a_short_block_below_a_line_is_said(put):
    text = table(["Specimen 1"], HEAD, *block(100.0), ["Specimen 2"], *block(140.0, 2), ["Specimen 3"], *block(70.0))
    recordings = import_tests(put("a.csv", text))
    assert [modulus(r) for r in recordings] == [100.0, 70.0]
    assert all("'Specimen 2' has 2 rows (row 16)" in " ".join(checks([r])) for r in recordings)


@pytest.mark.parametrize("remark", ["Test paused", "Sample slipped in the grip", "Run time 12 s", "Sample rate: 10 Hz"])
def test_a_remark_divides_no_test(put, remark):
    rows = block(100.0)
    (recording,) = import_tests(put("a.csv", table(HEAD, *rows[:6], [remark], *rows[6:])))
    assert len(recording) == 12


def test_a_short_group_of_columns_is_said(put):
    rows = [[100 * e, s, *([100 * e, 1.4 * s] if k < 2 else ["", ""]), *([100 * e, 0.7 * s] if k < 7 else ["", ""])]
            for k, (e, s) in enumerate(zip(STRAIN, stress(100.0), strict=True))]  # fmt: skip
    names = [f"{q} {k} ({u})" for k in (1, 2, 3) for q, u in (("Strain", "%"), ("Stress", "kPa"))]
    recordings = import_tests(put("a.csv", table(names, *rows)))
    assert [modulus(r) for r in recordings] == [100.0, 70.0]
    assert all("('Strain 2 (%)', 'Stress 2 (kPa)') has 2 rows" in " ".join(checks([r])) for r in recordings)


def test_what_begins_anew_without_a_name_is_asked_about(put):
    below = table(HEAD, *block(100.0)) + "\n" + table(*block(140.0))
    (recording,) = import_tests(put("a.csv", below))
    assert any("below an empty line the test begins anew (row 15)" in note for note in checks([recording]))
    named = [row for k in ("soft", "hard") for row in block(100.0, front=[k])]
    (recording,) = import_tests(put("b.csv", table(["Silicone", *HEAD], *named)))
    assert any("where 'Silicone' changes ('soft', 'hard')" in note for note in checks([recording]))
    assert len(import_tests(put("c.csv", (recording.path).read_text().replace("Silicone", "Specimen")))) == 2


def test_a_clock_that_goes_back_is_to_be_looked_at(put):
    rows = [[float(k % 12), *row] for k, row in enumerate([*block(100.0), *([e, s + 20.0] for e, s in block(140.0))])]
    (recording,) = import_tests(put("a.csv", table(["Time (s)", *HEAD], *[r[:1] + [r[1] + 5 * (k > 11), r[2]] for k, r in enumerate(rows)])))
    assert any("the clock goes back" in note for note in checks([recording]))


SPRING = "time (s),elongation (mm),force (N),resistance (Ohm)\n" + "".join(
    f"{0.5 * k},{0.3 * k:.2f},{0.006 * k:.4f},25.1\n" for k in range(30)
)


def test_a_sized_spring_of_another_alloy_than_the_sources_is_to_be_identified(put):
    sized = Options(kind="spring", dimensions={"wire_diameter_mm": 0.25, "active_coils": 40.0})
    (found,) = import_tests(put("a.csv", SPRING), sized)
    assert found.geometry["alloy"] == "fit"
    assert "alloy = \"fit\": its law is to be identified" in " ".join(checks([found]))
    (usual,) = import_tests(put("b.csv", SPRING.replace("25.1", "3.1")), sized)
    assert "alloy" not in usual.geometry and not any("identified" in note for note in checks([usual]))


def test_a_spring_of_unknown_size_and_strange_resistance_is_refused(put):
    with pytest.raises(InputError, match="25.1 cannot be: .* with --dimension where it is imported"):
        import_tests(put("a.csv", SPRING), Options(kind="spring"))


TUBE = ["Pressure (kPa),Length (mm)", *(f"{5 * k},{56 + 0.5 * k}" for k in range(6))]


def test_a_tube_whose_rows_are_numbered_is_no_table_of_sizes(put):
    """A second table without a clock was lost: its lengths were read as sizes of specimens 1 to 6."""
    first = ["Time (s)," + TUBE[0], *(f"{k},{row}" for k, row in enumerate(TUBE[1:]))]
    second = ["No.," + TUBE[0], *(f"{k + 1},{row}" for k, row in enumerate(TUBE[1:]))]
    both = import_tests(put("a.csv", "\n".join([*first, "", *second]) + "\n"))
    assert [recording.kind for recording in both] == ["tube", "tube"]
    assert any("the file has no clock" in note for note in both[1].notices)
    assert import_file(put("b.csv", "\n".join(second) + "\n")).kind == "tube"


def test_a_table_that_is_read_as_sizes_is_said(put):
    sizes = "\nNo.,Width (mm),Thickness (mm)\n" + "".join(f"{k},6,{k}\n" for k in range(1, 6))
    pull = "Time (s),Strain (-),Stress (kPa)\n" + "".join(f"{k},{0.05 * k:.2f},{4 * k}\n" for k in range(8))
    recording = import_file(put("a.csv", pull + sizes))
    assert any("'Thickness (mm)' was read as sizes of 5 specimens, and no test" in note for note in recording.notices)


def test_an_area_in_a_table_of_specimens_is_no_thickness():
    """`A0` is the name of a thickness, but its unit says otherwise; beside a width it gave a wrong area."""
    (sizes,) = table_of_sizes([["Specimen", "A0 (mm2)", "Width (mm)"], ["S1", "12.5", "6"]]).values()
    assert {name: size.value for name, size in sizes.items()} == {"area_mm2": 12.5, "width_mm": 6.0}
