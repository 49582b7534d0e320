"""The straight wire: its law, strain solved from stress, memory, derivatives, refusals."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.calibration import load_calibration
from pneusma_jax.nitinol import SpringState, WireAlloy, WireStatus, load_wire, simulate_wire

MPA = 1e6
THERE_AND_BACK = np.concatenate([np.linspace(90.0, 10.0, 60), np.linspace(10.0, 90.0, 61)[1:]])


def changed(wire, **values):
    names = list(values)
    return eqx.tree_at(lambda w: [getattr(w, n) for n in names], wire, [jnp.asarray(values[n]) for n in names])


def fold():
    """A martensite that detwins within 0.4 % of strain: stress falls there, so that several strains carry it."""
    return changed(load_wire(), beta_1=900.0, beta_2=0.0, beta_3=30.0)


def test_the_law_is_the_springs_law_with_other_names():
    """With a spring's numbers in place of the wire's, stress, residual strain and memory are the spring's."""
    alloy = pj.load_alloy("krl35")
    same = {f.name: getattr(alloy, f.name) for f in dataclasses.fields(WireAlloy) if hasattr(alloy, f.name)}
    wire = WireAlloy(**same, E_m=alloy.G_m, E_a=alloy.G_a, eps_L=alloy.gamma_L)
    for strain, xi0, prestrain in [(0.05, 0.7, 0.0), (0.15, 0.2, 0.12), (0.02, 1.0, 0.19), (-0.01, 0.5, 0.05)]:
        state = SpringState(prestrain, 0.9)
        eps_R = alloy.residual_strain(state, xi0)
        row = wire.respond(jnp.asarray(strain), jnp.asarray(xi0), state)
        np.testing.assert_allclose(row.eps_R, eps_R, rtol=1e-14)
        np.testing.assert_allclose(row.stress, alloy.shear_stress(strain, xi0, eps_R), rtol=1e-14)
        ours, theirs = wire.remember(state, row), alloy.remember(state, strain, xi0)
        np.testing.assert_allclose(jax.tree.leaves(ours), jax.tree.leaves(theirs), rtol=1e-14)
    np.testing.assert_allclose(wire.martensite_fraction_at(33.0), alloy.martensite_fraction_at(33.0), rtol=1e-14)


def test_the_shipped_wire_behaves_like_nitinol():
    wire = load_wire()
    strain = jnp.linspace(-0.05, 0.2, 2001)
    for xi0 in (0.0, 0.3, 0.7, 1.0):
        assert np.all(np.diff(wire.axial_stress(strain, xi0, 0.0)) > 0.0)
    cold = {s: float(simulate_wire(wire, stress=jnp.full(1, s * MPA), xi0=1.0).rows.strain[0]) for s in (150, 300)}
    hot = float(simulate_wire(wire, stress=jnp.full(1, 100 * MPA), xi0=0.0).rows.strain[0])
    print(f"cold wire: {cold}; hot at 100 MPa: {hot:.5f}")
    assert cold[150] == pytest.approx(0.017, abs=0.001) and cold[300] == pytest.approx(0.047, abs=0.001)
    assert hot == pytest.approx(100 * MPA / 70e9, rel=0.12)


def test_strain_carries_the_stress_over_the_whole_range():
    wire, state = load_wire(), SpringState.fresh(0.03)
    sigma = jnp.asarray(np.concatenate([-np.geomspace(1e3, 3e9, 9), [0.0], np.geomspace(1e3, 3e9, 9)]))
    strains = jax.jit(jax.vmap(lambda s, xi0: wire.strain_at(s, xi0, state), (0, None)))
    for xi0 in (0.0, 1e-6, 0.5, 1.0):
        rows = strains(sigma, xi0)
        assert set(np.asarray(rows.status)) == {WireStatus.converged}
        back = wire.axial_stress(rows.strain, xi0, rows.eps_R)
        np.testing.assert_allclose(back, sigma, rtol=1e-10, atol=1e-4)


def test_where_several_strains_carry_the_stress_the_smallest_is_given_and_said():
    wire, state, sigma = fold(), SpringState.fresh(0.0), 20 * MPA
    row = wire.strain_at(jnp.asarray(sigma), jnp.asarray(1.0), state)
    fine = np.linspace(-0.01, 0.2, 2_000_001)
    height = np.asarray(wire.axial_stress(jnp.asarray(fine), 1.0, row.eps_R)) - sigma
    upward = fine[1:][(height[:-1] < 0.0) & (height[1:] >= 0.0)]
    assert len(upward) == 2 and int(row.status) == WireStatus.several_strains
    assert float(row.strain) == pytest.approx(upward[0], abs=2e-7)
    assert "smallest" in WireStatus(int(row.status)).sentence


