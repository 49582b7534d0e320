"""Lines that state sizes: decimal commas among commas, prose about something else, footers, marks of inches."""

from pathlib import Path

import pytest
from answers import PULL, SPRING, TUBE, checks, refusal

from fitting.data.importers import import_file
from fitting.data.importers.parts import samples_of, stated_specimen
from fitting.data.importers.raw import RawFile
from fitting.data.importers.size_names import names_a_specimen


@pytest.mark.parametrize(
    ("number", "value", "doubt"),
    [
        ("1,15", 1.15, "comma was taken as a decimal mark"), ("1,5", 1.5, "comma was taken as a decimal mark"),
        ("2,5", 2.5, "comma was taken as a decimal mark"), ("0,25", 0.25, ""), ("1,500", 1.5, "or 1500 mm, if its mark groups thousands"),
        ("1.15", 1.15, ""),
    ],
)  # fmt: skip
@pytest.mark.parametrize("line", ["# mandrel diameter: {} mm", "mandrel diameter = {} mm", "# mandrel: {},mm", "# mandrel {} mm"])
def test_a_decimal_comma_among_commas(read, line, number, value, doubt):
    """It was read as 15 mm, 5 mm, 500 mm: the digits behind the comma alone."""
    recording = read(f"{line.format(number)}\n# spring\n" + SPRING)
    assert recording.geometry["mandrel_diameter_mm"] == value
    asked = [note for note in checks(recording) if "mandrel" in note]
    assert len(asked) == bool(doubt) and all(doubt in note for note in asked)


def test_decimal_commas_of_a_coupon_among_commas(read):
    recording = read("# gauge length: 25 mm\n# width: 1,5 mm\n# thickness: 1,25 mm\n" + PULL)
    assert recording.columns["stress_kPa"][-1] == pytest.approx(0.889 / 1.875 * 1e3, abs=0.01)


def test_a_decimal_comma_among_semicolons_is_no_doubt(read):
    recording = read("# mandrel diameter: 1,15 mm\n# spring\n" + SPRING.replace(",", ";"))
    assert recording.geometry["mandrel_diameter_mm"] == 1.15 and not checks(recording)


@pytest.mark.parametrize("heading", ["width: 1", "width 1", "width (1)", "coils: 1", "width, 1"])
def test_a_one_in_a_heading_is_no_unit(read, heading):
    recording = read(f"{heading};5 mm\n# spring\n" + SPRING.replace(",", ";"))
    assert "5 mm" not in " ".join(note for note in recording.notices if "as the file states" in note)


def test_a_count_may_be_said_to_have_no_unit(read):
    assert read("Windungszahl / 1;52\n" + SPRING.replace(",", ";")).geometry == {"active_coils": 52.0}


@pytest.mark.parametrize("mark", [",", ";"])
def test_sizes_of_clamps_are_no_sizes_of_the_specimen(put, mark):
    line = f"# Clamps: steel{mark} width 20 mm{mark} thickness 5 mm"
    said = refusal(put("a.csv", f"# gauge length: 25 mm\n{line}\n" + PULL), kind="elastomer")
    assert "cross-section" in said and "'# Clamps: steel" in said and "thickness 5 mm'" in said


@pytest.mark.parametrize(
    "line",
    [
        "# Spring test; compared with spring S3, wire diameter 0.30 mm", "# replaces the old spring, coils 60, mandrel 1.2 mm",
        "# replaces the old spring; coils: 60", "# Clamps: wire diameter 1 mm, mandrel 2 mm",
    ],
)  # fmt: skip
def test_sizes_in_prose_are_asked_about_with_the_whole_line(read, line):
    recording = read(f"{line}\n# spring\n" + SPRING)
    assert recording.geometry == {}
    (asked,) = checks(recording)
    assert line.split(",")[0].split(";")[0] in asked and line.split(" ")[-1] in asked and "may state a size" in asked


@pytest.mark.parametrize("label", ["", "Spring: ", "Spring A7, ", "# Feder S-7: ", "Specimen A; ", "d_1 = 5, "])
def test_a_line_of_sizes_alone_is_read(read, label):
    recording = read(f"{label}wire diameter 0.25 mm, coils: 45\n# spring\n" + SPRING)
    assert recording.geometry == {"wire_diameter_mm": 0.25, "active_coils": 45.0}
    assert len(checks(recording)) == label.startswith("d_1")


def test_two_specimens_in_the_header_contradict(read):
    head = "# gauge length: 25 mm\n# Specimen A: width 6 mm, thickness 2 mm\n# Specimen B: width 8 mm, thickness 2 mm\n"
    (asked,) = (note for note in checks(read(head + PULL, kind="elastomer")) if "also states" in note)
    assert "'# Specimen B: width 8 mm'" in asked


