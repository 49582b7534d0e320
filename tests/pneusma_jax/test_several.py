"""Batched rows with several equilibria: the same as one by one, and what was missed is noticed."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.actuator import all_starts, several
from pneusma_jax.actuator.batches import Rows, taken
from pneusma_jax.actuator.root_count import counted
from pneusma_jax.actuator.root_find import STUCK
from pneusma_jax.numerics.newton import newton_rows

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
    for k in several_there[::5]:
        own = pj.solve(*row_of(batch, k))
        assert int(own.equilibria) == int(found.equilibria[k]) >= 3
        assert bool(own.stable) == bool(found.stable[k])
        np.testing.assert_allclose(found.curvature[k], own.curvature, rtol=0.0, atol=1e-7)
    alone = np.asarray(found.status) == int(pj.Status.converged)
    assert alone.sum() + len(several_there) == ROWS
    np.testing.assert_allclose(found.curvature[alone], true.curvature[alone], rtol=0.0, atol=1e-6)


def test_no_row_of_known_numbers_is_left_to_the_slow_search(batch, monkeypatch):
    body, pressure, drive, *_, found = batch
    monkeypatch.setattr(several, "by_all_starts", lambda *_: pytest.fail("rows got all starts"))
    again = pj.solve_batch(body, pressure, drive)
    np.testing.assert_array_equal(again.curvature, found.curvature)


def test_rows_far_beyond_the_grid_are_solved_though_they_are_looked_at_by_themselves(monkeypatch):
    """The grid reaches 50 kPa from the median, 100 kPa. With five rows at a time, the first and last five lie beyond."""
    body, pressure = pj.make_actuator("pneusma2"), np.linspace(0.0, 200e3, 30)
    xi0 = np.random.default_rng(4).uniform(0.0, 1.0, (2, 30))
    true = pj.solve_batch(body, pressure, tuple(pj.MartensiteFraction(x) for x in xi0))
    drive = tuple(pj.Resistance(np.asarray(s.resistance)) for s in true.springs)
    whole = pj.solve_batch(body, pressure, drive)
    monkeypatch.setattr(several, "PIECE", 5)
    found = pj.solve_batch(body, pressure, drive)
    np.testing.assert_array_equal(found.status, whole.status)
    np.testing.assert_allclose(found.curvature, whole.curvature, rtol=0.0, atol=1e-9)
    alone = np.asarray(found.status) == int(pj.Status.converged)
    assert alone[:5].all() and alone[-1]
    np.testing.assert_allclose(found.curvature[alone], true.curvature[alone], rtol=0.0, atol=1e-6)


def test_an_equilibrium_that_was_missed_is_noticed(batch):
    """The signs of the stiffness add up to one over all equilibria, and to something else without one of them."""
    *_, found = batch
    k = int(np.flatnonzero(np.asarray(found.equilibria) == 3)[0])
    body, pressure, drive = row_of(batch, k)
    states = jax.tree.map(np.asarray, body.fresh_states())
    rows = Rows(body, jax.tree.map(lambda x: np.asarray(x)[None], (pressure, drive, states)))
    known = all_starts.every_root(rows)
    assert known.real[0].sum() == 3 and known.whole[0]
    three = known.which[0, :3]
    for kept in ([0, 1, 2], [1, 2], [0, 2], [0, 1]):
        part = counted(rows, np.zeros(len(kept), int), taken(known.every, three[kept]))
        assert bool(part.whole[0]) == (len(kept) == 3)


def test_rows_whose_springs_remember_different_things_are_those_solved_alone(batch):
    body, pressure, drive, *_ = batch
    some = slice(0, 60)
    remembered = tuple(
        pj.SpringState(np.where(np.arange(60) < 40, 0.19, 0.15), np.ones(60)) for _ in body.springs
    )
    given = tuple(pj.Resistance(a.value[some]) for a in drive)
    found = pj.solve_batch(body, pressure[some], given, remembered)
    for k in (3, 20, 41, 59):
        own = tuple(jax.tree.map(lambda x: x[k], state) for state in remembered)  # noqa: B023
        alone = pj.solve(body, pressure[k], tuple(pj.Resistance(a.value[k]) for a in given), own, throw=False)
        assert int(alone.status) == int(found.status[k])
        np.testing.assert_allclose(found.curvature[k], alone.curvature, atol=1e-7)


def test_under_loads_every_equilibrium_is_listed_and_batches_say_so():
    """An actuator under a force of 1 N along it buckles: straight it is unstable, and bends to either side."""
    body = pj.make_actuator("pneusma2").with_loads(pj.TipForce([0.0, 0.0, -1.0]))
    cold = tuple(pj.MartensiteFraction(np.ones(3)) for _ in body.springs)
    every = pj.solve_all(body, 0.0)
    count = int(every.equilibria[0])
    curvature = np.asarray(every.curvature[:count])
    assert count == 3
    np.testing.assert_allclose(np.sort(curvature), [-max(curvature), 0.0, max(curvature)], atol=1e-6)
    assert max(curvature) > 10.0
    np.testing.assert_array_equal(every.stable[:3], np.abs(curvature) > 1.0)
    found, one = pj.solve_batch(body, np.zeros(3), cold), pj.solve(body, 0.0)
    assert set(np.asarray(found.status)) == {int(one.status)}
    assert set(np.asarray(found.stable)) == {bool(one.stable)}


def some_curvatures(batch):
    """Curvatures over pressure of four rows by resistance, of which the last has several equilibria."""
    body, pressure, drive, _, found = batch
    several_there = np.flatnonzero(np.asarray(found.equilibria) == 3)
    which = np.append(np.flatnonzero(np.asarray(found.equilibria) == 1)[:3], several_there[:1])
    given = tuple(pj.Resistance(a.value[which]) for a in drive)
    return lambda p: pj.solve_batch(body, p, given).curvature, pressure[which]


@pytest.mark.slow
def test_gradients_of_a_batch_are_those_of_differences(batch):
    curvatures, here = some_curvatures(batch)
    slopes = jax.grad(lambda p: curvatures(p).sum())(here)
    differences = (np.asarray(curvatures(here + 1.0)) - np.asarray(curvatures(here - 1.0))) / 2.0
    np.testing.assert_allclose(slopes, differences, rtol=1e-4)


@pytest.mark.slow
def test_a_batch_has_the_same_gradient_inside_of_jit(batch):
    curvatures, here = some_curvatures(batch)
    slopes = jax.grad(lambda p: curvatures(p).sum())
    np.testing.assert_allclose(jax.jit(slopes)(here), slopes(here), rtol=1e-9)


@pytest.fixture(scope="module")
def cold():
    """Rows of which one spring is exactly cold, or both are, and what a batch makes of them."""
    rng, body = np.random.default_rng(6), pj.make_actuator("pneusma2")
    pressure, xi0 = rng.uniform(0.0, 50e3, 120), rng.uniform(0.0, 1.0, (2, 120))
    xi0[0, :100], xi0[1, 90:] = 1.0, 1.0
    true = pj.solve_batch(body, pressure, tuple(pj.MartensiteFraction(x) for x in xi0))
    drive = tuple(pj.Resistance(np.asarray(s.resistance)) for s in true.springs)
    return body, pressure, drive, true


def test_rows_with_a_cold_spring_have_the_equilibria_of_one_row_alone(cold):
    body, pressure, drive, true = cold
    found = pj.solve_batch(body, pressure, drive)
    several_there = np.asarray(found.status) == int(pj.Status.several_equilibria)
    assert np.all(np.asarray(found.converged)) and 40 <= several_there.sum() <= 80
    alone = ~several_there
    np.testing.assert_allclose(found.curvature[alone], true.curvature[alone], rtol=0.0, atol=1e-6)
    one_cold = several_there & (np.arange(len(pressure)) % 100 < 90)  # two are a corner, and may hide a pair
    for k in np.flatnonzero(one_cold)[::12]:
        own = pj.solve(*row_of((body, pressure, drive), k))
        assert int(own.equilibria) == int(found.equilibria[k])
        np.testing.assert_allclose(found.curvature[k], own.curvature, rtol=0.0, atol=1e-6)


def test_few_rows_with_a_cold_spring_are_left_to_the_slow_search(cold, monkeypatch):
    """An equilibrium with an exactly cold spring has two slopes; counted by one of them, most rows seemed to
    have missed one."""
    left, slow = [], all_starts.every_root
    monkeypatch.setattr(all_starts, "every_root", lambda rows, *more: left.append(len(rows)) or slow(rows, *more))
    pj.solve_batch(*cold[:3])
    assert sum(left) <= 6


def test_an_attempt_that_stays_at_an_end_is_given_up():
    """The root is at -1, and the unknown is held to [0, 1]: without the rule the attempt goes on until it ends."""
    ends = {"free": 1, "few": 12, "closing": 1e-4, "count": jnp.zeros(2, int)}
    missed = lambda y, row: jnp.stack([y[0] + 0.3 * y[0] ** 3 - y[1], y[1] - row])  # noqa: E731
    begin, rows, none = jnp.full((2, 2), 0.9), jnp.asarray([-1.0, 0.5]), jnp.zeros(2, bool)
    unknowns, state = newton_rows(missed, rows, begin, ends | {"stuck": STUCK}, none, 2, jnp.asarray(40))
    assert int(state.count[0]) == STUCK and float(state.excess[0]) > 0.5 and float(unknowns[0, 1]) == 0.0
    assert float(unknowns[1, 1]) == pytest.approx(0.5, abs=1e-12)
    patient = newton_rows(missed, rows, begin, ends, none, 2, jnp.asarray(40))[1]
    assert int(patient.count[0]) > STUCK