def test_a_thermal_cycle_under_stress_opens_and_closes_and_repeats():
    wire = load_wire()
    twice = np.concatenate([THERE_AND_BACK, THERE_AND_BACK[1:]])
    history = simulate_wire(wire, stress=jnp.asarray(200 * MPA), temperature=twice)
    strain = np.asarray(history.rows.strain)
    n = len(THERE_AND_BACK)
    assert np.all(history.converged)
    assert strain[59] > 0.03 and strain[0] < 0.004
    np.testing.assert_allclose(strain[n - 1 :], strain[:n], atol=1e-3)  # one reversible curve
    np.testing.assert_allclose(strain[n - 1 + 59], strain[59], rtol=1e-9)
    assert float(history.states.prestrain[59]) == pytest.approx(strain[59])


def test_unloading_the_cold_wire_leaves_a_strain_that_heating_recovers_for_good():
    wire = load_wire()
    pull = np.concatenate([np.linspace(0, 300, 40), np.linspace(300, 0, 40), np.zeros(20)]) * MPA
    xi0 = np.concatenate([np.ones(80), np.linspace(1.0, 0.0, 10), np.linspace(0.0, 1.0, 10)])
    history = simulate_wire(wire, stress=pull, xi0=xi0)
    strain = np.asarray(history.rows.strain)
    never = float(simulate_wire(wire, stress=jnp.zeros(1), xi0=1.0).rows.strain[0])
    assert strain[39] > 0.04 and strain[79] > 0.03
    assert strain[89] < 1e-3
    assert strain[99] == pytest.approx(never, abs=1e-4)
    # repeating a row changes nothing
    held = simulate_wire(wire, stress=jnp.full(5, 300 * MPA), xi0=1.0)
    np.testing.assert_allclose(held.rows.strain, held.rows.strain[0], rtol=1e-12)


