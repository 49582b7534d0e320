"""What the rule of the residual strain decides: by what can be told, not by noise."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.characterise.spring.stand_tests import _phases, _Reading
from fitting.models.spring_law import Law
from pneusma_jax.nitinol import Spring, SpringState


@pytest.fixture(scope="module")
def law():
    """A cold spring that is pulled and comes back, twice."""
    body = pj.make_actuator("pneusma2").springs[0]
    loose = Spring(body.geometry, body.alloy, body.geometry.free_length)
    way = np.concatenate([np.linspace(0.0, 1.0, 20), np.linspace(1.0, 0.0, 20)])
    elongation = jnp.asarray(3.0 * float(body.geometry.free_length) * np.tile(way, 2))
    return Law(loose, jnp.zeros(()), elongation, None)


def test_rows_that_are_as_hot_as_anyone_can_tell_feel_their_own_heat(law):
    random, sd = np.random.default_rng(0), 1e-4
    xi0 = jnp.asarray(0.999 + sd * random.standard_normal(law.elongation.size))
    by_noise, by_what_is_told = law.decide(xi0), law.decide(xi0, 6.0 * sd)
    back = slice(21, 40)  # on the way back the memory is that of the pull
    remembered = np.asarray(xi0)[np.asarray(by_noise.hottest)[back]]
    assert remembered.mean() < 0.999 - 0.5 * sd  # the row whose noise was lowest
    assert not np.asarray(by_noise.hotter)[back].all() and np.asarray(by_what_is_told.hotter)[back].all()
    known = eqx.tree_at(lambda x: x.decisions, law, by_what_is_told, is_leaf=lambda x: x is None)
    truth, found = law.follow(jnp.full_like(xi0, 0.999)), known.follow(xi0)
    noisy = eqx.tree_at(lambda x: x.decisions, law, by_noise, is_leaf=lambda x: x is None).follow(xi0)
    bias = [float(jnp.mean((x.gamma_R - truth.gamma_R)[back])) for x in (found, noisy)]
    assert abs(bias[0]) < 0.4 * abs(bias[1]) and bias[1] < 0.0


def test_a_heated_row_is_hotter_whatever_the_slack(law):
    xi0 = jnp.where(jnp.arange(law.elongation.size) < 45, 1.0, 0.6)
    decisions = law.decide(xi0, 1e-3)
    assert bool(decisions.hotter[45]) and int(decisions.hottest[50]) >= 45
    warmer = law.decide(jnp.where(jnp.arange(xi0.size) < 25, 0.6, 0.62), 1e-3)
    assert not np.asarray(warmer.hotter)[26:40].any()  # twenty times the slack colder than it was


def test_a_margin_moves_only_what_is_marginal():
    alloy = pj.load_alloy("krl35")
    state, xi0 = SpringState.fresh(0.05), jnp.asarray(1.0)
    gamma = jnp.linspace(0.0, 0.15, 400)
    plain = alloy.remember(state, gamma, xi0).prestrain != 0.05
    later = alloy.remember(state, gamma, xi0, 5.0).prestrain != 0.05
    assert bool(jnp.all(plain == (alloy.remember(state, gamma, xi0, 0.0).prestrain != 0.05)))
    assert 0 < int(later.sum()) < int(plain.sum()) and bool(jnp.all(plain | ~later))
    assert bool(later[-1])


def test_the_cold_end_is_told_by_resistance_where_stiffness_hardly_differs():
    def reading(slope, rho):
        return _Reading(strain=5.0, gamma=0.2, slope=slope, resistivity=rho, unloads=True, isoresistive=False)

    # the test between is, by noise, the softest; the contrast is less than a per cent
    found = _phases([reading(1.00e9, 17.76), reading(9e9, 17.63), reading(0.99e9, 17.738)])
    assert [phase for phase, _ in found] == ["cold", "hot", "intermediate"]
    alike = _phases([reading(1.00e9, 17.76), reading(1.01e9, 17.77)])
    assert {phase for phase, _ in alike} == {"cold"}
