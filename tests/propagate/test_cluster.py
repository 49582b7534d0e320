"""Chunks on spawned workers: the same bytes, and a worker that dies loses and doubles nothing."""

import os
import signal
import threading
import time

import pytest
from study_texts import ISHIGAMI

from fitting.propagate import propagate
from pneusma_jax.errors import InputError

pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning"),
    pytest.mark.slow,
]
TEXT = ISHIGAMI + "\n[sampling]\nrows = 12000\nchunk = 500\n[indices]\n"


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted((folder / "chunks").iterdir())}


def test_two_workers_one_killed_leave_the_bytes_of_one_process(write, tmp_path):
    from fitting.engine.cluster import Cluster

    path = write(TEXT)
    alone = propagate(path, tmp_path / "alone")
    with Cluster(workers=2) as cluster:
        victim = cluster.processes[0]

        def kill():
            while len(list((tmp_path / "shared").glob("chunks/chunk-*"))) < 3:
                time.sleep(0.01)
            os.kill(victim, signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        together = propagate(path, tmp_path / "shared", cluster)
        killer.join()
        assert victim not in cluster.processes
    assert together.computed == alone.computed == 12_000
    assert contents(tmp_path / "shared") == contents(tmp_path / "alone")
    assert together.summary.failures.total == 12_000


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    from fitting.engine import cluster

    monkeypatch.setattr(cluster, "CONNECT", 0.5)
    with pytest.raises(InputError, match="no Dask scheduler answers there"):
        cluster.Cluster("tcp://127.0.0.1:9")
