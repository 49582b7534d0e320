"""Histories: agreement with an independent implementation, memory, gradients and their cost, heating, refusals."""

import json
import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.nitinol.thermal import steady_temperature, time_constant


def phase(x):
    return pj.MartensiteFraction(jnp.asarray(x))


_residual = eqx.filter_jit(lambda alloy, state, xi0: alloy.residual_strain(state, xi0))


def residual_after(body, history, k):
    """Residual strain that the memory after each row leaves at that row's phase."""
    return _residual(body.springs[k].alloy, history.states[k], history.rows.springs[k].xi0)


@pytest.mark.parametrize("case", range(4))
def test_oracle_histories(shared, case):
    case = json.loads((shared / "oracle" / "history.json").read_text())["cases"][case]
    column = lambda key: np.asarray([row[key] for row in case["rows"]])  # noqa: E731
    body = pj.make_actuator(case["design"])
    drive = (phase(1.0), phase(column("xi0_2")))[-len(body.springs) :]
    history = pj.simulate_history(body, jnp.asarray(column("pressure_Pa")), drive)
    assert np.all(history.converged)
    ours = {
        "delta1_m": history.rows.delta_1, "delta2_m": history.rows.delta_2, "curvature_1pm": history.rows.curvature,
        "resistance_2_ohm": history.rows.springs[-1].resistance, "gamma_p_2": history.states[-1].prestrain,
        "xi_min_2": history.states[-1].xi_min, "gamma_R_2": residual_after(body, history, -1),
    }  # fmt: skip
    for key, value in ours.items():
        np.testing.assert_allclose(value, column(key), rtol=1e-6, atol=1e-9, err_msg=key)


def cycles(rows=60, coldest=0.4, count=2):
    turn = np.linspace(0.0, 2.0 * count, count * rows + 1)
    return 1.0 - (1.0 - coldest) * (1.0 - np.abs(turn % 2.0 - 1.0))


def test_curvature_does_not_return_and_the_second_cycle_repeats():
    body, xi0 = pj.make_actuator("pneusma2"), cycles()
    history = pj.simulate_history(body, jnp.full(xi0.size, 20e3), (phase(1.0), phase(xi0)))
    kappa = np.asarray(history.rows.curvature)
    start, first, second = kappa[0], kappa[60], kappa[120]
    print(f"curvature cold, after one and after two heat-cool cycles: {start:.4f}, {first:.4f}, {second:.4f} 1/m")
    assert abs(start) < 1e-9 and first > 1.0
    assert abs(second - first) < 1e-6
    left = residual_after(body, history, 1)
    assert float(left[0]) == pytest.approx(0.0938, abs=5e-5)
    assert float(left[30]) == pytest.approx(0.0047, abs=5e-5)


@pytest.mark.slow
def test_a_long_history_is_differentiable_at_the_cost_of_a_few_simulations():
    """d(last curvature) of 400 rows over every parameter: against central differences; at most 4 forward runs."""
    t = jnp.linspace(0.0, 1.0, 400)
    geometry = pj.design_geometry("pneusma2", prestrain=0.17)
    inputs = (pj.load_alloy("krl35"), pj.load_silicone(), geometry, 20e3 + 8e3 * jnp.sin(20 * t), cycles(200, 0.45, 2)[:400])
    numbers, fixed = eqx.partition(inputs, eqx.is_inexact_array)

    def last(numbers):
        alloy, silicone, geometry, pressure, xi0 = eqx.combine(numbers, fixed)
        body = pj.round_actuator(pj.layout("pneusma2"), geometry, alloy, silicone)
        drive = (phase(1.0), pj.MartensiteFraction(xi0))
        return pj.simulate_history(body, pressure, drive, pj.fresh_states(body, geometry)).rows.curvature[-1]

    run, slope = jax.jit(last), jax.jit(jax.grad(last))
    gradient = slope(numbers)
    assert all(bool(jnp.all(jnp.isfinite(leaf))) for leaf in jax.tree.leaves(gradient))
    leaves, tree = jax.tree.flatten(numbers[:3])
    sizes = np.cumsum([leaf.size for leaf in leaves])[:-1]
    flat = np.concatenate([np.ravel(leaf) for leaf in leaves])
    slopes = np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(gradient[:3])])

    def at(vector):
        parts = [p.reshape(x.shape) for p, x in zip(jnp.split(vector, sizes), leaves, strict=True)]
        return run((*jax.tree.unflatten(tree, parts), *numbers[3:]))

    scale = np.where(flat == 0.0, 1.0, np.abs(flat))
    numeric = []
    for i, size in enumerate(scale):
        step = np.zeros(flat.size)
        step[i] = 1e-5 * size
        numeric.append((at(flat + step) - at(flat - step)) / 2e-5)  # per relative change
    print(f"{np.sum(np.abs(numeric) > 0)} of {flat.size} parameters move the last curvature")
    np.testing.assert_allclose(slopes * scale, numeric, rtol=2e-5, atol=1e-6)

    def seconds(f):
        best = np.inf
        for _ in range(7):
            begin = time.process_time()  # not the clock on the wall: the machine may be busy
            jax.block_until_ready(f(numbers))
            best = min(best, time.process_time() - begin)
        return best

    cost = seconds(slope) / seconds(run)
    print(f"gradient of 400 rows costs {cost:.1f} forward simulations")
    assert cost <= 4.0


