"""What a recording and its sidecar say arrives in memory, in canonical units and in SI."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fitting.data.recordings import (
    read_campaign,
    read_recording,
    recordings_folder,
    resistance_range,
    wire_length,
)
from pneusma_jax.errors import InputError

ROOT = Path(__file__).resolve().parents[2]
TEXTS = {
    "elastomer": "time_s,strain,stress_kPa\n0,0,0\n1,0.1,5\n2,0.2,9\n",
    "tube": "time_s,pressure_kPa,length_mm\n0,0,56\n1,5,57\n",
    "wire": "time_s,strain,stress_MPa,temperature_degC\n0,0.001,50,90\n1,0.002,50,80\n",
}


def test_example_campaigns_are_read_without_a_notice(examples):
    expected = {
        "actuator": (["run_1", "run_4", "run_6"], [150, 180, 180]),
        "elastomer": (["pull_1", "pull_4"], [400, 400]),
        "spring": (["test_1", "test_3", "test_6"], [600, 360, 600]),
        "tube": (["inflation_1", "inflation_4"], [240, 240]),
        "wire": (["cycle_1", "cycle_2", "cycle_5"], [400, 400, 400]),
    }
    for kind, (names, rows) in expected.items():
        campaign = read_campaign(examples / kind)
        assert campaign.title == kind and campaign.kinds == [kind]
        assert [r.name for r in campaign.recordings] == names
        assert [len(r) for r in campaign.recordings] == rows
        assert [r.role for r in campaign.recordings] == ["fit"] * (len(names) - 1) + ["validation"]
        assert all(r.notices == [] and r.real is False for r in campaign.recordings)
        assert list(campaign.specimens()) == [kind[0].upper()]
    actuator = read_campaign(examples / "actuator").recordings[0]
    assert actuator.columns["pressure_kPa"][0] == 14.95498
    assert actuator.si("pressure")[0] == pytest.approx(14954.98, rel=1e-12)
    assert actuator.noise == {"curvature_1pm": 0.25, "pressure_kPa": 0.05, "resistance_2_ohm": 0.00015}
    assert actuator.noise_si("pressure") == pytest.approx(50.0) and actuator.noise_si("time") is None
    assert actuator.outputs == ["curvature_1pm"]


def test_units_are_converted_once_by_their_suffix(put):
    text = "time_ms,elongation_in,force_mN,resistance_mohm,temperature_K\n0,0,100,3700,300\n500,0.1,200,3600,310\n"
    recording = read_recording(put(text, 'kind = "spring"\nspecimen = "S"\n[noise]\nforce_mN = 4\ntemperature_K = 0.5\n'))
    expected = {
        "time_s": [0, 0.5], "elongation_mm": [0, 2.54], "force_N": [0.1, 0.2],
        "resistance_ohm": [3.7, 3.6], "temperature_degC": [26.85, 36.85],
    }  # fmt: skip
    assert list(recording.columns) == list(expected)
    for name, values in expected.items():
        np.testing.assert_allclose(recording.columns[name], values, rtol=1e-12)
    assert recording.noise == {"force_N": pytest.approx(0.004), "temperature_degC": pytest.approx(0.5)}
    np.testing.assert_allclose(recording.si("elongation"), [0, 2.54e-3], rtol=1e-12)
    assert "column force_mN converted to force_N" in recording.notices
    assert recording.has("force") and recording.has("force_N") and not recording.has("current")
    with pytest.raises(InputError, match="no 'forces' was recorded, did you mean 'force'"):
        recording.si("forces")


def test_curvature_and_pressure_of_an_actuator_in_other_units(put):
    recording = read_recording(put("time_min,pressure_psi,curvature_1pcm,bend_angle_rad\n0,1,0.1,1\n1,2,0.2,2\n"))
    assert recording.kind == "actuator"
    np.testing.assert_allclose(recording.columns["pressure_kPa"], [6.894757293168361, 13.789514586336722])
    np.testing.assert_allclose(recording.columns["curvature_1pm"], [10, 20])
    np.testing.assert_allclose(recording.columns["bend_angle_deg"], np.degrees([1, 2]))
    np.testing.assert_allclose(recording.si("bend_angle"), [1, 2])


def test_missing_samples_are_nan_and_masked(put):
    recording = read_recording(put("time_s,strain,stress_kPa\n0,0,0\n1,,5\n2,0.2,nan\n"))
    np.testing.assert_array_equal(recording.missing("strain"), [False, True, False])
    np.testing.assert_array_equal(recording.missing("stress"), [False, False, True])


def test_unknown_columns_are_kept_and_ignored_with_a_notice(put):
    recording = read_recording(put("time_s,strain,stress_kPa,operator,bath_px\n0,0,0,Ada,1\n1,0.1,5,Grace,2\n"))
    assert recording.known_columns == ["time_s", "strain", "stress_kPa"]
    assert list(recording.columns["operator"]) == ["Ada", "Grace"]
    np.testing.assert_array_equal(recording.columns["bath_px"], [1, 2])
    assert sum("kept and ignored" in text for text in recording.notices) == 2


def test_comments_bom_windows_line_ends_and_blank_lines(put, tmp_path):
    path = tmp_path / "pull.csv"
    path.write_bytes("\ufeff# bench 3\r\n# warm room\r\ntime_s,strain,stress_kPa\r\n0,0,0\r\n\r\n1,0.1,5\r\n\r\n".encode())
    recording = read_recording(path)
    assert recording.comments == ["bench 3", "warm room"] and len(recording) == 2
    assert any("1 blank line " in text for text in recording.notices)


def test_sizes_in_comments_are_asked_about(put):
    """They were not read, and the source's spring was taken without a word."""
    rows = "time_s,elongation_mm,force_N,resistance_ohm\n0,0,0.0,3.7\n1,1,0.1,3.6\n2,2,0.2,3.5\n"
    comments = "# wire diameter: 0.3 mm\n# coil_diameter_mm = 1.15\n# Active coils: 48\n# pull 3: slow\n"
    sidecar = 'kind = "spring"\n[geometry]\nactive_coils = 48.0\n'
    asked = [n for n in read_recording(put(comments + rows, sidecar)).notices if "was not read" in n]
    assert len(asked) == 2
    assert "wire_diameter_mm under [geometry] of run_1.toml, or the source's 0.25 is taken" in asked[0]
    assert "state mandrel_diameter_mm" in asked[1]


