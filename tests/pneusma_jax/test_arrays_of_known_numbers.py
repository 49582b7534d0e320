"""Known numbers become arrays of JAX without a program that is compiled for their shape."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.numerics.linear import determinant
from pneusma_jax.numerics.safe import as_array


@pytest.mark.parametrize("value", [1.5, 3, True, np.float64(2.0), np.arange(17.0), (0.5, 1.0), [np.ones(19)]])
def test_a_known_number_compiles_nothing(compiled, value):
    found = as_array(value)
    assert isinstance(found, jax.Array) and not compiled
    np.testing.assert_array_equal(found, np.asarray(value))


def test_a_traced_number_stays_traced():
    assert jax.grad(lambda x: jnp.sum(as_array((x, 2.0 * x)) + as_array(x)))(1.0) == 5.0
    assert jax.jit(lambda x: as_array(x) + as_array(np.ones(3)))(2.0).shape == (3,)


def test_an_actuator_is_built_without_compiling(compiled):
    pj.make_actuator("pneusma2", length=61e-3, active_coils=43.0)
    assert not compiled


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_determinant_of_known_numbers_stays_in_numpy(compiled, rows):
    matrices = np.random.default_rng(rows).normal(size=(rows, rows, 5))
    found = determinant(matrices)
    assert isinstance(found, np.ndarray) and not compiled
    np.testing.assert_allclose(found, np.linalg.det(np.moveaxis(matrices, -1, 0)), rtol=1e-12)
