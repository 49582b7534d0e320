"""Leads add to a reading and are heated by nobody's model: the wire is heated by I^2 times its own resistance."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.control.plant import Plant
from fitting.design.bodies import build_body, plan_of
from fitting.invert.electrical import electrical, holding_power
from fitting.invert.forward import fresh, states_of
from fitting.specimens.saved_models import AugmentedModel, add_effect
from pneusma_jax.effects import find_effect
from pneusma_jax.nitinol.thermal import Heating

OHMS = 0.036


def leads(ohms):
    """So many ohms beside the wire; without any, one compiled program serves both."""
    return find_effect("series_resistance")(ohms=ohms)


def warmer(per_kelvin):
    """A resistance of the wire itself that rises with the temperature."""
    return find_effect("resistance_temperature_coefficient")(alpha_m=per_kelvin, alpha_a=per_kelvin)


def heated(ohms, per_kelvin=0.0):
    """PneuSMA1 whose spring gets 0.3 A for a minute."""
    time, effects = np.arange(0.0, 60.0, 2.0), (leads(ohms), warmer(per_kelvin))
    drives = (Heating(np.full(time.size, 0.3)),)
    return pj.simulate_history(pj.make_actuator("pneusma1"), np.full(time.size, 20e3), drives, time=time, effects=effects)


def test_a_current_heats_the_wire_and_not_its_leads():
    plain, with_leads = heated(0.0), heated(OHMS)
    np.testing.assert_allclose(with_leads.temperatures[:, 0], plain.temperatures[:, 0], rtol=1e-12)
    shown = with_leads.rows.springs[0].resistance - plain.rows.springs[0].resistance
    np.testing.assert_allclose(shown, OHMS, rtol=1e-6)
    # a resistance of the wire itself is heated
    assert np.max(np.abs(heated(0.0, 8e-4).temperatures[:, 0] - plain.temperatures[:, 0])) > 0.1


def test_a_plant_in_a_loop_is_heated_like_its_history():
    body, last = pj.make_actuator("pneusma2"), []
    begin, step = eqx.filter_jit(Plant.begin), eqx.filter_jit(Plant.step)
    for ohms in (0.0, OHMS):
        plant = Plant(body, (leads(ohms),))
        memory = begin(plant, jnp.asarray(20e3))
        for k in range(5):
            given = (20e3, np.array([0.0, 0.3]), 2.0 * k, 2.0)
            memory, seen = step(plant, memory, *map(jnp.asarray, given))
        last.append(seen)
    np.testing.assert_allclose(last[1].temperatures, last[0].temperatures, rtol=1e-12)
    np.testing.assert_allclose(last[1].resistances - last[0].resistances, OHMS, rtol=1e-6)


def test_currents_of_an_inverse_count_the_wire_alone():
    pressure, fractions = np.array([20e3]), np.array([[1.0, 0.3]])
    told = []
    for ohms in (0.0, OHMS):
        plan = plan_of("pneusma2", model=AugmentedModel(added=(add_effect(leads(ohms), "here"),)))
        body = build_body(plan, {}, plan.materials())
        told.append(electrical(states_of(body, pressure, fractions, fresh(body))))
    (wire, current), (shown, with_leads) = told
    np.testing.assert_allclose(shown - wire, OHMS, rtol=1e-9)
    np.testing.assert_allclose(with_leads, current, rtol=1e-9)
    spring = body.segments[0].springs[1]
    degrees = spring.alloy.T_mid + spring.alloy.T_width * np.log(0.7 / 0.3)
    assert with_leads[0, 1] ** 2 * wire[0, 1] == pytest.approx(float(holding_power(spring, degrees)), rel=1e-9)
