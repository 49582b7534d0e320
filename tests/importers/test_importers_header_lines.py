"""Every line around a table is used, asked about, or named; and the kind is told on a stated ground."""

import pytest
from answers import PULL, SPRING, TUBE, checks, refusal

from fitting.data.importers import import_file, import_files, make_options
from fitting.data.importers.header_lines import MOST_ASKED, MOST_SHOWN
from fitting.data.importers.size_names import may_name_a_size, size_named
from fitting.data.recordings import read_campaign, write_recordings

COUPON = "# gauge length: 50 mm\n# width: 6 mm\n# thickness: 2 mm\n"


@pytest.mark.parametrize(
    "line", ["# coils: 52/54", "# active coils: approx. 45", "# coils = 45 or 46", "# Windungen (aktiv): 45 mm"]
)
def test_a_size_without_one_number_is_asked_about(read, line):
    recording = read(f"{line}\n# wire diameter: 0.25 mm\n" + SPRING)
    (asked,) = checks(recording)
    assert repr(line) in asked and "--dimension active_coils=..." in asked
    assert "active_coils" not in recording.geometry


@pytest.mark.parametrize(
    "line",
    [
        "total coils: 47", "d = 0.25 mm", "L/D: 12", "Endwindungen: 2", "Test rig distance: 40 mm",
        "Active coil: 2", "No active: 4", "die diameter: 3 mm", "Pas: 0,1 mm", "t_w = 2 mm", "Average diameter: 12 um",
        "s width: 0.1 mm", "e diameter: 0.1 mm", 'spring of 0.010" wire', "spring S7 of 0.25 mm wire", "S7 with 45 active coils", "Gauge length: 25 mm", "Querschnitt: 0,05 mm²",
    ],
)  # fmt: skip
def test_a_line_that_may_state_a_size_is_asked_about(read, line):
    asked = [note for note in checks(read(f"{line}\n# spring\n" + SPRING)) if "may state a size" in note]
    assert len(asked) == 1 and repr(line) in asked[0] and "active_coils" in asked[0]


@pytest.mark.parametrize(
    "line",
    [
        "Specimen: A7", "Sample ID: A7", "Probe: A7", "Operator: J. Smith", "Date: 2024-03-12", "Rate 1: 10 mm/min",
        "Load cell: 50 N", "Sampling rate = 2 Hz", "no. 5 in tray 3", "Coil ID: 3", "1 1.2 0.1", "Hardness: 30 Shore A", "Filter bandwidth: 10 Hz",
    ],
)  # fmt: skip
def test_any_other_line_is_named_and_kept(read, tmp_path, line):
    recording = read(f"{line}\n# spring\n" + SPRING)
    assert not checks(recording)
    assert any(note.startswith("other lines around the table") and repr(line) in note for note in recording.notices)
    write_recordings([recording], tmp_path / "out")
    (written,) = read_campaign(tmp_path / "out").recordings
    assert written.source["header"] == [line, "# spring"]


def test_many_lines_are_counted_and_kept(read):
    recording = read("".join(f"Channel {k} limit: {k + 1} N\n" for k in range(MOST_SHOWN + 3)) + SPRING)
    assert any(note.endswith("and 3 more") for note in recording.notices)
    assert len(recording.source["header"]) == MOST_SHOWN + 3
    (asked,) = checks(read("".join(f"Distance {k}: {k + 1} mm\n" for k in range(MOST_SHOWN + 2)) + "# spring\n" + SPRING))
    assert "and 2 more may state sizes of the specimen, and were not used" in asked
    asked = checks(read("".join(f"coils: {k}/50\n" for k in range(MOST_ASKED + 2)) + "# spring\n" + SPRING))
    assert len(asked) == MOST_ASKED + 1 and "2 more lines name sizes without one number" in asked[-1]


def test_sizes_of_an_actuator_are_offered_as_options(read):
    table = "Time (s),Pressure (kPa),Bend angle (deg)\n" + "".join(f"{k},{2 * k},{3 * k}\n" for k in range(9))
    recording = read("OD: 12 mm\nID: 8 mm\nLength: 60 mm\n" + table)
    first, second = checks(recording)
    assert recording.geometry == {} and "--dimension outer_diameter_mm=12 --dimension length_mm=60 takes them" in first
    assert "'ID: 8 mm' may state a size" in second


def test_a_size_that_is_repeated_is_not_asked_about(read):
    assert not checks(read("wire diameter: 0.25 mm\nDrahtdurchmesser: 0.25 mm\n# spring\n" + SPRING))


