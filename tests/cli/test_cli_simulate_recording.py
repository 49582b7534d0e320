"""`pneusma simulate RECORDING.csv`: model.csv, the figure, and recordings that cannot be used."""

import csv
import dataclasses
import shutil

import numpy as np
import pytest
from cli_samples import EXAMPLE, heated_recording

import pneusma_jax as pj
from fitting.data.recordings import Recording, write_recording
from fitting.simulate import predict
from pneusma_jax.effects import find_effect


def _table(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def test_elastomer_gets_the_law_of_its_material(run, tmp_path):
    result = run("simulate", EXAMPLE, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    table = _table(tmp_path / "out" / "model.csv")
    law = pj.load_silicone("dragon_skin_10_fast")
    assert table["model_stress_kPa"] == pytest.approx(np.asarray(law(table["strain"])) / 1e3, rel=1e-12)
    assert (tmp_path / "out" / "model.png").read_bytes().startswith(b"\x89PNG")
    first, header = EXAMPLE.read_text().splitlines()[:2]
    assert first.startswith("#") and (tmp_path / "out" / "model.csv").read_text().splitlines()[0] == first
    assert list(table) == [*header.split(","), "model_stress_kPa"]


@pytest.mark.slow
def test_actuator_follows_its_own_model_to_the_noise(run, heated, tmp_path):
    result = run("simulate", heated, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    table = _table(tmp_path / "out" / "model.csv")
    off = table["curvature_1pm"] - table["model_curvature_1pm"]
    assert np.mean(off**2) / 0.25**2 < 2.0
    assert "model_length_mm" in table and "model_resistance_2_ohm" not in table
    assert "spring 1 was not recorded: it is taken as cold" in result.stderr
    states = (tmp_path / "out" / "states.csv").read_text().splitlines()
    assert states[0] == "time_s,status,xi0_1,gamma_R_1,xi0_2,gamma_R_2" and ",converged,1," in states[1]


@pytest.mark.slow
def test_without_noise_the_model_is_reproduced_with_its_memory():
    recording = heated_recording(noise=False)
    prediction = predict(recording, denoise=False)
    assert prediction.outputs["curvature_1pm"] == pytest.approx(recording.columns["curvature_1pm"], abs=1e-6)
    residual = prediction.states["gamma_R_2"]
    assert residual[-1] == pytest.approx(residual.min())  # cooling has not brought it back


@pytest.mark.slow
def test_reading_through_the_smoother_beats_reading_sample_by_sample():
    recording = heated_recording()
    rmse = [
        np.sqrt(
            np.mean(
                (predict(recording, d).outputs["curvature_1pm"] - recording.columns["curvature_1pm"]) ** 2
            )
        )
        for d in (True, False)
    ]
    assert rmse[0] < rmse[1]


@pytest.mark.slow
def test_rows_with_a_missing_input_are_passed_over():
    recording = heated_recording(61)
    recording.columns["pressure_kPa"][5] = np.nan
    prediction = predict(recording)
    empty = np.isnan(prediction.outputs["curvature_1pm"])
    assert list(np.flatnonzero(empty)) == [5] and prediction.states["status"][5] == ""
    assert any("1 of 61 rows" in sentence for sentence in prediction.notices)


def test_a_spring_is_driven_in_rows_whose_resistance_is_missing_between_readings():
    spring = pj.Spring(pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3), pj.load_alloy("krl35"), 14e-3)
    x = 0.03 * np.interp(np.arange(41.0), [0, 10, 20, 30, 40], [0, 1, 0, 1, 0])
    made = pj.simulate_spring(spring, x, pj.MartensiteFraction(0.8)).rows
    columns = {
        "time_s": np.arange(41.0), "elongation_mm": 1e3 * x, "force_N": np.asarray(made.force),
        "resistance_ohm": np.array(made.resistance),
    }  # fmt: skip
    columns["resistance_ohm"][[0, 10, 30, 40]] = np.nan  # at two turns, and at both ends
    recording = Recording("s", None, "spring", specimen="S", geometry={"free_length_mm": 14.0}, columns=columns)
    found = predict(recording)
    assert list(np.flatnonzero(np.isnan(found.outputs["force_N"]))) == [0, 40]
    assert found.outputs["force_N"][10] == pytest.approx(columns["force_N"][10], rel=0.02)
    assert any("resistance_ohm is missing in 2 of 41 rows" in notice for notice in found.notices)
    assert any("2 of 41 rows lack one of" in notice for notice in found.notices)


@pytest.mark.slow
def test_spring_and_tube(tmp_path, run):
    spring = pj.Spring(
        pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3), pj.load_alloy("krl35"), 14e-3
    )
    x = 0.04 * np.abs(np.sin(np.linspace(0.0, 6.0, 40)))
    made = pj.simulate_spring(spring, x, pj.MartensiteFraction(0.8)).rows
    columns = {
        "time_s": np.arange(40.0), "elongation_mm": 1e3 * x, "force_N": np.asarray(made.force),
        "resistance_ohm": np.asarray(made.resistance), "temperature_degC": np.full(40, 25.0),
    }  # fmt: skip
    path = write_recording(
        Recording("s", None, "spring", specimen="S", geometry={"free_length_mm": 14.0}, columns=columns),
        tmp_path,
    )
    assert run("simulate", path, "--out", tmp_path / "s").exit_code == 0
    table = _table(tmp_path / "s" / "model.csv")
    assert table["model_force_N"] == pytest.approx(table["force_N"], abs=1e-6)
    assert np.all(np.isfinite(table["model_resistance_ohm"]))

    law = pj.load_silicone()
    kPa = np.linspace(0.0, 40.0, 9)
    length = [1e3 * float(pj.tube_length(1e3 * p, 56e-3, 10e-3, 1e-3, law)) for p in kPa]
    columns = {"time_s": np.arange(9.0), "pressure_kPa": kPa, "length_mm": np.array(length)}
    path = write_recording(Recording("t", None, "tube", specimen="T", columns=columns), tmp_path)
    assert run("simulate", path, "--out", tmp_path / "t").exit_code == 0
    assert _table(tmp_path / "t" / "model.csv")["model_length_mm"] == pytest.approx(
        np.array(length), rel=1e-10
    )


def _spoil(change):
    def make(folder):
        lines = [line for line in EXAMPLE.read_text().splitlines() if not line.startswith("#")]
        path = folder / "pull.csv"
        path.write_text("\n".join(change(lines)) + "\n")
        shutil.copy(EXAMPLE.with_suffix(".toml"), folder / "pull.toml")
        return path

    return make


SPOILT = {
    "a missing column": (lambda L: [line.rsplit(",", 1)[0] for line in L], "stress_kPa"),
    "text in a number": (lambda L: L[:5] + ["abc" + L[5][L[5].index(",") :]] + L[6:], "row 6"),
    "an unknown unit": (lambda L: [L[0].replace("stress_kPa", "stress_furlong")] + L[1:], "furlong"),
    "an empty file": (lambda L: [], "empty"),
    "a row of nothing": (lambda L: L[:4] + ["," * L[0].count(",")] + L[5:], "row 5"),
    "time going backwards": (lambda L: [L[0], *reversed(L[1:])], "backwards"),
}


@pytest.mark.parametrize("what", SPOILT)
def test_spoilt_recordings_are_refused_and_nothing_is_written(refused, tmp_path, what):
    change, words = SPOILT[what]
    line = refused("simulate", _spoil(change)(tmp_path), "--out", tmp_path / "out")
    assert "pull.csv" in line and words in line
    assert not (tmp_path / "out").exists()


def _wire(**geometry):
    wire = pj.nitinol.load_wire("niti_wire")
    celsius = np.concatenate([np.linspace(90.0, 20.0, 20), np.linspace(20.0, 90.0, 20)])
    made = pj.nitinol.simulate_wire(wire, stress=np.full(40, 150e6), temperature=celsius)
    columns = {
        "time_s": np.arange(40.0), "strain": np.asarray(made.rows.strain), "stress_MPa": np.full(40, 150.0),
        "temperature_degC": celsius,
    }  # fmt: skip
    return Recording("w", None, "wire", specimen="W", geometry=geometry, columns=columns)


def test_a_wire_follows_its_own_model(run, tmp_path):
    path = write_recording(_wire(), tmp_path)
    result = run("simulate", path, "--raw-resistance", "--out", tmp_path / "w")
    assert result.exit_code == 0 and "stress drives the wire" in result.stderr
    table = _table(tmp_path / "w" / "model.csv")
    assert table["model_strain"] == pytest.approx(table["strain"], abs=1e-9)


def test_a_wire_without_temperature_or_alloy_is_refused(refused, tmp_path):
    blind = _wire()
    del blind.columns["temperature_degC"]
    line = refused("simulate", write_recording(blind, tmp_path / "a"), "--out", tmp_path / "o")
    assert "there is no temperature_degC" in line
    line = refused("simulate", write_recording(_wire(alloy="fit"), tmp_path / "b"), "--out", tmp_path / "o")
    assert "to be fitted" in line


LEADS = """schema = "pneusma-model/1"
[base]
G_a = {value = 9.0, unit = "GPa", status = "fitted", source = "a test"}
[[effect]]
slug = "series_resistance"
[effect.parameters]
ohms = {value = 0.05, unit = "ohm", status = "fitted", source = "a test"}
"""


@pytest.mark.slow
def test_a_model_on_disk_is_used_with_its_numbers_and_effects(run, tmp_path):
    recording = heated_recording(noise=False)
    body = pj.make_actuator("pneusma2", pj.load_alloy(_stiffer()))
    leads = find_effect("series_resistance")(ohms=0.05)
    ohms = pj.Resistance(recording.columns["resistance_2_ohm"])
    wanted = pj.simulate_history(
        body, recording.si("pressure"), (pj.MartensiteFraction(1.0), ohms), effects=(leads,)
    )
    path, model = write_recording(recording, tmp_path), tmp_path / "augmented.toml"
    model.write_text(LEADS)
    result = run("simulate", path, "--model", model, "--raw-resistance", "--out", tmp_path / "o")
    assert result.exit_code == 0, result.output
    table = _table(tmp_path / "o" / "model.csv")
    ours, theirs = table["model_curvature_1pm"], np.asarray(wanted.seen["curvature"])
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-6, equal_nan=True)
    assert np.isfinite(ours).sum() > 55
    assert np.nanmax(np.abs(table["model_curvature_1pm"] - table["curvature_1pm"])) > 0.1


def _stiffer():
    table = pj.load_calibration("krl35")
    number = dataclasses.replace(table.quantities["G_a"], value=9e9)
    return dataclasses.replace(table, quantities={**table.quantities, "G_a": number})


def test_other_refusals(refused, tmp_path, heated):
    assert "no such file" in refused("simulate", tmp_path / "none.csv", "--out", tmp_path / "out")
    assert "needs --out" in refused("simulate", EXAMPLE)
    assert "brings its own inputs" in refused(
        "simulate", EXAMPLE, "--pressure-kPa", 3, "--out", tmp_path / "out"
    )
    assert "is a folder" in refused("simulate", EXAMPLE.parent, "--out", tmp_path / "out")
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    assert "this is a file" in refused("simulate", EXAMPLE, "--out", in_the_way)
    assert "to be fitted" in refused("simulate", _with_material_fit(tmp_path), "--out", tmp_path / "o")
    assert not (tmp_path / "o").exists()


def _with_material_fit(folder):
    path = folder / "open.csv"
    shutil.copy(EXAMPLE, path)
    path.with_suffix(".toml").write_text('kind = "elastomer"\nspecimen = "A"\n[geometry]\nmaterial = "fit"\n')
    return path
