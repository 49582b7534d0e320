"""Files that hold several tests: sheets, tables below each other, side by side, by a column; sizes they state."""

import numpy as np
import pytest
from answers import checks

from fitting.data.importers import import_file, import_tests, make_options
from pneusma_jax.errors import InputError

STRAIN = np.linspace(0.0, 1.0, 21)
MODULI = {"A": 300.0, "B": 360.0, "C": 330.0}


def stress(mu, strain=STRAIN):
    stretch = 1.0 + strain
    return mu * (stretch - stretch**-2)


def modulus(recording):
    stretch = 1.0 + recording.columns["strain"]
    shape = stretch - stretch**-2
    return float(shape @ recording.columns["stress_kPa"] / (shape @ shape))


def moduli(recordings):
    return [round(modulus(recording), 3) for recording in recordings]


def rows_of(mu, clock=True):
    columns = [np.arange(21) * 0.5, 100 * STRAIN, stress(mu)] if clock else [100 * STRAIN, stress(mu)]
    return [list(map(float, row)) for row in np.transpose(columns)]


HEAD = ["Time (s)", "Strain (%)", "Stress (kPa)"]


def text(rows):
    return "\n".join(",".join(map(str, row)) for row in rows) + "\n"


def refusal(call, *args, **named):
    with pytest.raises(InputError) as caught:
        call(*args, make_options(**named))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def three_sheets(put, put_sheet):
    return put_sheet("many.xlsx", {f"Specimen {k}": [HEAD, *rows_of(mu)] for k, mu in MODULI.items()})


def repeated_headers(put, put_sheet):
    return put("many.csv", text([row for k, mu in MODULI.items() for row in ([f"Specimen {k}"], HEAD, *rows_of(mu), [])]))


def units_below_the_names(put, put_sheet):
    """Bluehill's raw data: a label above each specimen's table, units in a row of their own."""
    blocks = [
        f'"Specimen label","{k}"\n"Rate","50","mm/min"\n\n"Time","Tensile strain","Tensile stress"\n"(s)","(%)","(kPa)"\n'
        + "".join('"' + '","'.join(map(str, row)) + '"\n' for row in rows_of(mu))
        for k, mu in MODULI.items()
    ]
    return put("many.csv", "\n".join(blocks))


def side_by_side_under_titles(put, put_sheet):
    """Titles in merged cells, of which the first holds the text; groups of unequal length."""
    title = [cell for k in MODULI for cell in (f"Specimen {k}", "", "")]
    blocks = [rows_of(mu)[: 21 - k] for k, mu in enumerate(MODULI.values())]
    rows = [[cell for block in blocks for cell in (block[i] if i < len(block) else ["", "", ""])] for i in range(21)]
    return put("many.csv", text([title, HEAD * 3, *rows]))


def side_by_side_with_a_gap(put, put_sheet):
    rows = [[cell for mu in MODULI.values() for cell in (*rows_of(mu)[i], None)] for i in range(21)]
    return put_sheet("many.xlsx", [[*HEAD, None] * 3, *rows])


def one_strain_and_a_stress_for_each(put, put_sheet):
    rows = [[100 * STRAIN[i], *(stress(mu)[i] for mu in MODULI.values())] for i in range(21)]
    return put("many.csv", text([["Strain (%)", *(f"Stress {k} (kPa)" for k in MODULI)], *rows]))


def a_column_of_names(put, put_sheet):
    rows = [[f"coupon-{k}", *row] for k, mu in MODULI.items() for row in rows_of(mu)]
    return put("many.csv", text([["Specimen", *HEAD], *rows]))


def a_column_of_numbers(put, put_sheet):
    rows = [[k, *row] for k, mu in enumerate(MODULI.values(), start=1) for row in rows_of(mu)]
    return put("many.csv", text([["Sample No.", *HEAD], *rows]))


def appended_without_a_word(put, put_sheet):
    """The clock and the strain begin anew, and nothing else says so."""
    return put("many.csv", text([HEAD, *(row for mu in MODULI.values() for row in rows_of(mu))]))


