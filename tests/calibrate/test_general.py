"""Wires, tubes and actuators through one pipeline: constants come out again, what stays open is named."""

import dataclasses
import json
import shutil
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

import pneusma_jax as pj
from fitting.characterise import characterise
from fitting.cli import main
from fitting.data.importers import import_file
from fitting.data.recordings import read_campaign, write_recording
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import load_wire

SHIPPED = Path(str(resources.files("calibration_data"))) / "examples"


def truth(kind):
    return json.loads((SHIPPED / kind / "truth.json").read_text())


@pytest.fixture(scope="module")
def wire():
    return characterise(SHIPPED / "wire", starts=1, profile=1)


@pytest.fixture(scope="module")
def tube():
    return characterise(SHIPPED / "tube")


def test_a_wires_constants_come_out_again(wire):
    parameters = wire.parameters
    for name, entry in truth("wire")["parameters"].items():
        found = parameters[name]
        assert abs(found.value - entry["value"]) < 3.5 * found.sd, name
        assert found.unit == entry["unit"]
    assert parameters["T_mid"].sd < 0.2 and parameters["T_width"].sd < 0.1  # degC, K
    assert 0.8 < wire.fit.reduced_chi_square < 1.3 and wire.fit.inflation == 1.0


def test_what_cycles_do_not_show_is_named(wire):
    stayed = {e["parameters"][0] for e in wire.identifiability if e["kind"] == "at_start"}
    assert {"gR_amplitude", "gR_slope", "gR_shift"} <= stayed
    together = [e["parameters"] for e in wire.identifiability if e["kind"] == "known_together"]
    assert ["beta_2", "beta_3"] in together
    assert "are still at the values they started from" in " ".join(wire.report().split())


@pytest.mark.slow
def test_held_out_cycles_are_predicted(wire):
    report = json.loads(wire.documents()["report.json"])
    assert report["schema"] == "pneusma-characterisation/1" and report["kind"] == "wire"
    assert all({"value", "sd", "unit", "at_bound"} <= set(p) for p in report["parameters"].values())
    held = report["metrics_held_out"]
    assert held["mae_strain"] < 1.5e-4 and 0.0 < held["rpd"] < 0.02 and abs(held["rpd_signed"]) < 0.02
    assert report["next_test"]["candidates"][0]["information_nats"] > 0.5


@pytest.mark.slow
def test_the_alloy_found_can_be_simulated(wire, tmp_path):
    wire.save(tmp_path / "out")
    again = load_wire(tmp_path / "out" / "alloy.toml")
    assert float(again.eps_L) == pytest.approx(wire.parameters["eps_L"].value)
    assert float(again.T_width) == pytest.approx(wire.parameters["T_width"].value)
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert {"report.json", "report.html", "alloy.toml", "parameters.csv", "fit.png", "residuals.png"} <= names


def test_a_tubes_wall_and_silicone_are_known_only_together(tube):
    kinds = {(e["kind"], *e["parameters"]) for e in tube.identifiability}
    assert ("loose_direction", "wall_thickness__1", "silicone_stiffness__1") in kinds
    assert "cannot be separated" in tube.verdict[-1]
    assert "end in __1 for A, __2 for B." in " ".join(tube.report().split())
    for number, specimen in enumerate("AB", start=1):
        own = truth("tube")["specimens"][specimen]
        product = own["silicone_stiffness"]["value"] * own["geometry"]["wall_thickness_mm"]["value"]
        found = [tube.parameters[f"{n}__{number}"].value for n in ("silicone_stiffness", "wall_thickness")]
        assert found[0] * found[1] == pytest.approx(product, rel=0.01)
    assert 0.8 < tube.fit.reduced_chi_square < 1.25  # noise of the pressure is in it


@pytest.mark.slow
def test_the_material_found_can_be_simulated(tube, tmp_path):
    tube.save(tmp_path / "out")
    law, base = pj.load_silicone(tmp_path / "out" / "material.toml"), pj.load_silicone()
    both = np.array([tube.parameters[f"silicone_stiffness__{k}"].value for k in (1, 2)])
    assert both.min() < float(law(0.5) / base(0.5)) < both.max()


@pytest.mark.slow
def test_a_held_parameter_stays(tube):
    fixed = {f"wall_thickness__{k}": {"value": 1.0, "vary": False} for k in (1, 2)}
    held = characterise(SHIPPED / "tube", adjust=fixed, starts=1)
    assert held.parameters["wall_thickness__1"].value == pytest.approx(1.0)
    assert held.parameters["silicone_stiffness__1"].sd < 0.1 * tube.parameters["silicone_stiffness__1"].sd


def test_nothing_open_and_nothing_to_fit_are_refused(tmp_path):
    campaign = read_campaign(SHIPPED / "tube")
    for recording in campaign.recordings:
        recording.tolerance = {}
    with pytest.raises(InputError, match="leave nothing open"):
        characterise(campaign)
    campaign = read_campaign(SHIPPED / "tube")
    for recording in campaign.recordings:
        recording.role = "validation"
    with pytest.raises(InputError, match='role = "fit"'):
        characterise(campaign)


