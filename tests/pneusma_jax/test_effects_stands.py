"""What each effect does to a spring, a wire and a coupon, against a calculation by hand."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_programs import AREA, GAUGE, PROTOCOLS, ROWS, TIME, UP_AND_DOWN, seen, specimen, without
from scipy.optimize import brentq

import pneusma_jax as pj
from pneusma_jax.effects import find_effect
from pneusma_jax.effects.phases import REGIONS
from pneusma_jax.effects.sensors import ahead, followed
from pneusma_jax.effects.wall import StrainStiffening, ViscoelasticRelaxation
from pneusma_jax.pipeline import Known

UP = slice(0, 16)  # the first rise of UP_AND_DOWN
DOWN = slice(17, 30)
COLD = np.ones(ROWS)


@pytest.fixture(scope="module")
def alloy():
    return specimen("S").alloy


def ratio(one, other):
    return np.asarray(one) / np.asarray(other)


# ---------------------------------------------------------------- coupon


@pytest.mark.parametrize("stiffening", [0.0, 2.0])
def test_a_soft_load_train_adds_its_own_length(stiffening):
    give, strain = 2e-3, PROTOCOLS["E"]["strain"]
    found = seen("E", {"load_train_compliance.give": give, "load_train_compliance.stiffening": stiffening})
    law = specimen("E")
    np.testing.assert_allclose(found["stress"], law(found["true_strain"]), rtol=1e-12)
    force = found["stress"] * AREA
    recorded = found["true_strain"] + give * force / (1.0 + stiffening * np.abs(force)) / GAUGE
    np.testing.assert_allclose(recorded, strain, rtol=1e-10, atol=1e-14)
    assert np.max(strain - found["true_strain"]) > 0.02


def test_a_load_cell_on_a_coupon_errs_by_force_over_area():
    moved = seen("E", {"force_calibration.offset": 0.02, "force_calibration.drift": 1e-4})["stress"]
    np.testing.assert_allclose(moved - without("E")["stress"], (0.02 + 1e-4 * TIME) / AREA, rtol=1e-9)


@pytest.mark.parametrize("lag", [0.0, 0.5])
def test_a_row_without_an_answer_leaves_later_rows_of_a_late_channel(lag):
    """It had made all rows after it NaN, even without a lag."""
    time, course = jnp.arange(12.0), jnp.sin(jnp.arange(12.0))
    found = np.asarray(followed(time, course.at[4].set(jnp.nan), jnp.asarray(lag)))
    assert np.flatnonzero(np.isnan(found)).tolist() == [4]
    np.testing.assert_allclose(found[8:], followed(time, course, jnp.asarray(lag))[8:], atol=0.02)


@pytest.mark.parametrize("filtered", [0.5, 1.0])
def test_a_late_channel_may_follow_by_a_filter(filtered):
    """A ramp is late by the whole delay at its end, whatever part of it a filter makes; its beginning is rounded."""
    lag = find_effect("channel_lag")(delay=4.0, filtered=filtered)
    late = lag.recorded({"force": jnp.asarray(TIME)}, jnp.asarray(TIME))["force"]
    since, tau = np.maximum(TIME - 4.0 * (1.0 - filtered), 0.0), 4.0 * filtered
    exact = since - tau * (1.0 - np.exp(-since / tau))
    np.testing.assert_allclose(late, exact, atol=1e-12)
    assert late[-1] == pytest.approx(TIME[-1] - 4.0, abs=1e-6)



@pytest.mark.parametrize("delay", [0.7, 2.0, 5.3])
def test_a_late_channel_shows_what_was(delay):
    bare = without("E")["stress"]
    late = seen("E", {"channel_lag.delay": delay})["stress"]
    np.testing.assert_allclose(late, np.interp(TIME - delay, TIME, bare), rtol=1e-12, atol=1e-9)


def relaxed(elastic, share, tau):
    """An elastic stress with its overstress, by the exact rule of one Maxwell element over each row."""
    over = np.zeros(len(elastic))
    for k in range(1, len(elastic)):
        ratio = (TIME[k] - TIME[k - 1]) / tau
        over[k] = np.exp(-ratio) * over[k - 1] - np.expm1(-ratio) / ratio * (elastic[k] - elastic[k - 1])
    return elastic + share * over


@pytest.mark.parametrize(
    "beside",
    [
        {"strain_stiffening.c_2": 5e3},
        {"mullins_softening.depth": 0.5, "strain_stiffening.c_3": 4e2},
        {"permanent_set.share": 0.05},
    ],
)
def test_all_of_the_elastic_stress_relaxes(beside):
    """A stiffening named beside a relaxation had not relaxed, nor had a softening softened the overstress."""
    elastic = np.asarray(seen("E", beside)["stress"])
    found = seen("E", beside | {"viscoelastic_relaxation.g_1": 0.4, "viscoelastic_relaxation.tau_1": 3.0})
    np.testing.assert_allclose(found["stress"], relaxed(elastic, 0.4, 3.0), rtol=1e-9, atol=1e-6)
    assert np.max(np.abs(found["stress"] - elastic)) > 0.02 * np.max(elastic)


def test_the_order_of_relaxation_and_stiffening_does_not_matter():
    """Values and derivatives, of the stress that is left of a held strain."""
    strain, time = np.array([0.0, 1.0, 1.0, 1.0]), np.array([0.0, 1.0, 4.0, 400.0])

    def held(given):
        relaxes = ViscoelasticRelaxation(g_1=given[0], tau_1=given[1])
        pair = relaxes, StrainStiffening(c_2=given[2])
        both = [pj.simulate_coupon(specimen("E"), strain, time=time, effects=e).rows.stress for e in (pair, pair[::-1])]
        return jnp.stack(both)

    at = jnp.array([0.3, 5.0, 4e3])
    (one, other), slopes = jax.jit(lambda x: (held(x), jax.jacfwd(held)(x)))(at)
    np.testing.assert_allclose(one, other, rtol=1e-12)
    np.testing.assert_allclose(slopes[0], slopes[1], rtol=1e-9, atol=1e-9)
    elastic = float(one[-1])
    fresh = -np.expm1(-1.0 / 5.0) / (1.0 / 5.0)
    np.testing.assert_allclose(one[1:3] / elastic, 1.0 + 0.3 * fresh * np.exp([0.0, -3.0 / 5.0]), rtol=1e-9)
    by_g = elastic * fresh  # slope of the peak by g_1, of all of the stress
    np.testing.assert_allclose(slopes[0][1, 0], by_g, rtol=1e-9)


def test_softening_spares_the_virgin_curve_and_halves_below_it():
    bare, strain = without("E")["stress"], PROTOCOLS["E"]["strain"]
    soft = seen("E", {"mullins_softening.depth": 0.5, "mullins_softening.scale": 0.1})["stress"]
    np.testing.assert_allclose(soft[UP], bare[UP], rtol=1e-12)
    most = np.max(strain[:17])
    wanted = 1.0 - 0.5 * (1.0 - np.exp(-(most - strain[DOWN]) / 0.1)) / (1.0 - np.exp(-10.0))
    np.testing.assert_allclose(ratio(soft[DOWN], bare[DOWN]), wanted, rtol=1e-9)


@pytest.mark.parametrize(("scale", "linear"), [(0.1, False), (10.0, True)])
def test_softening_loses_its_depth_at_full_unloading(scale, linear):
    """Over a long scale the loss grows linearly on the way, over a short one at once."""
    half = ROWS // 2
    strain = np.concatenate([np.linspace(1e-6, 0.8, half), np.linspace(0.8, 1e-6, ROWS - half)])
    names = {"depth": 0.15, "scale": scale, "relative": 1.0}
    soft = seen("E", {f"mullins_softening.{name}": x for name, x in names.items()}, strain=strain)["stress"]
    lost = 1.0 - ratio(soft, without("E", strain=strain)["stress"])[half:]
    np.testing.assert_allclose(lost[-1], 0.15, rtol=1e-4)
    straight = 0.15 * (1.0 - strain[half:] / 0.8)
    assert np.allclose(lost, straight, rtol=0.06, atol=1e-9) == linear
    assert np.all(lost > straight - 1e-9)


@pytest.mark.parametrize("energy", [0.0, 1.0])
def test_softening_never_takes_more_than_its_depth(energy):
    strain = np.concatenate([np.linspace(0.0, 5.0, ROWS // 2), np.linspace(5.0, 0.0, ROWS - ROWS // 2)])
    names = {"depth": 0.7, "scale": 10.0, "energy": energy}
    soft = seen("E", {f"mullins_softening.{name}": x for name, x in names.items()}, strain=strain)["stress"]
    lost = 1.0 - ratio(soft, np.maximum(without("E", strain=strain)["stress"], 1e-9))[ROWS // 2 : -1]
    assert np.all(lost <= 0.7 + 1e-9) and lost[-1] > 0.6


def test_relaxation_after_a_step_decays_with_its_time():
    strain = np.where(TIME < 3.0, 0.0, 0.4)
    bare = without("E", strain=strain)["stress"]
    drawn = seen("E", {"viscoelastic_relaxation.g_2": 0.3, "viscoelastic_relaxation.tau_2": 12.0}, strain=strain)
    over = drawn["stress"][2:] - bare[2:]
    # the step takes one row of 2 s, in which the stress rises linearly
    first = 0.3 * bare[2] * (1.0 - np.exp(-2.0 / 12.0)) / (2.0 / 12.0)
    np.testing.assert_allclose(over, first * np.exp(-(TIME[2:] - TIME[2]) / 12.0), rtol=1e-9, atol=1e-6)


def test_set_moves_the_rest_length_by_cycles():
    law, strain = specimen("E"), PROTOCOLS["E"]["strain"]
    found = seen("E", {"permanent_set.share": 0.05, "permanent_set.cycles": 0.5})["stress"]
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(strain)))])
    most = np.maximum.accumulate(strain)
    rest = 0.05 * most[:-1] * (1.0 - np.exp(-path[:-1] / (2.0 * np.maximum(most[:-1], 1e-6)) / 0.5))
    np.testing.assert_allclose(found[1:], law(strain[1:] - rest), rtol=1e-9, atol=1e-6)


def test_stiffening_is_yeohs():
    stretch = 1.0 + PROTOCOLS["E"]["strain"]
    excess = stretch**2 + 2.0 / stretch - 3.0
    more = 2.0 * (stretch - stretch**-2) * (2.0 * 3e3 * excess + 3.0 * 100.0 * excess**2)
    found = seen("E", {"strain_stiffening.c_2": 3e3, "strain_stiffening.c_3": 100.0})["stress"]
    np.testing.assert_allclose(found - without("E")["stress"], more, rtol=1e-9, atol=1e-6)


# ---------------------------------------------------------------- spring


def test_leads_add_their_resistance_and_nothing_else():
    bare, found = without("S"), seen("S", {"series_resistance.ohms": 0.12})
    np.testing.assert_allclose(found["resistance"] - bare["resistance"], 0.12, rtol=1e-9)
    np.testing.assert_allclose(found["force"], bare["force"], rtol=1e-12)


def test_a_temperature_coefficient_follows_the_reversible_curve(alloy):
    xi0 = np.linspace(0.9, 0.1, ROWS)
    found = seen("S", {"resistance_temperature_coefficient.alpha_a": 1e-3}, xi0=xi0)["resistance"]
    warm = float(alloy.T_mid) + float(alloy.T_width) * np.log((1.0 - xi0) / xi0)
    wanted = 1.0 + (1.0 - xi0) * 1e-3 * (warm - 22.0)
    np.testing.assert_allclose(ratio(found, without("S", xi0=xi0)["resistance"]), wanted, rtol=1e-9)


def test_a_recorded_temperature_counts_where_there_is_one(alloy):
    """Of two recordings one has a thermometer. The other's wire is as warm as its fraction says."""
    effect = find_effect("resistance_temperature_coefficient")(alpha_m=1e-3, alpha_a=1e-3)
    known = lambda degrees: Known({"temperature": jnp.asarray(degrees), "spring": specimen("S")})  # noqa: E731
    recorded, none = (float(effect._factor(known(x), (0.0, 1.0), jnp.asarray(0.5))) for x in (41.0, np.nan))
    assert recorded == pytest.approx(1.019, abs=1e-12)
    assert none == pytest.approx(1.0 + 1e-3 * (float(alloy.T_mid) - 22.0), abs=1e-12)


