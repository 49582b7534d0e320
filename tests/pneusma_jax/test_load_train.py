"""A specimen in series with a load train: the root and its derivatives, rigid and soft."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneusma_jax.train import strain_in_train

RECORDED = jnp.linspace(0.0, 2.0, 7)
STIFFENING = 0.2


def _force(stiffness, x):
    return stiffness * jnp.tanh(x) + 0.3 * x


def _true(compliance, stiffness):
    return jax.vmap(lambda r: strain_in_train(_force, stiffness, r, compliance, STIFFENING))(RECORDED)


def test_true_and_train_make_up_the_recorded_length():
    true = _true(0.4, 1.5)
    pull = _force(1.5, true)
    np.testing.assert_allclose(true + 0.4 * pull / (1.0 + STIFFENING * jnp.abs(pull)), RECORDED, atol=1e-14)


def test_a_rigid_train_gives_the_recorded_length_exactly():
    assert jnp.array_equal(_true(0.0, 1.5), RECORDED)


@pytest.mark.parametrize("compliance", [0.0, 0.4])
@pytest.mark.parametrize("derivative", [jax.grad, jax.jacfwd])
def test_derivatives_are_those_of_the_implicit_function(compliance, derivative):
    total = lambda c, k: jnp.sum(_true(c, k))  # noqa: E731
    found = jax.jit(derivative(total, (0, 1)))(compliance, 1.5)
    h = 1e-5
    apart = [(total(compliance + h, 1.5) - total(compliance - h, 1.5)) / (2.0 * h)]
    apart += [(total(compliance, 1.5 + h) - total(compliance, 1.5 - h)) / (2.0 * h)]
    np.testing.assert_allclose(found, apart, rtol=1e-6, atol=1e-9)
