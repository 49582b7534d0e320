"""Known numbers become arrays of JAX without a program that is compiled for their shape."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.numerics.linear import determinant
from pneusma_jax.numerics.safe import as_array, as_numpy
from pneusma_jax.silicone import Gent, Ogden


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


def _laws_of_an_alloy(alloy, gamma, xi0):
    rho, limit = alloy.resistivity(xi0, gamma), alloy.residual_strain_limit(gamma)
    read = alloy.martensite_fraction(rho, gamma)
    cold = alloy.martensite_fraction_at(60.0 * gamma)
    stress = alloy.shear_stress(gamma, xi0, limit)
    return rho, limit, read.xi0, read.clipped, read.degenerate, cold, stress


@pytest.mark.parametrize("name", ["krl35", "krl45"])
def test_laws_of_numpy_numbers_compile_nothing(compiled, name):
    alloy = pj.load_alloy(name)
    gamma, xi0 = np.linspace(0.0, 0.25, 60)[:, None], np.linspace(0.02, 0.98, 7)  # ends are clipped by rounding
    compiled.clear()
    plain = _laws_of_an_alloy(as_numpy(alloy), gamma, xi0)
    assert not compiled and all(isinstance(x, np.ndarray) for x in plain)
    for own, other in zip(plain, jax.jit(_laws_of_an_alloy)(alloy, gamma, xi0), strict=True):
        np.testing.assert_allclose(own, other, rtol=1e-9, atol=1e-12)


def test_silicone_laws_of_numpy_numbers_compile_nothing(compiled):
    strain = np.linspace(-0.7, 2.0, 80)
    for law in (pj.load_silicone(), pj.load_silicone_test("standard_tension"), Gent(8e4, 5.0),
                Ogden([8e4, 1e3], [2.0, -3.0])):  # fmt: skip
        compiled.clear()
        plain = as_numpy(law)(strain)
        assert not compiled and isinstance(plain, np.ndarray)
        np.testing.assert_allclose(plain, jax.jit(lambda law, x: law(x))(law, strain), rtol=1e-12, atol=1e-8)