def test_held_variants_keep_the_resistance_of_their_strain(alloy):
    drive = dict(elongation=60e-3 * UP_AND_DOWN, xi0=COLD)
    bare = without("S", **drive)
    found = seen("S", {"detwinned_resistivity_memory.share": 1.0}, **drive)
    unloaded = 30
    held = float(bare["true_gamma_R"][unloaded] / alloy.gamma_L)
    wanted = float(alloy.rho_m_of(held)) * float(specimen("S").geometry.wire_length)
    assert held > 1.5 * float(alloy.xi_sm(bare["true_gamma"][unloaded]))
    np.testing.assert_allclose(found["resistance"][unloaded], wanted, rtol=1e-9)
    np.testing.assert_allclose(found["resistance"][UP], bare["resistance"][UP], rtol=1e-12)


def test_fewer_turns_stretch_further_and_a_longer_spring_less():
    x = 30e-3 * UP_AND_DOWN
    turned = seen("S", {"inactive_coils.coils": 4.0}, elongation=x)["force"]
    np.testing.assert_allclose(turned, without("S", elongation=x / (1.0 - 4.0 / 52.0))["force"], rtol=1e-10)
    longer = seen("S", {"prestrain_error.shift": 1e-3}, elongation=x)["force"]
    np.testing.assert_allclose(longer, without("S", elongation=x - 1e-3)["force"], rtol=1e-10)


