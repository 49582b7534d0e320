"""Files of tasks are whole or not there, and what is missing is what is computed."""

import errno
import os

import pytest

from fitting.engine import Rate, Store, Task, run_tasks
from pneusma_jax.errors import InputError

TASKS = [Task(f"part-{k}", 10 * (k + 1)) for k in range(4)]


def job(number):
    return f"content {number}".encode()


def test_every_task_is_computed_and_named(tmp_path):
    store = Store(tmp_path / "parts")
    assert run_tasks(job, TASKS, store) == 4
    assert [store.read(task) for task in TASKS] == [job(k) for k in range(4)]
    assert sorted(os.listdir(store.folder)) == [task.name for task in TASKS]


def test_only_missing_tasks_are_computed(tmp_path):
    store, asked = Store(tmp_path), []
    store.write(TASKS[1], b"was there")
    assert run_tasks(lambda k: asked.append(k) or job(k), TASKS, store) == 3
    assert asked == [0, 2, 3] and store.read(TASKS[1]) == b"was there"


def test_the_order_in_which_tasks_end_does_not_matter(tmp_path):
    backwards = lambda job, numbers: ((k, job(k)) for k in reversed(numbers))  # noqa: E731
    run_tasks(job, TASKS, Store(tmp_path), backwards)
    assert [Store(tmp_path).read(task) for task in TASKS] == [job(k) for k in range(4)]


def test_drafts_of_killed_runs_are_removed_and_never_read(tmp_path):
    (tmp_path / f".{TASKS[0].name}.123.part").write_bytes(b"half")
    assert Store(tmp_path).missing(TASKS) == [0, 1, 2, 3]
    run_tasks(job, TASKS, Store(tmp_path))
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_a_disk_that_refuses_ends_in_one_line_and_the_run_goes_on_later(tmp_path, monkeypatch, code):
    real, written = os.fsync, []

    def refuse(handle):
        written.append(handle)
        if len(written) == 3:
            raise OSError(code, os.strerror(code))
        real(handle)

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(InputError, match=r"2 of 4 chunks are done and stay.*--resume") as caught:
        run_tasks(job, TASKS, Store(tmp_path))
    assert os.strerror(code) in str(caught.value) and "\n" not in str(caught.value)
    assert not list(tmp_path.glob(".*")), "no part of the refused file is left"
    assert run_tasks(job, TASKS, Store(tmp_path)) == 2
    assert [Store(tmp_path).read(task) for task in TASKS] == [job(k) for k in range(4)]


def test_progress_counts_rows_and_says_the_time_left(capsys, monkeypatch):
    clock = iter([0.0, 0.0, *(10.0 * k for k in range(1, 100))])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    rate = Rate("propagating", 1000, 200)
    rate.done(100)
    assert 0.0 < rate.rate < 100.0 and rate.left > 0.0
    for _ in range(5):
        rate.done(100)
    said = capsys.readouterr().err
    assert "of 1,000 rows" in said and "a second" in said and "left" in said