def test_spring_on_a_stand_keeps_a_residual_strain_and_loses_it_by_heating():
    dimensions = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    spring = pj.Spring(dimensions, pj.load_alloy("krl35"), 14e-3)
    pull = np.concatenate([np.linspace(0, 80e-3, 60), np.linspace(80e-3, 0, 60)])
    cold = pj.simulate_spring(spring, pull, phase(1.0))
    assert float(cold.rows.force[-1]) < -0.1 and float(cold.states.prestrain[-1]) == pytest.approx(0.1924, rel=0.02)
    hot = pj.simulate_spring(spring, pull[:61] * 0.6, phase(0.0))
    assert float(hot.rows.force[60]) > float(cold.rows.force[60])
    held = pj.simulate_spring(spring, pull, pj.Resistance(jnp.asarray(3.4)))
    assert bool(held.rows.clipped[59]) or abs(float(held.rows.resistance[59]) - 3.4) < 1e-9
    np.testing.assert_allclose(held.rows.resistance[:20], 3.4, rtol=1e-9)


@pytest.mark.slow
def test_current_heats_bends_and_cools():
    body = pj.make_actuator("pneusma2")
    t = np.linspace(0.0, 60.0, 241)
    current = np.where((t > 5) & (t < 25), 0.25, 0.0)
    drive = (phase(1.0), pj.Heating(jnp.asarray(current)))
    history = pj.simulate_history(body, jnp.full(t.size, 20e3), drive, time=jnp.asarray(t))
    spring = body.springs[1]
    resistance = history.rows.springs[1].resistance[95]
    target = steady_temperature(spring.alloy, spring.geometry, 0.25, resistance, 22.0)
    tau = float(time_constant(spring.alloy, spring.geometry))
    assert 1.0 < tau < 10.0
    assert float(history.temperatures[99, 1]) == pytest.approx(float(target), abs=0.5)
    assert np.isnan(history.temperatures[:, 0]).all()
    kappa = np.asarray(history.rows.curvature)
    assert kappa[99] > 20.0 and kappa[-1] < kappa[99]
    warm = pj.MartensiteFraction(spring.alloy.martensite_fraction_at(22.0))  # already a little below 1
    np.testing.assert_allclose(kappa[0], pj.solve(body, 20e3, (phase(1.0), warm)).curvature, rtol=1e-9)


@pytest.mark.slow
def test_histories_vmap_over_specimens():
    xi0 = cycles(20, 0.5, 1)
    body = pj.make_actuator("pneusma2")

    def run(stiffness):
        softer = eqx.tree_at(lambda b: b.silicone.stiffness, body, stiffness)
        return pj.simulate_history(softer, jnp.full(xi0.size, 15e3), (phase(1.0), phase(xi0))).rows.curvature

    many = jax.vmap(run)(jnp.asarray([0.8, 1.0, 1.2]))
    np.testing.assert_allclose(many[1], run(jnp.asarray(1.0)), rtol=1e-9, atol=1e-9)


def test_a_failed_row_commits_nothing_and_stops_no_other():
    body = pj.make_actuator("pneusma2")
    xi0 = jnp.asarray([1.0, 0.7, jnp.nan, 0.7])
    history = pj.simulate_history(body, jnp.full(4, 20e3), (phase(1.0), phase(xi0)))
    assert history.converged.tolist() == [True, True, False, True]
    assert float(history.states[1].xi_min[2]) == pytest.approx(0.7)
    np.testing.assert_allclose(history.rows.curvature[3], history.rows.curvature[1], rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (dict(pressure=jnp.zeros(0)), "at least one row"),
        (dict(time=jnp.asarray([0.0, 2.0, 1.0])), "must not go backwards, but it does after row 2"),
        (dict(activations=(phase(1.0), phase([1.0, 0.5]))), "3 rows like the pressure"),
        (dict(activations=(phase(1.0), pj.Heating(0.2))), "`time` must be given"),
        (dict(activations=(phase(1.0),)), "one entry per spring"),
    ],
)
def test_meaningless_histories_are_refused(change, what):
    arguments = dict(pressure=jnp.full(3, 1e4), activations=(phase(1.0), phase(1.0))) | change
    with pytest.raises(ValueError, match=what):
        pj.simulate_history(pj.make_actuator("pneusma2"), **arguments)


def test_phases_that_are_no_drives_are_refused_as_by_solve():
    with pytest.raises(TypeError, match=r"`activations` must be a tuple of drives, .* MartensiteFraction\(0.4\)"):
        pj.simulate_history(pj.make_actuator("pneusma2"), jnp.full(3, 1e4), (jnp.ones(3), jnp.ones(3)))
