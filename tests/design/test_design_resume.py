"""Studies that are killed end with the same bytes."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from study_files import write_study

ROOT = Path(__file__).resolve().parents[2]


def begin(study: Path, out: Path) -> subprocess.Popen:
    command = [sys.executable, "-m", "fitting.cli", "design", str(study), "--out", str(out)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def end(process: subprocess.Popen) -> None:
    _, errors = process.communicate(timeout=500)
    assert process.returncode == 0, errors.decode()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def killed_and_resumed(study: Path, out: Path, kills: int, seed: int, whole: int) -> int:
    """Kill a study when its file of evaluations has grown past random sizes; how many kills hit it alive."""
    chance, hits = random.Random(seed), 0
    log = out / "evaluations.jsonl"
    for size in sorted(chance.randrange(200, whole) for _ in range(kills)):
        process = begin(study, out)
        while process.poll() is None and not (log.exists() and log.stat().st_size >= size):
            time.sleep(0.001)
        time.sleep(chance.random() * 0.02)
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            hits += 1
        process.communicate()
        if process.returncode == 0:
            break
    if not (out / "report.json").exists():
        end(begin(study, out))
    return hits


@pytest.mark.slow
@pytest.mark.parametrize(("kills", "seed"), [(1, 1), (10, 2)])
def test_a_killed_study_ends_with_the_same_bytes(kills, seed, tmp_path):
    study = write_study(tmp_path)
    end(begin(study, tmp_path / "whole"))
    expected = contents(tmp_path / "whole")
    size = len(expected["evaluations.jsonl"])
    hits = killed_and_resumed(study, tmp_path / "killed", kills, seed, size)
    assert hits == kills  # every kill hit a study that was running
    assert contents(tmp_path / "killed") == expected
