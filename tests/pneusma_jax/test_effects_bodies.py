"""What each effect does to an actuator and a tube, against a calculation by hand."""

import numpy as np
import pytest
from effect_programs import PROTOCOLS, ROWS, TIME, UP_AND_DOWN, names, run, seen, specimen, without
from scipy.integrate import solve_ivp

import pneusma_jax as pj

pytestmark = pytest.mark.slow  # one program each, with every effect of the kind: a minute to compile
RAMP = 300.0 * TIME  # Pa


def close(one, other, **more):
    np.testing.assert_allclose(one, other, **({"rtol": 1e-8, "atol": 1e-13} | more))


# ---------------------------------------------------------------- tube


def test_a_misread_pressure_is_another_pressure():
    wrong = {"gain": 1.05, "offset": 500.0, "drift": 10.0}
    found = seen("T", {f"pressure_calibration.{name}": value for name, value in wrong.items()}, pressure=RAMP)
    close(found["length"], without("T", pressure=1.05 * RAMP + 500.0 + 10.0 * TIME)["length"])


def test_a_chamber_lags_a_ramp_by_its_time_constant():
    laminar = {"pressure_lag.tau": 3.0, "pressure_lag.laminar": 1e9}
    found = seen("T", laminar, pressure=RAMP)["length"]
    behind = 3.0 * (1.0 - np.exp(-TIME / 3.0))
    close(found, without("T", pressure=RAMP - 300.0 * behind)["length"])


def test_a_chamber_that_is_far_behind_fills_as_through_an_orifice():
    pressure = np.where(TIME > 5.0, 20e3, 0.0)
    found = seen("T", {"pressure_lag.tau": 2.0, "pressure_lag.laminar": 3e3}, pressure=pressure)["length"]

    def falls(time, drop):
        k = np.clip(np.searchsorted(TIME, time, side="right") - 1, 0, len(TIME) - 2)
        rate = (pressure[k + 1] - pressure[k]) / (TIME[k + 1] - TIME[k])
        return rate - drop / (2.0 * ((9e6 + drop**2) / (9e6 + 1e6)) ** 0.25)

    drop = solve_ivp(falls, TIME[[0, -1]], [0.0], t_eval=TIME, max_step=0.05, rtol=1e-8).y[0]
    assert 5e3 < drop.max() < 20e3
    inside = without("T", pressure=pressure - drop)["length"]
    close(found, inside, rtol=0.0, atol=0.01 * np.ptp(inside))


def test_the_signature_of_a_lag_is_the_rate_of_the_pressure():
    slopes = run("T", pressure=RAMP)[1]["length"]
    slugs = [f"{slug}.{name}" for slug, name, _ in names("T")]
    lag, offset = (
        np.asarray(slopes)[:, slugs.index(name)] for name in ("pressure_lag.tau", "pressure_calibration.offset")
    )
    close(lag[1:], -300.0 * offset[1:], rtol=0.01)  # a time constant of a kPa, at no drop


def test_a_wider_bore_pushes_as_a_higher_pressure_would():
    found = seen("T", {"radial_expansion.per_pressure": 2e-6}, pressure=RAMP)["length"]
    close(found, without("T", pressure=RAMP * (1.0 + 2e-6 * RAMP))["length"])


def test_stress_across_the_wall_adds_to_the_axial_one():
    tube = specimen("T")
    bore, wall = float(tube.section.enclosed_area), float(tube.section.moments()[0])
    found = seen("T", {"thick_wall.share": 0.3, "thick_wall.stretched": 0.2}, pressure=RAMP)["length"]
    strain = found / float(tube.length) - 1.0
    stress = np.asarray(tube.silicone(strain)) + RAMP * (0.3 + 0.2 * strain)
    close(stress * wall, RAMP * bore, rtol=1e-6, atol=1e-9)


def test_a_tube_rubs_against_its_wrapping_both_ways():
    tube = specimen("T")
    area, radius = float(tube.section.enclosed_area), float(tube.section.radius)
    friction = {"wrap_friction.constant": 2e-4, "wrap_friction.slip": 0.01, "wrap_friction.spread": 0.0}
    found = seen("T", friction)["length"]
    resists = 2e-4 / radius / area  # Pa
    pressure = PROTOCOLS["T"]["pressure"]
    rising, falling = slice(8, 15), slice(20, 27)
    close(found[rising], without("T", pressure=pressure - resists)["length"][rising], rtol=1e-7)
    close(found[falling], without("T", pressure=pressure + resists)["length"][falling], rtol=1e-7)


def test_a_recording_that_begins_loaded_begins_with_friction_or_without():
    """As it says: `begun` is 1 where the tube came there from rest, and its friction is all there."""
    tube, steady = specimen("T"), np.full(ROWS, 30e3)
    area, radius = float(tube.section.enclosed_area), float(tube.section.radius)
    friction = {"wrap_friction.constant": 2e-4, "wrap_friction.slip": 0.01, "wrap_friction.spread": 1.0}
    lengths = [
        seen("T", friction | {"wrap_friction.begun": begun}, pressure=steady)["length"][0]
        for begun in (0.0, 0.5, 1.0, -1.0)
    ]
    close(lengths[0], without("T", pressure=steady)["length"][0])
    close(lengths[2], without("T", pressure=steady - 2e-4 / radius / area)["length"][0], rtol=1e-7)
    assert lengths[2] < lengths[1] < lengths[0] < lengths[3]


