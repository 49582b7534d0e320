"""Independent fits side by side: a compiled program leaves Python alone while it runs, so threads do."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

MOST = 8
"""Threads at most; more would wait for each other between runs."""
Job, Result = TypeVar("Job"), TypeVar("Result")


def abreast(function: Callable[[Job], Result], jobs: Iterable[Job]) -> list[Result]:
    """`list(map(function, jobs))` on as many threads as this process may use cores.

    Args:
        function: depends on nothing that another job changes.
        jobs: what to do; the results have their order, and the first error that a job raises is raised.
    """
    with ThreadPoolExecutor(min(cores(), MOST)) as pool:
        return list(pool.map(function, jobs))


def cores() -> int:
    """Processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
