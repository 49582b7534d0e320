"""Programs of a study's rows are kept on disk under everything that a row depends on."""

import jax
import numpy as np
import pytest

from fitting.propagate.evaluate import Evaluator


@pytest.fixture
def kept(tmp_path):
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path
    jax.config.update("jax_compilation_cache_dir", before)


def counted(factor, traced):
    def row(x):
        traced.append(factor)
        return factor * x[:1], (x[0] > 0.0).astype("uint8")

    return row


def test_rows_of_the_same_identity_are_traced_once_and_of_another_anew(kept):
    x, traced = np.array([[1.0], [-2.0]]), []
    first = Evaluator(counted(3.0, traced), 8, identity="three")(x)
    known = len(traced)
    assert known > 0
    again = Evaluator(counted(3.0, traced), 8, identity="three")(x)
    assert len(traced) == known
    other = Evaluator(counted(5.0, traced), 8, identity="five")(x)
    assert len(traced) > known
    alone = Evaluator(counted(3.0, []), 8)(x)
    for found in (again, alone):
        assert all(np.array_equal(a, b) for a, b in zip(first, found, strict=True))
    assert list(other[0][:, 0]) == [5.0, -10.0] and list(other[1]) == [1, 0]
