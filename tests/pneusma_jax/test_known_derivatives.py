"""Derivatives of `solve_batch`: the same inside of `jax.jit` and outside, of any order, for any number of rows."""

import gc
import weakref

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.actuator.known_derivatives import _Rows

BODY = pj.make_actuator("pneusma2")
RANDOM = np.random.default_rng(3)
PRESSURE = jnp.asarray(RANDOM.uniform(1e3, 50e3, 1100))
XI0 = jnp.asarray(RANDOM.uniform(0.02, 0.98, (1100, 2)))


def thicker(times):
    """PneuSMA2 with a first wire so many times as thick."""
    return eqx.tree_at(lambda a: a.springs[0].geometry.wire_diameter, BODY, replace_fn=lambda d: d * times)


def solved(pressure, xi0, times=1.0):
    """Rows of it."""
    return pj.solve_batch(thicker(times), pressure, tuple(pj.MartensiteFraction(x) for x in xi0.T))


def squares(pressure, xi0, times=1.0):
    """Sum of squared curvatures of the rows that have one."""
    return jnp.nansum(solved(pressure, xi0, times).curvature ** 2)


def shown(times, pressure, *xi0):
    """Bends, lengths and first resistances of rows, whose derivatives by all these inputs are one program."""
    found = pj.solve_batch(thicker(times), pressure, tuple(map(pj.MartensiteFraction, xi0)))
    return found.bend, found.length, found.springs[0].resistance


def inputs(rows):
    """Pressure and fractions of so many rows."""
    return [jax.device_put(np.asarray(x)[:rows]) for x in (PRESSURE, *XI0.T)]


def pulled(rows):
    """Derivatives of what is `shown` of so many rows by their inputs and a wire."""
    found, back = jax.vjp(shown, 1.0, *inputs(rows))
    return back(jax.tree.map(lambda x: jax.device_put(np.ones(x.shape)), found))


def test_another_number_of_rows_compiles_nothing(compiled):
    few, many = pulled(70), pulled(1100)
    compiled.clear()
    first, second = pulled(90), pulled(1060)
    assert compiled == []
    for some, every in ((few, first), (first, many), (second, many)):
        for one, other in zip(some[1:], every[1:], strict=True):
            np.testing.assert_allclose(one, other[: len(one)], rtol=1e-9, atol=1e-15)
    assert float(first[0]) != 0.0


def test_a_derivative_leaves_no_rows_in_memory(monkeypatch):
    """JAX kept the rows of 2048 derivatives."""
    made, alive, begin = [], weakref.WeakSet(), _Rows.__init__

    def watched(rows, *given):
        begin(rows, *given)
        made.append(id(rows))
        alive.add(rows)

    monkeypatch.setattr(_Rows, "__init__", watched)
    for k in range(3):
        jax.grad(squares, argnums=(0, 1, 2))(PRESSURE[:70] + k, XI0[:70], 1.0)
    gc.collect()
    assert len(made) == 3 and len(alive) <= 1


def test_derivatives_are_those_of_a_compiled_program():
    pressure = PRESSURE[:80].at[5].set(np.nan).at[7].set(3e6)  # rows without a result
    own = jax.grad(squares, argnums=(0, 1, 2))
    for found, one in zip(own(pressure, XI0[:80], 1.0), jax.jit(own)(pressure, XI0[:80], 1.0), strict=True):
        assert np.isfinite(one).all()
        np.testing.assert_allclose(found, one, rtol=1e-6, atol=1e-8 * float(np.max(np.abs(one))))


def test_tangents_and_their_transpose_agree():
    given = (1.0, *inputs(70))
    along = (0.03, *map(jax.device_put, (np.full(70, 30.0), *RANDOM.normal(size=(2, 70)))))
    found, forward = jax.jvp(shown, given, along)
    _, back = jax.vjp(shown, *given)
    weights = jax.tree.map(lambda x: jnp.asarray(RANDOM.normal(size=x.shape)), found)
    total = lambda a, b: sum(float(jnp.vdot(x, y)) for x, y in zip(a, b, strict=True))  # noqa: E731
    assert total(forward, weights) == pytest.approx(total(along, back(weights)), rel=1e-10)


@pytest.fixture(scope="module")
def bends():
    """Second derivatives of `squares` of three rows by their own pressures, by differences of first ones."""
    slope, h = jax.jit(jax.grad(squares)), 20.0
    ends = [slope(PRESSURE[:3] + k * h, XI0[:3]) for k in (-2, -1, 1, 2)]
    return (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * h)


@pytest.mark.slow
@pytest.mark.parametrize("inside", [False, True])
def test_second_derivatives_of_rows(inside, bends):
    """A rule of `jax.custom_jvp` was dropped in them, inside of a loop: entries were off by up to a quarter."""
    pressure, xi0 = PRESSURE[:3], XI0[:3]
    of = jax.jit if inside else lambda function: function
    compositions = [jax.hessian(squares), jax.jacrev(jax.grad(squares)), jax.jacfwd(jax.jacfwd(squares))]
    for second in compositions if inside else compositions[:1]:  # what is composed makes no difference to where
        found = of(second)(pressure, xi0)
        np.testing.assert_allclose(np.diag(found), bends, rtol=1e-6)
        np.testing.assert_allclose(found - np.diag(np.diag(found)), 0.0, atol=1e-16)


@pytest.mark.slow
def test_derivatives_by_one_number_of_those_by_another():
    pressure, xi0 = PRESSURE[:3], XI0[:3]
    mixed = lambda times: jnp.sum(jax.grad(squares)(pressure, xi0, times))  # noqa: E731
    h = 3e-4
    ends = [float(mixed(1.0 + k * h)) for k in (-2, -1, 1, 2)]
    numeric = (ends[0] - 8.0 * ends[1] + 8.0 * ends[2] - ends[3]) / (12.0 * h)
    assert float(jax.grad(mixed)(1.0)) == pytest.approx(numeric, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("of", [lambda one: one, jax.grad])
def test_batches_side_by_side_outside_of_jit(of):
    """Known phases are arrays of NumPy there, which a traced number did not index."""
    xi0 = np.asarray(XI0[:2])
    one = of(lambda pressure: squares(pressure, xi0))
    pressures = PRESSURE[:4].reshape(2, 2)
    found = jax.vmap(one)(pressures)
    np.testing.assert_allclose(found, [one(p) for p in pressures], rtol=1e-6)
    wires = jax.vmap(lambda times: squares(np.asarray(pressures[0]), xi0, times))(jnp.asarray([1.0, 1.05]))
    np.testing.assert_allclose(wires, [squares(pressures[0], xi0, t) for t in (1.0, 1.05)], rtol=1e-6)