@pytest.mark.slow
def test_the_command_writes_everything(tmp_path, capsys):
    copy = tmp_path / "tube"
    shutil.copytree(SHIPPED / "tube", copy)
    with pytest.raises(SystemExit) as left:
        main(["characterise", str(copy), "--starts", "1", "--out", str(tmp_path / "out")])
    assert not left.value.code and (tmp_path / "out" / "report.html").exists()
    assert "SIMULATED" in capsys.readouterr().out


def test_the_command_refuses_what_a_kind_has_not_in_one_line(tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        main(["characterise", str(SHIPPED / "tube"), "--law", "yeoh", "--out", str(tmp_path / "no")])
    assert left.value.code == 2 and not (tmp_path / "no").exists()
    assert len([line for line in capsys.readouterr().err.splitlines() if line.strip()]) == 1


@pytest.mark.slow
def test_an_actuators_numbers_come_out_again():
    found = characterise(SHIPPED / "actuator")
    real = truth("actuator")
    pairs = {"G_m": real["parameters"]["G_m"], "G_a": real["parameters"]["G_a"]}
    pairs |= {"wall_thickness": real["geometry"]["wall_thickness_mm"]}
    pairs |= {"silicone_stiffness": real["silicone_stiffness"]}
    for name, entry in pairs.items():
        estimate = found.parameters[name]
        assert abs(estimate.value - entry["value"]) < 3.0 * estimate.sd, name
    assert {"alloy.toml", "material.toml", "geometry.toml"} <= set(found.documents())


@pytest.mark.slow
def test_measured_thermal_cycles_are_fitted_by_the_base_law_and_missed_by_how_much(measured, tmp_path):
    for load in (7, 50, 150, 200):
        recording = import_file(measured(f"sma_react/cal_sample_1/{load} MPa.txt"))
        write_recording(recording, tmp_path / "nitico")
    found = characterise(tmp_path / "nitico")
    scores = {score.name: score for score in found.scores}
    print("\nNiTiCo cycles, reversible base law:", found.verdict[0], sep="\n")
    for name, score in scores.items():
        print(f"  {name}: RMS {score.metrics['rmse']:.2e}, {score.rms_over_noise:.0f} times the noise")
    assert found.fit.reduced_chi_square > 10.0  # the loops have a width, the law has none
    assert found.fit.inflation > 3.0 and any("does not fit these recordings" in sentence for sentence in found.verdict)
    loop = scores["200_MPa"]
    assert 5e-4 < loop.metrics["rmse"] < 1e-2
    assert -30.0 < found.parameters["T_mid"].value < 15.0  # the cycles span -70 to 30 degC


def test_noise_of_the_temperature_counts_where_strain_follows_it(wire):
    """Weights are those of the strain's own noise with the temperature's times the slope of strain over it."""
    for rows, found in zip(wire.fit.rows, wire.fit.predict(), strict=True):
        clean, weight = (np.asarray(w["strain"]) for w in (rows.extra["clean"], rows.weight))
        slope = np.gradient(found["strain"], rows.inputs["temperature"])
        expected = 1.0 / np.sqrt(1.0 + (clean * slope * float(rows.extra["sigma"]["temperature"])) ** 2)
        np.testing.assert_allclose(weight / clean, expected, atol=0.1)
    assert np.min(weight / clean) < 0.7  # of the heaviest load


def test_one_error_of_a_constant_is_shown_at_every_place(tube):
    """The figure of what is known, and the material's table, had the errors of the fit alone."""
    from matplotlib.container import ErrorbarContainer

    from fitting.calibrate.general.tables import tables
    from fitting.report.general.figures import pictures
    from pneusma_jax.units import to_si

    wide = dataclasses.replace(tube.lasting, variance=9.0 * np.ones_like(tube.lasting.variance), side_variances={})
    result = dataclasses.replace(tube, lasting=wide, profiles={})
    assert result.parameters["silicone_stiffness__1"].sd == pytest.approx(3.0 * tube.fitted["silicone_stiffness__1"].standard_error)
    entries = [entry for entry in result.fitted.values() if entry.prior is not None]
    bars = [c for c in pictures(result)["parameters"].figure.axes[0].containers if isinstance(c, ErrorbarContainer)]
    assert len(bars) == len(entries) > 2
    for bar, entry in zip(bars, entries, strict=True):
        ((low, high),) = (segment[:, 0] for segment in bar.lines[2][0].get_segments())
        quoted = result.parameters[entry.name]
        assert 0.5 * (high - low) * entry.prior.sd == pytest.approx(to_si(quoted.sd, quoted.unit, difference=True))
    errors = [result.parameters[f"silicone_stiffness__{k}"].sd for k in (1, 2)]
    assert tables(result)["material.toml"].quantities["silicone_stiffness"].prior.sd > 0.9 * np.hypot(*errors) / 2.0
