"""Files of tasks are whole or not there, and what is missing is what is computed."""

import errno
import os
from dataclasses import dataclass
from typing import NamedTuple

import pytest

from fitting.engine import Rate, Store, Task, digest, objects, run_results, run_tasks, unique_names
from fitting.engine.members import _is_done
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


def test_results_are_read_or_computed_and_each_is_told_of(tmp_path):
    store, told, asked = Store(tmp_path), [], []

    def work(number):
        asked.append(number)
        return objects.dump({"task": number, "good": number != 3})

    kept = lambda number, result: told.append(("kept", number)) or result  # noqa: E731
    finished = lambda number, result: told.append(("finished", number)) or result  # noqa: E731
    more = {"kept": kept, "finished": finished, "usable": lambda result: result["good"]}
    first = run_results(work, TASKS[:2], store, **more)
    assert [result["task"] for result in first] == [0, 1] and told == [("finished", 0), ("finished", 1)]
    store.path(TASKS[1]).write_bytes(b"damaged")
    every = run_results(work, TASKS, store, **more)
    assert [result["task"] for result in every] == [0, 1, 2, 3] and asked == [0, 1, 1, 2, 3]
    assert told[2:] == [("kept", 0), ("finished", 1), ("finished", 2), ("finished", 3)]
    again = run_results(work, TASKS, store, **more)
    assert asked == [0, 1, 1, 2, 3, 3], "what is not good is computed again"
    assert again == every


class Member(NamedTuple):
    """No dataclass, so no member of a batch."""

    done: bool


@dataclass
class Fitted:
    """The same as a member of a batch."""

    name: str
    path: str
    result: float | None

    @property
    def done(self):
        return self.result > 0.0


def test_a_stored_object_that_is_no_member_is_computed_again():
    fitted, emptied = Fitted("a", "a", 1.0), Fitted("a", "a", 1.0)
    del emptied.result
    assert _is_done(fitted)
    for stored in (b"bytes", None, Member(True), Fitted("a", "a", None), Fitted("a", "a", -1.0), emptied, Fitted):
        assert not _is_done(stored)


def test_files_may_have_folders_of_their_own(tmp_path):
    store, tasks = Store(tmp_path), [Task("a/report.json"), Task("b/report.json")]
    store.write(tasks[1], b"was there")
    (tmp_path / "b" / ".report.json.1.part").write_bytes(b"half")
    assert store.missing(tasks) == [0]
    assert run_tasks(job, tasks, store) == 1
    assert sorted(p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*.*")) == [
        t.name for t in tasks
    ]


def test_names_are_unique_and_digests_follow_content(tmp_path):
    for folder in ("x/strip", "y/strip", "x/strip_2", "z/STRIP"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "pull.csv").write_text("time_s\n")
    paths = [tmp_path / "x" / "strip", tmp_path / "y" / "strip"]
    assert unique_names(paths) == ["strip", "strip_2"]
    others = [tmp_path / "x" / "strip_2", paths[0], paths[1], tmp_path / "z" / "STRIP"]
    found = unique_names(others)  # each has a folder of results, and some file systems do not tell capitals
    assert found == ["strip_2", "strip", "strip_3", "STRIP_4"]
    before = digest(paths[:1], 3)
    assert before == digest(paths[1:], 3) != digest(paths[:1], 4)
    (paths[0] / "pull.csv").write_text("time_s\n1\n")
    assert digest(paths[:1], 3) != before
    one = digest([paths[1] / "pull.csv"])
    (paths[1] / "pull.toml").write_text('kind = "elastomer"')
    assert digest([paths[1] / "pull.csv"]) != one, "a CSV's meaning is in the TOML beside it"


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
