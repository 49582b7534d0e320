"""Every refusal is one line that names file, place and remedy; nothing unusable is read."""

import numpy as np
import pytest

from fitting.data.recordings import read_campaign, read_recording
from pneusma_jax.errors import InputError

STAND = "time_s,elongation_mm,force_N,resistance_ohm\n"
COUPON = "time_s,strain,stress_kPa\n"
TUBE = "time_s,pressure_kPa,length_mm\n"
WIRE = "time_s,strain,stress_MPa,temperature_degC\n"
BODY = "time_s,pressure_kPa,resistance_1_ohm,curvature_1pm\n"


def refusal(call, *args):
    with pytest.raises(InputError) as caught:
        call(*args)
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ["the file is empty"]),
        ("# only a comment\n\n", ["the file is empty"]),
        (COUPON, ["no row of data"]),
        (COUPON + "\n\n", ["no row of data"]),
        ("time_s;strain;stress_kPa\n0;0;0\n", ["separated by semicolons", "pneusma import"]),
        ("time_s\tstrain\tstress_kPa\n0\t0\t0\n", ["separated by tabs"]),
        ("0,0,0\n1,0.1,5\n", ["row 1", "numbers where the names"]),
        (COUPON + "0,0,0\n1,0.1\n", ["row 3", "2 fields where the header has 3"]),
        (COUPON + "0,0,0\n1,0,1,5\n", ["row 3", "4 fields", "decimal mark must be a point"]),
        ("# a\n# b\n" + COUPON + "0,0,0\n1,abc,5\n", ["row 5, column strain", "'abc' is not a number", "empty"]),
        (COUPON + "0,0,0\n\n1,0.1,1_000\n", ["row 4, column stress_kPa", "'1_000' is not a number"]),
        (COUPON + '0,0,0\n1,"0,1",5\n', ["row 3, column strain", "'0,1' is not a number", "`pneusma import` reads such"]),
        (COUPON + "00:00:01,0,0\n", ["row 2, column time_s", "'00:00:01' is not", "`pneusma import` reads such files"]),
        (COUPON + "0,0,0\n1,0.1,inf\n", ["row 3, column stress_kPa", "'inf'"]),
        (COUPON + '0,0,0\n1,"0.1,5\n', ["row 3", "not a comma-separated row"]),
        ("time_s,strain,strain,stress_kPa\n0,0,0,0\n", ["row 1, column strain", "there twice"]),
        ("strain,stress_kPa,stress_MPa\n0,0,0\n", ["column stress_MPa", "same quantity as column stress_kPa"]),
        ("strain,,stress_kPa\n0,1,0\n", ["column 2 has no name"]),
        ("time_s,strain,stress_furlong\n0,0,0\n", ["row 1, column stress_furlong", "unknown unit 'furlong'"]),
        ("time_s,strain,stress_kpa\n0,0,0\n", ["column stress_kpa", "did you mean 'kPa'"]),
        ("time_s,strain,stress_mm\n0,0,0\n", ["a unit of length, not of pressure", "write stress_kPa"]),
        ("time_s,strain,stress\n0,0,0\n", ["column stress", "the unit is missing; write stress_kPa"]),
        ("time_s,strain\n0,0\n", ["kind of recording cannot be told", "`pneusma import`", "kind = "]),
        (COUPON + "0,0,0\n2,0.1,5\n1,0.2,9\n", ["row 4, column time_s", "time goes backwards, 1 s after 2 s"]),
        (COUPON + "0,0,0\n,0.1,5\n", ["row 3, column time_s", "time is missing"]),
        (COUPON + "0,0,0\n,,\n1,0.1,5\n", ["row 3", "every field is empty"]),
        (COUPON + "0,,0\n1,,5\n", ["column strain", "no row has a value"]),
        (COUPON + "0,-1.5,0\n", ["row 2, column strain", "stays above -1"]),
        ("strain,stress_kPa,cycle\n0,0,-1\n", ["column cycle", "0 or more"]),
        (WIRE + "0,1.5,50,20\n", ["row 2, column strain", "strain_percent"]),
        (WIRE + "0,0.01,50,-300\n", ["column temperature_degC", "absolute zero"]),
        (TUBE + "0,0,56\n1,30000,57\n", ["row 3, column pressure_kPa", "is the unit right?"]),
        (TUBE + "0,-150,56\n", ["column pressure_kPa", "-102 to 1000 kPa"]),
        (TUBE + "0,0,0\n", ["row 2, column length_mm", "more than 0"]),
        (STAND + "0,0,0,3.7\n1,1,0.1,0\n", ["row 3, column resistance_ohm", "more than 0"]),
        (STAND + "0,0,0,3.7\n1,1,0.1,-3\n", ["row 3, column resistance_ohm", "more than 0"]),
        (STAND + "0,0,0,9.5\n", ["row 2, column resistance_ohm", "krl35", "1.62 to 7.51 ohm", 'alloy = "fit"']),
        (STAND + "0,0,0,1.2\n", ["row 2, column resistance_ohm", "1.62 to 7.51 ohm"]),
        (BODY + "0,10,3.7,0\n1,10,30,0\n", ["row 3, column resistance_1_ohm", "52 coils"]),
    ],
)  # fmt: skip
def test_unusable_tables(put, text, said):
    message = refusal(read_recording, put(text))
    assert "run_1.csv" in message
    for words in said:
        assert words in message


