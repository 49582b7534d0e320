"""Files in the shapes of what laboratories publish, made for this purpose: each gives what is right, or asks for it."""

import numpy as np
import pytest

from fitting.data.importers import import_tests, make_options
from fitting.data.recordings import read_campaign
from fitting.specimens import WIRE
from pneusma_jax.errors import InputError


def modulus(recording):
    """Neo-Hookean modulus by least squares [kPa]."""
    stretch = 1.0 + recording.columns["strain"]
    shape = stretch - stretch**-2
    return float(shape @ recording.columns["stress_kPa"] / (shape @ shape))


@pytest.fixture
def field(shared):
    """Finds one of the files, or skips."""

    def find(name):
        if not (shared / "field" / name).exists():
            pytest.skip(f"no {name} in {shared / 'field'}")
        return shared / "field" / name

    return find


def test_a_puck_pressed_by_a_machine_that_counts_down(field, follow):
    args = (field("compression_positive/puck.csv"), "--dimension", "gauge_length_mm=10", "--dimension", "diameter_mm=20")
    output, _ = follow(*args)
    assert "only stiffens" in output and "--compression" in output
    _, (recording,) = follow(*args, "--compression")
    assert modulus(recording) == pytest.approx(200.0, rel=0.01) and recording.columns["strain"].min() == pytest.approx(-0.3)


@pytest.mark.parametrize(
    ("file", "option", "column"),
    [("dead_weight.csv", "stress_MPa=300", "stress_MPa"), ("room_temperature_pull.csv", "temperature_degC=22", "temperature_degC")],
)
def test_the_two_standard_tests_of_shape_memory_laboratories(field, follow, file, option, column):
    path = field(f"constant_channel/{file}")
    assert f"--constant {column}=..." in follow(path)[0]
    _, (recording,) = follow(path, "--constant", option)
    assert recording.kind == "wire" and np.ptp(recording.columns[column]) == 0.0
    rows = WIRE.rows_for(read_campaign(recording.path))  # what characterise and diagnose begin with
    assert len(rows) == 1 and len(rows[0].time) == len(recording)


def test_a_map_does_not_lose_the_clock(field):
    options = make_options(kind="actuator", columns=["pressure=Pressure command (kPa)"])
    (recording,) = import_tests(field("map_drops_clock/angle.csv"), options)
    assert recording.columns["time_s"][[0, -1]].tolist() == [0.0, 6.0] and recording.columns["bend_angle_deg"][-1] == 60.0


def test_percent_without_unit(field, follow):
    path = field("percent_without_unit/pct_nounit.csv")
    message, _ = follow(path)
    _, (recording,) = follow(path, *follow.options_in(message)[:2])
    assert modulus(recording) == pytest.approx(300.0, rel=1e-4)


def test_factors_on_what_is_made(field):
    path = field("scale_ignored/press.csv")
    named = {"kind": "elastomer", "dimensions": ["gauge_length_mm=10", "area_mm2=100"]}
    (recording,) = import_tests(path, make_options(**named, scales=["strain=-1", "stress=-1"]))
    assert modulus(recording) == pytest.approx(200.0, rel=1e-3) and recording.columns["stress_kPa"].min() == pytest.approx(-268.16)
    for wrong in ({"scales": ["resistance=-1"]}, {"units": ["pressure=kPa"]}):
        with pytest.raises(InputError, match="is one of these meant"):
            import_tests(path, make_options(**named, **wrong))


@pytest.mark.parametrize(("file", "moduli"), [("three_sheets", [300, 360, 330]), ("param_then_data", [300, 360])])
def test_no_sheet_is_dropped(field, file, moduli):
    recordings = import_tests(field(f"sheets_dropped/{file}.xlsx"))
    assert [round(modulus(recording), 3) for recording in recordings] == moduli
    if file == "param_then_data":
        assert any("'Parameters' states sizes: Gauge length 50 mm; Width 6 mm" in text for text in recordings[0].notices)


def test_slack_and_a_zero(field, follow):
    path = field("slack_offset/slack.csv")
    output, (seen,) = follow(path)
    assert "flat at 4.0" in output and "up to strain 0.050" in output and modulus(seen) != pytest.approx(120.0, rel=0.05)
    _, (recording,) = follow(path, "--slack", "auto")
    assert modulus(recording) == pytest.approx(120.0, rel=0.002)