def test_comments_between_the_rows_are_left_out_and_said(put):
    recording = read_recording(put("time_s,strain,stress_kPa\n0,0,0\n# belt touched, 5, 7\n1,0.1,5\n# end\n"))
    np.testing.assert_array_equal(recording.columns["strain"], [0.0, 0.1])
    assert any("2 comments between the rows skipped (row 3)" in text for text in recording.notices)


def test_a_number_that_no_other_unit_can_hold_is_refused(put):
    with pytest.raises(InputError, match="row 3, column stress_kPa: inf cannot be: an instrument writes it for no reading"):
        read_recording(put("time_s,strain,stress_MPa\n0,0,0\n1,0.1,1e308\n", 'kind = "elastomer"\n'))


@pytest.mark.parametrize("name", ["stress_kPa", "stress_Pa"])
def test_an_instruments_mark_for_no_reading_is_refused(put, name):
    with pytest.raises(InputError, match=r"row 3, column stress_kPa: 9.9e\+3\d( Pa, that is 9.9e\+34 kPa,)? cannot be: an instrument writes it for no reading"):
        read_recording(put(f"time_s,strain,{name}\n0,0,0\n1,0.1,9.9E37\n"))


@pytest.mark.parametrize(
    ("header", "row", "kind"),
    [
        ("time_s,elongation_mm,force_N,resistance_ohm", "0,1,0.1,3.7", "spring"),
        ("time_s,strain,stress_MPa,temperature_degC", "0,0.01,50,20", "wire"),
        ("time_s,strain,stress_MPa", "0,0.01,50", "wire"),
        ("time_s,strain,stress_MPa", "0,3.0,1.2", "elastomer"),
        ("time_s,strain,stress_kPa", "0,0.01,50", "elastomer"),
        ("strain,stress_MPa", "0.01,0.05", "elastomer"),
        ("time_s,strain,stress_MPa,cycle", "0,0.01,0.05,1", "elastomer"),
        ("time_s,pressure_kPa,length_mm", "0,1,56", "tube"),
        ("time_s,pressure_kPa,length_mm,resistance_1_ohm", "0,1,56,3.7", "actuator"),
        ("time_s,pressure_bar,bend_angle_deg", "0,0.1,5", "actuator"),
    ],
)
def test_kind_is_inferred_from_the_columns_with_a_notice(put, header, row, kind):
    recording = read_recording(put(f"{header}\n{row}\n"))
    assert recording.kind == kind and recording.specimen == kind and recording.real is None
    assert any("no sidecar run_1.toml" in text and f"kind {kind}" in text for text in recording.notices)


