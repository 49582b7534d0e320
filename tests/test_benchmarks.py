"""The benchmark of the core runs, and leaves what it says."""

import argparse
import importlib
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


def test_a_run_of_the_core_goes_on_after_the_cases_that_it_has(tmp_path, monkeypatch):
    speed = importlib.import_module("benchmarks.core_speed")
    asked = []
    monkeypatch.setattr(speed, "child", lambda name, *_, **__: asked.append(name) or [])
    monkeypatch.setattr(speed, "table", lambda found: "")
    monkeypatch.setattr(speed, "plot", lambda found, path: None)
    run = lambda *more: speed.main(["--tiny", "--out", str(tmp_path), "--go-on", *more])  # noqa: E731
    run("--only", "floor")
    run("--only", "floor", "wire")
    assert asked == ["prepare", "floor", "prepare", "wire"]
    assert list(json.loads((tmp_path / "core_speed.json").read_text())["cases"]) == ["floor", "wire"]
    monkeypatch.setattr(speed, "machine", lambda: {"code": "another"})
    with pytest.raises(SystemExit, match="is of code .*, and this is another"):
        run()


def test_overheads_are_told_in_imports_that_load_jax(monkeypatch):
    """A bare import of the package loads no library, so that a ratio to it says nothing."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    overhead = importlib.import_module("command_overhead")
    asked = []
    monkeypatch.setattr(overhead, "twice", lambda *_: ())
    monkeypatch.setattr(overhead, "process", lambda words, *_: asked.append(words))
    overhead.beside("check", ROOT, False)
    (flag, code) = asked.pop()
    loads = f"{code}; import sys; sys.exit('jax' not in sys.modules)"
    assert subprocess.run([sys.executable, flag, loads], cwd=ROOT, check=False).returncode == 0


def test_campaigns_are_counted_once_and_go_on_where_they_ended(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    campaigns = importlib.import_module("campaigns")
    parser = argparse.ArgumentParser()
    campaigns.add_arguments(parser, 4)
    earlier = tmp_path / "earlier.jsonl"
    earlier.write_text('{"seed": 3, "square": 9}\n')
    asked = []

    def campaign(seed):
        asked.append(seed)
        return {"seed": seed, "square": seed**2}

    def run(*options):
        given = parser.parse_args(["--dir", str(tmp_path / "made"), *options])
        return campaigns.campaigns_done(campaign, range(3, 3 + given.campaigns), given, "usual")[:2]

    assert run("--minutes", "0") == ([], 0) and not asked
    assert run("--campaigns", "2") == ([{"seed": 3, "square": 9}, {"seed": 4, "square": 16}], 2)
    done, new = run("--file", str(earlier))
    assert new == 2 and sorted(entry["seed"] for entry in done) == [3, 4, 5, 6] and asked == [3, 4, 5, 6]
    assert run("--report", "--campaigns", "9") == (done, 0)
