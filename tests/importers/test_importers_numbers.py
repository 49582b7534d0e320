"""Numbers, units and headings as laboratories and machines write them."""

import numpy as np
import pytest
from answers import refusal

from fitting.data.importers import import_file, make_options
from fitting.data.importers.clocks import read_clock
from fitting.data.importers.numerals import to_number
from fitting.data.importers.spelling import parse_heading, unit_name
from fitting.data.importers.words import heading_of, meaning
from pneusma_jax.errors import InputError
from pneusma_jax.units import to_si

STRETCH = np.linspace(1.0, 1.6, 25)
STRESS = 400.0 * (STRETCH - STRETCH**-2)  # kPa


def said(recording, words):
    return any(words in text for text in recording.notices)


@pytest.mark.parametrize(
    ("text", "decimal", "value"),
    [
        ("1,234.5", ".", 1234.5), ("12,345,678", ".", 12345678.0), ("1.234,5", ",", 1234.5), ("1 234.5", ".", 1234.5),
        ("1\u00a0234,5", ",", 1234.5), ("1\u202f234", ".", 1234.0), ("1'234.5", ".", 1234.5), ("1’234’567,25", ",", 1234567.25),
        ("-1,234.5e-3", ".", -1.2345), ("\u22125.5", ".", -5.5), ("1.5D-3", ".", 1.5e-3), (".5", ".", 0.5), ("0,025", ",", 0.025),
    ],
)  # fmt: skip
def test_thousands_are_grouped_in_every_convention(text, decimal, value):
    assert to_number(text, decimal) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(("text", "decimal"), [("0,025", "."), ("1,23", "."), ("1.23", ","), ("12 34", "."), ("1.2.3", "."), ("1,2,3", ","), ("abc", ".")])
def test_what_is_no_number_is_not_guessed(text, decimal):
    assert to_number(text, decimal) is None


@pytest.mark.parametrize(
    ("delimiter", "number"),
    [
        (";", lambda x: f"{x:,.3f}"),
        (";", lambda x: f"{x:,.3f}".translate(str.maketrans(",.", ".,"))),
        ("\t", lambda x: f"{x:,.3f}".replace(",", " ")),
        (";", lambda x: f"{x:,.3f}".replace(",", "'")),
        ("\t", lambda x: f"{x:,.2f}".replace(",", "\u202f").replace(".", ",")),
        (",", lambda x: f'"{x:,.3f}"'),
        (",", lambda x: f"{x:,.3f}".replace(",", " ")),
    ],
)
def test_a_file_whose_loads_pass_a_thousand(put, delimiter, number):
    """The same test in seven conventions: loads from -2 to 7000 N."""
    force = 10.0 * STRESS
    rows = [delimiter.join([number(1e3 * (s - 1.0)), number(f)]) for s, f in zip(STRETCH, force, strict=True)]
    path = put("a.csv", "\n".join([delimiter.join(["Extension (mm)", "Load (N)"]), *rows, ""]))
    recording = import_file(path, make_options(kind="elastomer", dimensions=["gauge_length_mm=1000", "area_mm2=10000"]))
    np.testing.assert_allclose(recording.columns["strain"], STRETCH - 1.0, atol=1e-5)
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, atol=2e-3)
    assert said(recording, "thousands are grouped") and len(recording) == 25


def test_three_decimals_after_a_comma_are_no_thousands(put):
    rows = "".join(f"{s - 1.0:.3f};{p:.3f}\n".replace(".", ",") for s, p in zip(STRETCH, STRESS, strict=True))
    recording = import_file(put("a.csv", "Strain (-);Stress (kPa)\n" + rows))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, atol=1e-3)


@pytest.mark.parametrize("field", ["broken", "1.2.3 ", "see note"])
def test_a_needed_column_of_words_is_refused(put, field):
    rows = "".join(f"{i},{0.1 * i},{field if i % 4 else i}\n" for i in range(12))
    message = refusal(put("a.csv", "Time (s),Strain (-),Stress (kPa)\n" + rows))
    assert "9 of 12 fields of 'Stress (kPa)' are no numbers" in message and field.strip() in message and "row 3" in message