def test_defaults_are_the_source_specimens(put):
    actuator = read_recording(put("time_s,pressure_kPa,curvature_1pm\n0,1,2\n", 'kind = "actuator"\nspecimen = "A"\n'))
    full = actuator.full_geometry()
    assert full == {
        "design": "pneusma2", "orientation": "vertical_base_down", "outer_diameter_mm": 10.0,
        "wall_thickness_mm": 1.0, "length_mm": 56.0, "wire_diameter_mm": 0.25, "mandrel_diameter_mm": 0.9,
        "initial_pitch_mm": 0.269, "active_coils": 52.0, "free_length_mm": 14.0, "attached_length_mm": 56.0,
        "prestrain": 0.1924, "alloy": "krl35", "material": "dragon_skin_10_fast", "cycles_before": 0.0,
    }  # fmt: skip
    assert actuator.role == "fit" and actuator.tolerance is None and actuator.geometry == {}
    tolerance = actuator.full_tolerance()
    assert tolerance["wall_thickness_mm"] == 0.03 and tolerance["length_mm"] == 0.02
    assert tolerance["rho_mean"] == 0.003 and tolerance["a"] == 0.02 and tolerance["gamma_L"] == 0.03
    assert "beta_1" not in tolerance and "km_1" not in tolerance and "active_coils" not in tolerance


def test_geometry_that_follows_from_other_geometry(put):
    text = "time_s,pressure_kPa,curvature_1pm\n0,1,2\n"
    sidecar = 'kind = "actuator"\nspecimen = "A"\n[geometry]\ndesign = "{}"\n{}'
    longer = read_recording(put(text, sidecar.format("pneusma1", "length_cm = 6.0"), "a")).full_geometry()
    assert longer["length_mm"] == pytest.approx(60.0) and longer["attached_length_mm"] == pytest.approx(60.0)
    thick = read_recording(put(text, sidecar.format("pneuflex_t", ""), "b")).full_geometry()
    assert thick["wall_thickness_mm"] == 1.5 and thick["outer_diameter_mm"] == 10.0
    wide = read_recording(put(text, sidecar.format("pneuflex_w", ""), "c")).full_geometry()
    assert wide["outer_diameter_mm"] == 14.0
    stand = "time_s,elongation_mm,force_N,resistance_ohm\n0,0,0,3\n"
    spring = read_recording(put(stand, 'kind="spring"\nspecimen="S"\n[geometry]\nactive_coils = 40\n', "d"))
    assert spring.full_geometry()["free_length_mm"] == pytest.approx(40 * 0.269)
    assert spring.full_geometry()["prestrain"] == 0.0


def test_a_tolerance_table_is_complete(put):
    text = "time_s,strain,stress_kPa\n0,0,0\n1,0.1,5\n"
    stated = read_recording(put(text, 'kind="elastomer"\nspecimen="E"\n[tolerance]\nsilicone_stiffness = 0.1\n', "a"))
    assert stated.full_tolerance() == {"silicone_stiffness": 0.1}
    exact = read_recording(put(text, 'kind="elastomer"\nspecimen="E"\n[tolerance]\n', "b"))
    assert exact.full_tolerance() == {}


