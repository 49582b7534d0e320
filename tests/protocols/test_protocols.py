"""Protocols: sampled as written, what happens is what the model says, what cannot be is refused."""

import csv
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import pneusma_jax as pj
from fitting.cli import main
from fitting.data.protocols import load_protocol, protocol_examples
from pneusma_jax.serial_chain.chain_files import chain_examples

RAMP = """schema = "pneusma-protocol/1"
name = "ramp"
kind = "actuator"
interval_s = 1.0
repeat = 2
[start]
pressure_kPa = 0.0
xi0_2 = 1.0
[[step]]
duration_s = 4.0
pressure_bar = 0.2
[[step]]
duration_s = 0.0
xi0_2 = 0.5
[[step]]
duration_s = 2.0
pressure_kPa = 0.0
"""


def written(folder, text=RAMP):
    path = folder / "ramp.toml"
    path.write_text(text)
    return path


def simulated(*arguments):
    result = CliRunner().invoke(main, ["simulate", *map(str, arguments)])
    assert result.exit_code == 0, result.output
    return result


def table(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    number = lambda text: float(text) if text.replace(".", "").lstrip("-")[:1].isdigit() else text  # noqa: E731
    return {name: np.array([number(row[name]) for row in rows]) for name in rows[0]}


def test_steps_are_ramps_and_jumps(tmp_path):
    told = load_protocol(written(tmp_path))
    assert told.time.tolist() == list(range(13))
    assert told.channels["pressure"][:7] / 1e3 == pytest.approx([0, 5, 10, 15, 20, 10, 0])
    assert told.channels["xi0_2"][:6].tolist() == [1, 1, 1, 1, 0.5, 0.5]
    # the second round goes on from where the first ended
    assert told.channels["xi0_2"][6:].tolist() == [0.5] * 7


@pytest.mark.parametrize("name", protocol_examples())
def test_every_shipped_protocol_reads(name):
    told = load_protocol(name)
    assert len(told) > 50 and told.description
    assert np.all(np.diff(told.time) > 0.0)


@pytest.mark.slow
def test_a_heated_spring_does_not_return_and_the_second_cycle_closes(tmp_path):
    simulated("--protocol", "thermal_cycle", "--out", tmp_path / "o")
    rows = table(tmp_path / "o" / "model.csv")
    curvature, residual = rows["model_curvature_1pm"], rows["model_gamma_R_2"]
    middle = len(curvature) // 2
    assert curvature[0] == pytest.approx(0.0, abs=1e-9)
    assert curvature[middle] > 15.0
    assert curvature[-1] == pytest.approx(curvature[middle], rel=1e-6)
    assert residual[0] == pytest.approx(0.0938, abs=5e-5)
    assert residual[rows["time_s"] <= 55.0].min() == pytest.approx(0.0047, abs=5e-5)  # first time at 0.4
    assert set(rows["status"]) == {"converged"}
    assert (tmp_path / "o" / "model.png").read_bytes().startswith(b"\x89PNG")


def test_a_tube_is_what_python_says(tmp_path):
    simulated("--protocol", "tube_inflation", "--out", tmp_path / "o")
    rows = table(tmp_path / "o" / "model.csv")
    at = int(np.argmax(rows["pressure_kPa"]))
    wanted = pj.tube_length(40e3, 56e-3, 10e-3, 1e-3, pj.load_silicone())
    assert rows["model_length_mm"][at] == pytest.approx(1e3 * float(wanted), rel=1e-8)


def test_a_spring_test_is_what_python_says(tmp_path):
    simulated("--protocol", "isoresistive", "--design", "pneusma2", "--out", tmp_path / "o")
    rows = table(tmp_path / "o" / "model.csv")
    dimensions = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    spring = pj.Spring(dimensions, pj.load_alloy("krl35"), 14e-3)
    wanted = pj.simulate_spring(spring, 1e-3 * rows["elongation_mm"], pj.Resistance(3.4)).rows
    assert rows["model_force_N"] == pytest.approx(np.asarray(wanted.force), rel=1e-9, abs=1e-12)
    assert rows["model_resistance_ohm"] == pytest.approx(3.4, rel=1e-6)


@pytest.mark.slow
def test_duty_cycle_in_curvature_out(tmp_path):
    text = """schema = "pneusma-protocol/1"
interval_s = 0.1
[supply]
current_A = 0.5
[start]
pressure_kPa = 20.0
duty_2 = 0.1
[[step]]
duration_s = 40.0
"""
    simulated("--protocol", written(tmp_path, text), "--out", tmp_path / "mean")
    simulated(
        "--protocol",
        written(tmp_path, text.replace("[start]", "period_s = 1.0\n[start]")),
        "--out",
        tmp_path / "pulses",
    )
    mean, pulses = (table(tmp_path / which / "model.csv") for which in ("mean", "pulses"))
    assert mean["model_curvature_1pm"][-1] > mean["model_curvature_1pm"][0] + 10.0
    settled = slice(-50, None)  # five periods of the pulses
    assert np.ptp(pulses["model_temperature_2_degC"][settled]) > 0.5
    assert np.mean(pulses["model_temperature_2_degC"][settled]) == pytest.approx(
        np.mean(mean["model_temperature_2_degC"][settled]), abs=0.5
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("pneusma-protocol/1", "pneusma-protocol/7", "pneusma-protocol/7"),
        ("duration_s = 4.0", "duration_s = -4.0", "time cannot go backwards"),
        ("duration_s = 4.0\n", "", "duration_s is missing"),
        (RAMP[RAMP.index("[[step]]") :], "", "empty"),
        ("pressure_kPa = 0.0\nxi0_2", "xi0_2", "[start] needs pressure_kPa"),
        ("pressure_bar", "pressure_ohm", "must be a pressure"),
        ("pressure_bar = 0.2", "presure_kPa = 20.0", "unknown channel"),
        ("pressure_bar = 0.2", 'pressure_bar = "high"', "finite number"),
        ("xi0_2 = 0.5", "xi0_2 = 1.5", "from 0 (hot) to 1 (cold)"),
        ("xi0_2 = 0.5", "xi0_1 = 0.5", "no value in [start]"),
        ("xi0_2 = 1.0", "xi0_2 = 1.0\nresistance_2_ohm = 3.5", "both drive one spring"),
        ("xi0_2 = 1.0", "xi0_2 = 1.0\nxi0_3 = 1.0", "springs that are there are: 1, 2"),
        ("xi0_2 = 1.0", "xi0_2 = 1.0\nduty_1 = 0.5", "[supply] current_A"),
        ("xi0_2 = 1.0", "xi0_2 = 1.0\ncurrent_1_A = 150", "0 to 100 A"),
        ("[start]", "[supply]\ncurrent_A = 150\n[start]", "[supply] current_A must be at most 100, but it is 150"),
        ("xi0_2 = 1.0", "xi0_2 = 1.0\nsegment_3 = {xi0_1 = 1.0}", "this is no chain"),
        ("xi0_2 = 1.0", "xi0_2 = 1.0\nresistance_1_ohm = 30.0", "half to twice the range of alloy 'krl35'"),
        ("interval_s = 1.0", "interval_s = 1e-9", "too many"),
        ("repeat = 2", "repeat = 0", "whole number from 1"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(tmp_path, old, new, words):
    assert old in RAMP
    path = written(tmp_path, RAMP.replace(old, new, 1))
    result = CliRunner().invoke(main, ["simulate", "--protocol", str(path), "--out", str(tmp_path / "o")])
    lines = result.stderr.splitlines()
    assert result.exit_code == 2 and len(lines) == 1, result.output
    assert words in lines[0] and "ramp.toml" in lines[0]
    assert not (tmp_path / "o").exists()


def test_the_pages_name_what_is_shipped():
    docs = Path(pj.__file__).resolve().parents[1] / "docs"
    told, actuators = ((docs / f"{name}.md").read_text() for name in ("protocols", "actuators"))
    assert all(f"`{name}`" in told for name in protocol_examples())
    assert all(f"`{name}`" in actuators for name in chain_examples())