def test_opening_coils_shorten_the_lever():
    bare, found = without("S")["force"], seen("S", {"large_helix_angle.degree": 1.0})["force"]
    geometry = specimen("S").geometry
    turn, pitch = np.pi * float(geometry.coil_diameter), float(geometry.initial_pitch)
    wire = np.hypot(turn, pitch)  # of one coil, whose length stays
    opened = np.sqrt(wire**2 - (pitch * (1.0 + PROTOCOLS["S"]["elongation"] / 14e-3)) ** 2)
    np.testing.assert_allclose(ratio(found, bare), turn / opened, rtol=1e-9)


def test_closed_coils_pull_together_and_push_apart():
    x = PROTOCOLS["S"]["elongation"]
    found = seen("S", {"coil_contact.tension": 0.1, "coil_contact.opening": 2e-3, "coil_contact.stop": 800.0})
    wanted = 0.1 * (1.0 - np.exp(-np.maximum(x, 0.0) / 2e-3)) + 800.0 * np.minimum(x, 0.0)
    np.testing.assert_allclose(found["force"] - without("S")["force"], wanted, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("stiffening", [0.0, 2.0])
def test_a_stand_that_gives_takes_its_share(stiffening):
    give, name = 1e-3, "load_train_compliance"
    found = seen("S", {f"{name}.give": give, f"{name}.stiffening": stiffening})["force"]
    taken = give * found / (1.0 + stiffening * np.abs(found))
    again = without("S", elongation=PROTOCOLS["S"]["elongation"] - taken)["force"]
    np.testing.assert_allclose(again, found, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("spread", [0.0, 1.2])
def test_the_lower_branch_is_a_gap_below_once_the_strain_has_turned(spread):
    drive, form = dict(xi0=np.full(ROWS, 0.6)), dict(gap_m=10e6, gap_a=30e6, width=0.01, closed=0.03, spread=spread)
    bare = without("S", **drive)
    found = seen("S", {f"transformation_hysteresis.{name}": value for name, value in form.items()}, **drive)
    drop = bare["true_stress"] - found["true_stress"]
    np.testing.assert_allclose(drop[UP], 0.0, atol=1e-3)
    back = np.max(bare["true_gamma"][:17]) - bare["true_gamma"][DOWN]
    height = np.minimum(np.abs(bare["true_gamma"][DOWN]) / 0.03, 1.0)
    widths = 0.01 * np.exp(spread * np.linspace(-1.0, 1.0, REGIONS))
    returned = np.minimum(back[:, None] / widths, 1.0).mean(axis=1)
    np.testing.assert_allclose(drop[DOWN], 18e6 * height * returned, rtol=1e-8)


def test_the_r_phase_is_soft_on_cooling_only(alloy):
    drive = dict(elongation=np.full(ROWS, 10e-3), xi0=0.5 + 0.45 * np.cos(np.pi * TIME / 47.0))
    bare, found = without("S", **drive), seen("S", {"r_phase.strain": 5e-3, "r_phase.onset": 10.0}, **drive)
    drop = bare["true_stress"] - found["true_stress"]
    heating, cooling = slice(6, 24), slice(28, ROWS)
    np.testing.assert_allclose(drop[heating], 0.0, atol=1e-3)
    xi0, gain = drive["xi0"][cooling], np.exp(10.0 / float(alloy.T_width))
    share = (1.0 - xi0) * xi0 * gain / (1.0 - xi0 + gain * xi0)
    strain = 5e-3 * share * np.tanh(bare["true_gamma"][cooling] / 5e-3)
    np.testing.assert_allclose(drop[cooling], np.asarray(alloy.modulus(xi0)) * strain, rtol=1e-8)


def test_stress_turns_more_of_the_wire_into_martensite(alloy):
    drive = dict(xi0=np.full(ROWS, 0.3))
    bare, found = without("S", **drive), seen("S", {"stress_shifted_transformation.shift": 1e-8}, **drive)
    logit = np.log(0.3 / 0.7) + 1e-8 * bare["true_stress"] / float(alloy.T_width)
    wanted = alloy.shear_stress(bare["true_gamma"], 1.0 / (1.0 + np.exp(-logit)), bare["true_gamma_R"])
    np.testing.assert_allclose(found["true_stress"], wanted, rtol=1e-9)


def test_pushed_stress_alone_is_scaled():
    x = np.linspace(-3e-3, 5e-3, ROWS)
    bare, found = without("S", elongation=x), seen("S", {"tension_compression_asymmetry.excess": 0.4}, elongation=x)
    np.testing.assert_allclose(ratio(found["force"], bare["force"]), np.where(x < 0.0, 1.4, 1.0), rtol=1e-9)


def test_a_fast_pull_rises_by_the_strain_that_it_gained():
    drive = dict(elongation=20e-3 * np.minimum(TIME / 40.0, 1.0), xi0=COLD)
    bare = without("S", **drive)
    found = seen("S", {"self_heating_rate.rise": 0.2, "self_heating_rate.tau": 8.0}, **drive)
    gamma, gained = bare["true_gamma"], [0.0]
    for step in np.diff(gamma):
        gained.append(np.exp(-0.25) * gained[-1] + step * (1.0 - np.exp(-0.25)) / 0.25)
    np.testing.assert_allclose(
        found["true_stress"], bare["true_stress"] * (1.0 + 0.2 * np.array(gained) / 0.05), rtol=1e-9, atol=1e-3
    )


def test_shakedown_grows_with_the_path(alloy):
    drive = dict(elongation=30e-3 * UP_AND_DOWN, xi0=COLD)
    bare = without("S", **drive)
    found = seen("S", {"cyclic_shakedown.shift": 0.01, "cyclic_shakedown.cycles": 2.0}, **drive)
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(drive["elongation"])))])
    count = np.concatenate([[0.0], path[:-1]]) / (2.0 * np.max(drive["elongation"]))
    wanted = float(alloy.G_m) * 0.01 * (1.0 - np.exp(-count / 2.0))
    np.testing.assert_allclose(bare["true_stress"] - found["true_stress"], wanted, rtol=1e-8, atol=1e-3)


