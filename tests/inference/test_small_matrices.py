"""Libraries for linear algebra get one thread while a function of small problems runs, and theirs back afterwards."""

import os

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from fitting.inference.parallel import one_thread_per_matrix, run_short_jobs


def threads():
    """Threads of every library for linear algebra."""
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]


@pytest.fixture
def two():
    """Two threads for each library, where there are two cores."""
    np.eye(2) @ np.eye(2)
    with threadpool_limits(limits=2, user_api="blas"):
        if 2 not in threads():
            pytest.skip("a library that cannot have two threads here")
        yield


def test_the_limit_ends_with_the_outermost_of_nested_calls(two):
    before = threads()

    @one_thread_per_matrix
    def outer():
        one_thread_per_matrix(lambda: None)()
        return threads()

    assert set(outer()) == {1}
    assert threads() == before


def test_the_limit_ends_with_an_error(two):
    before = threads()
    with pytest.raises(ZeroDivisionError):
        one_thread_per_matrix(lambda: 1 / 0)()
    assert threads() == before


def test_short_jobs_keep_their_order(monkeypatch):
    for count in ("1", "2"):
        monkeypatch.setenv("PNEUSMA_THREADS", count)
        assert run_short_jobs(lambda k: k * k, list(range(20))) == [k * k for k in range(20)]
        assert run_short_jobs(lambda k: k + os.getpid(), [1]) == [1 + os.getpid()]
