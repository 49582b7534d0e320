"""The raw files that docs/own_data.md shows, imported by the commands beside them."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest

from fitting.cli import main
from fitting.data.recordings import read_campaign

PAGE = Path(__file__).parents[2] / "docs" / "own_data.md"
SECTION = PAGE.read_text("utf-8").partition("## A file of each kind")[2].partition("\n## ")[0]
EXAMPLE = re.compile(r"```\n\$ head -4 (\S+)\n(.*?)\n\n\$ pneusma (import .*?)\n```", re.S)
COLUMNS = {
    "spring": {"time_s", "elongation_mm", "force_N", "resistance_ohm", "current_A"},
    "wire": {"time_s", "strain", "stress_MPa", "temperature_degC"},
    "tube": {"time_s", "pressure_kPa", "length_mm"},
    "actuator": {"time_s", "pressure_kPa", "resistance_2_ohm", "current_2_A", "curvature_1pm"},
}
FIRST = {
    "spring": ("force_N", -0.88e-3),
    "wire": ("strain", 0.0271 / 40.0),
    "tube": ("pressure_kPa", -0.058),
    "actuator": ("pressure_kPa", 8.017),
}


def examples():
    return {name.removesuffix(".csv"): (name, head, command) for name, head, command in EXAMPLE.findall(SECTION)}


def imported(kind, monkeypatch, folder):
    """The folder that an example's command fills."""
    name, head, command = examples()[kind]
    monkeypatch.chdir(folder)
    Path(name).write_text(head + "\n", "utf-8")
    main(shlex.split(command.replace("\\\n", " ")), standalone_mode=False)
    return Path(f"my_{kind}")


def test_the_page_has_an_example_of_each_kind_but_the_silicone_above():
    assert set(examples()) == set(COLUMNS)


@pytest.mark.parametrize("kind", list(COLUMNS))
def test_an_example_is_read_as_its_kind(kind, monkeypatch, tmp_path):
    [recording] = read_campaign(imported(kind, monkeypatch, tmp_path)).recordings
    assert recording.kind == kind and set(recording.columns) == COLUMNS[kind]
    column, value = FIRST[kind]
    assert recording.columns[column][0] == pytest.approx(value)


def test_the_shared_entries_are_those_of_a_campaign(monkeypatch, tmp_path):
    folder = imported("actuator", monkeypatch, tmp_path)
    text = re.search(r"```\n(title = .*?)```", SECTION, re.S)[1]
    (folder / "campaign.toml").write_text(text, "utf-8")
    [recording] = read_campaign(folder).recordings
    stated = tomllib.loads(text)
    assert recording.geometry["wall_thickness_mm"] == stated["geometry"]["wall_thickness_mm"]
    assert recording.tolerance == stated["tolerance"]