def test_zones_in_series_carry_one_stress(alloy):
    share, xi0 = 0.2, np.full(ROWS, 0.4)
    drive = dict(elongation=40e-3 * np.linspace(0.0, 1.0, ROWS), xi0=xi0)
    found = seen("S", {"uneven_heating.share": share}, **drive)
    cold = lambda g: float(alloy.shear_stress(g, 1.0, 0.0))  # noqa: E731
    limit = float(alloy.residual_strain_limit(0.0))
    assert limit < 1e-3
    for row in (20, 47):
        gamma, rest = found["true_gamma"][row], found["true_gamma_R"][row]
        warm = lambda g, r=rest: float(alloy.shear_stress(g, 0.4, r))  # noqa: E731
        both = lambda g, y=gamma, w=warm: w((y - share * g) / (1.0 - share)) - cold(g)  # noqa: E731
        zone = brentq(both, 0.0, 0.4)
        assert found["true_stress"][row] == pytest.approx(cold(zone), rel=2e-3)
        base = float(without("S", **drive)["true_stress"][row])
        assert abs(base - cold(zone)) > 0.02 * base


def test_a_zone_a_little_colder_has_its_own_fraction(alloy):
    share, colder, xi0 = 0.3, 1.5, 0.4
    fraction = 1.0 / (1.0 + np.exp(-(np.log(xi0 / (1.0 - xi0)) + colder)))  # that many widths colder
    drive = dict(elongation=40e-3 * np.linspace(0.0, 1.0, ROWS), xi0=np.full(ROWS, xi0))
    whole = seen("S", {"uneven_heating.share": share}, **drive)
    found = seen("S", {"uneven_heating.share": share, "uneven_heating.colder": colder}, **drive)
    cold = lambda g: float(alloy.shear_stress(g, fraction, 0.0))  # noqa: E731
    for row in (20, 30):
        gamma, rest = found["true_gamma"][row], found["true_gamma_R"][row]
        warm = lambda g, r=rest: float(alloy.shear_stress(g, xi0, r))  # noqa: E731
        both = lambda g, y=gamma, w=warm: w((y - share * g) / (1.0 - share)) - cold(g)  # noqa: E731
        zone = brentq(both, 0.0, 0.4)
        stress = found["true_stress"][row]
        assert stress == pytest.approx(cold(zone), rel=5e-3)
        base, fully = (float(x["true_stress"][row]) for x in (without("S", **drive), whole))
        assert abs(stress - base) > 0.01 * base and abs(stress - fully) > 0.01 * base