def test_a_number_with_doubtful_marks_is_refused_where_it_is_needed(put):
    rows = "".join(f"{0.1 * i:.2f};{'1.003.000' if i == 7 else f'{i}.25'};{'1.003.000' if i == 7 else i}\n" for i in range(12))
    path = put("a.csv", "Strain (-);Stress (kPa);Counter\n" + rows)
    message = refusal(path)
    assert "'1.003.000' in row 9 of 'Stress (kPa)'" in message and "its marks are not those of the other numbers" in message
    assert import_file(put("b.csv", path.read_text().replace("1.003.000;", "8.25;"))).kind == "elastomer"


@pytest.mark.parametrize("mark", ["#DIV/0!", "#N/A", "#REF!", "#VALUE!", "#NUM!", "#NAME?", "#WERT!", "NaN", "-", "n/a"])
def test_what_is_written_as_missing_is_counted_with_its_first_row(put, mark):
    """Errors of a spreadsheet are to be looked at; they had been blanks without a word."""
    written = {3: mark, 5: mark}
    rows = "".join(f"{s - 1.0:.4f},{written.get(k, f'{p:.4f}')}\n" for k, (s, p) in enumerate(zip(STRETCH, STRESS, strict=True)))
    recording = import_file(put("a.csv", "Strain (-),Stress (kPa)\n" + rows))
    assert np.flatnonzero(np.isnan(recording.columns["stress_kPa"])).tolist() == [3, 5]
    told = f"2 fields of column 'Stress (kPa)' are written as missing ({mark!r} in row 5 and 1 more row)"
    assert ("check: " * mark.startswith("#") + told) in recording.notices


def test_many_columns_with_blanks_have_one_line_together(put):
    rows = "".join(f"{s - 1.0:.4f},{p:.4f}" + ",NaN,1" * (k == 3) + ",1,2" * (k != 3) + ",-" * 9 * (k == 4) + ",1" * 9 * (k != 4) + "\n"
                   for k, (s, p) in enumerate(zip(STRETCH, STRESS, strict=True)))  # fmt: skip
    heads = ",".join(f"spare {k}" for k in range(11))
    notices = import_file(put("a.csv", f"Strain (-),Stress (kPa),{heads}\n" + rows)).notices
    assert sum("of column" in note and "written as missing" in note for note in notices) == 6
    assert "fields of further columns are written as missing: 'spare 7' 1, 'spare 8' 1, 'spare 9' 1, 'spare 10' 1" in notices


@pytest.mark.parametrize("blank", ["N/A", "#N/A", "****", "-", "nan", ""])
def test_blanks_are_missing_and_an_empty_column_is_passed_over(put, blank):
    rows = "".join(f"{s - 1.0},{blank},{p}\n" for s, p in zip(STRETCH, STRESS, strict=True))
    recording = import_file(put("a.csv", "Strain (-),Stress (MPa),Engineering stress (kPa)\n" + rows))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS)


