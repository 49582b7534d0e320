"""Chunks are the same wherever, whenever and in whatever order they are computed, and survive a kill."""

import errno
import hashlib
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from click.testing import CliRunner
from study_texts import ISHIGAMI, PLAIN

from fitting.cli import main
from fitting.propagate import build_problem, propagate, read_study
from fitting.propagate.chunk import ChunkJob, compute_chunk, prepare
from pneusma_jax.errors import InputError

SMALL = PLAIN + "\n[sampling]\nrows = 1000\nchunk = 300\n"


def contents(folder):
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted((folder / "chunks").iterdir())}


@pytest.mark.parametrize("method", ["monte_carlo", "sobol", "latin_hypercube"])
@pytest.mark.parametrize("indices", ["", '\n[indices]\nkind = "sobol"\n', '\n[indices]\nkind = "shapley"\n'])
def test_a_chunk_can_be_computed_alone_and_in_any_order(write, method, indices):
    text = ISHIGAMI + f'\n[sampling]\nrows = 2000\nchunk = 500\nmethod = "{method}"\n' + indices
    problem = build_problem(read_study(write(text)))
    job = prepare(problem)
    forwards = [job(k) for k in range(len(problem.tasks))]
    backwards = [job(k) for k in reversed(range(len(problem.tasks)))]
    assert forwards == backwards[::-1]
    assert len(set(forwards)) == len(forwards), "no two chunks are the same"


def test_a_sobol_study_in_chunks_has_the_points_of_the_whole_sequence(write):
    from scipy.stats import qmc

    problem = build_problem(read_study(write(SMALL)))
    parts = [problem.sampler().points(k, size) for k, size in enumerate((300, 300, 300, 100))]
    sequence = qmc.Sobol(2, scramble=True, rng=np.random.default_rng(0))
    whole = np.concatenate([sequence.random(1), sequence.random(999)])
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_a_latin_hypercube_has_a_point_in_every_layer_of_its_chunk(write):
    text = SMALL.replace("[sampling]", '[sampling]\nmethod = "latin_hypercube"')
    points = build_problem(read_study(write(text))).sampler().points(1, 300)
    assert np.all(np.sort((points * 300).astype(int), axis=0) == np.arange(300)[:, None])


def test_inputs_have_their_distributions_and_correlation(write):
    text = SMALL.replace("rows = 1000\nchunk = 300", "rows = 40000\nchunk = 40000")
    text += '\n[[correlation]]\nbetween = ["a", "b"]\nvalue = 0.6\n'
    problem = build_problem(read_study(write(text)))
    summary, y, _ = compute_chunk(problem, problem.sampler(), 0)
    assert y.mean() == pytest.approx(1.0, abs=0.02)
    assert y.var() == pytest.approx(0.25 + 4.0 + 2 * 2 * 0.6 * 0.5, rel=0.02)
    expected = (0.5 + 2 * 0.6) / np.sqrt(5.45), (2.0 + 0.6 * 0.5) / np.sqrt(5.45)
    np.testing.assert_allclose(summary.correlation.coefficients[:, 0], expected, atol=0.01)


def test_another_process_computes_the_same_bytes_from_the_study_alone(write):
    path = write(SMALL)
    problem = build_problem(read_study(path))
    here = prepare(problem)(2)
    code = (
        "import pickle, sys; job = pickle.loads(sys.stdin.buffer.read());"
        " sys.stdout.buffer.write(job(2))"
    )
    import pickle

    job = pickle.dumps(ChunkJob(problem.study, problem.fingerprint))
    done = subprocess.run([sys.executable, "-c", code], input=job, capture_output=True, check=True)
    assert done.stdout == here


def test_a_finished_study_needs_resume_or_force(write, tmp_path):
    path, out = write(SMALL), tmp_path / "out"
    first = propagate(path, out)
    assert first.computed == 1000
    with pytest.raises(InputError, match="begun here.*--resume"):
        propagate(path, out)
    again = propagate(path, out, resume=True)
    assert again.computed == 0 and again.summary.moments.mean == first.summary.moments.mean
    assert propagate(path, out, force=True).computed == 1000


def test_chunks_of_another_study_are_not_mixed_in(write, tmp_path):
    out = tmp_path / "out"
    propagate(write(SMALL), out)
    with pytest.raises(InputError, match="another study"):
        propagate(write(SMALL.replace("2*b", "3*b")), out, resume=True)
    (out / "study.json").write_text("{")
    with pytest.raises(InputError, match="no manifest"):
        propagate(write(SMALL), out, resume=True)


def test_more_rows_are_added_to_those_that_are_there(write, tmp_path):
    out = tmp_path / "out"
    propagate(write(SMALL), out)
    more = SMALL.replace("rows = 1000", "rows = 2000")
    result = propagate(write(more), out, resume=True)
    assert result.computed == 2000 - 900, "whole chunks stay, the last one was no whole one"
    whole = propagate(write(more), tmp_path / "fresh")
    assert whole.summary.moments.mean == result.summary.moments.mean
    assert whole.summary.sketches == result.summary.sketches


def test_a_damaged_chunk_is_named(write, tmp_path):
    path, out = write(SMALL), tmp_path / "out"
    propagate(path, out)
    chunk = next((out / "chunks").iterdir())
    chunk.write_bytes(chunk.read_bytes()[:100])
    with pytest.raises(InputError, match=rf"{chunk.name}: cannot be read as a chunk of a study"):
        propagate(path, out, resume=True)