# ---------------------------------------------------------------- wire


def test_a_wire_heats_along_another_branch_than_it_cools():
    wire = specimen("W")
    temperature = np.interp(TIME, [0.0, 47.0, 94.0], [80.0, 0.0, 80.0])
    drive = dict(temperature=temperature, stress=np.full(ROWS, 80e6))
    found = seen("W", {"transformation_hysteresis.gap_T": 12.0, "transformation_hysteresis.width_T": 2.0}, **drive)
    phase = lambda t: np.asarray(wire.martensite_fraction_at(t))  # noqa: E731
    np.testing.assert_allclose(found["true_xi0"][12:23], phase(temperature[12:23]), rtol=1e-9)
    np.testing.assert_allclose(found["true_xi0"][35:], phase(temperature[35:] - 12.0), rtol=1e-9)


@pytest.mark.parametrize("lag", [0.9, 3.0])
def test_a_wire_is_warmer_than_its_thermometer_while_that_rises(lag):
    """A first-order follower, in closed form on both ramps, tells the wire's temperature some lags after a turn."""
    wire, rate = specimen("W"), 80.0 / 47.0
    temperature = 80.0 - rate * TIME
    behind = rate * lag * (1.0 - np.exp(-TIME / lag))
    up = TIME - 47.0
    rising = rate * up + np.exp(-np.maximum(up, 0.0) / lag) * (behind[-1] + rate * lag) - rate * lag
    read = np.where(up < 0.0, temperature + behind, rising)
    drive = dict(temperature=read, stress=np.full(ROWS, 80e6))
    found = seen("W", {"channel_lag.delay_temperature": lag}, **drive)["true_xi0"]
    wanted = np.asarray(wire.martensite_fraction_at(np.abs(temperature)))
    assert np.max(np.abs(without("W", **drive)["true_xi0"] - wanted)) > 0.05 * lag
    np.testing.assert_allclose(found, wanted, atol=0.01 * lag)
    late = (np.abs(up) > 8.0 * lag) & (TIME > 8.0 * lag)
    np.testing.assert_allclose(found[late], wanted[late], rtol=2e-3)