@pytest.mark.parametrize(
    ("written", "unit", "si"),
    [
        ("kgf/cm2", "kgf/cm2", 98066.5), ("kg/cm²", "kgf/cm2", 98066.5), ("ksi", "ksi", 6894757.293168361), ("g/mm2", "gf/mm2", 9806.65),
        ("mbar", "mbar", 100.0), ("inH2O", "inH2O", 249.08891), ("in H2O", "inH2O", 249.08891), ("PSI", "psi", 6894.757293168361),
        ("Kpa", "kPa", 1e3), ("MPA", "MPa", 1e6), ("N/mm²", "N/mm2", 1e6), ("N/mm^2", "N/mm2", 1e6), ("Torr", "torr", 133.32236842),
        ("lbf/in2", "psi", 6894.757293168361), ("kN/m2", "kN/m2", 1e3), ("kp/cm2", "kgf/cm2", 98066.5), ("psia", "psi", 6894.757293168361),
        ("bar(g)", "bar", 1e5), ("cmH2O", "cmH2O", 98.0665), ("mm Hg", "mmHg", 133.322387415),
        ("mWC", "mH2O", 9806.65), ("mH2O", "mH2O", 9806.65), ("m H2O", "mH2O", 9806.65), ("mWS", "mH2O", 9806.65), ("mca", "mH2O", 9806.65),
        ("mmH2O", "mmH2O", 9.80665), ("mm WC", "mmH2O", 9.80665), ("mmWS", "mmH2O", 9.80665), ("cm WC", "cmH2O", 98.0665),
        ("cmH2O(g)", "cmH2O", 98.0665), ("mmHg abs", "mmHg", 133.322387415), ("in. H2O", "inH2O", 249.08891), ('"WC', "inH2O", 249.08891),
        ("inHg", "inHg", 3386.388640341), ("in. Hg", "inHg", 3386.388640341), ('"Hg', "inHg", 3386.388640341), ("torr", "torr", 133.32236842),
        ("atm", "atm", 101325.0), ("kgf/cm2", "kgf/cm2", 98066.5), ("N/cm2", "N/cm2", 1e4), ("N/cm²", "N/cm2", 1e4), ("hPa", "hPa", 100.0),
        ("N mm-2", "N/mm2", 1e6), ("N·mm⁻²", "N/mm2", 1e6), ("MN m^-2", "MN/m2", 1e6), ("mm s-1", "mm/s", 1e-3), ("N m-1", "N/m", 1.0),
        ("Newtons", "N", 1.0), ("LBF", "lbf", 4.4482216152605), ("gf", "gf", 9.80665e-3), ("ozf", "ozf", 0.27801385), ("oz", "ozf", 0.27801385),
        ("daN", "daN", 10.0), ("kp", "kgf", 9.80665), ("inches", "in", 0.0254), ("mil", "mil", 2.54e-5), ("µm", "um", 1e-6), ("msec", "ms", 1e-3),
        ("microstrain", "microstrain", 1e-6), ("µε", "microstrain", 1e-6), ("‰", "permille", 1e-3), ("℃", "degC", 1.0), ("deg. C", "degC", 1.0),
    ],
)  # fmt: skip
def test_units_as_instruments_write_them(written, unit, si):
    assert unit_name(written) == unit
    assert to_si(1.0, unit) == pytest.approx(si, rel=1e-6)


@pytest.mark.parametrize("written", ["MH2O", "ata", "cmHg", "ftH2O", "dbar", "mWs", "Sample m-2", "T-1"])
def test_a_unit_that_is_not_known_is_no_other_one(written):
    assert unit_name(written) == written


def test_a_pressure_of_water_that_counts_from_vacuum_is_read(read):
    rows = "".join(f"{k},{1033.2274528 + 10.0 * k:.6f},{56 + 0.1 * k:.2f}\n" for k in range(9))
    recording = read(f"Time (s),Pressure (cmH2O abs),Length (mm)\n{rows}")
    np.testing.assert_allclose(recording.columns["pressure_kPa"], 0.980665 * np.arange(9), atol=1e-4)


@pytest.mark.parametrize(
    ("heading", "quantity", "unit"),
    [
        ("Load (lbf)", "force", "lbf"), ("Force / kN", "force", "kN"), ("Load, N", "force", "N"), ("Stress in MPa", "stress", "MPa"),
        ("Strain %", "strain", "percent"), ("Temperature C", "temperature", "degC"), ("Elongation (%)", "strain", "percent"),
        ("Stress (N)", "force", "N"), ("Strain (mm)", "elongation", "mm"), ("Tensile strain (Displacement) (%)", "strain", "percent"),
        ("Compressive stress [MPa]", "stress", "MPa"), ("Standardkraft [N]", "force", "N"), ("Weg / mm", "elongation", "mm"),
        ("ε [%]", "strain", "percent"), ("σ (MPa)", "stress", "MPa"), ("Engineering Strain", "strain", None), ("force_mN", "force", "mN"),
        ("Absolute pressure (kPa)", "pressure", "kPa"), ("Time_s", "time", "s"), ("位移 (mm)", "elongation", "mm"),
    ],
)  # fmt: skip
def test_headings_name_quantity_and_unit(heading, quantity, unit):
    read = heading_of(heading)
    assert meaning(read).quantity == quantity and read.unit == unit


