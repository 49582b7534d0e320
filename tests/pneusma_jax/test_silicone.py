"""Silicone laws: shear moduli at rest, limits, and the regularised joint."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.silicone import Gent, NeoHookean, Ogden, Yeoh, hyperelastic

LAWS = {
    "neo_hookean": (NeoHookean(8.5e4), 8.5e4),
    "yeoh": (Yeoh(4e4, 1e3, 20.0), 8e4),
    "gent": (Gent(7e4, 30.0), 7e4),
    "ogden": (Ogden([5e4, -1e4], [2.0, -2.0]), 6e4),
}


@pytest.mark.parametrize("name", LAWS)
def test_slope_at_rest_is_three_times_the_shear_modulus(name):
    law, mu = LAWS[name]
    value, slope = jax.jit(jax.value_and_grad(law))(0.0)
    assert float(value) == pytest.approx(0.0, abs=1e-9)
    assert float(slope) == pytest.approx(3.0 * mu, rel=1e-12)


def test_every_law_reduces_to_neo_hookean():
    strain = jnp.linspace(-0.4, 2.0, 9)
    reference = NeoHookean(6e4)(strain)
    for law in (Yeoh(3e4, 0.0, 0.0), Gent(6e4, 1e12), Ogden([6e4], [2.0])):
        np.testing.assert_allclose(law(strain), reference, rtol=1e-9)


def test_printed_neo_hookean_is_the_cauchy_stress():
    stretch = jnp.asarray([0.8, 1.5, 3.0])
    np.testing.assert_allclose(
        hyperelastic.printed_neo_hookean_stress(stretch, 1.0), stretch * hyperelastic.neo_hookean_stress(stretch, 1.0)
    )


def test_gent_past_its_limit_stays_finite_and_rises():
    law = Gent(7e4, 10.0)
    stress = law(jnp.linspace(0.0, 6.0, 200))
    assert np.all(np.isfinite(stress)) and np.all(np.diff(stress) > 0)


def test_regularised_law_is_monotone_smooth_and_vanishes_at_rest():
    law = pj.load_silicone()
    strain = jnp.linspace(-0.9, 3.0, 4001)
    assert float(law(0.0)) == 0.0
    assert np.all(np.diff(law(strain)) > 0)
    for cut in (-0.02, 0.02):
        for order in (1, 2):
            f = law
            for _ in range(order):
                f = jax.grad(f)
            f = jax.jit(f)
            np.testing.assert_allclose(f(cut - 1e-9), f(cut + 1e-9), rtol=1e-4, atol=1.0)
    assert np.all(np.diff(law.cuts) > 0)


def test_the_five_mechanical_tests():
    at = {"standard_tension": 1.0, "tube_tension": 0.5, "bulk_compression": -0.3,
          "tube_buckling": -0.3, "needle_buckling": -0.3}  # fmt: skip
    for test, strain in at.items():
        fit = pj.load_silicone_test(test)
        powers = strain ** np.arange(fit.coefficients.size - 1, -1, -1)
        np.testing.assert_allclose(fit(strain), np.asarray(fit.coefficients) @ powers, rtol=1e-12)
        assert fit.strain_min < fit.strain_max
    by_hand = (-63.4249 + 239.8487 - 264.5191 + 234.7951 - 0.3729) * 1e3
    assert float(pj.load_silicone_test("standard_tension")(1.0)) == pytest.approx(by_hand, rel=1e-12)
    with pytest.raises(ValueError, match="standard_tension"):
        pj.load_silicone_test("tension")
