"""One rule for folders of results: a command replaces what it wrote itself with the same options, and nothing else."""

import importlib
import json

import pytest

from fitting.cli import COMMANDS
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
