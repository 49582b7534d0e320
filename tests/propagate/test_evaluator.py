"""An evaluator gives arrays of the right shape for any number of rows, and each gradient its own function."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.propagate.evaluate import Evaluator


@pytest.fixture(scope="module")
def evaluator():
    def row(x):
        return x**2, (x[0] > 0.0).astype("uint8")

    return Evaluator(row, 8)


@pytest.mark.parametrize("rows", [0, 1, 3])
def test_any_number_of_rows_has_the_same_widths_and_types(evaluator, rows):
    x = np.arange(1.0, 1.0 + 2 * rows).reshape(rows, 2)
    columns, status = evaluator(x)
    assert columns.shape == (rows, 2) and columns.dtype == float
    assert status.shape == (rows,) and status.dtype == np.uint8
    number, slopes = evaluator.with_gradient(jnp.sum, x)
    assert number.shape == (rows,) and slopes.shape == (rows, 2)
    assert np.allclose(slopes, 2.0 * x)


def test_each_function_has_its_own_gradient(evaluator):
    x = np.array([[2.0, 3.0]])
    first, second = (lambda y: y[0]), (lambda y: 10.0 * y[1])
    for _ in range(2):
        assert np.allclose(evaluator.with_gradient(first, x)[1], [[4.0, 0.0]])
        assert np.allclose(evaluator.with_gradient(second, x)[1], [[0.0, 60.0]])
