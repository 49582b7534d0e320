"""Parallel jobs on threads, and counters of their work."""

import functools
import os
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from pneusma_jax.errors import InputError

FITS = "fits"
"""Counter of models that were fitted to all recordings."""
RUNS = "runs"
"""Counter of runs of the compiled program."""
THREADS = "PNEUSMA_THREADS"
"""Environment variable with the maximum number of parallel fits, for users who run several diagnoses at
once."""

Job, Result = TypeVar("Job"), TypeVar("Result")
Work = TypeVar("Work", bound=Callable)


def one_thread_per_matrix(function: Work) -> Work:
    """Decorator of a function whose linear algebra is many small problems: each gets one thread.

    A library for linear algebra otherwise starts threads for every one, which wait for each other. A
    diagnosis of an actuator took 2.7 times the processor time on two cores.
    """

    @functools.wraps(function)
    def limited(*arguments: Any, **named: Any) -> Any:
        with _ONE_THREAD:
            return function(*arguments, **named)

    return limited  # type: ignore[return-value]


class _OneThread:
    """One thread for all linear algebra of this process while any function is inside.

    The library keeps one limit for the process. So the first function that enters sets it, and the last one
    that leaves lifts it.
    """

    def __init__(self) -> None:
        self._lock, self._inside, self._limit = Lock(), 0, None

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                self._limit = threadpool_limits(limits=1, user_api="blas")
            self._inside += 1

    def __exit__(self, *_: Any) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._limit.restore_original_limits()


_ONE_THREAD = _OneThread()


class Tally:
    """Counters by name that several threads increment."""

    def __init__(self) -> None:
        self._counts, self._lock = Counter(), Lock()

    def __getitem__(self, name: str) -> int:
        """Count of a name."""
        return self._counts[name]

    def count(self, name: str) -> None:
        """Increment a counter."""
        with self._lock:
            self._counts[name] += 1


def run_parallel(function: Callable[[Job], Result], jobs: Iterable[Job]) -> list[Result]:
    """Results of independent jobs, in their order, computed on all cores of this process.

    Compiled programs run outside of Python's lock. So threads are sufficient, and share compiled programs.

    Args:
        function: called with one job; an error that it raises is raised here.
        jobs: any number of them; none gives an empty list.

    Raises:
        InputError: if the environment variable `PNEUSMA_THREADS` is no whole number of at least 1.
    """
    jobs = list(jobs)
    workers = min(_cores(), len(jobs))
    if workers < 2:
        return [function(job) for job in jobs]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(function, jobs))


def run_short_jobs(function: Callable[[Job], Result], jobs: Sequence[Job]) -> list[Result]:
    """Same as `run_parallel` for jobs of milliseconds, on threads that are not ended in between.

    Such jobs must not call this function themselves: they would wait for their own threads.

    Raises:
        InputError: as `run_parallel`.
    """
    workers = _cores()
    if min(workers, len(jobs)) < 2:
        return [function(job) for job in jobs]
    return list(_pool(workers).map(function, jobs))


@functools.cache
def _pool(workers: int) -> ThreadPoolExecutor:
    """The threads of `run_short_jobs`, which live as long as the process."""
    return ThreadPoolExecutor(workers, thread_name_prefix="runs")


if hasattr(os, "register_at_fork"):  # a child has none of the threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


def _cores() -> int:
    """Number of cores that this process may use, at most `PNEUSMA_THREADS` of them."""
    available = getattr(os, "sched_getaffinity", None)
    cores = len(available(0)) if available else os.cpu_count() or 1
    setting = os.environ.get(THREADS, str(cores))
    if not setting.isdecimal() or int(setting) < 1:
        raise InputError(f"{THREADS} must be a whole number of at least 1, but is {setting!r}")
    return min(cores, int(setting))
