"""Do the tasks that are missing."""

from collections.abc import Callable, Iterable, Iterator, Sequence

from pneusma_jax.errors import InputError

from .progress import Rate
from .store import Store, Task

Job = Callable[[int], bytes]
"""Content of a task's file from the task's number. It must depend on nothing else, and be picklable to run in
other processes."""
Scheduler = Callable[[Job, Iterable[int]], Iterable[tuple[int, bytes]]]
"""Does a job for each of some numbers, in any order; yields each number with what came of it. Numbers are
taken one by one as there is room, so an iterator that ends early ends the run."""


def in_this_process(job: Job, numbers: Iterable[int]) -> Iterator[tuple[int, bytes]]:
    """The simplest scheduler: one task after the other."""
    for number in numbers:
        yield number, job(number)


def run_tasks(
    job: Job,
    tasks: Sequence[Task],
    store: Store,
    scheduler: Scheduler = in_this_process,
    progress: Rate | None = None,
) -> int:
    """Compute every task whose file is missing.

    Only this process writes files, so nothing is written twice, wherever tasks are computed.

    Args:
        job: see `Job`.
        tasks: all of them; the missing ones are done.
        store: store of the tasks' files.
        scheduler: scheduler that computes the tasks.
        progress: told of each task that is done.

    Returns:
        Number of tasks that were computed.

    Raises:
        InputError: if a file cannot be written; says how many are done, and how to go on.
    """
    store.clear_drafts()
    missing = store.missing(tasks)
    count = 0
    for number, content in scheduler(job, missing):
        try:
            store.write(tasks[number], content)
        except OSError as error:
            done = len(tasks) - len(missing) + count
            raise InputError(
                f"{store.folder}: cannot be written ({error.strerror}); {done} of {len(tasks)} chunks are "
                "done"
                " and stay: make room or give permission, then go on with --resume"
            ) from None
        count += 1
        if progress is not None:
            progress.done(tasks[number].size)
    return count