SHAPES = [
    three_sheets, repeated_headers, units_below_the_names, side_by_side_under_titles, side_by_side_with_a_gap,
    one_strain_and_a_stress_for_each, a_column_of_names, a_column_of_numbers, appended_without_a_word,
]  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES)
def test_each_specimen_becomes_a_recording(put, put_sheet, shape):
    path = shape(put, put_sheet)
    recordings = import_tests(path)
    assert moduli(recordings) == [300.0, 360.0, 330.0]
    assert len({recording.name for recording in recordings}) == 3
    same = shape is appended_without_a_word  # further tests of what may be one specimen
    assert len({recording.specimen for recording in recordings}) == (1 if same else 3)
    for recording in recordings:
        assert any("one of 3 tests in this file" in notice for notice in recording.notices)
    message = refusal(import_file, path)
    assert "holds 3 tests" in message and "--sheet or --specimen" in message
    for recording in recordings:  # the refusal's advice, followed
        part = recording.source["raw_part"]
        assert repr(part) in message
        (one,) = import_tests(path, make_options(specimen=part))
        assert modulus(one) == pytest.approx(modulus(recording), rel=1e-12)


def test_numbered_headings_are_groups(put):
    heads = [f"{name}{tail}" for tail in ("", ".1", ".2") for name in ("Strain (%)", "Stress (kPa)")]
    rows = [[cell for mu in MODULI.values() for cell in rows_of(mu, clock=False)[i]] for i in range(21)]
    path = put("many.csv", text([heads, *rows]))
    assert moduli(import_tests(path)) == [300.0, 360.0, 330.0]


def test_one_sheet_can_be_chosen_by_name_and_number(put_sheet):
    path = three_sheets(None, put_sheet)
    for sheet in ("specimen b", "2"):
        recording = import_file(path, make_options(sheet=sheet))
        assert modulus(recording) == pytest.approx(360.0) and any("'Specimen A' was left out (--sheet)" in n for n in recording.notices)
    message = refusal(import_tests, path, sheet="Specimen D")
    assert "there is no such sheet; there are 'Specimen A', 'Specimen B', 'Specimen C'" in message


def test_a_text_file_has_no_sheets(put):
    assert "--sheet 2: this is a text file" in refusal(import_tests, put("a.csv", text([HEAD, *rows_of(300.0)])), sheet="2")


def test_a_sheet_of_results_beside_the_data_is_named(put_sheet):
    results = [["Specimen", "Modulus (kPa)", "Max. load (N)"], *(["A", 900, 12.5], ["B", 950, 13.0], ["C", 940, 12.9])]
    path = put_sheet("a.xlsx", {"Summary": results, "Notes": [["Tested by Ada"]], "Data": [HEAD, *rows_of(300.0)]})
    (recording,) = import_tests(path)
    assert modulus(recording) == pytest.approx(300.0)
    said = "\n".join(recording.notices)
    assert "'Summary' was left out" in said and "sheet 'Notes' holds no table of a test" in said


def test_two_strain_gauges_on_one_specimen_are_not_two(put):
    rows = [[*row, row[1]] for row in rows_of(300.0)]
    assert len(import_tests(put("a.csv", text([[*HEAD, "Strain (%)"], *rows])))) == 1


def test_cycles_whose_clock_restarts_are_one_test(put):
    half = [*range(11), *range(10, -1, -1)]
    rows = [[c, 0.5 * i, 100 * STRAIN[k], stress(300.0)[k]] for c in (1, 2, 3) for i, k in enumerate(half)]
    (recording,) = import_tests(put("a.csv", text([["Cycle", *HEAD], *rows])))
    assert len(recording) == 66 and "clock_as_logged" in recording.columns


def test_remarks_between_rows_do_not_cut_a_test(put):
    lines = text([HEAD, *rows_of(300.0)]).splitlines()
    lines[10:10] = ["paused here; operator away, 5 min", ""]
    (recording,) = import_tests(put("a.csv", "\n".join(lines)))
    assert len(recording) == 21


# Sizes that a file states.

LOADS = [[0.5 * i, 25.0 * e, 0.018 * s / 1e0] for i, (e, s) in enumerate(zip(STRAIN, stress(300.0), strict=True))]
MACHINE = ["Time (s)", "Extension (mm)", "Load (N)"]


def bluehill_dimensions():
    return "Dimension : Length,25,mm\nDimension : Width,6,mm\nDimension : Thickness,3,mm\n\n" + text([["Time", "Extension", "Load"], ["(s)", "(mm)", "(N)"], *LOADS])


def zwick_text():
    head = '"Specimen thickness",3,"mm"\n"Specimen width",6,"mm"\n"Cross-section",18,"mm²"\n"Gage length, standard travel",25,"mm"\n"Operator",""\n"v1",1,"mm/min"\n'
    return head + text([["Time", "Standard travel", "Standard force"], ["s", "mm", "N"], *LOADS])


