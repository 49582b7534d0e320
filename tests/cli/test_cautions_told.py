"""Files whose numbers are not to be trusted: every command that reads one says so, once."""

import warnings
from importlib import resources
from pathlib import Path

import pytest

from fitting.inference.progress import Steps
from fitting.specimens.saved_models import AugmentedModel, load_model
from fitting.specimens.saved_models.files import render_model
from pneusma_jax import program_cache
from pneusma_jax.calibration import load_calibration
from pneusma_jax.errors import DISTRUSTED, Distrusted, InputError

ALLOY = Path(str(resources.files("calibration_data"))) / "krl35.toml"
WHY = "The law does not fit these tests."


@pytest.fixture
def alloy(tmp_path):
    """A table of an alloy whose law did not fit."""
    path = tmp_path / "alloy.toml"
    path.write_text(ALLOY.read_text().replace('kind = "alloy"\n', f'kind = "alloy"\ncaution = "{WHY}"\n'))
    return path


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "augmented.toml"
    path.write_text(render_model(AugmentedModel(tables={"design": "pneusma2"}, caution=WHY)))
    return path


def test_a_table_and_a_model_warn_when_they_are_read(alloy, model):
    for read, path in ((load_calibration, alloy), (load_model, model)):
        with pytest.warns(Distrusted) as told:
            found = read(path)
        assert [str(one.message) for one in told] == [f"{path}: {DISTRUSTED}. {WHY}"]
        assert WHY in (found.caution if path is model else found.text["caution"])


def test_a_table_without_a_caution_does_not():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "caution" not in load_calibration("krl35").text


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "--design", "pneusma2", "--pressure-kPa", "10", "--alloy", "ALLOY"],
        ["simulate", "--pressure-kPa", "10", "--model", "MODEL"],
        ["invert", "--curvature-1pm", "10", "--alloy", "ALLOY"],
        ["invert", "--curvature-1pm", "10", "--model", "MODEL"],
        ["control", "--model", "MODEL", "--out", "out"],
        ["workspace", "--model", "MODEL", "--out", "out"],
        ["plan", "ALLOY", "--out", "out"],
        ["characterise", "SPRING", "--base", "ALLOY", "--out", "out"],
        ["characterise", "SPRING", "--model", "MODEL", "--out", "out"],
        ["diagnose", "SPRING", "--alloy", "ALLOY", "--out", "out"],
        ["diagnose", "SPRING", "--model", "MODEL", "--out", "out"],
        ["posterior", "SPRING", "--model", "MODEL", "--out", "out"],
    ],
    ids=lambda words: f"{words[0]} {[w for w in words if w.isupper()][-1]}",
)
def test_every_command_that_reads_such_a_file_says_so_once(run, tmp_path, monkeypatch, alloy, model, command):
    """The commands end where they begin to compute, after their files were read."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(program_cache._Cached, "__call__", stopped)
    if command[0] != "invert":  # which says its only step before
        monkeypatch.setattr(Steps, "__call__", stopped)
    spring = str(Path(str(resources.files("calibration_data"))) / "examples" / "spring")
    result = run(*({"ALLOY": str(alloy), "MODEL": str(model), "SPRING": spring}.get(word, word) for word in command))
    notes = [line for line in result.stderr.splitlines() if DISTRUSTED in line]
    assert len(notes) == 1 and notes[0].startswith("note: ") and notes[0].endswith(WHY), result.stderr


def stopped(*given, **named):
    raise InputError("stopped")