@pytest.mark.parametrize(
    ("sidecar", "said"),
    [
        ("kind =\nrole = 3", ["not a TOML", "line 1"]),
        ('kind = "elastomr"', ["kind = 'elastomr'", "did you mean 'elastomer'"]),
        ("kind = 3", ["kind = 3 is not known"]),
        ('rôle = "fit"', ["not a TOML"]),
        ('roll = "fit"', ["unknown key 'roll'", "did you mean 'role'"]),
        ('role = "training"', ["role = 'training'", "fit, validation"]),
        ("specimen = 3", ["specimen = 3 must be a text"]),
        ('real = "yes"', ["real = 'yes'", "true (measured) or false"]),
        ("geometry = 3", ["geometry must be a table"]),
        ('kind = "elastomer"\n[constant]\ntemperature_degC = 22', ["unknown column 'temperature_degC' in [constant]"]),
        ('[constant]\nstrain = "much"', ["[constant] strain", "must be a finite number"]),
        ("[constant]\nstrain = 0.1", ["[constant] strain: run_1.csv has a column of it"]),
        ("[constant]\nstress_K = 0.1", ["[constant] stress_K", "not of pressure"]),
        ("[source]\nlicence = {a = 1}", ["[source] licence must be a text"]),
        ("[noise]\nstress_kPa = -0.1", ["[noise] stress_kPa = -0.1", "more than 0"]),
        ("[noise]\nstress_kPa = 0", ["[noise] stress_kPa = 0", "estimated"]),
        ('[noise]\nstress_kPa = "small"', ["must be a finite number"]),
        ("[noise]\nstress_kPa = nan", ["must be a finite number"]),
        ("[noise]\nstrss_kPa = 1", ["unknown column 'strss_kPa' in [noise]", "did you mean 'stress_kPa'"]),
        ("[noise]\nstress_mm = 1", ["[noise] stress_mm", "unit of length"]),
        ("[noise]\nstress_kPa = 1\nstress_Pa = 1", ["there twice"]),
        ("[geometry]\nwall_thickness_mm = -1", ["wall_thickness_mm = -1 must be more than 0"]),
        ("[geometry]\nlength_mm = 0", ["length_mm = 0 must be more than 0"]),
        ("[geometry]\nouter_diameter_mm = -10", ["outer_diameter_mm = -10"]),
        ("[geometry]\nactive_coils = -52", ["active_coils = -52"]),
        ("[geometry]\ncycles_before = -1", ["cycles_before = -1 must be 0 or more"]),
        ("[geometry]\nprestrain = 19", ["prestrain = 19", "a fraction below 1"]),
        ("[geometry]\nwall_thickness_mm = true", ["must be a finite number"]),
        ("[geometry]\nwall_thicknes_mm = 1", ["unknown key 'wall_thicknes_mm' in [geometry]", "wall_thickness_mm"]),
        ("[geometry]\nwall_thickness_furlong = 1", ["[geometry] wall_thickness_furlong", "unknown unit 'furlong'"]),
        ("[geometry]\nwall_thickness_kPa = 1", ["a unit of pressure, not of length"]),
        ("[geometry]\nlength_mm = 1\nlength_in = 1", ["there twice"]),
        ('[geometry]\ndesign = "pneusma3"', ["[geometry] design = 'pneusma3'", "did you mean 'pneusma"]),
        ('[geometry]\norientation = "upside_down"', ["[geometry] orientation"]),
        ('[geometry]\nlaw = "youh"', ["did you mean 'yeoh'"]),
        ("[geometry]\nmaterial = 3", ["must be a name, the path of a TOML"]),
        ('[geometry]\nmaterial = "dragon_skin"', ["[geometry] material", "dragon_skin_10_fast"]),
        ('[geometry]\nmaterial = "nowhere.toml"', ["[geometry] material", "nowhere.toml"]),
        ("[tolernace]\nmu = 0.1", ["unknown key 'tolernace'", "did you mean 'tolerance'?"]),
        ("[tolerance]\nG_m = -0.1", ["[tolerance] G_m = -0.1", "0 (exact) or more"]),
        ("[tolerance]\nG_m = 5", ["relative: 3 percent is 0.03"]),
        ("[tolerance]\nG_q = 0.1", ["unknown key 'G_q' in [tolerance]", "did you mean 'G_"]),
        ("[tolerance]\nwall_thickness_mm = 0.1\nwall_thickness_in = 0.1", ["there twice"]),
    ],
)
def test_unusable_sidecars(put, sidecar, said):
    message = refusal(read_recording, put(COUPON + "0,0,0\n1,0.1,5\n", sidecar))
    assert "run_1.toml" in message
    for words in said:
        assert words in message


