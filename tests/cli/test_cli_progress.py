"""Commands that may take long say in a log what they do."""

from importlib import resources
from pathlib import Path

import pytest

from fitting.inference.progress import PlainLines
from pneusma_jax.errors import InputError

TUBE = str(Path(str(resources.files("calibration_data"))) / "examples" / "tube")


def stopped(*given, progress=None, **named):
    """The work of a command, which says a step and ends."""
    if progress is not None:
        progress("a step")
    raise InputError("stopped")


@pytest.mark.parametrize(
    ("command", "work", "said"),
    [
        (["invert", "--design", "pneusma2", "--curvature-1pm", "40"], "fitting.invert.Inverse", "solving"),
        (["characterise", TUBE, "--out", "out"], "fitting.calibrate.registry.characterise", "a step"),
        (["plan", "--out", "out"], "fitting.plan.plan_campaign", "a step"),
        (["workspace", "--design", "pneuflex_s", "--out", "out"], "fitting.simulate.workspace.compute_workspace", "states of pneuflex_s"),
        (["reproduce", "--out", "out"], "validation.reproduction.reproduce", "a step"),
    ],
)
def test_a_long_command_says_what_it_does(run, tmp_path, monkeypatch, command, work, said):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(work, stopped)
    lines = []
    monkeypatch.setattr(PlainLines, "say", lambda self, text: lines.append(text))
    result = run(*command)
    assert result.exit_code == 2 and "stopped" in result.stderr and any(said in line for line in lines)
