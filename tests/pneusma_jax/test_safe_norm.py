"""A norm that is smooth at zero, and that says where there is nothing to measure."""

import jax
import jax.numpy as jnp
import numpy as np

from fitting.invert.goals import GOALS, misses
from pneusma_jax.numerics.safe import safe_norm
from pneusma_jax.serial_chain.shape import ChainShape


def test_values_and_the_gradient_at_zero():
    assert float(safe_norm(jnp.asarray([3.0, 4.0]))) == 5.0
    assert jax.grad(safe_norm)(jnp.zeros(2)).tolist() == [0.0, 0.0]
    np.testing.assert_allclose(jax.grad(safe_norm)(jnp.asarray([3.0, 4.0])), [0.6, 0.8])


def test_total_bend_of_a_chain_adds_sizes_and_has_a_gradient_when_straight():
    """Bends to opposite sides do not cancel. Nor may a straight segment spoil the others' gradient."""

    def total(bends):
        return ChainShape(bends, *(jnp.zeros(3),) * 4, frames=jnp.zeros((4, 4, 4))).total_bend

    bends = jnp.asarray([[3.0, 4.0], [0.0, 0.0], [-6.0, 8.0]])
    assert float(total(bends)) == 15.0
    np.testing.assert_allclose(jax.grad(total)(bends), [[0.6, 0.8], [0.0, 0.0], [-0.6, 0.8]])


def test_a_vector_that_is_no_number_has_no_norm():
    """A state without equilibrium is NaN; a size of 0 would pass for a straight body."""
    for some in (np.array([[np.nan, 1.0], [0.0, 2.0]]), jnp.asarray([[np.nan, 1.0], [0.0, 2.0]])):
        found = safe_norm(some)
        assert np.isnan(found[0]) and found[1] == 2.0


def test_a_state_without_equilibrium_meets_no_target():
    goals = ("curvature", "tip")
    missed = misses(goals, jnp.full((1, 4), jnp.nan), jnp.zeros((1, 4)))
    assert not any(np.asarray(missed[name] <= GOALS[name].tolerance).any() for name in goals)