@pytest.mark.parametrize("line", ["active coils: 45 (measured)", "active coils: 45.0", "active coils = 45 coils", "45 coils\nactive coils: 45"])
def test_a_remark_in_brackets_is_no_unit(read, line):
    assert read(f"{line}\n# spring\n" + SPRING).geometry == {"active_coils": 45.0}


def test_a_number_in_brackets_is_asked_about(read):
    assert any("'coils: 52 (54 in total)' names a size" in note for note in checks(read("coils: 52 (54 in total)\n# spring\n" + SPRING)))


def test_lines_below_the_table_count_as_well(read):
    recording = read(SPRING + "\nWire diameter: 0.25 mm\nMax force: 0.7 N\nCoils: 52/54\nOperator: js\nslipped\nend\n")
    assert recording.geometry == {"wire_diameter_mm": 0.25}
    assert any("'Coils: 52/54' names a size" in note for note in checks(recording))
    assert any("'Operator: js', 'slipped', 'end'" in note for note in recording.notices)
    assert recording.source["footer"][-1] == "end"


def test_headers_of_successive_files_are_kept_one_after_the_other(put):
    table = "Time [s],Strain [%],Stress [kPa]\n" + "".join(f"{k},{k},{4 * k}\n" for k in range(9))
    paths = [put(f"{k}.csv", f"Operator: {name}\n{table}") for k, name in enumerate(("js", "kl"))]
    (whole,) = import_files(paths, make_options(successive=True, slack="keep"))
    assert whole.source["header"] == ["Operator: js", "Operator: kl"]


def test_a_line_above_wins_over_one_below(read):
    recording = read("# wire diameter: 0.25 mm\n" + SPRING + "\n# wire diameter: 0.3 mm\n")
    assert recording.geometry["wire_diameter_mm"] == 0.25
    assert any("it also states '# wire diameter: 0.3 mm'" in note for note in checks(recording))


def test_sizes_that_a_kind_does_not_need_are_named(read):
    recording = read(COUPON + "# mandrel: 20 mm\nTime [s],Strain [%],Stress [kPa]\n" + "".join(f"{k},{k},{4 * k}\n" for k in range(9)))
    (said,) = (note for note in recording.notices if note.startswith("stated, but not needed for kind elastomer"))
    assert all(word in said for word in ("gauge length", "width", "thickness", "mandrel"))


def test_a_sheet_of_parameters_is_asked_about(put_sheet):
    data = [("Zeit (s)", "Weg (mm)", "Kraft (N)", "Widerstand (Ohm)"), *((k, 0.8 * k, 0.02 * k, 3.32) for k in range(8))]
    info = [("Probe", "A7"), ("Windungen (aktiv)", 45), ("Drahtdurchmesser", 0.25, "mm"), ("Windungen gesamt", 47)]
    recording = import_file(put_sheet("a.xlsx", {"Info": info, "Daten": data}))
    assert recording.geometry == {"wire_diameter_mm": 0.25, "active_coils": 45.0}
    (asked,) = checks(recording)
    assert "'Windungen gesamt 47' may state a size" in asked
    assert any(note.endswith("[source]: 'Probe A7'") for note in recording.notices)
    assert recording.source["other_sheets"][0] == "Probe A7"


def test_two_quantities_of_a_tube_in_one_line_are_asked_about(read):
    recording = read("length/inner diameter,120/8 mm\nOD,10 mm\n" + TUBE)
    assert recording.geometry == {"outer_diameter_mm": 10.0}
    (asked,) = checks(recording)
    assert "'length/inner diameter 120/8 mm'" in asked and "wall_thickness_mm" in asked


@pytest.mark.parametrize("heading", ["Length/inner diameter (mm)", "Length/inner diameter"])
def test_two_quantities_of_a_tube_in_one_heading_are_refused(put, heading):
    assert repr(heading) in refusal(put("a.csv", TUBE.replace("Length (mm)", heading)))


def test_a_bore_makes_the_wall_or_contradicts_it(read):
    assert read("Inner diameter: 8 mm\nWall thickness: 1 mm\n" + TUBE).geometry["outer_diameter_mm"] == 10.0
    recording = read("ID: 8 mm\nOD: 10 mm\nwall: 0.7 mm\n" + TUBE)
    assert recording.geometry["wall_thickness_mm"] == 0.7
    assert any("'ID: 8 mm'" in note and "8.6 mm" in note for note in checks(recording))
    assert any("was not used" in note for note in checks(read("ID: 8 mm\n" + TUBE)))


