"""A spring whose resistance nobody measured: its constants from force, elongation and temperature."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

import pneusma_jax as pj
from fitting.calibrate.registry import specimen_in
from fitting.characterise import characterise
from fitting.cli import main
from fitting.data.recordings import read_campaign
from fitting.specimens import BY_TEMPERATURE, SPRING
from fitting.specimens.spring_by_temperature import ELECTRICAL

NOISE = 0.004  # N
SIDECAR = """kind = "spring"
specimen = "S"
real = false
[geometry]
alloy = "{alloy}"
wire_diameter_mm = 0.25
mandrel_diameter_mm = 0.9
initial_pitch_mm = 0.269
active_coils = 52.0
[noise]
force_N = 0.004
[tolerance]
G_m = 0.05
G_a = 0.05
"""
ROWS = 60


def write(folder, tests, alloy="krl35", resistance=False, seed=1):
    """A spring of krl35, in files: elongation [m] and temperature [degC] of every test by name."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    shape = pj.SpringGeometry(
        wire_diameter=0.25e-3, mandrel_diameter=0.9e-3, initial_pitch=0.269e-3, active_coils=52.0, free_length=52 * 0.269e-3
    )
    spring = pj.Spring(shape, pj.load_alloy("krl35"), shape.free_length)
    for name, (elongation, temperature) in tests.items():
        rows = pj.simulate_spring(spring, jnp.asarray(elongation), pj.Temperature(jnp.asarray(temperature))).rows
        columns = {
            "time_s": np.arange(len(elongation)) * 0.5,
            "elongation_mm": elongation * 1e3,
            "force_N": np.asarray(rows.force) + NOISE * rng.standard_normal(len(elongation)),
            "temperature_degC": temperature,
        } | ({"resistance_ohm": np.asarray(rows.resistance)} if resistance else {})
        lines = [",".join(f"{x:.6g}" for x in row) for row in zip(*columns.values(), strict=True)]
        (folder / f"{name}.csv").write_text(",".join(columns) + "\n" + "\n".join(lines) + "\n")
        (folder / f"{name}.toml").write_text(SIDECAR.format(alloy=alloy))
    return folder


def stand():
    up = np.r_[np.linspace(0.0, 40e-3, ROWS), np.linspace(40e-3, 0.0, ROWS)]
    heat = np.r_[np.linspace(20.0, 60.0, ROWS), np.linspace(60.0, 20.0, ROWS)]
    return {
        "cold": (up, np.full(2 * ROWS, 20.0)),
        "hot": (up, np.full(2 * ROWS, 60.0)),
        "heated": (np.full(2 * ROWS, 30e-3), heat),
    }


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return characterise(write(tmp_path_factory.mktemp("spring") / "stand", stand()), starts=1)


def test_moduli_and_curve_over_temperature_come_out_again(found):
    for name, true in (("G_m", 3.0), ("G_a", 8.25), ("T_mid", 31.0), ("T_width", 2.5)):
        estimate = found.parameters[name]
        assert abs(estimate.value - true) < 4.0 * estimate.sd, name
    assert found.parameters["T_mid"].sd < 0.1
    assert 0.7 < found.fit.reduced_chi_square < 1.3


def test_the_report_says_what_a_resistance_would_have_told(found):
    report = found.report()
    assert "No resistance was recorded" in found.verdict[1]
    assert "What a resistance would have told" in report and "rho_span" in report
    assert not set(ELECTRICAL) & set(found.parameters)
    scores = {score.name: score.x_column for score in found.scores}
    assert scores == {"cold": "elongation_mm", "hot": "elongation_mm", "heated": "temperature_degC"}


def test_the_alloy_is_written_with_what_was_found(found, tmp_path):
    files = {path.name for path in found.save(tmp_path / "out")}
    assert {"alloy.toml", "report.json", "fit.png"} <= files
    alloy = pj.load_alloy(str(tmp_path / "out" / "alloy.toml"))
    assert float(alloy.T_mid) == pytest.approx(found.parameters["T_mid"].value, rel=1e-6)
    assert "T_mid" in json.loads((tmp_path / "out" / "report.json").read_text())["parameters"]


def test_an_unknown_alloys_curve_begins_where_the_pull_is_half_way(tmp_path):
    campaign = read_campaign(write(tmp_path / "new", stand(), "fit"))
    parameters = BY_TEMPERATURE.parameters_for(campaign)
    assert parameters["T_mid"].value == pytest.approx(31.0, abs=3.0)
    assert {"beta_1", "G_m", "T_width"} <= set(parameters) and "rho_mean" not in parameters


def test_a_spring_with_resistance_goes_the_usual_way(tmp_path):
    only = {"cold": stand()["cold"]}
    assert specimen_in(read_campaign(write(tmp_path / "with", only, resistance=True))) is SPRING
    assert specimen_in(read_campaign(write(tmp_path / "without", only))) is BY_TEMPERATURE


@pytest.mark.parametrize(("command", "said"), [("diagnose", "no resistance_ohm"), ("characterise", "resistance_ohm, temperature_degC")])
def test_what_cannot_be_used_is_refused_in_one_line(tmp_path, command, said):
    folder = write(tmp_path / "spring", {"cold": stand()["cold"]})
    if command == "characterise":  # neither tells the phase
        table = [line.rsplit(",", 1)[0] for line in (folder / "cold.csv").read_text().splitlines()]
        (folder / "cold.csv").write_text("\n".join(table) + "\n")
    run = CliRunner().invoke(main, [command, str(folder), "--out", str(tmp_path / "out")])
    assert run.exit_code == 2 and said in run.output and not (tmp_path / "out").exists()
