"""Derivatives by differences, in place of the tangents of a long program."""

import jax
import jax.numpy as jnp
import numpy as np

from fitting.inference.differences import differenced


def _law(given):
    (gain, rate), time = given
    return gain * jnp.exp(-rate * time)


def test_differences_along_many_directions_are_the_tangents_of_the_law():
    time, point = jnp.linspace(0.0, 3.0, 7), (jnp.asarray(2.0), jnp.asarray(0.7))
    directions = (jnp.array([1.0, 0.0, 0.5]), jnp.array([0.0, 1.0, -2.0]))

    def along(law):
        return jax.vmap(lambda *way: jax.jvp(lambda *p: law((p, time)), point, way), out_axes=(None, 0))(*directions)

    value, slopes = along(lambda given: differenced(_law, given, jax.lax.stop_gradient(_law(given))))
    expected, tangents = along(_law)
    np.testing.assert_array_equal(value, expected)
    np.testing.assert_allclose(slopes, tangents, atol=1e-5)
    assert not np.array_equal(slopes, tangents)


def test_the_law_is_computed_once_where_its_value_is_known():
    """So a program holds the law only where it is moved."""
    point = (jnp.asarray(2.0), jnp.asarray(0.7)), jnp.ones(3)
    program = str(jax.make_jaxpr(lambda p: jax.jvp(lambda p: differenced(_law, p, jnp.zeros(3)), (p,), (p,)))(point))
    assert program.count("exp") == 1
