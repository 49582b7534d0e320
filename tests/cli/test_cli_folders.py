"""One rule for folders of results: a command replaces what it wrote itself with the same options, and nothing else."""

import importlib
import json
from pathlib import Path

import pytest

from fitting.cli import COMMANDS
from fitting.cli._made_by import _text
from fitting.data.publish import RECORD, check_free, publish, running
from pneusma_jax.errors import InputError

STATE = ("simulate", "--design", "pneuflex_s")
TUBE = "time_s,pressure_kPa,length_mm\n" + "".join(f"{k},{k}.0,{56 + 0.1 * k:.2f}\n" for k in range(8))


def refused(result, *words):
    assert result.exit_code == 2 and result.stderr.count("\n") == 1
    assert all(word in result.stderr for word in words), result.stderr


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_same_run_replaces_its_own_results_and_no_other_does(run, tmp_path):
    out = tmp_path / "out"
    first = (*STATE, "--pressure-kPa", 10, "--out", out)
    assert run(*first).exit_code == 0
    before = contents(out)
    assert set(before) == {"state.json", "shape.png", RECORD}
    assert run(*first).exit_code == 0 and contents(out) == before
    other = (*STATE, "--pressure-kPa", 20, "--out", out)
    refused(run(*other), "results are here already, of `pneusma simulate` with other options", "--force")
    refused(run("workspace", "--design", "pneuflex_s", "--out", out), "results are here already, of `pneusma simulate`;")
    assert contents(out) == before
    assert run(*other, "--force").exit_code == 0 and contents(out)["state.json"] != before["state.json"]
    (out / "notes.txt").write_text("mine")
    assert run(*other).exit_code == 0 and (out / "notes.txt").read_text() == "mine"
    (out / "state.json").write_text("{}")
    refused(run(*other), "state.json was changed since it was written")


@pytest.mark.parametrize("arguments", [("workspace", "--design", "pneuflex_s"), (*STATE, "--pressure-kPa", 10)])
def test_a_campaign_and_files_of_the_user_are_kept(run, tmp_path, arguments):
    """A recording that was called model.csv was replaced by the model's answer to it."""
    (tmp_path / "campaign.toml").write_text('title = "mine"\n')
    (tmp_path / "model.csv").write_text(TUBE)
    before = contents(tmp_path)
    refused(run(*arguments, "--out", tmp_path), "campaign.toml is here already, and is not of this run")
    refused(run("simulate", tmp_path / "model.csv", "--out", tmp_path), "campaign.toml is here already")
    refused(run("effects", "mullins_softening", "--plot", "--out", tmp_path), "campaign.toml is here already")
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_with_a_folder_can_be_forced(name):
    module, function, _ = COMMANDS[name]
    names = {one.name for one in getattr(importlib.import_module(module), function).params}
    assert "out" not in names or "force" in names


def test_files_of_nobody_are_not_replaced(tmp_path):
    publish(tmp_path / "out", {"a.csv": "1"}, force=False)
    assert set(contents(tmp_path / "out")) == {"a.csv"}
    with pytest.raises(InputError, match=r"a\.csv is here already, and is not of this run"):
        publish(tmp_path / "out", {"b.csv": "1"}, force=False)
    with running("pneusma x", {}), pytest.raises(InputError, match=r"a\.csv is here already"):
        check_free(tmp_path / "out")


def test_a_later_run_knows_files_of_an_earlier_one(tmp_path):
    with running("pneusma x", {"a": "1"}):
        publish(tmp_path / "out", {"a.csv": "1", "report.json": "{}"}, force=False)
        publish(tmp_path / "out", {"report.json": "{}"}, force=False)
        publish(tmp_path / "out", {"a.csv": "2"}, force=False)
    assert json.loads((tmp_path / "out" / RECORD).read_text())["options"] == {"a": "1"}
    with running("pneusma x", {"a": "2"}), pytest.raises(InputError, match="with other options"):
        check_free(tmp_path / "out")


def test_a_blind_campaign_does_not_say_its_seed(run, tmp_path):
    assert run("synthesise", "tube", "--out", tmp_path / "x", "--seed", 71, "--hide-truth").exit_code == 0
    assert not (tmp_path / "x" / RECORD).exists()


def test_a_file_of_one_name_in_another_folder_is_another_one(run, tmp_path, monkeypatch):
    """The same words in two working folders were the same run: one's results were replaced by the other's."""
    out = tmp_path / "out"
    for number, name in enumerate(("first", "second")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.csv").write_text(TUBE.replace("56.", f"5{6 + number}."))
    monkeypatch.chdir(tmp_path / "first")
    assert run("simulate", "run.csv", "--out", "../out").exit_code == 0
    before = contents(out)
    assert json.loads(before[RECORD])["options"] == {"recording": "../first/run.csv"}
    monkeypatch.chdir(tmp_path / "second")
    refused(run("simulate", "run.csv", "--out", "../out"), "of `pneusma simulate` with other options")
    assert contents(out) == before
    monkeypatch.chdir(tmp_path)
    assert run("simulate", "first/run.csv", "--out", out).exit_code == 0 and contents(out) == before
    (tmp_path / "link").symlink_to(out)
    assert run("simulate", tmp_path / "first" / "run.csv", "--out", "link").exit_code == 0
    assert contents(out) == before


@pytest.mark.parametrize("command", ["diagnose", "characterise-batch"])
def test_a_run_that_goes_on_replaces_no_results_of_another_command(run, tmp_path, command):
    campaigns = [tmp_path / "A", tmp_path / "B"]
    for campaign in campaigns:
        campaign.mkdir()
        (campaign / "run.csv").write_text(TUBE)
    with running("pneusma other", {}):
        publish(tmp_path / "out", {"report.json": "{}"}, force=False)
    before = contents(tmp_path / "out")
    resumed = (command, *campaigns, "--out", tmp_path / "out", "--resume")
    refused(run(*resumed), "results are here already, of `pneusma other`")
    store = tmp_path / "out" / ("diagnosed" if command == "diagnose" else "fitted")
    store.mkdir()
    (store / "0").write_text("")
    refused(run(*resumed), "results are here already, of `pneusma other`")
    store.joinpath("0").unlink(), store.rmdir()
    assert contents(tmp_path / "out") == before


def test_the_name_of_a_shipped_table_is_the_same_from_every_folder(tmp_path, monkeypatch):
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text("")
    here = [_text(value, tmp_path / "out") for value in (Path("wider_pneusma2"), "pneusma2", Path("mine.toml"), ("a", 2.0))]
    assert here == ["wider_pneusma2", "pneusma2", "../mine.toml", "(a, 2.0)"]
    monkeypatch.chdir(tmp_path / "other")
    assert [_text(value, tmp_path / "out") for value in (Path("wider_pneusma2"), "../mine.toml")] == [here[0], here[2]]


def test_a_run_goes_on_with_parts_of_its_own_command(tmp_path):
    with running("pneusma x", {"rows": "1"}):
        publish(tmp_path / "out", {"report.json": "{}"}, force=False)
    with running("pneusma x", {"rows": "2"}):
        check_free(tmp_path / "out", goes_on=True)
        with pytest.raises(InputError, match="with other options"):
            check_free(tmp_path / "out")
