"""Heat that reaches a spring taken to be cold: both forms of the heat, and both of the answer to it."""

from types import SimpleNamespace

import jax
import numpy as np
import pytest
from effect_programs import specimen

from pneusma_jax.effects.heat import OpposingSpringHeating
from pneusma_jax.nitinol.thermal import steady_temperature
from pneusma_jax.pipeline import Known

AIR, OHMS = 22.0, 3.6


def left(effect, arriving, air=None):
    """Fraction of spring 1 where so much heat of spring 2 arrives."""
    memory = {1: (0.0, 0.0, 0.0), 2: (0.0, arriving, 0.0)}
    known = {"number": 1, "spring": specimen("A").springs[0]} | ({} if air is None else {"temperature": air})
    return float(effect.phase(1.0, Known(known), memory))


def warmed(effect, xi0, current, rows=200, recorded=None):
    """Heat of spring 2 that has arrived after 2 s a row of a fraction, and of a current where there is one.

    Where other recordings have a current, `recorded` is 1 if this one has it, too, and else 0.
    """
    body = specimen("A")
    springs = [SimpleNamespace(xi0=1.0, resistance=OHMS), SimpleNamespace(xi0=xi0, resistance=OHMS)]
    known = {"actuator": body, "solved": SimpleNamespace(springs=springs), "interval": 2.0}
    known |= {} if current is None else {"currents": {2: current}}
    at = Known(known | ({} if recorded is None else {"has_currents": {2: recorded}}))
    memory = effect.begin(at)
    for _ in range(rows):
        memory = effect.remember(memory, at)
    return float(memory[2][1])


@pytest.mark.parametrize("along", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("gain", [0.0, 0.2, 0.9])
def test_lasting_full_heat_takes_the_share_of_the_gain_in_either_form(gain, along):
    effect = OpposingSpringHeating(gain=gain, along_curve=along)
    assert left(effect, 0.0) == pytest.approx(1.0, abs=1e-12)
    assert left(effect, 1.0) == pytest.approx(1.0 - gain, abs=1e-12)


@pytest.mark.parametrize("air", [None, 18.0, 26.0])
def test_along_the_reversible_curve_a_rise_of_temperature_takes_what_the_alloy_says(air):
    alloy = specimen("A").springs[0].alloy
    at_rest, rises = AIR if air is None else air, np.array([0.0, 4.0, 9.0, 16.0, 30.0])
    expected = [float(alloy.martensite_fraction_at(at_rest + x) / alloy.martensite_fraction_at(at_rest)) for x in rises]
    effect = OpposingSpringHeating(gain=1.0 - expected[3], along_curve=1.0)
    assert [left(effect, x / rises[3], air) for x in rises] == pytest.approx(expected, abs=1e-9)
    assert expected[-1] < 0.01  # more heat finds no martensite


def test_in_proportion_no_heat_takes_more_than_all():
    effect = OpposingSpringHeating(gain=0.5)
    assert [left(effect, x) for x in (0.5, 1.5, 3.0)] == pytest.approx([0.75, 0.25, 0.0])


@pytest.mark.parametrize("gain", [0.0, 1e-3])
def test_both_forms_begin_with_the_same_slope(gain):
    slopes = [
        jax.grad(lambda g, s=along: OpposingSpringHeating(gain=g, along_curve=s).phase(
            1.0, Known({"number": 1, "spring": specimen("A").springs[0]}), {2: (0.0, 1.0, 0.0)}
        ))(gain)
        for along in (0.0, 1.0)
    ]  # fmt: skip
    assert slopes == pytest.approx([-1.0, -1.0], rel=1e-6)


def test_heat_by_the_current_goes_on_where_all_is_austenite():
    """Its steady value is the wire's temperature rise over that at which 95 % is austenite."""
    spring = specimen("A").springs[1]
    alloy = spring.alloy
    full = alloy.T_mid + 3.0 * alloy.T_width - AIR
    assert 1.0 - float(alloy.martensite_fraction_at(AIR + full)) == pytest.approx(0.95, abs=0.005)
    by_austenite, by_current = OpposingSpringHeating(), OpposingSpringHeating(by_current=1.0)
    for current in (0.2, 0.4):
        rise = float(steady_temperature(alloy, spring.geometry, current, OHMS, 0.0))
        assert warmed(by_current, 0.0, current) == pytest.approx(rise / float(full), rel=1e-3)
        assert warmed(by_austenite, 0.0, current) == pytest.approx(1.0, rel=1e-3)


def test_without_a_current_the_heat_is_the_austenite():
    assert warmed(OpposingSpringHeating(by_current=1.0), 0.4, None) == pytest.approx(0.6, rel=1e-3)


@pytest.mark.parametrize("recorded", [0.0, 1.0])
def test_a_current_counts_in_the_recordings_that_have_it(recorded):
    """A recording without one was taken as unheated where another one had it."""
    effect, current = OpposingSpringHeating(by_current=1.0), 0.3 * recorded
    told = warmed(effect, 0.4, current, recorded=recorded)
    assert told == pytest.approx(warmed(effect, 0.4, current if recorded else None), rel=1e-9)
    assert recorded or told == pytest.approx(0.6, rel=1e-3)
