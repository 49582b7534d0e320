"""The balance itself: symmetry, closed forms, statuses, and twenty thousand random problems."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from activations import phases

import pneusma_jax as pj
from pneusma_jax.actuator.equilibrium import Problem, imbalance
from pneusma_jax.silicone import SiliconeLaw


class Linear(SiliconeLaw):
    """sigma = E eps with E = 0.2 MPa."""

    def __call__(self, strain):
        return 2e5 * strain


def test_linear_tube_with_a_stiff_fibre_has_a_closed_form():
    """Fibre of stiffness k at side 2: two linear equations for elongation and bend."""
    body = pj.make_actuator("pneuflex_s", silicone=Linear(), inextensible=False)
    found = pj.solve(body, 5e3)
    r, ri, length, k = 5e-3, 4e-3, 56e-3, 1e6
    ea, ei = 2e5 * np.pi * (r**2 - ri**2), 2e5 * np.pi / 4 * (r**4 - ri**4)
    push = 5e3 * np.pi * ri**2
    matrix = [[ea / length + k, -k * r], [-k * r, ei / length + k * r**2]]
    centre, bend = np.linalg.solve(matrix, [push, 0.0])
    np.testing.assert_allclose([found.delta_centre, found.bend_angle], [centre, bend], rtol=1e-8)


def test_a_stiff_fibre_approaches_the_inextensible_limit():
    exact = pj.solve(pj.make_actuator("pneuflex_s"), 20e3)
    assert float(exact.delta_2) == 0.0
    gaps = []
    for k in (1e4, 1e6, 1e8):
        body = pj.make_actuator("pneuflex_s", inextensible=False, fibre_stiffness=k)
        gaps.append(abs(float(pj.solve(body, 20e3).curvature - exact.curvature)))
    np.testing.assert_allclose(np.array(gaps[:-1]) / np.array(gaps[1:]), 100.0, rtol=0.05)


def test_equal_springs_do_not_bend():
    for xi0 in (1.0, 0.5, 0.1):
        for pressure in (0.0, 20e3, 50e3):
            found = pj.solve(pj.make_actuator("pneusma2"), pressure, phases(xi0, xi0))
            assert abs(float(found.curvature)) < 1e-12


def test_swapping_the_springs_mirrors_the_bend():
    body = pj.make_actuator("pneusma2")
    one, other = pj.solve(body, 20e3, phases(1.0, 0.4)), pj.solve(body, 20e3, phases(0.4, 1.0))
    np.testing.assert_allclose(one.curvature, -other.curvature, rtol=1e-10)
    np.testing.assert_allclose(one.delta_1, other.delta_2, rtol=1e-10)


@pytest.mark.parametrize("design", ["pneusma2", pytest.param("triad", marks=pytest.mark.slow)])
def test_force_and_moment_really_balance(design):
    body = pj.make_actuator(design)
    xi0 = phases(0.9, 0.5, 0.2)[: len(body.springs)]
    found = pj.solve(body, 25e3, xi0)
    states = tuple(pj.SpringState.fresh(0.1924) for _ in body.springs)
    balance = jax.jit(lambda centre, bend: imbalance(Problem(body, jnp.asarray(25e3), xi0, states), centre, bend))
    force, moment = balance(found.delta_centre, found.bend)
    assert abs(float(force)) < 1e-12 and float(jnp.max(jnp.abs(moment))) < 1e-14


def test_twenty_thousand_random_problems():
    """All of PneuSMA2's workspace: pressure to 60 kPa, both springs from cold to fully austenitic."""
    rng, rows = np.random.default_rng(2026), 20_000
    drive = phases(rng.uniform(0, 1, rows), rng.uniform(0, 1, rows))
    found = pj.solve_batch(pj.make_actuator("pneusma2"), jnp.asarray(rng.uniform(0, 60e3, rows)), drive)
    counts = np.bincount(np.asarray(found.status), minlength=len(pj.Status))
    print({status.name: int(n) for status, n in zip(pj.Status, counts, strict=True)})
    assert counts[pj.Status.converged] == rows
    assert np.all(np.isfinite(found.curvature))


@pytest.mark.slow
def test_measured_resistances_converge_or_say_why():
    rng, rows = np.random.default_rng(7), 2_000
    drive = tuple(pj.Resistance(jnp.asarray(rng.uniform(3.2, 3.75, rows))) for _ in range(2))
    found = pj.solve_batch(pj.make_actuator("pneusma2"), jnp.asarray(rng.uniform(0, 60e3, rows)), drive)
    good = np.asarray(found.converged)
    print(f"{good.sum()} of {rows} random pairs of resistances converged; the rest: {pj.Status.no_equilibrium.name}")
    assert good.mean() > 0.97
    assert np.all(np.isfinite(np.asarray(found.curvature)) == good)


