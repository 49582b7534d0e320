"""Two runs into one folder: the second is told so at once, and a killed run holds nothing."""

import signal
import subprocess
import sys
import time

import click
import pytest

from fitting.cli import COMMANDS, main
from fitting.cli._lock import SHARED, held, locked

HOLD = """
import sys, time
from pathlib import Path
from fitting.cli._lock import held
with held(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def other_run(tmp_path):
    """Another process that holds a folder."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path / "out")], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def test_a_second_run_into_the_same_folder_is_refused_in_one_line(other_run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the same folder, however it is written
    with pytest.raises(click.ClickException, match=rf"another run is writing.*process {other_run.pid}"):
        with held(tmp_path.joinpath("out").relative_to(tmp_path)):
            pass
    with held(tmp_path / "another"):
        pass


def test_a_killed_run_leaves_the_folder_free(other_run, tmp_path):
    other_run.send_signal(signal.SIGKILL)
    other_run.wait()
    time.sleep(0.05)
    with held(tmp_path / "out"):
        pass


def test_a_command_is_refused_while_another_run_holds_its_folder(other_run, refused, tmp_path):
    line = refused("effects", "mullins_softening", "--plot", "--out", tmp_path / "out")
    assert "another run is writing results here" in line


def test_the_refusal_names_the_folder_as_it_is_written(refused, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    process = subprocess.Popen([sys.executable, "-c", HOLD, "Out"], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"held\n"
    try:
        assert "Out: another run is writing" in refused("effects", "mullins_softening", "--plot", "--out", "Out")
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_with_a_folder_of_results_holds_it(name):
    command = main.get_command(click.Context(main), name)
    wants = name not in SHARED and any(parameter.name == "out" for parameter in command.params)
    assert getattr(command.callback, "holds_folder", False) == wants
    assert locked(command, name).callback is command.callback  # once is enough
