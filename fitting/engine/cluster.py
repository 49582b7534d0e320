"""Tasks on the workers of a Dask cluster: one on this machine, or one that is running elsewhere.

Workers are spawned, never forked: a forked process inherits JAX's threads in an undefined state. A few tasks
per worker are under way at a time, so neither the scheduler nor this process holds more than these. Dask
gives the tasks of a worker that dies to another one. Needs the extra `cluster`.
"""

import os
from collections.abc import Iterable, Iterator
from types import TracebackType

import dask
from dask.distributed import Client, LocalCluster, as_completed
from distributed.scheduler import KilledWorker

from pneusma_jax.errors import InputError

from .run import Job

AHEAD = 2
"""Tasks under way for each worker: the one that it computes, and the next."""
CONNECT = 20.0
"""Seconds to wait for the scheduler of a cluster: several times what a slow network takes to answer."""
_ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NPROC", "PNEUSMA_THREADS")
}
"""Workers fill the cores by themselves: none has a pool of threads of its own, and XLA (`NPROC`) has none."""


class Cluster:
    """A scheduler of tasks, to be used in a `with` statement.

    Args:
        address: address of a running cluster, `tcp://host:8786`; None starts workers on this machine.
        workers: number of processes to start on this machine.

    Raises:
        InputError: if no cluster answers at the address.
    """

    def __init__(self, address: str | None = None, workers: int = 2):
        self._local = None
        if address is None:
            settings = {
                "distributed.worker.multiprocessing-method": "spawn",
                "distributed.nanny.pre-spawn-environ": _ONE_THREAD,
            }
            with dask.config.set(settings):
                self._local = LocalCluster(
                    n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None,
                    memory_limit=0,
                )  # fmt: skip
        try:
            self._client = Client(self._local or address, timeout=CONNECT)
        except (OSError, ValueError, TimeoutError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise InputError(f"--cluster {address}: no Dask scheduler answers there ({reason})") from None

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._client.close()
        if self._local is not None:
            self._local.close()

    @property
    def processes(self) -> list[int]:
        """Process ids of the workers that are there now."""
        return sorted(self._client.run(os.getpid).values())

    def __call__(self, job: Job, numbers: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Follows `run.Scheduler`.

        Raises:
            InputError: if one task killed several workers, which Dask then gives up.
        """
        waiting = iter(numbers)
        most = AHEAD * max(1, len(self._client.scheduler_info(n_workers=-1)["workers"]))
        futures: dict = {}

        def submit() -> object | None:
            number = next(waiting, None)
            if number is None:
                return None
            future = self._client.submit(job, number, pure=False)
            futures[future.key] = number
            return future

        first = [future for _ in range(most) if (future := submit()) is not None]
        arriving = as_completed(first)
        for future in arriving:
            try:
                content = future.result()
            except KilledWorker as error:
                raise InputError(
                    f"task {futures[future.key]} ended {error.allowed_failures + 1} workers, by lack of "
                    "memory"
                    " perhaps: take smaller chunks, or fewer workers on a machine"
                ) from None
            number = futures.pop(future.key)
            future.release()
            after = submit()
            if after is not None:
                arriving.add(after)
            yield number, content
