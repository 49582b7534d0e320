"""What was counted while fits ran side by side, and how they run."""

import os
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import TypeVar

from pneusma_jax.errors import InputError

FITS = "fits"
"""Models that were fitted to all that is to be fitted."""
RUNS = "runs"
"""Runs of the compiled program."""
THREADS = "PNEUSMA_THREADS"
"""Environment variable: most fits at a time, for those who run several diagnoses at once."""

Job, Result = TypeVar("Job"), TypeVar("Result")


class Tally:
    """Counts by name that several threads add to."""

    def __init__(self) -> None:
        self._counts, self._lock = Counter(), Lock()

    def __getitem__(self, name: str) -> int:
        """How often a name was counted."""
        return self._counts[name]

    def count(self, name: str) -> None:
        """Once more."""
        with self._lock:
            self._counts[name] += 1


def run_parallel(function: Callable[[Job], Result], jobs: Iterable[Job]) -> list[Result]:
    """Results of jobs that do not depend on each other, in their order, on all cores that this process has.

    Compiled programs run outside of Python's lock; so threads are enough, and share what was compiled.

    Raises:
        InputError: if the environment says how many and it is no number.
    """
    jobs = list(jobs)
    workers = min(_cores(), len(jobs))
    if workers < 2:
        return [function(job) for job in jobs]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(function, jobs))


def _cores() -> int:
    available = getattr(os, "sched_getaffinity", None)
    cores = len(available(0)) if available else os.cpu_count() or 1
    told = os.environ.get(THREADS, str(cores))
    if not told.isdigit() or int(told) < 1:
        raise InputError(f"{THREADS} must be a whole number of at least 1, but is {told!r}")
    return min(cores, int(told))
