"""A value whose derivatives follow from a rule: of any order, through every transformation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneusma_jax.numerics.carried import carried

X = jnp.asarray([1.0, 2.0, 3.0])


def root(x):
    """The square root, whose derivatives only the rule knows."""
    return carried(jax.lax.stop_gradient(jnp.sqrt(x)), lambda value, given, by: by["x"] / (2.0 * value), {"x": x})


WAYS = {
    "one by one": lambda x: jnp.stack([root(one) for one in x]),
    "side by side": jax.vmap(root),
    "side by side twice": lambda x: jax.vmap(jax.vmap(root))(x[:, None])[:, 0],
    "in a loop": lambda x: jax.lax.map(root, x),
    "in a loop that computes again": lambda x: jax.lax.map(jax.checkpoint(root, prevent_cse=False), x),
    "in a loop, side by side": lambda x: jax.lax.map(jax.vmap(root), x[None])[0],
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("compiled", [False, True])
def test_derivatives_of_every_order(way, compiled):
    cubes = lambda x: jnp.sum(WAYS[way](x) ** 3)  # noqa: E731
    compositions = (jax.hessian(cubes), jax.jacrev(jax.grad(cubes)), jax.jacfwd(jax.jacfwd(cubes)))
    seconds = compositions if compiled else compositions[:1]  # outside of a program every operation is one
    # third derivatives of one by one are 70 programs of one operation each there, which other ways have too
    thirds = () if way == "one by one" and not compiled else (jax.jacfwd(jax.hessian(cubes)),)
    every = lambda x: [of(x) for of in (jax.grad(cubes), *seconds, *thirds)]  # noqa: E731
    first, *found = (jax.jit(every) if compiled else every)(X)
    np.testing.assert_allclose(first, 1.5 * np.sqrt(X))
    for second in found[: len(seconds)]:
        np.testing.assert_allclose(second, np.diag(0.75 / np.sqrt(X)), atol=1e-15)
    for third in found[len(seconds) :]:
        np.testing.assert_allclose(np.einsum("iii->i", third), -0.375 / X**1.5)


def test_what_does_not_vary_has_no_tangent():
    seen = []

    def rule(value, given, by):
        seen.append(by["b"])
        return by["a"] * given["b"]

    product = lambda a, b: carried(jax.lax.stop_gradient(a * b), rule, {"a": a, "b": b})  # noqa: E731
    assert float(jax.grad(product)(2.0, 3.0)) == 3.0
    assert seen == [None]


def test_a_value_is_the_same_for_all_rows():
    scaled = lambda x: carried(jnp.asarray(4.0), lambda value, given, by: 2.0 * by, x)  # noqa: E731
    np.testing.assert_array_equal(jax.vmap(scaled)(X), 4.0)
    np.testing.assert_array_equal(jax.vmap(jax.grad(scaled))(X), 2.0)