def test_names_of_specimens():
    assert all(map(names_a_specimen, ("Spring", "Specimen A", "Feder S-7", "Coil 3")))
    assert not any(map(names_a_specimen, ("Spring test", "old spring", "Clamps", "A7", "compared with spring S3", "")))


def test_a_footer_that_contradicts_is_asked_about(read):
    head = "# gauge length: 25 mm\n# width: 6 mm\n# thickness: 2 mm\n"
    recording = read(head + PULL + "# width: 8 mm\n# thickness: 2 mm\n", kind="elastomer")
    (asked,) = checks(recording)
    assert "the width is 6 mm" in asked and "it also states '# width: 8 mm'" in asked
    assert not any("not needed" in note for note in recording.notices)


def test_a_sheet_of_parameters_that_contradicts_is_asked_about(put_sheet):
    data = [("width", 6, "mm"), ("thickness", 2, "mm"), ("gauge length", 25, "mm"),
            ("Time (s)", "Extension (mm)", "Force (N)"), *((k, k / 2, k / 9) for k in range(9))]  # fmt: skip
    recording = import_file(put_sheet("a.xlsx", {"Info": [("width", 8, "mm"), ("Operator", "js")], "Data": data}))
    assert any("the width is 6 mm" in note and "it also states 'width 8 mm'" in note for note in checks(recording))


@pytest.mark.parametrize(
    ("head", "table", "key", "value", "doubt"),
    [
        ("outer diameter: 0.5 in\ninner diameter: 0.25\n", TUBE, "wall_thickness_mm", 6.225, "unit is not stated"),
        ("outer diameter: 12 mm\ninner diameter: 8 mm\ninner diameter: 9 mm\n", TUBE, "wall_thickness_mm", 2.0, "inner diameter: 9 mm"),
        ("wire diameter: 0.25 mm\nCoil OD: 1.5\n", SPRING, "mandrel_diameter_mm", 1.0, "unit is not stated"),
        ("wire diameter: 0.25 mm\nCoil OD: 1.5 mm\nCoil OD: 2.5 mm\n", SPRING, "mandrel_diameter_mm", 1.0, "'Coil OD: 2.5 mm'"),
        ("wire diameter: 0.25 mm\nCoil OD: 1,500 mm\n", SPRING, "mandrel_diameter_mm", 1.0, "1500 mm, if that size's mark groups"),
        ("length: 56\n", TUBE, "length_mm", 56.0, "unit is not stated"),
    ],
)  # fmt: skip
def test_a_doubt_about_a_size_is_one_about_what_follows(read, head, table, key, value, doubt):
    recording = read(head + table)
    assert recording.geometry[key] == pytest.approx(value)
    assert any(doubt in note and str(key).removesuffix("_mm").replace("_", " ") in note for note in checks(recording))


@pytest.mark.parametrize("mark", ['"', ' "', "''", "″", "”", " in"])
def test_marks_of_inches(read, mark):
    recording = read(f"# wire diameter: 0.010{mark}\n# spring\n" + SPRING)
    assert recording.geometry["wire_diameter_mm"] == 0.254 and not checks(recording)


def test_marks_of_quotation_are_no_inches(read):
    for line in ('# "wire diameter: 0.25"', '# "mandrel: 0.9, wire diameter: 0.25"', '"# wire diameter: 0.25"'):
        assert read(f"{line}\n# spring\n" + SPRING).geometry["wire_diameter_mm"] == 0.25


def specimen_of(line):
    """Name of the specimen in a line above a table."""
    (sample,) = samples_of(RawFile(Path("a.csv"), f"{line}\n{SPRING}".encode()))
    return stated_specimen(sample.require_grid())


@pytest.mark.parametrize("line", ["# Sample: every 0.1 s", "# Probe: PT100 type K", "# Sample: 10 Hz", "# Probe: thermocouple 2", "# Specimen: none"])
def test_a_setting_or_a_sensor_is_no_name_of_a_specimen(read, line):
    assert specimen_of(line) == ""
    assert any(repr(line) in note for note in read(f"{line}\n# spring\n" + SPRING).notices if note.startswith("other lines"))


@pytest.mark.parametrize(("line", "name"), [("# Sample: A7", "A7"), ("# Probe: Schlauch 3", "Schlauch 3"), ("Sample: NT 38 A", "NT 38 A"), ("# Prüfling: S3", "S3"), ("Proben-Nr.: S3", "S3"), ("Probenbezeichnung: S3", "S3")])
def test_a_name_of_a_specimen_is_taken(line, name):
    assert specimen_of(line) == name
