"""Batched rows with several equilibria: the same as one by one, and what was missed is noticed."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.actuator import equilibrium, several
from pneusma_jax.actuator.balance import Problem
from pneusma_jax.actuator.root_find import all_roots, stiffness_signs

ROWS = 400


@pytest.fixture(scope="module")
def batch():
    """Rows with the resistances of random states, and what a batch makes of them."""
    rng, body = np.random.default_rng(4), pj.make_actuator("pneusma2")
    pressure, xi0 = rng.uniform(0.0, 50e3, ROWS), rng.uniform(0.0, 1.0, (2, ROWS))
    true = pj.solve_batch(body, pressure, tuple(pj.MartensiteFraction(x) for x in xi0))
    drive = tuple(pj.Resistance(np.asarray(s.resistance)) for s in true.springs)
    return body, pressure, drive, true, pj.solve_batch(body, pressure, drive)


def row_of(batch, k):
    body, pressure, drive, *_ = batch
    return body, pressure[k], tuple(pj.Resistance(a.value[k]) for a in drive)


def test_several_equilibria_are_those_that_one_row_alone_has(batch):
    *_, true, found = batch
    several_there = np.flatnonzero(np.asarray(found.status) == int(pj.Status.several_equilibria))
    assert 5 <= len(several_there) <= 40
    for k in several_there:
        own = pj.solve(*row_of(batch, k))
        assert int(own.equilibria) == int(found.equilibria[k]) >= 3
        assert bool(own.stable) == bool(found.stable[k])
        np.testing.assert_allclose(found.curvature[k], own.curvature, rtol=0.0, atol=1e-7)
    alone = np.asarray(found.status) == int(pj.Status.converged)
    assert alone.sum() + len(several_there) == ROWS
    np.testing.assert_allclose(found.curvature[alone], true.curvature[alone], rtol=0.0, atol=1e-6)


def test_no_row_of_known_numbers_is_left_to_the_slow_search(batch, monkeypatch):
    body, pressure, drive, *_, found = batch
    monkeypatch.setattr(equilibrium, "_hard", lambda *row: pytest.fail("a row was solved alone"))
    again = pj.solve_batch(body, pressure, drive)
    np.testing.assert_array_equal(again.curvature, found.curvature)


def test_an_equilibrium_that_was_missed_is_noticed(batch):
    """The signs of the stiffness add up to one over all equilibria, and to something else without one of them."""
    *_, found = batch
    k = int(np.flatnonzero(np.asarray(found.equilibria) == 3)[0])
    body, pressure, drive = row_of(batch, k)
    states = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), body.fresh_states())
    problem = Problem(body, jnp.asarray(pressure), drive, states)
    roots = all_roots(problem)
    signed = [jnp.append(stiffness_signs(problem, root)[1], root) for root in roots.unknowns[:3]]
    signed = jnp.concatenate([signed[0][None], signed[1][None], signed[2][None]])
    rows = jax.tree.map(lambda x: jnp.asarray(x)[None], (pressure, drive, states))
    for kept in ([True, True, True], [False, True, True], [True, False, True], [True, True, False]):
        args = rows, signed[None], jnp.asarray([kept]), jnp.zeros(1, int)
        assert bool(several._least_heated(body, *args)[1][0]) == all(kept)