def prose_above():
    return "# Tensile test of 3 May\n# Gauge length: 25 mm\n# Cross-section = 18 mm^2\n" + text([MACHINE, *LOADS])


def units_in_the_names():
    return "Specimen Cross-section (cm²);0.18\nGrip separation (mm);25\n\n" + text([MACHINE, *LOADS]).replace(",", ";")


def german():
    body = text([["Zeit", "Standardweg", "Standardkraft"], ["s", "mm", "N"], *LOADS]).replace(",", ";").replace(".", ",")
    return "Probenbreite;6;mm\nProbendicke;3,0;mm\nL0;25;mm\n" + body


def with_symbols():
    return german().replace("Probenbreite", "Probenbreite b0").replace("Probendicke", "Probendicke a0").replace("L0", "Einspannlänge L0")


@pytest.mark.parametrize("shape", [bluehill_dimensions, zwick_text, prose_above, units_in_the_names, german, with_symbols])
def test_a_block_of_dimensions_is_read(put, shape):
    recording = import_file(put("a.csv", shape()))
    assert recording.kind == "elastomer" and modulus(recording) == pytest.approx(300.0, rel=1e-6)
    assert any("as the file states" in notice for notice in recording.notices)


def test_a_letter_that_is_no_symbol_of_a_size_makes_no_size_of_it(put):
    other = with_symbols().replace("Probenbreite b0", "Probenbreite x")
    with pytest.raises(InputError, match="the cross-section is missing"):
        import_file(put("a.csv", other))


def test_what_the_person_states_wins_over_the_file(put):
    path = put("a.csv", zwick_text())
    recording = import_file(path, make_options(dimensions=["gauge_length_mm=50"]))
    assert recording.columns["strain"].max() == pytest.approx(0.5)


def test_a_sheet_of_parameters_and_one_of_results_by_specimen(put_sheet):
    parameters = [["Gauge length", 25, "mm"]]
    results = [[None, "Specimen designation", "a0", "b0"], [None, None, "mm", "mm"], [None, "P7", 3, 6], [None, "P8", 3, 12]]
    data = [["P7"] * 3, ["Time", "Standard travel", "Standard force"], ["s", "mm", "N"], *LOADS]
    wide = [["P8"] * 3, ["Time", "Standard travel", "Standard force"], ["s", "mm", "N"], *([t, x, 2 * f] for t, x, f in LOADS)]
    path = put_sheet("a.xlsx", {"Parameters": parameters, "Results": results, "Values P7": data, "Values P8": wide})
    recordings = import_tests(path)
    assert moduli(recordings) == [300.0, 300.0]
    assert any("sheet 'Parameters' states sizes: Gauge length 25 mm" in notice for notice in recordings[0].notices)


def test_a_size_without_unit_is_assumed_and_said(put):
    recording = import_file(put("a.csv", "Width: 6\nThickness: 3\nGauge length: 25\n" + text([MACHINE, *LOADS])))
    assert modulus(recording) == pytest.approx(300.0, rel=1e-6)
    assert sum("its unit is not stated and was taken as mm" in notice for notice in recording.notices) == 3


def test_the_temperature_of_a_wire_in_the_preamble(put):
    rows = "".join(f"{0.001 * i},{30 * i}\n" for i in range(20))
    recording = import_file(put("a.csv", "Test temperature: 23 °C\nStrain (-),Stress (MPa)\n" + rows))
    assert recording.kind == "wire" and set(recording.columns["temperature_degC"]) == {23.0}


def test_one_measurement_in_two_units_is_not_two_specimens(put):
    rows = [[x, x / 25.4, f, f / 9.80665] for x, f in zip(25 * STRAIN, 18e-3 * stress(300.0), strict=True)]
    text_ = text([["Extension (mm)", "Extension (in)", "Load (N)", "Load (kgf)"], *rows])
    (recording,) = import_tests(put("a.csv", text_), make_options(dimensions=["gauge_length_mm=25", "area_mm2=18"]))
    assert modulus(recording) == pytest.approx(300.0)


def test_a_preload_in_the_preamble_is_said(put):
    recording = import_file(put("a.csv", "Preload: 0.1 N\n" + text([HEAD, *rows_of(300.0)])))
    assert any("speaks of a preload ('Preload: 0.1 N')" in notice for notice in recording.notices)


