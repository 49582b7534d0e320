"""Places where tasks are computed: this process, several here, or a cluster."""

from contextlib import AbstractContextManager, nullcontext

from pneusma_jax.errors import InputError

from .run import Scheduler, in_this_process

try:
    from .cluster import Cluster
except ImportError:  # Dask is an extra
    Cluster = None


def place_of(workers: int | None = None, address: str | None = None) -> AbstractContextManager[Scheduler]:
    """A scheduler for a `with` statement. Importing this module imports Dask, where it is installed.

    Args:
        workers: processes to start on this machine; None for this process.
        address: address of a running Dask scheduler, in the place of `workers`.

    Raises:
        InputError: if Dask is not installed, or no scheduler answers.
    """
    if workers is None and address is None:
        return nullcontext(in_this_process)
    if Cluster is None:
        raise InputError("--workers and --cluster need Dask: pip install 'pneusma-jax[cluster]'")
    return Cluster(address, workers or 1)
