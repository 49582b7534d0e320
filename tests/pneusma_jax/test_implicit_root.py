"""Derivatives of a root of one unknown, and that they call back into nothing."""

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest

from pneusma_jax.nitinol.geometry import spring_strain
from pneusma_jax.numerics.implicit_root import OneUnknown
from pneusma_jax.numerics.newton import BoundedNewton
from pneusma_jax.silicone import load_silicone
from pneusma_jax.silicone.tube import tube_strain
from pneusma_jax.simulate.load_train import strain_in_train

GIVEN = (3.0, 0.7)


def cube_root(a, b, shape=(1,)):
    """Root of `x**3 + b*x = a*b`; `b` comes through a closure."""
    missed = lambda x, a: x**3 + b * x - a * b  # noqa: E731
    method = BoundedNewton(close=1e-12, longest=jnp.inf)
    if not shape:
        method = optx.Bisection(rtol=1e-14, atol=1e-14, flip=False)
    options = {} if shape else dict(lower=0.0, upper=9.0)
    found = optx.root_find(
        missed, method, jnp.ones(shape), a, options=options, max_steps=200, adjoint=OneUnknown(), throw=False
    )
    return found.value.reshape(())


@pytest.mark.parametrize("shape", [(1,), ()])
def test_first_and_second_derivatives_are_those_of_the_implicit_function(shape):
    """By differences of the root, and of its first derivatives."""
    a, b = GIVEN
    root = lambda a, b: cube_root(a, b, shape)  # noqa: E731
    x = float(root(a, b))
    slope = 3.0 * x**2 + b
    exact = np.array([b / slope, (a - x) / slope])
    for first in (jax.grad, jax.jacfwd):
        np.testing.assert_allclose(first(root, argnums=(0, 1))(a, b), exact, rtol=1e-12)
    h = 1e-4
    ends = [np.array(jax.grad(root, argnums=(0, 1))(a + k * h, b)) for k in (-1, 1)]
    for second in (jax.jacfwd(jax.grad(root, argnums=(0, 1))), jax.jacrev(jax.jacfwd(root, argnums=(0, 1)))):
        np.testing.assert_allclose(second(a, b), (ends[1] - ends[0]) / (2.0 * h), rtol=1e-6)
    many = jax.vmap(jax.grad(root))(jnp.array([a, 2.0 * a]), jnp.array([b, b]))
    np.testing.assert_allclose(many, [exact[0], float(jax.grad(root)(2.0 * a, b))], rtol=1e-12)


def test_a_root_at_which_the_function_is_flat_raises_nothing():
    """It ended a whole batch of rows."""

    def flat(a):
        missed = lambda x, a: 0.0 * x + a  # noqa: E731
        return optx.root_find(missed, BoundedNewton(), jnp.ones(1), a, adjoint=OneUnknown(), throw=False).value[0]

    assert not np.isfinite(jax.jit(jax.grad(flat))(2.0))


def test_other_roots_call_back_into_nothing_for_their_derivatives():
    bent = lambda gamma: jnp.sum(spring_strain(gamma, 0.6e-3, 1.2e-3, 0.25e-3))  # noqa: E731
    wall = lambda pressure: tube_strain(pressure, 12e-3, 1e-3, load_silicone(), throw=False)  # noqa: E731
    for function, at in ((bent, 0.02), (wall, 5e3)):
        program = jax.jit(jax.grad(function)).lower(at).as_text()
        assert "while" in program and "callback" not in program
        h = 1e-4 * at
        numeric = (float(function(at + h)) - float(function(at - h))) / (2.0 * h)
        assert float(jax.grad(function)(at)) == pytest.approx(numeric, rel=1e-5)


def test_the_strain_in_a_load_train_can_be_kept_compiled_with_its_derivatives():
    """A check of the linear solve called back, so that every diagnosis of an elastomer was compiled anew."""
    spring = lambda stiffness, length: stiffness * length  # noqa: E731

    def strain(stiffness, compliance):
        return strain_in_train(spring, stiffness, jnp.asarray(0.4), compliance, jnp.asarray(0.1))

    given = jnp.asarray(20.0), jnp.asarray(0.01)
    program = jax.jit(jax.jacfwd(strain, argnums=(0, 1))).lower(*given).as_text()
    assert "while" in program and "callback" not in program
    slopes = jax.grad(strain, argnums=(0, 1))(*given)
    ends = [[float(strain(*(g + k * 1e-4 * g * (i == j) for j, g in enumerate(given)))) for k in (-1, 1)] for i in (0, 1)]
    numeric = [(up - low) / (2e-4 * float(g)) for (low, up), g in zip(ends, given, strict=True)]
    np.testing.assert_allclose(slopes, numeric, rtol=1e-6)