def test_columns_of_no_specimen_are_named(put):
    rows = [[100 * e, a, b, (a + b) / 2] for e, a, b in zip(STRAIN, stress(300.0), stress(360.0), strict=True)]
    recordings = import_tests(put("a.csv", text([["Strain (%)", "Stress A (kPa)", "Stress B (kPa)", "Stress mean (kPa)"], *rows])))
    assert moduli(recordings) == [300.0, 360.0]
    assert all(any("left aside: 'Stress mean (kPa)'" in notice for notice in recording.notices) for recording in recordings)


def test_a_date_beside_the_time_of_day_is_no_text(put):
    rows = [["2023-05-01", f"12:00:{i:02d}", *row[1:]] for i, row in enumerate(rows_of(300.0))]
    (recording,) = import_tests(put("a.csv", text([["Date", *HEAD[:1], *HEAD[1:]], *rows])))
    assert modulus(recording) == pytest.approx(300.0) and recording.columns["time_s"][-1] - recording.columns["time_s"][0] == 20.0


def shimadzu():
    rows = [[cell for mu in MODULI.values() for cell in rows_of(mu)[i]] for i in range(21)]
    quoted = [[f"1 _ {k}" for k in (1, 2, 3) for _ in range(3)], ["Time", "Strain", "Stress"] * 3, ["sec", "%", "kPa"] * 3, *rows]
    return "\n".join(",".join(f'"{cell}"' for cell in row) for row in quoted)


def report_with_a_table_of_results():
    head = "Results Table 1\n,Specimen label,Width (mm),Thickness (mm),Maximum Load (N)\n1,A,6,3,5\n2,B,6,6,6\n3,C,12,3,5\nMean,,8,4,\n\n"
    areas = {"A": 18, "B": 36, "C": 36}
    blocks = [
        f"Specimen {k}\nTime,Extension,Load\n(sec),(mm),(N)\n" + text([[t, e / 4, areas[k] * s / 1000] for t, e, s in rows_of(mu)])
        for k, mu in MODULI.items()
    ]
    return head + "\n".join(blocks)


def runs_with_a_head_each():
    blocks = [
        f"Test Run Name\tRun {k}\nDate\t01.02.2023\n\nDisplacement \tForce \tTime \nmm\tN\tsec\n"
        + "".join(f"{e / 4}\t{0.018 * s}\t{t}\n" for t, e, s in rows_of(mu)) for k, mu in MODULI.items()
    ]  # fmt: skip
    return "\n".join(blocks)


@pytest.mark.parametrize(
    ("shape", "sizes"),
    [(shimadzu, []), (report_with_a_table_of_results, ["gauge_length_mm=25"]), (runs_with_a_head_each, ["gauge_length_mm=25", "area_mm2=18"])],
)  # fmt: skip
def test_exports_of_machines_with_several_specimens(put, shape, sizes):
    assert moduli(import_tests(put("a.csv", shape()), make_options(dimensions=sizes))) == [300.0, 360.0, 330.0]


def test_a_name_for_several_specimens_is_said(put):
    recordings = import_tests(put("a.csv", text(repeated_rows())), make_options(specimen="batch 7"))
    assert {recording.specimen for recording in recordings} == {"batch 7"}
    assert all(any("--specimen batch 7 names no test of this file" in n for n in recording.notices) for recording in recordings)


def repeated_rows():
    return [row for k, mu in MODULI.items() for row in ([f"Specimen {k}"], HEAD, *rows_of(mu), [])]


def test_headings_with_the_number_of_a_channel(put):
    head = "S/No;C_1_Temps[s];C_1_Force[kN];C_1_Valeur de consigne[];C_1_Déplacement[mm]\n"
    rows = "".join(f"{i};{t};{1e-3 * f};200.0;{x}\n" for i, (t, x, f) in enumerate(LOADS))
    recording = import_file(put("a.csv", head + rows), make_options(dimensions=["gauge_length_mm=25", "area_mm2=18"]))
    assert modulus(recording) == pytest.approx(300.0) and recording.columns["time_s"][-1] == 10.0


SIDE_BY_SIDE = "{0},{1},,{0},{1},\n" + "".join(f"{k},{56 + 0.1 * k:.2f},,{k},{56 + 0.15 * k:.2f},\n" for k in range(8))