def test_precedence_campaign_sidecar_command_line(put, tmp_path):
    (tmp_path / "campaign.toml").write_text(
        'title = "Bench 3"\n[geometry]\nouter_diameter_mm = 11.0\nwall_thickness_mm = 1.1\nlength_mm = 50\n'
        "[tolerance]\nwall_thickness_mm = 0.1\nlength_mm = 0.1\n"
    )
    text = "time_s,pressure_kPa,length_mm\n0,0,56\n1,5,57\n"
    put(text, 'kind="tube"\nspecimen="T"\n[geometry]\nwall_thickness_mm = 1.2\n[tolerance]\nlength_mm = 0.2\n')
    put(text, 'kind="tube"\nspecimen="T"\n', "below/run_2")
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden" / "scrap.csv").write_text("not a recording")
    campaign = read_campaign(tmp_path, {"geometry": {"length_mm": 60}, "tolerance": {"G_m": 0.3}})
    assert campaign.title == "Bench 3" and [r.name for r in campaign.recordings] == ["below/run_2", "run_1"]
    below, run = campaign.recordings
    assert run.geometry == {"outer_diameter_mm": 11.0, "wall_thickness_mm": 1.2, "length_mm": 60.0}
    assert below.geometry == {"outer_diameter_mm": 11.0, "wall_thickness_mm": 1.1, "length_mm": 60.0}
    assert run.tolerance == {"length_mm": 0.2, "G_m": 0.3}
    assert below.tolerance == {"wall_thickness_mm": 0.1, "length_mm": 0.1, "G_m": 0.3}


def test_one_file_is_a_campaign_of_one(put, tmp_path):
    path = put("time_s,pressure_kPa,length_mm\n0,0,56\n1,5,57\n")
    put("time_s,pressure_kPa,length_mm\n0,0,56\n", name="run_2")
    campaign = read_campaign(path, {"role": "validation", "specimen": "T"})
    assert [r.name for r in campaign.recordings] == ["run_1"] and campaign.title == "run_1"
    assert campaign.recordings == campaign.of_kind("tube") and campaign.recordings[0].role == "validation"


def test_resistance_range_of_the_source_spring(put):
    recording = read_recording(put("time_s,elongation_mm,force_N,resistance_ohm\n0,0,0,3.7\n"))
    length = 52 * np.hypot(np.pi * 1.15, 0.269) * 1e-3
    assert wire_length(recording.full_geometry()) == pytest.approx(length, rel=1e-12)
    low, high = resistance_range(recording)
    # Table 2.2 with correction 4: least rho_a 17.1884, largest rho_m 18.8697 + 2.1034 / 2 ohm/m
    assert low == pytest.approx(0.5 * 17.1884 * length, rel=1e-9)
    assert high == pytest.approx(2.0 * (18.8697 + 2.1034 / 2) * length, rel=1e-9)


def test_an_alloy_file_beside_the_recording_is_found(put, tmp_path):
    import shutil
    from importlib import resources

    shutil.copy(str(resources.files("calibration_data") / "krl45.toml"), tmp_path / "ours.toml")
    text = "time_s,elongation_mm,force_N,resistance_ohm\n0,0,0,3.7\n"
    path = put(text, 'kind="spring"\nspecimen="S"\n[geometry]\nalloy = "ours.toml"\n')
    recording = read_recording(path)
    assert recording.table("alloy") == tmp_path / "ours.toml"
    high = resistance_range(recording)[1]
    assert high == pytest.approx(2 * (18.9763 + 3.1742 / 2) * wire_length(recording.full_geometry()), rel=1e-9)
    assert len(read_campaign(tmp_path).recordings) == 1  # the alloy's TOML is not taken for a sidecar


def test_repeated_times_are_accepted_with_a_notice(put):
    recording = read_recording(put("time_s,strain,stress_kPa\n0,0,0\n0,0.1,5\n1,0.2,9\n"))
    assert any("1 row has the same time_s" in text for text in recording.notices)


def test_recordings_folder_honours_its_variable(tmp_path, monkeypatch):
    monkeypatch.setenv("PNEUSMA_RECORDINGS", str(tmp_path))
    assert recordings_folder() == tmp_path
    monkeypatch.setenv("PNEUSMA_RECORDINGS", str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match="PNEUSMA_RECORDINGS"):
        recordings_folder()
    monkeypatch.delenv("PNEUSMA_RECORDINGS")
    beside = ROOT.parent / "shared" / "recordings"
    assert recordings_folder() == (beside if beside.is_dir() else None)


