"""Every command has an example in docs/commands.md, every example runs as it is printed, no figure is cut."""

import re
import shlex
from pathlib import Path

import pytest
from borders import cut_at, cut_pictures
from matplotlib.figure import Figure

from fitting.cli import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
PAGE, DESIGN = ROOT / "docs" / "commands.md", ROOT / "docs" / "design.md"
BAND = ROOT / "calibration_data" / "examples" / "studies" / "pneusma2_band.toml"
RAW = "Sample A\nTime (s),Strain (%),Stress (kPa)\n" + "".join(f"{k},{2 * k},{3.0 * k}\n" for k in range(20))


def examples() -> list[tuple[str, bool]]:
    """Commands of the page in order, and whether each takes longer than a test in `make test` may."""
    found, long = [], False
    for block in re.finditer(r"^## |<!-- long -->|```\n(.*?)```", PAGE.read_text(), flags=re.S | re.M):
        if block[1] is None:
            long = block[0] == "<!-- long -->"
        else:
            found += [(line, long) for line in block[1].splitlines() if line.startswith("pneusma ")]
    return found


def run_all(run, commands) -> None:
    Path("RAW.csv").write_text(RAW)
    Path("my_study.toml").write_text(re.search(r"```toml\n(.*?)```", DESIGN.read_text(), flags=re.S)[1])
    Path("my_band.toml").write_text(
        BAND.read_text().replace("rows = 20000", "rows = 256").replace("chunk = 10000", "chunk = 128")
    )
    for command in commands:
        result = run(*shlex.split(command)[1:])
        assert result.exit_code == 0, f"{command}\n{result.output}\n{result.stderr}"


def test_every_command_has_an_example():
    named = {command.split()[1] for command, _ in examples()}
    assert named == set(COMMANDS)


def test_the_short_examples_run(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = [command for command, long in examples() if not long]
    assert len(short) >= 8
    run_all(run, short)
    assert (tmp_path / "my_import" / "RAW.csv").exists()


@pytest.mark.slow
def test_all_examples_run(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_all(run, [command for command, _ in examples()])
    pictures = list(tmp_path.rglob("*.png"))
    assert len(pictures) > 15
    assert not cut_pictures(tmp_path)


@pytest.mark.parametrize(("place", "borders"), [(0.5, []), (1.0, ["right"]), (0.0, ["left"])])
def test_text_that_is_cut_at_a_border_is_seen(tmp_path, place, borders):
    figure = Figure(figsize=(2, 1))
    figure.text(place, 0.5, "stress [kPa]", ha="center", va="center")
    figure.savefig(tmp_path / "a.png")
    assert cut_at(tmp_path / "a.png") == borders


@pytest.mark.slow
def test_the_figure_of_an_effect_is_not_cut(run, tmp_path):
    result = run("effects", "mullins_softening", "--plot", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    assert list((tmp_path / "out").glob("*.png")) and not cut_pictures(tmp_path)