def test_strain_drive_is_the_inverse_of_stress_drive():
    wire = load_wire()
    sigma = jnp.asarray(np.concatenate([np.linspace(0, 250, 30), np.linspace(250, 40, 30)]) * MPA)
    temperature = 45.0 + 15.0 * np.sin(np.arange(60) / 9.0)
    by_stress = simulate_wire(wire, stress=sigma, temperature=temperature)
    by_strain = simulate_wire(wire, strain=by_stress.rows.strain, temperature=temperature)
    np.testing.assert_allclose(by_strain.rows.stress, sigma, rtol=1e-9, atol=1.0)
    np.testing.assert_allclose(by_strain.states.prestrain, by_stress.states.prestrain, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("wire", [load_wire(), fold()], ids=["monotone", "folded"])
def test_gradients_of_a_history_agree_with_central_differences(wire):
    """d(sum of squared strains) over every constant, stress and temperature, through states and root-find."""
    temperature = THERE_AND_BACK[::4] + 0.37

    def loss(wire, stress, shift):
        return jnp.sum((100 * simulate_wire(wire, stress=stress, temperature=temperature + shift).rows.strain) ** 2)

    inputs = (wire, jnp.asarray(180 * MPA), jnp.asarray(0.0))
    numbers, fixed = eqx.partition(inputs, eqx.is_inexact_array)
    run = jax.jit(lambda n: loss(*eqx.combine(n, fixed)))
    leaves, tree = jax.tree.flatten(numbers)
    gradient = [float(g) for g in jax.tree.leaves(jax.jit(jax.grad(run))(numbers))]
    forward = jax.jit(jax.jacfwd(run))(numbers)
    np.testing.assert_allclose(gradient, jax.tree.leaves(forward), rtol=1e-8, atol=1e-12)
    assert np.all(np.isfinite(gradient))
    for i, leaf in enumerate(leaves):
        step = 1e-6 * max(abs(float(leaf)), 1.0)
        ends = [jax.tree.unflatten(tree, [x + s * step * (i == j) for j, x in enumerate(leaves)]) for s in (1, -1)]
        numeric = float(run(ends[0]) - run(ends[1])) / (2 * step)
        assert gradient[i] == pytest.approx(numeric, rel=2e-4, abs=1e-7 * max(1.0, abs(float(run(numbers))))), i


@pytest.fixture(scope="module")
def strain_and_slopes():
    """Strain, and its derivatives by stress, fraction, pre-strain and least fraction, compiled once."""
    wire = load_wire()
    strain = lambda *x: wire.strain_at(x[0], x[1], SpringState(x[2], x[3])).strain  # noqa: E731
    return jax.jit(jax.value_and_grad(strain, argnums=(0, 1, 2, 3)))


@pytest.mark.parametrize("xi0", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("sigma", [0.0, -50 * MPA, 300 * MPA])
def test_values_and_gradients_are_finite_at_singular_points(xi0, sigma, strain_and_slopes):
    """At the ends of the phase, at zero stress, and where both branches of the law tie."""
    tie, _ = strain_and_slopes(300 * MPA, 1.0, 0.0, 1.0)
    for prestrain in (0.0, float(tie), 0.3):
        value, slopes = strain_and_slopes(sigma, xi0, prestrain, 1.0)
        assert np.all(np.isfinite([value, *slopes]))


@pytest.mark.slow
def test_histories_vmap_over_wires():
    wire = load_wire()

    def run(eps_L):
        return simulate_wire(changed(wire, eps_L=eps_L), stress=jnp.asarray(150 * MPA), temperature=THERE_AND_BACK).rows.strain

    many = jax.vmap(run)(jnp.asarray([0.03, 0.05]))
    np.testing.assert_allclose(many[1], run(jnp.asarray(0.05)), rtol=1e-9)
    assert float(many[0, 59]) < float(many[1, 59])


def test_a_failed_row_is_said_commits_nothing_and_stops_no_other():
    wire = load_wire()
    sigma = jnp.asarray([200.0, np.nan, 200.0, 1e8, 200.0]) * MPA
    history = simulate_wire(wire, stress=sigma, xi0=1.0)
    codes = [WireStatus(int(code)).name for code in history.rows.status]
    assert codes == ["converged", "input_not_finite", "converged", "no_strain", "converged"]
    assert np.isnan(history.rows.strain[1]) and np.isnan(history.rows.strain[3])
    np.testing.assert_allclose(history.rows.strain[jnp.asarray([2, 4])], history.rows.strain[0], rtol=1e-12)
    assert history.converged.tolist() == [True, False, True, False, True]
    slope = jax.grad(lambda s: jnp.nansum(simulate_wire(wire, stress=s, xi0=1.0).rows.strain))(sigma)
    assert np.all(np.isfinite(np.asarray(slope)[[0, 2, 4]]))


def test_a_table_without_residual_strain_gets_the_springs_scaled(tmp_path):
    table = load_calibration("niti_wire")
    bare = dataclasses.replace(table, quantities={k: q for k, q in table.quantities.items() if not k.startswith("gR")})
    wire, full = WireAlloy.from_calibration(bare), load_wire()
    for key in ("gR_amplitude", "gR_slope", "gR_shift", "gR_decay"):
        assert float(getattr(wire, key)) == pytest.approx(float(getattr(full, key)), rel=5e-3)


def test_meaningless_calls_are_refused():
    wire, rows = load_wire(), jnp.zeros(3)
    with pytest.raises(ValueError, match="`stress` or `strain`"):
        simulate_wire(wire, stress=rows, strain=rows, xi0=1.0)
    with pytest.raises(ValueError, match="`temperature` or `xi0`"):
        simulate_wire(wire, stress=rows)
    with pytest.raises(ValueError, match="equally many rows"):
        simulate_wire(wire, stress=rows, xi0=jnp.ones(4))
    with pytest.raises(ValueError, match="at least one row"):
        simulate_wire(wire, stress=jnp.asarray(1.0), xi0=1.0)
    with pytest.raises(ValueError, match="`E_a` must be positive"):
        WireAlloy(*(0.0 if f.name == "E_a" else 1.0 for f in dataclasses.fields(WireAlloy) if f.name != "name"))
    with pytest.raises(pj.InputError, match="an alloy of springs, but one of straight wires is needed here \\(it lacks 'E_m'\\)"):
        load_wire("krl35")


def test_the_residual_strain_of_a_wire_as_hot_as_ever_follows_the_next_heating_in_full():
    wire, state = load_wire(), SpringState(0.03, 0.5)
    left = lambda xi0: wire.residual_strain(state, xi0)  # noqa: E731
    hotter = (left(np.asarray(0.5)) - left(np.asarray(0.5 - 1e-6))) / 1e-6
    assert float(jax.grad(left)(0.5)) == pytest.approx(float(hotter), rel=1e-4)