def test_a_bad_row_stops_no_other():
    pressure = jnp.asarray([10e3, jnp.nan, 20e3])
    found = pj.solve_batch(pj.make_actuator("pneusma2"), pressure, phases(jnp.ones(3), jnp.asarray([0.3, 0.4, jnp.inf])))
    assert found.status.tolist() == [0, pj.Status.input_not_finite, pj.Status.input_not_finite]
    assert np.isfinite(found.curvature).tolist() == [True, False, False]


def test_no_solution_is_raised_in_words_and_named_in_a_batch():
    body = pj.make_actuator("pneusma2")
    with pytest.raises(RuntimeError, match="not a finite number"):
        pj.solve(body, jnp.nan, phases(1.0, 1.0))
    assert all(status.sentence.endswith(".") for status in pj.Status)


def test_wrong_number_of_springs_is_refused():
    with pytest.raises(ValueError, match="one entry per spring, 2 here"):
        pj.solve(pj.make_actuator("pneusma2"), 1e4, phases(1.0))


@pytest.mark.parametrize("drives", [(1.0, 0.4), pj.MartensiteFraction(1.0), 0.4])
def test_what_is_no_drive_is_refused(drives):
    with pytest.raises(TypeError, match=r"`activations` must be a tuple of drives, .* MartensiteFraction\(0.4\)"):
        pj.solve(pj.make_actuator("pneusma2"), 1e4, drives)


@pytest.mark.parametrize("pressure", ["30", ["30", "40"], None])
@pytest.mark.parametrize("solve", [pj.solve, pj.solve_batch, pj.simulate_history])
def test_a_pressure_that_is_no_number_is_refused(solve, pressure):
    with pytest.raises(TypeError, match=r"`pressure` must be numbers"):
        solve(pj.make_actuator("pneusma2"), pressure, phases(1.0, 0.4))


SEVERAL = np.array([1e4, 2e4, 3e4])


@pytest.mark.parametrize("solve", [pj.solve, pj.solve_all])
def test_one_row_takes_scalars(solve):
    actuator = pj.make_actuator("pneusma2")
    with pytest.raises(ValueError, match=r"`pressure` must be scalar .* has the shape \(3,\)"):
        solve(actuator, SEVERAL)
    with pytest.raises(ValueError, match=r"`activations` must be scalar .* has the shape \(2,\)"):
        solve(actuator, 1e4, phases(np.ones(2), np.ones(2)))


def test_a_batch_takes_rows_or_scalars():
    actuator = pj.make_actuator("pneusma2")
    for pressure in (1e4, SEVERAL[:, None]):
        with pytest.raises(ValueError, match=r"`pressure` must have the shape \(rows,\)"):
            pj.solve_batch(actuator, pressure)
    with pytest.raises(ValueError, match=r"`activations` must be scalar or of shape \(3,\), but .* \(2,\)"):
        pj.solve_batch(actuator, SEVERAL, phases(np.ones(2), np.ones(2)))
    alike = pj.solve_batch(actuator, SEVERAL, phases(0.5, 1.0))
    each = pj.solve_batch(actuator, SEVERAL, phases(np.full(3, 0.5), np.ones(3)))
    np.testing.assert_array_equal(alike.curvature, each.curvature)


def test_float32_is_refused():
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(RuntimeError, match="enable_float64"):
            pj.solve(pj.make_actuator("pneusma2"), 1e4)
    finally:
        jax.config.update("jax_enable_x64", True)


def test_a_model_of_single_precision_is_refused_wherever_it_stands():
    jax.config.update("jax_enable_x64", False)
    try:
        body = pj.make_actuator("pneusma1")
    finally:
        jax.config.update("jax_enable_x64", True)
    chain = pj.chain_of(body, 2)
    loaded = chain.with_loads(pj.PointLoad(force=np.array([0.0, 1e-3, 0.0])))
    calls = [lambda: pj.solve(body, 1e4), lambda: pj.simulate_history(body, np.full(2, 1e4))]
    calls += [lambda c=c: pj.solve_chain(c, 1e4) for c in (chain, loaded)]
    calls += [lambda: pj.simulate_chain_history(loaded, np.full(2, 1e4))]
    for call in calls:
        with pytest.raises(RuntimeError, match="built in single precision"):
            call()


@pytest.mark.parametrize("drive", [pj.MartensiteFraction(0.5), pj.Resistance(3.45)])
def test_a_guess_of_another_shape_is_refused(drive):
    body = pj.make_actuator("pneusma1")
    with pytest.raises(ValueError, match=r"`guess` .* of shape \(2,\) here, but it has \(1,\)"):
        pj.solve(body, 1e4, (drive,), guess=np.zeros(1))


def test_clipped_resistance_is_flagged():
    body = pj.make_actuator("pneusma1")
    found = pj.solve(body, 10e3, (pj.Resistance(4.2),))
    assert bool(found.springs[0].clipped) and float(found.springs[0].xi0) == 1.0
