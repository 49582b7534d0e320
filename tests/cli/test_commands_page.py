"""Every command has an example in docs/commands.md, and every example runs as it is printed."""

import re
import shlex
from pathlib import Path

import pytest

from fitting.cli import COMMANDS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "commands.md"
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
