"""Sums over a wall for derivatives along many directions, against the plain quadrature and its derivatives."""

import functools
import re
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

import pneusma_jax as pj
from pneusma_jax.section.kinds import rectangle
from pneusma_jax.section.many_directions import in_plane
from pneusma_jax.section.shapes import sine
from pneusma_jax.silicone import SiliconeLaw

DIRECTION = jnp.asarray([0.6, 0.8])
STATES = {
    "straight": (0.05, 0.0),
    "tension": (0.2, 10.0),
    "through zero": (0.01, -40.0),
    "past the tested strains": (0.5, 120.0),
}
"""Strain of the centre line [1] and its gradient [1/m]."""


def _sections():
    return {
        "tube": lambda size, wall: pj.annulus(10e-3 * size, 1e-3 * wall),
        "rectangle": lambda size, wall: rectangle(10e-3 * size, 8e-3, 1e-3 * wall),
    }


def _vector(integrate):
    force, moment = integrate
    return jnp.concatenate([force[None], moment])


def _numbers(strain, gradient):
    return jnp.asarray([1.0, 1.0]), pj.load_silicone(), jnp.asarray(strain), jnp.asarray(gradient)


def _at(state):
    """Vector of all numbers in a state."""
    return ravel_pytree(eqx.filter(_numbers(*STATES[state]), eqx.is_inexact_array))[0]


def _both(shape):
    """Plain and new sums as functions of one vector of all numbers."""
    floats, rest = eqx.partition(_numbers(0.0, 0.0), eqx.is_inexact_array)
    _, restored = ravel_pytree(floats)

    def of(function):
        def sums(flat):
            (size, wall), law, strain, gradient = eqx.combine(restored(flat), rest)
            return _vector(function(_sections()[shape](size, wall), law, strain, gradient, DIRECTION))

        return sums

    plain = lambda section, law, *at: section.integrate_in_plane(law, *at)  # noqa: E731
    return of(plain), of(in_plane)


@functools.cache
def _slopes(shape):
    """Plain and new sums and their derivatives, one program for every state."""
    plain, new = _both(shape)
    return jax.jit(lambda flat: (plain(flat), new(flat), jax.jacfwd(plain)(flat), jax.jacfwd(new)(flat), jax.jacrev(new)(flat)))


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("shape", ["tube", pytest.param("rectangle", marks=pytest.mark.slow)])
def test_sums_and_slopes_are_those_of_the_plain_quadrature(shape, state):
    plain, new, wanted, *jacobians = _slopes(shape)(_at(state))
    np.testing.assert_allclose(new, plain, rtol=1e-11, atol=1e-14)
    scale = np.abs(np.asarray(wanted)).max(axis=0) + 1e-12
    for jacobian in jacobians:
        np.testing.assert_allclose(jacobian / scale, wanted / scale, atol=1e-10)


@pytest.mark.parametrize("first", [pytest.param(jax.jacfwd, marks=pytest.mark.slow), jax.jacrev])
def test_second_derivatives_are_those_of_the_plain_quadrature(first):
    plain, new = _both("tube")
    ways = jax.jacfwd(jax.jacfwd(plain)), jax.jacfwd(first(new))
    wanted, found = (np.asarray(x) for x in jax.jit(lambda flat: tuple(way(flat) for way in ways))(_at("through zero")))
    np.testing.assert_allclose(found, wanted, atol=np.abs(wanted).max() * 1e-9)


def test_rows_side_by_side_are_those_one_by_one_and_nan_stays_nan():
    section, law = pj.annulus(10e-3, 1e-3), pj.load_silicone()
    strain = jnp.asarray([0.1, jnp.nan, 0.01, 0.1])
    gradient = jnp.asarray([5.0, 5.0, -40.0, jnp.nan])
    one = jax.jit(lambda e, g: _vector(in_plane(section, law, e, g, DIRECTION)))
    side_by_side = jax.jit(jax.vmap(one))(strain, gradient)
    assert np.all(np.isnan(side_by_side[jnp.asarray([1, 3])]))
    for k in (0, 2):
        np.testing.assert_allclose(side_by_side[k], one(strain[k], gradient[k]), rtol=1e-13)
    assert np.all(np.isnan(one(strain[1], gradient[1])))


class Exponential(SiliconeLaw):
    """sigma = a (exp(eps) - 1), whose exponential is seen in a compiled program."""

    a: jax.Array = eqx.field(converter=jnp.asarray)

    def __call__(self, strain):
        return self.a * (jnp.exp(strain) - 1.0)


def test_laws_are_computed_once_for_all_directions():
    section = pj.annulus(10e-3, 1e-3)
    sums = lambda at: _vector(in_plane(section, Exponential(at[2]), at[0], at[1], DIRECTION))  # noqa: E731
    along = lambda at, steps: jax.vmap(lambda step: jax.jvp(sums, (at,), (step,)))(steps)  # noqa: E731
    program = jax.jit(along).lower(jnp.asarray([0.1, 5.0, 1e5]), jnp.ones((16, 3))).compile().as_text()
    shapes = re.findall(r"f64\[([0-9,]*)\]\S* exponential\(", program)
    assert shapes and not any(shape.startswith("16") for shape in shapes)


class Cut(SiliconeLaw):
    """A law of a user's own: a function in a field that is no array, and a place where it is not smooth."""

    function: Callable
    order: int
    place: jax.Array = eqx.field(converter=jnp.asarray)

    def __call__(self, strain):
        return 1e5 * sum(self.function(strain) ** k for k in range(1, self.order + 1))

    @property
    def cuts(self):
        return self.place[None]


def test_laws_with_functions_and_counts_in_their_fields_are_integrated():
    section, at = pj.annulus(10e-3, 1e-3), (jnp.asarray(0.1), jnp.asarray(5.0), DIRECTION)
    law = Cut(jnp.tanh, 2, 0.1)
    ways = lambda *at: in_plane(section, law, *at), lambda *at: section.integrate_in_plane(law, *at)  # noqa: E731
    (found, slope), (wanted, plain) = (
        jax.jit(lambda strain, way=way: (_vector(way(strain, *at[1:])), jax.grad(lambda e: way(e, *at[1:])[0])(strain)))(at[0])
        for way in ways
    )
    np.testing.assert_allclose(found, wanted, rtol=1e-12)
    np.testing.assert_allclose(slope, plain, rtol=1e-12)


def test_a_law_whose_cut_is_unknown_leaves_no_wall_of_zero():
    at = jnp.asarray(0.1), jnp.asarray(5.0), DIRECTION
    sums = _vector(in_plane(pj.annulus(10e-3, 1e-3), Cut(jnp.tanh, 1, jnp.nan), *at))
    assert np.all(np.isnan(sums))


def test_sine_is_exact_to_rounding_up_to_a_quarter_turn():
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20_001)
    np.testing.assert_allclose(sine(jnp.asarray(angles)), np.sin(angles), rtol=4e-16, atol=0.0)