def test_an_unknown_unit_is_said_and_can_be_stated(put):
    rows = "".join(f"{s - 1.0},{p}\n" for s, p in zip(STRETCH, STRESS, strict=True))
    path = put("a.csv", "Strain (-),Stress (stone)\n" + rows)
    assert parse_heading("Stress (stone)").unit == "stone"
    message = refusal(path)
    assert "unknown unit 'stone'" in message and "--unit stress=" in message
    np.testing.assert_allclose(import_file(path, make_options(units=["stress=kPa"])).columns["stress_kPa"], STRESS)


def test_grams_on_a_load_cell_are_the_force_of_that_weight(put):
    rows = "".join(f"{10 * i},{50 * i}\n" for i in range(9))
    path = put("a.csv", "Extension (mm),Load (g)\n" + rows)
    recording = import_file(path, make_options(kind="elastomer", dimensions=["gauge_length_mm=100", "area_mm2=10"]))
    np.testing.assert_allclose(recording.columns["stress_kPa"], 50 * np.arange(9) * 9.80665e-3 / 10 * 1e3)


@pytest.mark.parametrize(
    ("texts", "seconds"),
    [
        (["0:00:01.5", "0:00:02.0", "0:01:00"], [1.5, 2.0, 60.0]),
        (["2023-05-01 12:00:00", "2023-05-01T12:00:02", "2023-05-02 00:00:00"], [0.0, 2.0, 43200.0]),
        (["01.05.2023 12:00:00.5", "01.05.2023 12:00:01.0", ""], [0.0, 0.5, np.nan]),
        (["5/1/2023 11:59:59 PM", "5/2/2023 12:00:01 AM"], [0.0, 2.0]),
    ],
)
def test_clocks_are_read(texts, seconds):
    np.testing.assert_allclose(read_clock(texts).seconds, seconds)
    assert read_clock([*texts, "loading"]) is None


def test_a_clock_of_the_day_is_not_lost_and_passes_midnight(put):
    times = ["23:59:58", "23:59:59", "00:00:00", "00:00:01"]
    rows = "".join(f"{t},{20 + 10 * i},{0.01 * i},100\n" for i, t in enumerate(times))
    recording = import_file(put("a.csv", "Time,Temperature (°C),Strain (-),Stress (MPa)\n" + rows))
    np.testing.assert_allclose(np.diff(recording.columns["time_s"]), 1.0)
    assert said(recording, "is a clock")


def percent_table(strain, heading, factor):
    stretch = 1.0 + strain
    stress = 300.0 * (stretch - stretch**-2)
    return heading + "".join(f"{factor * e:.5f},{p:.4f}\n" for e, p in zip(strain, stress, strict=True))


@pytest.mark.parametrize(("most", "factor"), [(1.0, 100.0), (0.1, 100.0), (4.0, 100.0)])
def test_percent_without_unit_is_asked_for(put, most, factor):
    """Up to 100, 10 and 400 percent: the second could be a fraction by its size, but not by its curve."""
    path = put("a.csv", percent_table(np.linspace(0.0, most, 61), "Strain,Stress (kPa)\n", factor))
    message = refusal(path)
    assert "--unit strain=percent" in message and "has no unit" in message
    recording = import_file(path, make_options(units=["strain=percent"]))
    assert recording.columns["strain"].max() == pytest.approx(most)


@pytest.mark.parametrize("most", [0.5, 3.0, 8.0])
def test_a_fraction_without_unit_is_taken_and_said(put, most):
    recording = import_file(put("a.csv", percent_table(np.linspace(0.0, most, 61), "Strain,Stress (kPa)\n", 1.0)))
    assert recording.columns["strain"].max() == pytest.approx(most) and said(recording, "taken as a fraction")


def test_another_column_tells_percent_from_fraction(put):
    strain = np.linspace(0.0, 0.12, 40)
    stretch = 1.0 + strain
    stress = 300.0 * (stretch - stretch**-2)
    rows = "".join(f"{100 * e:.4f},{np.log1p(e):.6f},{p:.4f}\n" for e, p in zip(strain, stress, strict=True))
    recording = import_file(put("a.csv", "Strain,True Strain,Stress (kPa)\n" + rows))
    np.testing.assert_allclose(recording.columns["strain"], strain, atol=1e-6)
    assert said(recording, "taken as percent, as 'True Strain' tells")
    rows = "".join(f"{100 * e:.4f},{25 * e:.6f},{p:.4f}\n" for e, p in zip(strain, stress, strict=True))
    path = put("b.csv", "Gauge length: 25 mm\nStrain,Extension (mm),Stress (kPa)\n" + rows)
    np.testing.assert_allclose(import_file(path).columns["strain"], strain, atol=1e-6)


