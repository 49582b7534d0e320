"""The force that keeps a segment straight, against a root of its own by SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import pneusma_jax as pj
from fitting.design.bodies import Body, Solved
from fitting.design.quantities import blocking_force
from pneusma_jax.actuator.balance import Problem, imbalance

PRESSURE, FRACTIONS = 30e3, (1.0, 0.4)


@pytest.fixture(scope="module")
def force_at():
    """The quantity itself; nothing of the equilibrium enters it but the fractions."""
    actuator = pj.make_actuator("pneusma2")
    drives = tuple(pj.MartensiteFraction(jnp.asarray(one)) for one in FRACTIONS)
    found = pj.solve(actuator, jnp.asarray(PRESSURE), drives)
    solved = lambda p: Solved(Body((actuator,), None), p, (found,), jnp.eye(4), None)  # noqa: E731
    return jax.jit(jax.value_and_grad(lambda p: blocking_force(solved(p), 0)))


def test_the_blocked_force_is_that_of_a_straight_balanced_segment(force_at):
    actuator = pj.make_actuator("pneusma2")
    drives = tuple(pj.MartensiteFraction(jnp.asarray(one)) for one in FRACTIONS)
    problem = Problem(actuator, jnp.asarray(PRESSURE), drives, actuator.fresh_states())
    straight = jax.jit(lambda x: imbalance(problem, x, jnp.zeros(2)))
    length = float(actuator.length)
    longer = brentq(lambda x: float(straight(x)[0]), -0.1 * length, 0.3 * length, xtol=1e-13)
    moment = float(straight(longer)[1] @ jnp.asarray(actuator.side_direction))
    expected = abs(moment) / (0.5 * (length + longer))
    assert expected > 1e-3
    assert float(force_at(jnp.asarray(PRESSURE))[0]) == pytest.approx(expected, rel=1e-8)


def test_the_blocked_force_has_a_derivative(force_at):
    slope = float(force_at(jnp.asarray(PRESSURE))[1])
    step = 30.0
    sides = [float(force_at(jnp.asarray(PRESSURE + one))[0]) for one in (-step, step)]
    np.testing.assert_allclose(slope, (sides[1] - sides[0]) / (2.0 * step), rtol=1e-5)