def test_the_summary_alone_can_be_kept(write, tmp_path):
    kept = propagate(write(SMALL), tmp_path / "all")
    sums = propagate(write(SMALL + 'keep = "summary"\n'), tmp_path / "sums")
    assert sums.summary.moments.mean == kept.summary.moments.mean
    size = lambda name: sum(p.stat().st_size for p in (tmp_path / name / "chunks").iterdir())  # noqa: E731
    assert size("sums") < size("all")


def test_force_leaves_nothing_of_the_study_that_was_there(write, tmp_path):
    out = tmp_path / "out"
    propagate(write(SMALL), out)
    for name in ("report.json", "band_other.png", "indices.csv"):
        (out / name).write_text("old")
    (out / "notes.txt").write_text("mine")
    propagate(write(SMALL.replace("2*b", "3*b")), out, force=True)
    assert sorted(p.name for p in out.iterdir()) == ["chunks", "notes.txt", "study.json"]


def command(path, out, *options):
    code = "from fitting.cli import main; main()"
    return [sys.executable, "-c", code, "propagate", str(path), "--out", str(out), "--devices", "1", *options]


@pytest.fixture
def slow(write):
    """A study of 24 chunks whose rows take a while."""
    text = ISHIGAMI + "\n[sampling]\nrows = 24000\nchunk = 1000\n[indices]\n"
    return write(text)


@pytest.mark.slow
def test_killed_ten_times_and_resumed_it_leaves_the_same_bytes(slow, tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    subprocess.run(command(slow, whole), check=True, capture_output=True)
    for kill in range(10):
        with subprocess.Popen(
            command(slow, broken, "--resume"), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        ) as process:
            before = len(list(broken.glob("chunks/chunk-*")))
            deadline = time.monotonic() + 120.0
            while len(list(broken.glob("chunks/chunk-*"))) < min(before + 1 + kill % 2, 24):
                assert process.poll() is None, process.stderr.read().decode()
                assert time.monotonic() < deadline
                time.sleep(0.001)
            os.kill(process.pid, signal.SIGKILL)
    assert 0 < len(list(broken.glob("chunks/chunk-*"))) < 24, "the last kill was before the end"
    subprocess.run(command(slow, broken, "--resume"), check=True, capture_output=True)
    assert contents(broken) == contents(whole)
    for name in ("report.json", "columns.csv", "indices.csv", "inputs.csv"):
        assert (broken / name).read_bytes() == (whole / name).read_bytes()


@pytest.mark.slow
def test_two_devices_leave_the_bytes_of_one(slow, tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    subprocess.run(command(slow, one), check=True, capture_output=True)
    subprocess.run([*command(slow, two), "--devices", "2"], check=True, capture_output=True)
    assert contents(one) == contents(two)


@pytest.mark.slow
def test_a_disk_that_fills_up_ends_in_one_line_and_resume_works(slow, tmp_path):
    # a limit of the size of files is what a process can have of a full disk without being root
    out = tmp_path / "out"
    full = ["bash", "-c", 'ulimit -f 20; exec "$@"', "bash", *command(slow, out)]  # 20 kB
    environment = os.environ | {"PNEUSMA_CACHE": "off"}
    done = subprocess.run(full, capture_output=True, text=True, env=environment)
    assert done.returncode == 2, done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("pneusma: ")]
    assert len(lines) == 1 and "0 of 24 chunks are done" in lines[0] and "--resume" in lines[0]
    assert not list(out.glob("chunks/*")) and not list(out.glob("chunks/.*"))
    subprocess.run(command(slow, out, "--resume"), check=True, capture_output=True)
    assert json.loads((out / "report.json").read_text())["sampling"]["rows"] == 24000


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_a_disk_that_refuses_in_mid_run_ends_in_one_line_and_resume_leaves_the_same_bytes(
    write, tmp_path, monkeypatch, number
):
    path, out, real = write(SMALL), tmp_path / "out", os.replace
    monkeypatch.setenv("PNEUSMA_CACHE", "off")

    def refuse(source, target, **more):
        if len(list(out.glob("chunks/chunk-*"))) >= 2:
            raise OSError(number, os.strerror(number))
        return real(source, target, **more)

    with monkeypatch.context() as disk:
        disk.setattr(os, "replace", refuse)
        result = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out)])
    lines = [line for line in result.stderr.splitlines() if line.startswith("pneusma: ")]
    assert result.exit_code == 2 and len(lines) == 1, result.output
    assert os.strerror(number) in lines[0] and "2 of 4 chunks are done" in lines[0] and "--resume" in lines[0]
    assert len(list(out.glob("chunks/chunk-*"))) == 2 and not list(out.glob("chunks/.*"))
    assert CliRunner().invoke(main, ["propagate", str(path), "--out", str(out), "--resume"]).exit_code == 0
    propagate(path, tmp_path / "whole")
    assert contents(out) == contents(tmp_path / "whole")


def test_the_time_of_a_study_holds_that_of_its_first_row(write, tmp_path, monkeypatch):
    """The row at the nominal values compiles the program. 64 rows took 48 s, and 0 s were told with compiling."""
    problem = build_problem(read_study(write(SMALL)))
    monkeypatch.setattr("fitting.propagate.result.time.monotonic", lambda: 40.0 if "nominal" in problem.__dict__ else 0.0)
    assert propagate(problem, tmp_path / "out").seconds == 40.0
