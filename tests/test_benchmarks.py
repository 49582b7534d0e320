"""The benchmark of the core runs, and leaves what it says."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.slow
def test_a_tiny_run_leaves_table_figures_and_plot(tmp_path):
    command = [sys.executable, "-m", "benchmarks.core_speed", "--tiny", "--only", "coupon", "nelder_mead"]
    done = subprocess.run([*command, "--out", tmp_path], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "core_speed.json").read_text())
    (coupon,), (simplex,) = found["cases"]["coupon"], found["cases"]["nelder_mead"]
    assert coupon["size"] == 100 and coupon["programs"] > 0 and coupon["compile_s"] > 0.0
    assert coupon["peak_MB"] >= coupon["before_MB"] > 0.0
    assert simplex["programs"] == 0 and simplex["row_us"] > 0.0
    assert found["machine"]["versions"]["jax"]
    assert done.stdout == (tmp_path / "core_speed.txt").read_text() + "\n"
    assert "Nelder-Mead, NumPy residual" in done.stdout
    assert (tmp_path / "core_speed.png").read_bytes().startswith(b"\x89PNG")