@pytest.mark.parametrize("shape", ["Length (mm)", "Bend angle (deg)", "Curvature (1/m)"])
@pytest.mark.parametrize("above", ["", "Tube A,,,Tube B,,\n"])
def test_tubes_and_actuators_side_by_side_are_tests_of_their_own(put, shape, above):
    first, second = import_tests(put("a.csv", above + SIDE_BY_SIDE.format("Pressure (kPa)", shape)))
    one, other = (r.columns[next(name for name in r.columns if name not in ("time_s", "pressure_kPa"))] for r in (first, second))
    np.testing.assert_allclose(one, 56 + 0.1 * np.arange(8))
    np.testing.assert_allclose(other, 56 + 0.15 * np.arange(8))
    assert first.specimen != second.specimen and not above or "Tube_A" in first.specimen


def test_a_clock_of_its_own_goes_with_each_tube(put):
    rows = "".join(f"{k},{k},{56 + 0.1 * k:.2f},{3 * k},{k},{56 + 0.2 * k:.2f}\n" for k in range(6))
    recordings = import_tests(put("a.csv", "Time (s),Pressure (kPa),Length (mm)," * 2 + "\n" + rows))
    assert [list(r.columns["time_s"][:3]) for r in recordings] == [[0, 1, 2], [0, 3, 6]]


def test_two_pressures_and_two_angles_of_one_actuator_are_not_split(put):
    rows = "".join(f"{k},{k},{2 * k},{0.5 * k},{0.1 * k}\n" for k in range(8))
    assert len(import_tests(put("a.csv", "Time (s),Pressure 1 (kPa),Pressure 2 (kPa),Bend angle 1 (deg),Bend angle 2 (deg)\n" + rows))) == 1


def asks_for_specimens(recording):
    return [note for note in checks(recording) if "--specimen" in note]


def two(second, third="", heads="Pressure (kPa),Bend angle (deg)"):
    """Pressures and angles twice under the same headings, with a column between them."""
    between = f"{third}," if third else ""
    rows = "".join(f"{k},{k},{3 * k},{'3.6,' if third else ''}{second(k)}\n" for k in range(8))
    return f"Time (s),{heads},{between}{heads}\n{rows}"


@pytest.mark.parametrize("third", ["", "R1 (ohm)", "Temperature (degC)"])
def test_specimens_without_titles_are_asked_about_with_what_they_share(put, third):
    path = put("a.csv", two(lambda k: f"{0.5 * k},{2 * k}", third))
    recordings = import_tests(path, make_options(kind="actuator"))
    columns = "(2, 3) and (5, 6)" if third else "(2, 3) and (4, 5)"
    for recording in recordings:
        (said,) = asks_for_specimens(recording)
        assert f"columns {columns} have the same headings and were taken as 2 specimens" in said
        assert (f"Each was also given {third!r}: right if of all of them" in said) == bool(third)
    (alone,) = import_tests(path, make_options(kind="actuator", specimen="specimen_1"))
    np.testing.assert_allclose(alone.columns["bend_angle_deg"], 3.0 * np.arange(8))


def test_specimens_with_titles_are_not_asked_about(put):
    text = "Tube A,,,Tube B,,\n" + SIDE_BY_SIDE.format("Pressure (kPa)", "Length (mm)")
    assert not any(map(asks_for_specimens, import_tests(put("a.csv", text))))


def test_columns_that_repeat_others_are_no_second_specimen(put):
    (recording,) = import_tests(put("a.csv", two(lambda k: f"{k},{3 * k}")), make_options(kind="actuator"))
    assert sum("repeats it: left aside" in note for note in recording.notices) == 2 and not asks_for_specimens(recording)
    text = two(lambda k: f"{k},{3 * k},{k},{2 * k}").replace("\n", ",Pressure (kPa),Bend angle (deg)\n", 1)
    recordings = import_tests(put("b.csv", text), make_options(kind="actuator"))
    assert [one.columns["bend_angle_deg"][-1] for one in recordings] == [21.0, 14.0]
    assert any("columns 4, 5 repeat columns 2, 3: left aside" in note for note in recordings[0].notices)


def test_pressures_beside_pressures_make_no_clear_groups(put):
    head = "Time (s),Pressure (kPa),Pressure (kPa),Bend angle (deg),Bend angle (deg)\n"
    text = head + "".join(f"{k},{k},{2 * k},{3 * k},{4 * k}\n" for k in range(8))
    (recording,) = import_tests(put("a.csv", text), make_options(kind="actuator"))
    assert any("--map pressure=3 takes the other" in note for note in checks(recording))