def test_time_that_stands_still_tells_a_thermometer_nothing():
    run = jax.jit(lambda t, x, lag: jax.jvp(lambda lag: ahead(t, x, lag), (lag,), (1.0,)))
    time, course = np.array([0.0, 1.0, 1.0, 3.0, 4.0, 4.0]), np.array([20.0, 22.0, 22.0, 25.0, 24.0, 24.0])
    once, among = [0, 1, 3, 4, 4, 4], [0, 1, 1, 2, 3, 3]
    for lag in (0.0, 0.5, 6.0):
        found, slope = (np.asarray(x) for x in run(time, course, lag))
        for one, single in zip((found, slope), run(time[once], course[once], lag), strict=True):
            np.testing.assert_allclose(one, np.asarray(single)[among], rtol=1e-12)
        assert np.array_equal(found, course) is (lag == 0.0)
        assert lag > 0.0 or np.allclose(slope, [2.0, 1.75, 1.75, 0.25, -1.0, -1.0])
    assert np.array_equal(run(np.ones(6), np.ones(6), 2.0)[0], np.ones(6))


def test_stress_raises_the_temperature_of_a_wire():
    wire, drive = specimen("W"), PROTOCOLS["W"]
    found = seen("W", {"stress_shifted_transformation.shift": 1e-7})
    wanted = wire.martensite_fraction_at(drive["temperature"] - 1e-7 * drive["stress"])
    np.testing.assert_allclose(found["true_xi0"], wanted, rtol=1e-9)


def test_the_leads_of_a_wire_shift_the_phase_that_its_resistance_tells():
    wire = specimen("W")
    leads = pj.effects.find_effect("series_resistance")(ohms=0.1)
    ohms = pj.WireResistance(np.linspace(2.2, 2.9, 6), 3.0, 2.0)
    simulate = lambda given, effects: pj.simulate_wire(  # noqa: E731
        wire, stress=jnp.full(6, 50e6), resistance=given, effects=effects
    )
    found = simulate(ohms, (leads,)).rows
    np.testing.assert_allclose(found.xi0, (np.linspace(2.2, 2.9, 6) - 0.1 - 2.0) / 1.0, rtol=1e-12)
    less = dataclasses.replace(ohms, value=ohms.value - 0.1)
    np.testing.assert_allclose(found.strain, simulate(less, ()).rows.strain, rtol=1e-12)
