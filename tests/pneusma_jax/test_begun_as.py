"""What a scan begins with: unchanged in value, batched and differentiated from the start."""

import jax
import jax.numpy as jnp
import numpy as np

from pneusma_jax.numerics.safe import begun_as


def test_values_types_and_shapes_stay_even_beside_nan():
    first = {
        "a": jnp.asarray(-0.0),
        "b": jnp.arange(6.0).reshape(2, 3),
        "c": jnp.asarray(True),
        "d": jnp.asarray(3),
    }
    found = begun_as(first, (jnp.asarray([jnp.nan, 1.0]), 1))
    for name, value in first.items():
        assert found[name].dtype == value.dtype
        np.testing.assert_array_equal(found[name], value)
    assert np.signbit(found["a"])


def test_the_body_of_a_scan_is_batched_once():
    """Without it JAX batches the body twice: once to learn that the start comes to vary."""
    batched = []

    @jax.custom_batching.custom_vmap
    def double(x):
        return 2.0 * x

    @double.def_vmap
    def _(size, is_batched, x):
        batched.append(size)
        return 2.0 * x, is_batched[0]

    def run(scale, begun):
        first = jnp.asarray(0.0)
        first = begun_as(first, scale) if begun else first
        step = lambda carry, _: (double(carry + scale), carry)  # noqa: E731
        return jax.lax.scan(step, first, None, length=3)[0]

    counts, found = [], []
    for begun in (False, True):
        batched.clear()
        found.append(jax.vmap(lambda scale, begun=begun: run(scale, begun))(jnp.asarray([0.5, 1.0])))
        counts.append(len(batched))
    np.testing.assert_array_equal(*found)
    assert counts == [2, 1], "JAX needs no help any more" if counts[0] == 1 else counts


def test_without_arrays_nothing_is_done():
    first = (jnp.zeros(2),)
    assert begun_as(first, ()) is first
