"""What the source states about springs, silicone and actuators, with our numbers."""

import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj


def bend(design, pressure, *xi0):
    return pj.solve(pj.make_actuator(design), pressure, tuple(pj.MartensiteFraction(x) for x in xi0))


def test_shear_strains_at_the_quoted_lengths():
    spring = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    ours = spring.shear_strain(jnp.asarray([0.5, 1.0, 1.5, 5.75]) * 14e-3)
    np.testing.assert_allclose(ours, [0.0125, 0.0255, 0.0390, 0.1924], rtol=0.01)


def test_residual_strain_after_prestrain_and_after_heating():
    alloy = pj.load_alloy("krl35")
    assert float(alloy.residual_strain_limit(0.1924)) == pytest.approx(0.0938, abs=5e-5)
    assert float(alloy.residual_strain(pj.SpringState.fresh(0.1924), 0.4)) == pytest.approx(0.0047, abs=5e-5)


def test_elastic_unloading_leaves_the_residual_strain():
    """Eq. 3.3 crosses zero stress where Eq. 3.1 says, by the reconstructed gamma_L."""
    alloy = pj.load_alloy("krl35")
    gamma_R = alloy.residual_strain(pj.SpringState.fresh(0.1924), 1.0)
    assert float(alloy.shear_stress(gamma_R, 1.0, gamma_R)) == pytest.approx(0.0, abs=1.0)
    peak = alloy.shear_stress(0.1924, 1.0, gamma_R)
    assert float(0.1924 - peak / alloy.modulus(1.0)) == pytest.approx(float(gamma_R), rel=2e-3)


def test_repeating_a_load_changes_nothing():
    alloy = pj.load_alloy("krl35")
    state = pj.SpringState.fresh(0.05)
    for _ in range(3):
        after = alloy.remember(state, jnp.asarray(0.1), jnp.asarray(1.0))
        again = alloy.remember(after, jnp.asarray(0.1), jnp.asarray(1.0))
        assert float(again.prestrain) == float(after.prestrain) and float(again.xi_min) == float(after.xi_min)
        state = after
    assert float(state.prestrain) == pytest.approx(0.1)


def test_heating_is_remembered():
    alloy = pj.load_alloy("krl35")
    hot = alloy.remember(pj.SpringState.fresh(0.1924), jnp.asarray(0.05), jnp.asarray(0.4))
    cooled = alloy.remember(hot, jnp.asarray(0.05), jnp.asarray(1.0))
    assert float(alloy.residual_strain(cooled, 1.0)) < 0.1 * float(alloy.residual_strain_limit(0.1924))


def test_cold_pneusma2_stays_straight_and_cold_pneusma1_bends_more_with_pressure():
    assert all(abs(float(bend("pneusma2", p, 1.0, 1.0).curvature)) < 1e-12 for p in (0.0, 30e3, 60e3))
    cold = [float(bend("pneusma1", p, 1.0).curvature) for p in (10e3, 30e3, 50e3)]
    assert cold[0] < cold[1] < cold[2]


def test_hot_pneusma2_straightens_with_pressure():
    hot = [float(bend("pneusma2", p, 1.0, 0.1).curvature) for p in (10e3, 30e3, 50e3)]
    assert hot[0] > hot[1] > hot[2]


def test_heated_pneusma1_bends_past_270_degrees_and_tightest_of_all():
    one = bend("pneusma1", 30e3, 0.1)
    assert np.degrees(float(one.bend_angle)) > 270.0
    assert float(one.curvature) > float(bend("pneusma2", 30e3, 1.0, 0.1).curvature)
    assert float(one.curvature) > float(bend("pneuflex_s", 30e3).curvature)


def test_hot_pneusma1_disagrees_with_the_source():
    """Ours rises with pressure; the source measured a fall and discards those data (tip contact)."""
    hot = [float(bend("pneusma1", p, 0.1).curvature) for p in (10e3, 30e3, 50e3)]
    np.testing.assert_allclose(hot, [81.0, 91.0, 98.0], atol=0.6)


def test_pneuflex_order_at_equal_pressure():
    s, t, w = (float(bend(f"pneuflex_{k}", 30e3).curvature) for k in "stw")
    assert t < s < w


def test_tube_elongates_along_the_uniaxial_law():
    """Eq. 3.9 holds at the returned length, for the polynomial and the neo-Hookean law."""
    law = pj.load_silicone()
    length = float(pj.tube_length(30e3, 56e-3, 10e-3, 1e-3, law))
    strain = length / 56e-3 - 1.0
    assert float(law(strain)) * (10.0**2 - 8.0**2) == pytest.approx(30e3 * 8.0**2, rel=1e-9)
    slope = pj.tube_length(30e3 + 1.0, 56e-3, 10e-3, 1e-3, law) - pj.tube_length(30e3 - 1.0, 56e-3, 10e-3, 1e-3, law)
    import jax

    exact = jax.grad(lambda p: pj.tube_length(p, 56e-3, 10e-3, 1e-3, law))(30e3)
    np.testing.assert_allclose(exact, slope / 2.0, rtol=1e-6)