def test_walls_without_a_bore(put):
    text = TUBE + "0,0,56\n"
    message = refusal(read_recording, put(text, 'kind = "tube"\n[geometry]\nwall_thickness_mm = 5'))
    assert "run_1.toml" in message and "leaves no bore" in message and "less than 5" in message


def test_an_alloy_that_is_not_there(put):
    message = refusal(read_recording, put(STAND + "0,0,0,3.7\n", 'kind="spring"\n[geometry]\nalloy = "krl53"'))
    assert "run_1.toml: [geometry] alloy: no table" in message and "did you mean 'krl" in message
    message = refusal(read_recording, put(STAND + "0,0,0,3.7\n", 'kind="spring"\n'), {"geometry": {"alloy": ""}})
    assert message.startswith("command line: --alloy = '' must be a name")


def test_resistance_is_free_where_the_alloy_is_identified_too(put):
    text = STAND + "0,0,0,30\n"
    assert read_recording(put(text, 'kind="spring"\nspecimen="S"\n[geometry]\nalloy = "fit"')).si("resistance")[0] == 30
    stated = 'kind="spring"\nspecimen="S"\n[geometry]\nactive_coils = 400\n'
    assert read_recording(put(text, stated)).si("resistance")[0] == 30


def test_a_stated_kind_whose_columns_are_missing(put):
    message = refusal(read_recording, put("time_s,strain,stres_kPa\n0,0,0\n", 'kind = "elastomer"'))
    assert "needs the column stress_kPa" in message and "'stres_kPa'" in message
    message = refusal(read_recording, put(TUBE + "0,0,56\n", 'kind = "spring"'))
    assert "needs the column elongation_mm" in message and "look like kind tube" in message
    message = refusal(read_recording, put("time_s,pressure_kPa\n0,0\n", 'kind = "actuator"'))
    assert "one or more of the columns curvature_1pm, bend_angle_deg, length_mm" in message


