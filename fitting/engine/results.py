"""Tasks whose files hold results: those that are there, and the others as they are computed."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from pneusma_jax.errors import InputError

from . import objects
from .run import Job, Scheduler, in_this_process, run_tasks
from .store import Store, Task

OnResult = Callable[[int, Any], Any]
"""Called with a task's number and its result; gives back the result that counts."""


def run_results(
    job: Job,
    tasks: Sequence[Task],
    store: Store,
    scheduler: Scheduler = in_this_process,
    here: Callable[[int], tuple[Any, bytes]] | None = None,
    kept: OnResult = lambda _, result: result,
    finished: OnResult = lambda _, result: result,
    usable: Callable[[Any], bool] = lambda _: True,
) -> list[Any]:
    """The result of every task, in their order.

    Args:
        job: makes a result as bytes of `objects.dump`; see `run.Job`.
        tasks: all of them.
        store: store of the tasks' files.
        scheduler: scheduler that computes the tasks.
        here: takes the place of `job` in this process, such as to show progress; gives the result and its
            bytes.
        kept: told of results that were there; finished: of those that were computed, before they are stored.
        usable: true if a stored result is good. Other results are computed again, and so are damaged files.

    Raises:
        InputError: if a file cannot be written.
    """
    results = {}
    missing = set(store.missing(tasks))
    for number, task in enumerate(tasks):
        if number not in missing:
            result = _stored(store, task)
            if result is None or not usable(result):
                store.path(task).unlink()
            else:
                results[number] = kept(number, result)
    fresh: dict[int, Any] = {}

    def in_place(number: int) -> bytes:
        fresh[number], content = here(number)
        return content

    def watched(work: Job, numbers: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        for number, content in scheduler(work, numbers):
            result = fresh.pop(number) if number in fresh else objects.load(content)
            results[number] = finished(number, result)
            yield number, content

    run_tasks(in_place if here is not None and scheduler is in_this_process else job, tasks, store, watched)
    return [results[number] for number in range(len(tasks))]


def _stored(store: Store, task: Task) -> Any:
    """The result of a task's file; None where the file is damaged."""
    try:
        return objects.load(store.read(task))
    except InputError:
        return None
