"""Courses of many lengths run few programs, and give what they would give at their own length."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.numerics.lengths import SHORTEST, fixed_length, going_on
from pneusma_jax.simulate import history as module


def test_fixed_lengths_hold_every_course_and_are_few():
    lengths = [fixed_length(rows) for rows in range(1, 5000)]
    assert all(length >= rows for rows, length in enumerate(lengths, 1))
    assert max(length / max(rows, SHORTEST) for rows, length in enumerate(lengths, 1)) <= 1.5
    assert len(set(lengths)) < 16 and all(fixed_length(length) == length for length in lengths)


def test_a_clock_goes_on_at_its_last_interval():
    np.testing.assert_allclose(going_on(np.array([0.0, 1.0, 1.5]), 5), [0.0, 1.0, 1.5, 2.0, 2.5])
    np.testing.assert_allclose(going_on(np.array([3.0]), 3), 3.0)


@pytest.mark.parametrize(
    ("design", "rows"),
    [("pneuflex_s", 1), *(pytest.param("pneusma1", rows, marks=pytest.mark.slow) for rows in (1, 5, 65))],
)
def test_a_history_is_what_it_is_at_its_own_length(design, rows, monkeypatch):
    body, pressure = pj.make_actuator(design), np.linspace(1e3, 25e3, rows)
    phases = tuple(pj.MartensiteFraction(1.0 - 0.6 * np.linspace(0.0, 1.0, rows)) for _ in body.springs)
    found = pj.simulate_history(body, pressure, phases)
    monkeypatch.setattr(module, "fixed_length", lambda rows: rows)
    own = pj.simulate_history(body, pressure, phases)
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(own), strict=True):
        assert one.shape == other.shape and one.dtype == other.dtype
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-14)


@pytest.mark.slow
def test_a_history_of_known_values_may_stand_in_a_larger_program():
    body, states = pj.make_actuator("pneusma2"), pj.make_actuator("pneusma2").fresh_states()
    phases = tuple(pj.MartensiteFraction(jnp.full(5, x)) for x in (1.0, 0.6))
    curvature = lambda: pj.simulate_history(body, jnp.full(5, 2e4), phases, states, time=jnp.arange(5.0)).rows.curvature  # noqa: E731
    found = jax.jit(lambda x: x * curvature())(2.0)
    np.testing.assert_allclose(found, 2.0 * np.asarray(curvature()), rtol=1e-12)


def test_courses_of_two_lengths_are_traced_once(monkeypatch):
    body, lengths = pj.make_actuator("pneuflex_s"), []
    whole = module._simulate
    monkeypatch.setattr(module, "_simulate", lambda *given: lengths.append(len(given[1])) or whole(*given))
    for rows in (66, 90):
        found = pj.simulate_history(body, np.full(rows, 2e4))
        assert found.rows.curvature.shape == (rows,) and bool(found.converged.all())
    assert lengths == [96, 96]