def test_files_that_are_not_there_or_not_text(tmp_path):
    assert "there is no such file" in refusal(read_recording, tmp_path / "run.csv")
    assert "there is no such file or folder" in refusal(read_campaign, tmp_path / "nowhere")
    assert "there is no recording (NAME.csv)" in refusal(read_campaign, tmp_path)
    (tmp_path / "run.csv").write_bytes(b"time_s,strain,stress_kPa\n0,0,0\n1,0.1,5 \xb0\n")
    message = refusal(read_recording, tmp_path / "run.csv")
    assert "row 3" in message and "not UTF-8" in message
    (tmp_path / "run.csv").write_text(COUPON + "0,0,0\n")
    (tmp_path / "run.toml").write_bytes(b'specimen = "\xb0"')
    assert "run.toml: this is not UTF-8" in refusal(read_recording, tmp_path / "run.csv")
    assert "name the recording itself, run.csv" in refusal(read_recording, tmp_path / "run.toml")


def test_of_several_wrong_files_the_first_is_named_and_the_others_are_counted(put, tmp_path):
    put(COUPON + "0,0,0\n", name="a")
    put("", name="b")
    message = refusal(read_campaign, tmp_path)
    assert message.endswith("data rows are needed") and "b.csv" in message
    put(COUPON, name="c")
    assert refusal(read_campaign, tmp_path).endswith("(and 1 more file)")
    put(COUPON + "0,x,0\n", name="d/e")
    assert refusal(read_campaign, tmp_path).endswith("(and 2 more files)")


def test_a_sidecar_without_its_recording(put, tmp_path):
    put(COUPON + "0,0,0\n", name="a")
    (tmp_path / "b.toml").write_text('kind = "elastomer"')
    assert "b.csv is missing beside it" in refusal(read_campaign, tmp_path)


def test_one_specimen_of_two_kinds(put, tmp_path):
    put(COUPON + "0,0,0\n", 'kind = "elastomer"\nspecimen = "X"', "a")
    put(TUBE + "0,0,56\n", 'kind = "tube"\nspecimen = "X"', "b")
    message = refusal(read_campaign, tmp_path)
    assert "b.csv" in message and "specimen 'X' is of kind tube here but of kind elastomer" in message


def test_campaign_files_and_command_lines_are_checked_too(put, tmp_path):
    put(COUPON + "0,0,0\n")
    assert "command line: unknown key 'spec'" in refusal(read_campaign, tmp_path, {"spec": "X"})
    message = refusal(read_recording, tmp_path / "run_1.csv", {"geometry": {"length_mm": -1}})
    assert "command line: [geometry] length_mm = -1" in message
    (tmp_path / "campaign.toml").write_text('kind = "elastomer"')
    assert "campaign.toml: unknown key 'kind'" in refusal(read_campaign, tmp_path)
    (tmp_path / "campaign.toml").write_text("title = 3")
    assert "campaign.toml: title = 3 must be a text" in refusal(read_campaign, tmp_path)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda lines: [",".join(line.split(",")[:-1]) for line in lines], "needs the column stress_kPa"),
        (lambda lines: [*lines[:5], lines[5].replace(lines[5].split(",")[1], "abc", 1), *lines[6:]], "row 6, column strain"),
        (lambda lines: [], "the file is empty"),
        (lambda lines: [lines[0].replace("kPa", "furlong"), *lines[1:]], "unknown unit 'furlong'"),
        (lambda lines: [lines[0], *lines[:0:-1]], "row 3, column time_s: time goes backwards"),
    ],
)
def test_spoilt_copies_of_an_example(examples, tmp_path, spoil, said):
    for file in (examples / "elastomer").iterdir():
        (tmp_path / file.name).write_text(file.read_text())
    path = tmp_path / "pull_1.csv"
    path.write_text("\n".join(spoil(path.read_text().splitlines())) + "\n")
    message = refusal(read_campaign, tmp_path)
    assert "pull_1.csv" in message and said in message


def test_checks_leave_usable_numbers_alone(put):
    text = COUPON + "".join(f"{t},{s},{p}\n" for t, s, p in zip(range(50), np.linspace(-0.9, 10, 50), range(50), strict=True))
    assert len(read_recording(put(text))) == 50


