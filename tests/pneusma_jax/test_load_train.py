"""A specimen in series with a load train: the root and its derivatives, rigid and soft."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from pneusma_jax.simulate.load_train import strain_in_train

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


@pytest.mark.parametrize("compliance", [0.0, 0.4, 2.0])
@pytest.mark.parametrize("derivative", [jax.grad, jax.jacfwd])
def test_derivatives_are_those_of_the_implicit_function(compliance, derivative):
    total = lambda c, k: jnp.sum(_true(c, k))  # noqa: E731
    found = jax.jit(derivative(total, (0, 1)))(compliance, 1.5)

    def missing(true, recorded, c, k):
        pull = _force(k, true)
        return true + c * pull / (1.0 + STIFFENING * jnp.abs(pull)) - recorded

    roots = [brentq(missing, -1e-9, 2.0, args=(r, compliance, 1.5), xtol=1e-15) for r in RECORDED]
    slopes = [jax.grad(missing, (0, 2, 3))(x, r, compliance, 1.5) for x, r in zip(roots, RECORDED, strict=True)]
    implicit = -np.sum([[by_c / slope, by_k / slope] for slope, by_c, by_k in slopes], axis=0)
    np.testing.assert_allclose(found, implicit, rtol=1e-8, atol=1e-12)