def test_an_eccentric_bore_bends_a_tube_either_way_and_lengthens_it_alike():
    one, other = (seen("T", {"wall_eccentricity.shift": shift}) for shift in (1e-4, -1e-4))
    assert np.max(np.abs(one["true_bend"])) > 0.05
    close(one["true_bend"], -other["true_bend"], atol=1e-9)
    close(one["length"], other["length"])
    assert np.max(np.abs(one["length"] - without("T")["length"])) > 1e-7


def test_relaxation_drifts_in_a_hold_and_forgets():
    pressure = np.where(TIME < 3.0, 0.0, 30e3)
    slow = without("T", pressure=pressure)["length"]
    found = seen(
        "T", {"viscoelastic_relaxation.g_1": 0.3, "viscoelastic_relaxation.tau_1": 10.0}, pressure=pressure
    )["length"]
    assert found[2] - found[1] < 0.9 * (slow[2] - slow[1])
    assert np.all(np.diff(found[2:]) > 0.0)
    close(found[-1], slow[-1], rtol=1e-4)


def test_a_softened_tube_is_longer_on_the_way_down_only():
    bare, found = without("T")["length"], seen("T", {"mullins_softening.depth": 0.3})["length"]
    close(found[:16], bare[:16])
    assert np.all(found[18:29] > bare[18:29] + 1e-5)


# ---------------------------------------------------------------- actuator


def test_weight_is_that_of_the_load_of_the_same_name():
    body = specimen("A")
    down = PROTOCOLS["A"]["gravity"]
    found = seen("A", {"gravity.mass": 2e-3, "gravity.tip_mass": 1e-3})
    loaded = body.with_loads(pj.Gravity(down, 2e-3, tip_mass=1e-3))
    drive = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(PROTOCOLS["A"]["xi0"]))
    wanted = pj.simulate_history(loaded, PROTOCOLS["A"]["pressure"], drive).rows
    close(found["bend_angle"], wanted.bend_angle, atol=1e-9)
    assert np.max(np.abs(found["bend_angle"] - without("A")["bend_angle"])) > 1e-3


def test_contact_stops_the_bend():
    free = without("A")["bend_angle"]
    limit = 0.6 * float(np.max(free))
    held = seen("A", {"tip_contact.stiffness": 10.0, "tip_contact.angle": limit})["bend_angle"]
    first = int(np.argmax(free > limit))
    close(held[:first], free[:first], atol=1e-11)
    assert limit < float(np.max(held)) < 1.01 * limit


def test_a_camera_scales_what_it_sees():
    bare = without("A")
    found = seen("A", {"camera_calibration.scale": 1.1, "camera_calibration.offset": 0.02})
    close(found["bend_angle"], 1.1 * bare["bend_angle"] + 0.02)
    close(found["curvature"], 1.1 * bare["curvature"] + 0.02 / bare["length"])


def test_heat_that_stays_arrives_in_full_and_late():
    form = {"gain": 0.25, "tau_1": 5.0, "tau_2": 0.0}
    held = dict(xi0=np.full(ROWS, 0.4))
    found = seen("A", {f"opposing_spring_heating.{name}": value for name, value in form.items()}, **held)
    # what a row feels has left the other spring with the rows before
    rows = np.arange(ROWS)
    close(found["true_xi0_1"], 1.0 - 0.25 * 0.6 * (1.0 - np.exp(-2.0 * (rows - 1.0) / 5.0)) * (rows > 0))


def test_a_second_lag_and_a_power_delay_and_spare_small_heat():
    held, form = dict(xi0=np.full(ROWS, 0.8)), {"gain": 0.25, "tau_1": 5.0}
    named = lambda **more: {f"opposing_spring_heating.{n}": v for n, v in (form | more).items()}  # noqa: E731
    one, two, rare = (
        seen("A", named(**more), **held)["true_xi0_1"]
        for more in ({"tau_2": 0.0}, {"tau_2": 10.0}, {"tau_2": 0.0, "power": 2.0})
    )
    assert np.all(two[3:30] > one[3:30] + 1e-4)
    close(1.0 - rare[-1], 0.2 * (1.0 - one[-1]))


def test_friction_opposes_the_bend_by_its_limit():
    steady = dict(pressure=np.full(ROWS, 20e3), xi0=1.0 - 0.6 * UP_AND_DOWN)
    friction = {"wrap_friction.constant": 3e-4, "wrap_friction.slip": 0.01, "wrap_friction.spread": 0.0}
    bare, found = without("A", **steady)["bend_angle"], seen("A", friction, **steady)["bend_angle"]
    rising, falling = slice(3, 15), slice(20, 27)
    assert np.all(found[rising] < bare[rising]) and np.all(found[falling] > bare[falling] - 1e-2)
    body = specimen("A")
    # the same moment from a force at the tip's place in the section is felt alike
    drive = tuple(pj.MartensiteFraction(float(x)) for x in (1.0, steady["xi0"][10]))
    again = pj.solve(body, 20e3, drive, guess=None)
    assert float(again.bend_angle) > float(found[10])