def test_a_bore_wider_than_its_tube_is_refused(put):
    assert "no less than the outer diameter" in refusal(put("a.csv", "ID: 10 mm\nOD: 8 mm\n" + TUBE))


def test_a_spring_whose_ground_is_a_mandrel_alone_is_asked_about(read):
    (asked,) = (note for note in checks(read("mandrel 20 mm\ngauge length: 25 mm\n" + SPRING)) if "taken as" in note)
    assert "'gauge length: 25 mm' and 'mandrel 20 mm'" in asked and "--kind elastomer" in asked


def test_a_mandrel_makes_no_spring_of_a_coupon(read):
    recording = read("mandrel 20 mm\n" + COUPON + PULL)
    assert recording.kind == "elastomer" and any("'mandrel 20 mm'" in note for note in recording.notices)


def test_the_ground_of_a_spring_is_said(read):
    assert any("from its columns and 'active coils: 52'" in note for note in read("active coils: 52\n" + SPRING).notices)


def test_diameters_of_a_coil_are_compared(read):
    head = "wire diameter: 0.25 mm\nmean diameter: 1.15 mm\nouter diameter: 1.4 mm\n"
    agreed = read(head + SPRING)
    assert agreed.geometry["mandrel_diameter_mm"] == 0.9 and not checks(agreed)
    assert any("agrees with a mandrel of 0.9 mm" in note for note in agreed.notices)
    assert any("a mandrel of 1.1 mm, but also" in note for note in checks(read(head.replace("1.4", "1.6") + SPRING)))


@pytest.mark.parametrize(("number", "doubt"), [("25.000", True), ("25,000", False), ("25,0", False)])
def test_a_mark_that_may_group_thousands_is_a_decimal_mark(read, number, doubt):
    """It was read as 25 m beside decimal commas, and 25 mm before."""
    table = PULL.replace(",", ";").replace(".", ",")
    recording = read(f"gauge length;{number};mm\nwidth;6;mm\nthickness;2;mm\n{table}")
    assert recording.columns["strain"][-1] == 4.0 / 25.0
    assert any("25000 mm, if its mark groups thousands" in note for note in checks(recording)) == doubt


def test_names_of_sizes_are_read_part_by_part():
    known = {
        "active_coils": ("Windungen (aktiv)", "Anzahl federnder Windungen", "N_active", "nombre de spires utiles", "有効巻数", "有效圈数"),
        "wire_diameter_mm": ("d_wire", "Draht-Ø", "Durchmesser des Drahts", "线径", "diamètre du fil"),
        "mandrel_diameter_mm": ("Federinnendurchmesser", "Wickeldorn", "Spring ID", "芯棒直径"),
        "coil_outer_diameter_mm": ("Windungsaußendurchmesser", "Spring OD"), "free_length_mm": ("L_free", "弹簧自由长度"),
        "gauge_length_mm": ("標点間距離", "longueur utile", "标距"), "wall_thickness_mm": ("肉厚", "Schlauchwandstärke"),
    }  # fmt: skip
    for key, names in known.items():
        assert {name: size_named(name) for name in names} == dict.fromkeys(names, key)
    phrases = {"gauge_length_mm": ("Grip-separation", "L 0"), "active_coils": ("Windungszahl",), "temperature_degC": ("Temp.",)}
    behind = {"width_mm": ("宽度 b0", "Breite, b"), "length": ("Länge l0",), "wire_diameter_mm": ("Drahtstärke d_0",), "active_coils": ("圈数 n",)}
    for key, names in (*phrases.items(), *behind.items()):
        assert {name: size_named(name) for name in names} == dict.fromkeys(names, key)
    assert size_named("宽度 d0") is None and size_named("Drahtstärke b") is None
    for name in ("total coils", "Windungen gesamt", "length/inner diameter", "wire", "coil number", "Sample number", "d", "L/D", "rate"):
        assert size_named(name) is None, name
    assert may_name_a_size("Windungen gesamt") and may_name_a_size("L/D") and may_name_a_size("final length")
    assert not any(map(may_name_a_size, ("Sample number", "Rate 1", "Load cell", "Operator", "Specimen ID", "Number of cycles")))


@pytest.mark.parametrize("line", ["x" + " " * 5000 + "y", "length" * 5000, "径" * 9000, "1 ± " * 2000, "x " + "12 " * 5000, "a:" * 9000])
def test_a_long_line_is_named(read, line):
    """Runs of spaces took time with the square of their number; words are read by recursion."""
    assert any(note.startswith("other lines around the table") for note in read(line + "\n# spring\n" + SPRING).notices)