@pytest.mark.parametrize("most", [19.5, 60.0, 600.0])
def test_a_strain_without_a_unit_that_no_rubber_reaches_is_asked_about(put, most):
    """Percent were read as a strain of 6000 %."""
    rows = "".join(f"{t},{most * t / 10:g},{5 * t}\n" for t in range(11))
    message = refusal(read_recording, put(COUPON + rows))
    assert "run_1.csv" in message and "column strain" in message and "strain_percent" in message and "strain_mm/mm" in message
    assert read_recording(put(COUPON.replace("strain", "strain_percent") + rows)).columns["strain"][-1] == pytest.approx(most / 100)
    assert read_recording(put(COUPON.replace("strain", "strain_mm/mm") + rows)).columns["strain"][-1] == most


@pytest.mark.parametrize(("most", "asked"), [(9.0, False), (12.0, True)])
def test_a_strain_that_hardly_any_rubber_reaches_is_a_notice(put, most, asked):
    rows = "".join(f"{t},{most * t / 10:g},{5 * t}\n" for t in range(11))
    notices = read_recording(put(COUPON + rows)).notices
    assert any("strain_percent" in note for note in notices) == asked
    stated = read_recording(put(COUPON.replace("strain", "strain_mm/mm") + rows)).notices
    assert not any("strain_percent" in note for note in stated)


SPRING_SIZES = 'kind = "spring"\n[geometry]\nwire_diameter_mm = 0.25\nmandrel_diameter_mm = 0.9\nactive_coils = 52\n'
TUBE_SIZES = 'kind = "tube"\n[geometry]\nlength_mm = 56\n'


@pytest.mark.parametrize(
    ("table", "sidecar", "said"),
    [
        (STAND + "0,0,0,3.7\n1,60,638.7,3.7\n", SPRING_SIZES, ["row 3, column force_N: 638.7", "0.25 mm breaks below 147 N"]),
        (STAND + "0,0,0,3.7\n1,60,-638700,3.7\n", SPRING_SIZES, ["column force_N: -638700", "--unit force=uN"]),
        (STAND + "0,0,0,3.7\n1,600,0.6,3.7\n", SPRING_SIZES, ["row 3, column elongation_mm: 600", "188 mm of wire"]),
        (TUBE + "0,0,560\n1,50,600\n", TUBE_SIZES, ["row 2, column length_mm: 560", "length_mm = 56 is the length at rest"]),
        (TUBE + "0,0,5.6\n1,50,6.0\n", TUBE_SIZES, ["column length_mm: 5.6", "--unit length=cm"]),
        (STAND + "0,0,0,3700\n", SPRING_SIZES + 'alloy = "fit"\n', ["resistance_ohm: 3700", "on import --unit resistance=mohm"]),
    ],
)  # fmt: skip
def test_what_a_specimen_of_the_stated_sizes_cannot_have(put, table, sidecar, said):
    message = refusal(read_recording, put(table, sidecar))
    for words in said:
        assert words in message


@pytest.mark.parametrize(
    ("table", "sidecar"),
    [(STAND + "0,0,0,3.7\n1,180,20,3.7\n", SPRING_SIZES), (TUBE + "0,0,56\n1,50,150\n2,80,170\n", TUBE_SIZES)],
)
def test_what_a_specimen_of_the_stated_sizes_can_have(put, table, sidecar):
    assert len(read_recording(put(table, sidecar))) >= 2


def test_a_column_under_a_name_of_its_own_is_named_where_one_is_missing(put):
    """`Kraft_N` in place of `force_N` was refused, and nothing said that the file has a column that nobody knows."""
    text = "time_s,elongation_mm,Kraft_N,resistance_ohm\n0,0,0,3.7\n"
    message = refusal(read_recording, put(text, 'kind = "spring"'))
    assert "needs the column force_N; not recognised: 'Kraft_N'; rename it if it is one of these" in message
    message = refusal(read_recording, put(text.replace("Kraft_N", "force_N").replace("resistance_ohm", "R2"), 'kind = "spring"'))
    assert message.endswith("columns resistance_ohm, temperature_degC; not recognised: 'R2'; rename it if it is one of these")
    message = refusal(read_recording, put(text.replace("Kraft_N,", "").replace("0,0,0,", "0,0,"), 'kind = "spring"'))
    assert "not recognised" not in message
