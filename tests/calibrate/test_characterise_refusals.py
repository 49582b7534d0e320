"""What cannot be used ends in one line that says where and what would be right, and nothing is written."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.calibrate import characterise
from fitting.cli import main
from fitting.data.publish import publish
from fitting.data.recordings import read_campaign, write_recording
from fitting.specimens import SPECIMENS
from fitting.synthesise.elastomer import simulate_pulls, true_law
from pneusma_jax.errors import InputError


@pytest.fixture
def folder(tmp_path):
    for recording in simulate_pulls(true_law(), samples=40)[0]:
        write_recording(recording, tmp_path / "campaign")
    return tmp_path / "campaign"


@pytest.fixture
def refused(tmp_path):
    def check(*arguments):
        out = tmp_path / "out"
        result = CliRunner().invoke(main, ["characterise", *map(str, arguments), "--out", str(out)])
        lines = result.stderr.splitlines()
        assert result.exit_code == 2, result.output
        assert len(lines) == 1 and result.stdout == "", result.output
        assert not out.exists() or not any(out.iterdir())
        assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
        return lines[0]

    return check


def test_a_bad_number_names_file_row_and_column(folder, refused):
    file = folder / "pull_2.csv"
    lines = file.read_text().splitlines()
    lines[7] = lines[7].replace(lines[7].split(",")[1], "abc", 1)
    file.write_text("\n".join(lines) + "\n")
    line = refused(folder)
    assert "pull_2.csv" in line and "row 8" in line and "strain" in line and "abc" in line


def test_a_missing_campaign(tmp_path, refused):
    assert "there is no such file or folder" in refused(tmp_path / "nowhere")


def test_only_validation(folder, refused):
    for file in folder.glob("pull_*.toml"):
        file.write_text(file.read_text().replace('role = "fit"', 'role = "validation"'))
    assert 'role = "fit" is needed' in refused(folder)


def test_too_few_rows_below_max_strain(folder, refused):
    assert "1 usable row up to strain 0.05, but a curve needs 12" in refused(folder, "--max-strain", "0.05")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--law", "neohook"), "neohook"),
        (("--max-strain", "-1"), "must be more than 0"),
        (("--law", "gent", "--terms", "2"), "Ogden"),
        (("--terms", "7"), "7"),
        (("--fix", "p_5"), "NAME=VALUE"),
        (("--fix", "q=1"), "no law has a constant 'q'"),
        (("--fix", "p_55=0"), "no law has a constant 'p_55', did you mean 'p_5'"),
        (("--law", "neo_hookean", "--fix", "c_30=1"), "neo_hookean has no constant 'c_30' (yeoh has); it has mu"),
        (("--law", "gent", "--fix", "c_10=1"), "gent has no constant 'c_10'"),
        (("--law", "ogden", "--terms", "1", "--fix", "alpha_2=2"), "ogden_1 has no constant 'alpha_2'"),
        (("--law", "yeoh", "--fix", "c_10=1", "--fix", "p_5=0"), "yeoh has no constant 'p_5'"),
    ],
)
def test_options(folder, refused, options, words):
    assert words in refused(folder, *options)


def test_a_test_that_does_not_move(folder, refused):
    file = folder / "pull_1.csv"
    head, *rows = file.read_text().splitlines()[1:]
    rows = [",".join([row.split(",")[0], "0.1", row.split(",")[2]]) for row in rows]
    file.write_text("\n".join([head, *rows]) + "\n")
    line = refused(folder)
    assert "pull_1.csv" in line and "column strain" in line


def test_a_kind_without_a_specimen(tmp_path, refused, monkeypatch):
    monkeypatch.delitem(SPECIMENS, "tube")
    file = tmp_path / "campaign" / "inflation.csv"
    file.parent.mkdir()
    file.write_text("time_s,pressure_kPa,length_mm\n" + "".join(f"{k},{k},{50 + k}\n" for k in range(20)))
    line = refused(file)
    assert "kind tube" in line and "elastomer" in line


def test_several_kinds_together(folder, refused):
    (folder / "inflation.csv").write_text(
        "time_s,pressure_kPa,length_mm\n" + "".join(f"{k},{k},{50 + k}\n" for k in range(20))
    )
    assert "one kind at a time" in refused(folder)


@pytest.mark.slow
def test_results_are_not_replaced_without_force(folder, tmp_path):
    out = tmp_path / "out"
    runner = CliRunner()
    arguments = ["characterise", str(folder), "--out", str(out), "--law", "neo_hookean"]
    first = runner.invoke(main, arguments)
    assert first.exit_code == 0, first.output
    assert "Verdict" in first.stdout and "report.html" in first.stdout
    before = (out / "report.json").read_bytes()
    second = runner.invoke(main, [*arguments, "--max-strain", "1"])
    assert second.exit_code == 2 and "--force" in second.stderr
    assert (out / "report.json").read_bytes() == before
    third = runner.invoke(main, [*arguments, "--force", "--max-strain", "1"])
    assert third.exit_code == 0 and (out / "report.json").read_bytes() != before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["campaign", "out"]


def test_a_writer_that_fails_leaves_nothing(tmp_path):
    def broken():
        raise RuntimeError("half way")

    with pytest.raises(RuntimeError):
        publish(tmp_path / "out", broken, force=False)
    with pytest.raises(InputError, match="cannot be written"):
        publish(tmp_path / "out", {"a.txt": "whole", "x" * 300: "a name too long for a disk"}, force=False)
    with pytest.raises(InputError, match="cannot be the name"):
        publish(tmp_path / "out", {"a.txt": "whole", "no/such/folder.txt": "x"}, force=False)
    assert list(tmp_path.iterdir()) == []


def test_a_file_where_the_folder_should_be(folder, tmp_path):
    (tmp_path / "out").write_text("mine")
    result = CliRunner().invoke(main, ["characterise", str(folder), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2 and "a folder for results is needed" in result.stderr
    assert (tmp_path / "out").read_text() == "mine"


def test_missing_samples_are_left_out_and_said_so(folder):
    campaign = read_campaign(folder)
    first = campaign.recordings[0]
    first.columns["stress_kPa"] = np.where(np.arange(len(first)) == 5, np.nan, first.columns["stress_kPa"])
    result = characterise(campaign, law="neo_hookean")
    assert len(result.samples) == 4 * 40 - 1
    assert any("1 row without strain or stress left out" in notice for notice in result.samples.notices)
    assert np.isfinite(result.best.values).all()


def test_hysteresis_is_warned_of(folder):
    campaign = read_campaign(folder)
    recording = campaign.recordings[0]
    strain = np.concatenate([np.linspace(0, 1, 100), np.linspace(1, 0, 100)])
    stress = 40.0 * strain * np.where(np.arange(200) < 100, 1.1, 0.9)
    loop = dataclasses.replace(
        recording, columns={"strain": strain, "stress_kPa": stress}, noise={}, tolerance={}, name="loop"
    )
    campaign.recordings[:] = [loop]
    text = " ".join(characterise(campaign, law="neo_hookean").report().split())
    assert "loop: stress going up is 20 % higher than coming down" in text


@pytest.mark.parametrize(("option", "key"), [("base", "alloy"), ("material", "material")])
def test_fit_asks_to_identify_what_the_recordings_name(monkeypatch, option, key, folder):
    """As `alloy = "fit"` in the sidecars does; there is no table of that name."""
    from fitting.calibrate import registry

    campaign = read_campaign(folder)
    monkeypatch.setattr(registry, "pipeline_of", lambda _: (lambda given, **options: (given, options), {option}))
    given, options = characterise(campaign, **{option: "fit"})
    assert options == {} and {recording.geometry[key] for recording in given.recordings} == {"fit"}
    assert all(given is not recording for given, recording in zip(given.recordings, campaign.recordings, strict=True))
    given, options = characterise(campaign, **{option: "krl35"})
    assert options == {option: "krl35"} and given is campaign


TUBE = Path(__file__).resolve().parents[2] / "calibration_data" / "examples" / "tube"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--alloy", "krl35"), "option alloy (base) means nothing for recordings of kind tube; it is for spring, wire and actuator"),
        (("--fix", "wall_thickness__1=100"), "'wall_thickness__1': 100 mm is out of bounds; it must lie in 0.88 to 1.12 mm"),
        (("--fix", "silicone_stiffness__1=-2"), "'silicone_stiffness__1': -2 is out of bounds; it must lie in"),
    ],
)
def test_options_of_other_kinds_and_values_out_of_bounds(refused, options, words):
    """They named an option that nobody had written, and bounds in SI without a unit."""
    assert words in refused(TUBE, *options)