def test_a_wire_in_percent_without_unit_is_asked_for(put):
    rows = "".join(f"{0.1 * i},{8.0 * min(i, 50)}\n" for i in range(60))
    path = put("a.csv", "Strain,Stress (MPa)\n" + rows)
    message = refusal(path)
    assert "no nitinol wire" in message and "--unit strain=percent" in message
    recording = import_file(path, make_options(units=["strain=percent"]))
    assert recording.kind == "wire" and recording.columns["strain"].max() == pytest.approx(0.059)


def test_percent_signs_in_the_fields(put):
    rows = "".join(f"{100 * (s - 1.0):.3f}%,{p}\n" for s, p in zip(STRETCH, STRESS, strict=True))
    recording = import_file(put("a.csv", "Strain,Stress (kPa)\n" + rows))
    np.testing.assert_allclose(recording.columns["strain"], STRETCH - 1.0, atol=1e-5)
    assert said(recording, "end in a percent sign")
    message = refusal(put("b.csv", "Strain,Stress (kPa)\n" + rows.replace("%", "", 5)))
    assert "20 of 25 fields of 'Strain' end in a percent sign and the others do not" in message


@pytest.mark.parametrize("heading", ["Strain (%)", "Strain", "Strain (-)"])
def test_cells_in_a_percent_format_hold_a_hundredth_of_what_they_show(tmp_path, heading):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append([heading, "Stress (kPa)"])
    for s, p in zip(STRETCH, STRESS, strict=True):
        book.active.append([s - 1.0, p])
        book.active.cell(book.active.max_row, 1).number_format = "0.00%"
    book.save(tmp_path / "a.xlsx")
    np.testing.assert_allclose(import_file(tmp_path / "a.xlsx").columns["strain"], STRETCH - 1.0, atol=1e-12)


def test_a_column_of_words_beside_one_of_numbers_is_named(put):
    rows = "".join(f"{i},{'overload' if i % 3 else i}\n" for i in range(12))
    message = refusal(put("a.csv", "Strain (%),Stress (kPa)\n" + rows))
    assert "8 of 12 fields of 'Stress (kPa)' are no numbers ('overload' in row 3)" in message


def test_white_space_and_decimal_commas(put):
    rows = "".join(f"{100 * (s - 1.0):.3f}   {p:.3f}\n".replace(".", ",") for s, p in zip(STRETCH, STRESS, strict=True))
    recording = import_file(put("a.txt", "Strain[%]   Stress[kPa]\n" + rows))
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, atol=1e-3)


@pytest.mark.parametrize(("first", "factor", "doubtful"), [(0, 1.0, False), (1000, 1e-3, True)])
def test_a_comma_before_three_digits(put, first, factor, doubtful):
    """`950` beside `1,045` groups thousands; where all loads are above a thousand nothing tells, and that is said."""
    loads = [first + 45 * i for i in range(30)]
    rows = "".join(f"{i};{load:,d}\n" for i, load in enumerate(loads))
    recording = import_file(put("a.csv", "Strain (%);Load (N)\n" + rows), make_options(kind="elastomer", dimensions=["area_mm2=1000"]))
    np.testing.assert_allclose(recording.columns["stress_kPa"], factor * np.array(loads))
    assert said(recording, "if commas group thousands here") == doubtful


@pytest.mark.parametrize("mark", ["-999.25", "32767", "-32768", "65535", "8388607", "-2147483648", "-1000000", "1e20", "-9999.0"])
def test_a_mark_far_from_all_others_is_missing(put, mark):
    rows = "".join(f"{100 * (s - 1):.2f},{mark if k in (4, 11) else f'{p:.3f}'}\n" for k, (s, p) in enumerate(zip(STRETCH, STRESS, strict=True)))
    recording = import_file(put("a.csv", "Strain (%),Stress (kPa)\n" + rows))
    assert recording.kind == "elastomer" and np.isnan(recording.columns["stress_kPa"]).sum() == 2
    assert said(recording, "in 2 rows of 'Stress (kPa)' (first in row 6)") and said(recording, "taken as a mark for no reading")


