from collections.abc import Callable
from pathlib import Path

import pytest
from cli_samples import heated_recording
from click.testing import CliRunner, Result

from fitting.cli import main
from fitting.data.recordings import write_recording


@pytest.fixture
def run() -> Callable[..., Result]:
    """`run("simulate", ...)` as the shell would, without a new process."""
    return lambda *arguments: CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture
def refused(run) -> Callable[..., str]:
    """Run what must be refused; returns the one line."""

    def check(*arguments: object) -> str:
        result = run(*arguments)
        lines = result.stderr.splitlines()
        assert result.exit_code == 2, result.output
        assert len(lines) == 1 and lines[0].startswith("pneusma: "), lines
        assert result.stdout == ""
        return lines[0]

    return check


@pytest.fixture
def heated(tmp_path) -> Path:
    return write_recording(heated_recording(), tmp_path / "campaign")