def test_reading_needs_no_jax():
    # The package's own front page may load JAX; the modules that reading needs must not.
    code = (
        "import sys, types; front = types.ModuleType('pneusma_jax'); "
        f"front.__path__ = [{str(ROOT / 'pneusma_jax')!r}]; sys.modules['pneusma_jax'] = front; "
        "import fitting.data.recordings, fitting.data.importers; print([m for m in sys.modules if m.split('.')[0] == 'jax'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


def test_a_real_recording_needs_no_licence_and_that_is_noted(put):
    recording = read_recording(put("strain,stress_kPa\n0,0\n0.1,5\n", "kind = \"elastomer\"\nreal = true\n"))
    assert any("no licence is stated" in text for text in recording.notices)


def test_what_did_not_change_may_stand_in_the_sidecar(put):
    """A hung weight and a pull at room temperature, whose stress and temperature are in no column."""
    hung = "time_s,temperature_degC,strain\n0,30,0.04\n1,90,0.01\n2,30,0.04\n"
    recording = read_recording(put(hung, 'kind = "wire"\n[constant]\nstress_ksi = 10\n'))
    np.testing.assert_allclose(recording.columns["stress_MPa"], np.full(3, 68.94757293168361))
    assert recording.has("stress") and any("stress_MPa is 68.9476 in every row" in text for text in recording.notices)
    pull = "time_s,strain,stress_MPa\n0,0,0\n1,0.01,100\n2,0.02,200\n"
    recording = read_recording(put(pull, "[constant]\ntemperature_degF = 71.6\n"))  # and the kind follows
    assert recording.kind == "wire"
    np.testing.assert_allclose(recording.columns["temperature_degC"], np.full(3, 22.0))


def test_a_campaigns_noise_holds_for_columns_without_a_noise_of_their_own(tmp_path):
    """A campaign with a table of noise was refused."""
    (tmp_path / "campaign.toml").write_text("[noise]\nstress_kPa = 500\ntemperature_degF = 0.9\nstrain_percent = 0.02\n")
    (tmp_path / "a.csv").write_text("time_s,strain,stress_MPa\n0,0,0\n1,0.01,100\n")
    (tmp_path / "b.csv").write_text("time_s,strain,stress_MPa,temperature_degC\n0,0,0,40\n1,0.01,100,41\n")
    (tmp_path / "c.csv").write_text("strain,stress_kPa\n0,0\n0.1,5\n")
    for name, rest in (("a", ""), ("b", "[noise]\nstress_Pa = 3e5\n"), ("c", "")):
        kind = "elastomer" if name == "c" else "wire"
        (tmp_path / f"{name}.toml").write_text(f'kind = "{kind}"\nspecimen = "{kind}"\n{rest}')
    a, b, c = read_campaign(tmp_path).recordings
    assert a.noise == pytest.approx({"strain": 2e-4, "stress_MPa": 0.5})
    assert b.noise == pytest.approx({"strain": 2e-4, "stress_MPa": 0.3, "temperature_degC": 0.5})
    assert c.noise == pytest.approx({"strain": 2e-4, "stress_kPa": 500.0})


def test_a_campaign_may_state_that_an_input_is_exact(tmp_path):
    """A sidecar may state 0, too."""
    shared, pull = tmp_path / "campaign.toml", "time_s,elongation_mm,force_N,resistance_ohm\n0,0,0,3.7\n1,1,0.1,3.6\n"
    (tmp_path / "a.csv").write_text(pull)
    (tmp_path / "a.toml").write_text('kind = "spring"\nspecimen = "a"\n')
    shared.write_text("[noise]\nelongation_mm = 0.0\n")
    (a,) = read_campaign(tmp_path).recordings
    assert a.noise == {"elongation_mm": 0.0}
    shared.write_text("[noise]\nforce_N = 0.0\n")
    with pytest.raises(InputError, match=r"\[noise\] force_N = 0 must be more than 0"):
        read_campaign(tmp_path)


def test_a_campaigns_constant_fills_what_a_recording_lacks(tmp_path):
    (tmp_path / "campaign.toml").write_text("[constant]\ntemperature_degC = 22\n")
    (tmp_path / "a.csv").write_text("time_s,strain,stress_MPa\n0,0,0\n1,0.01,100\n")
    (tmp_path / "b.csv").write_text("time_s,strain,stress_MPa,temperature_degC\n0,0,0,40\n1,0.01,100,41\n")
    (tmp_path / "c.csv").write_text("strain,stress_kPa\n0,0\n0.1,5\n")
    for name, kind in (("a", "wire"), ("b", "wire"), ("c", "elastomer")):
        (tmp_path / f"{name}.toml").write_text(f'kind = "{kind}"\nspecimen = "{kind}"\n')
    a, b, c = read_campaign(tmp_path).recordings
    assert a.columns["temperature_degC"].tolist() == [22.0, 22.0] and b.columns["temperature_degC"].tolist() == [40.0, 41.0]
    assert not c.has("temperature")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[constant]\nstrses_MPa = 3\n", "unknown column 'strses_MPa' in [constant], did you mean 'stress_MPa'"),
        ("[constant]\ntemprature_degC = 22\n", "did you mean 'temperature_degC'"), ("[zero]\nbanana = 4\n", "unknown column 'banana' in [zero]"),
        ("[zero]\nforce_N = 4\n", "unknown column 'force_N' in [zero]"),
        ("[noise]\nstrss_MPa = 3\n", "unknown column 'strss_MPa' in [noise]"), ("[noise]\nstress_MPa = -3\n", "[noise] stress_MPa = -3 must be more than 0"),
        ("[noise]\nstress_MPa = true\n", "must be a finite number"), ("[noise]\nstress_MPa = 1\nstress_kPa = 3\n", "there twice"), ("[noise]\nstrain_mm = 1\n", "[noise] strain_mm"), ("[constant]\ntemperature_kPa = 22\n", "[constant] temperature_kPa"),
    ],
)  # fmt: skip
def test_a_column_that_no_kind_knows_is_refused_in_a_campaign(put, tmp_path, text, words):
    put(TEXTS["wire"], 'kind = "wire"\n')
    (tmp_path / "campaign.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        read_campaign(tmp_path)
    assert words in str(caught.value) and "campaign.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "text", "noted"),
    [
        ("wire", "[zero]\nstrain = 0.01\nstress_MPa = 3\n", ["[zero] strain", "[zero] stress_MPa"]), ("tube", "[constant]\ntemperature_degC = 22\n", ["[constant] temperature_degC"]),
        ("wire", "[constant]\ntemperature_degC = 22\n", ["[constant] temperature_degC"]), ("elastomer", "[zero]\nstrain = 0.01\nstress_kPa = 1\n", []),
        ("elastomer", "[constant]\ncycle = 1\n[zero]\nstress_MPa = 0.001\n", []),
        ("elastomer", "[noise]\nforce_N = 1\nstress_Pa = 100\n", ["[noise] force_N"]),
    ],
)  # fmt: skip
def test_what_no_recording_uses_of_a_campaign_is_noted(put, tmp_path, kind, text, noted):
    put(TEXTS[kind], f'kind = "{kind}"\n')
    (tmp_path / "campaign.toml").write_text(text)
    notices = [text for text in read_campaign(tmp_path).notices if "no recording uses it" in text]
    assert len(notices) == len(noted) and all(word in text for word, text in zip(noted, notices, strict=True))


@pytest.mark.parametrize(("noise", "asked"), [("stress_MPa = 0.2", True), ("stress_kPa = 0.2", False)])
def test_a_noise_beyond_every_reading_is_asked_about(put, tmp_path, noise, asked):
    put("time_s,strain,stress_kPa\n0,0,0\n1,0.1,-150\n", 'kind = "elastomer"\n')
    (tmp_path / "campaign.toml").write_text(f"[noise]\n{noise}\n")
    notices = [text for one in read_campaign(tmp_path).recordings for text in one.notices if "[noise]" in text]
    said = "check: [noise] stress_kPa: 200 is more than the largest reading, 150; is its unit right?"
    assert notices == [said] * asked