@pytest.mark.parametrize("number", ["1e400", "-1e400", "9" * 400, "1e" + "9" * 40, "1e308", "-1.7e308"])
@pytest.mark.parametrize("column", [0, 1])
def test_a_number_that_is_too_large_is_missing(put, number, column):
    cells = [[f"{100 * (s - 1):.2f}", f"{p:.3f}"] for s, p in zip(STRETCH, STRESS, strict=True)]
    cells[4][column] = number
    recording = import_file(put("a.csv", "Strain (%),Stress (kPa)\n" + "".join(",".join(row) + "\n" for row in cells)))
    name = ("strain", "stress_kPa")[column]
    np.testing.assert_array_equal(np.flatnonzero(~np.isfinite(recording.columns[name])), [4])
    assert said(recording, f"in 1 row of {('Strain (%)', 'Stress (kPa)')[column]!r} (first in row 6)")
    assert said(recording, "taken as a mark for no reading, so missing")


def test_a_heading_of_thousands_of_letters_is_told_by_its_ends(put):
    path = put("a.csv", "Time (s)," + "a" * 3000 + ",Stress (kPa)\n" + "".join(f"{k},{2 * k},{3 * k}\n" for k in range(20)))
    with pytest.raises(InputError, match=r"not recognised: 'a{99}\[\.\.\.\]a+") as refused:
        import_file(path, make_options(kind="elastomer"))
    assert len(str(refused.value)) < 1000


@pytest.mark.parametrize(("mark", "least", "most"), [("-99", 0.0, 300.0), ("-999", 0.0, 2000.0), ("32767", 0.0, 30000.0), ("99", 0.0, 60.0)])
def test_a_mark_near_the_others_is_kept_and_asked_about(put, mark, least, most):
    values = np.linspace(least, most, 40)
    rows = "".join(f"{0.5 * k},{mark if k in (4, 11, 30) else f'{v:.3f}'}\n" for k, v in enumerate(values))
    recording = import_file(put("a.csv", "Strain (%),Stress (Pa)\n" + rows), make_options(kind="elastomer"))
    assert np.isfinite(recording.columns["stress_kPa"]).all()
    (note,) = [text for text in recording.notices if "lies apart from all others and was kept" in text]
    assert note.startswith(f"check: {mark} in 3 rows of 'Stress (Pa)' (first in row 6)")


@pytest.mark.parametrize("values", [np.arange(60.0, 100.0), np.linspace(-120.0, 120.0, 41), np.arange(32730.0, 32770.0)])
def test_readings_that_look_like_marks_are_readings(put, values):
    rows = "".join(f"{0.5 * k},{v:.0f}\n" for k, v in enumerate(values))
    recording = import_file(put("a.csv", "Strain (%),Stress (Pa)\n" + rows), make_options(kind="elastomer"))
    assert np.isfinite(recording.columns["stress_kPa"]).all()
    assert not said(recording, "lies apart") and not said(recording, "mark for no reading")


@pytest.mark.parametrize("form", ["({})", "{}-"])
@pytest.mark.parametrize(("decimal", "sep"), [(".", ","), (",", ";")])
def test_negative_numbers_of_accountants_are_read(put, form, decimal, sep):
    """They were taken for words and left out."""
    stress = [0.5 * k - 10.0 for k in range(40)]
    texts = [(f"{x:.2f}" if x >= 0.0 else form.format(f"{-x:.2f}")).replace(".", decimal) for x in stress]
    rows = "".join(f"{k}{sep}{f'{0.01 * k:.2f}'.replace('.', decimal)}{sep}{text}\n" for k, text in enumerate(texts))
    recording = import_file(put("a.csv", f"Time (s){sep}Strain (-){sep}Stress (kPa)\n{rows}"), make_options(kind="elastomer"))
    np.testing.assert_allclose(recording.columns["stress_kPa"], stress, atol=1e-9)


@pytest.mark.parametrize("text", ["(1)", "(12)", "()", "(a)", "1-", "1-2", "(1.5", "(-1.5)"])
def test_other_brackets_and_dashes_are_no_negative_numbers(text):
    assert to_number(text, ".") is None
