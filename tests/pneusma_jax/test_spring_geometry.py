"""Springs by their coils: the inverse of Eq. 2.17, Eqs. 2.3 to 2.6, and the phases of Eqs. 2.25 to 2.28."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import pneusma_jax as pj
from pneusma_jax.nitinol import fractions
from pneusma_jax.nitinol.geometry import (
    coil_angle,
    elastic_force,
    elongation_of_angle,
    shear_strain,
    shear_strain_of_angle,
    shear_stress_of_force,
    spring_index,
    spring_strain,
    uncorrected_shear_stress,
    wahl_factor,
)

PITCH, COIL, WIRE = 0.269e-3, 1.15e-3, 0.25e-3  # m, Section 2.4.2
SPRINGS = [(PITCH, COIL, WIRE), (0.6e-3, 3e-3, 0.5e-3), (1.5e-3, 1.2e-3, 0.2e-3)]  # tight, wide, open


@functools.partial(jax.jit, static_argnums=2)
def _there_and_back(gamma, spring, helix):
    """Spring strain of a shear strain, and the shear strain of that."""
    strain = spring_strain(gamma, *spring, helix=helix)
    return strain, shear_strain(strain, *spring, helix=helix)


@pytest.mark.parametrize("helix", ["printed", "true"])
@pytest.mark.parametrize("spring", SPRINGS)
def test_the_inverse_of_the_shear_strain(spring, helix):
    """From a spring pushed together to one pulled out to a straight wire and beyond."""
    gamma = jnp.concatenate([jnp.linspace(-0.05, 0.5, 45), jnp.linspace(0.6, 10.0, 20)])
    strain, back = _there_and_back(gamma, spring, helix)
    assert np.all(np.diff(strain) > 0.0)
    np.testing.assert_allclose(back, gamma, rtol=1e-13, atol=1e-15)


def test_the_inverse_against_a_bracketed_root():
    """Eq. 2.17 as it is printed, with h and h_i, by bisection."""

    def printed(strain):
        h, h_i = 4.0 * COIL**2 + (PITCH * (1.0 + strain)) ** 2, 4.0 * COIL**2 + PITCH**2
        opening = PITCH * (1.0 + strain) / np.sqrt(h) - PITCH / np.sqrt(h_i)
        index, rise = COIL / WIRE, (PITCH * (1.0 + strain)) ** 2
        return h * opening / (index * h_i * (4.0 * COIL**2 / h + rise / (h * 1.33)))

    for gamma in (0.0125, 0.089, 0.1924):
        wanted = brentq(lambda strain, gamma=gamma: printed(strain) - gamma, 0.0, 10.0, xtol=1e-14)
        assert float(spring_strain(gamma, PITCH, COIL, WIRE)) == pytest.approx(wanted, rel=1e-12)


def test_the_inverse_has_derivatives_of_every_order():
    inverse = lambda gamma, pitch: spring_strain(gamma, pitch, COIL, WIRE)  # noqa: E731
    by_gamma = jax.grad(inverse)

    @jax.jit
    def every(gamma, pitch):
        """Strain, its slopes by both, its second derivative by the first, and the slope of the inverse there."""
        strain = inverse(gamma, pitch)
        back = jax.grad(lambda strain: shear_strain(strain, PITCH, COIL, WIRE))(strain)
        return strain, by_gamma(gamma, pitch), jax.grad(inverse, 1)(gamma, pitch), jax.grad(by_gamma)(gamma, pitch), back

    _, by_strain, by_length, twice, slope = (float(x) for x in every(0.1, PITCH))
    assert by_strain == pytest.approx(1.0 / slope, rel=1e-12)
    assert twice == pytest.approx(float(every(0.1 + 1e-5, PITCH)[1] - every(0.1 - 1e-5, PITCH)[1]) / 2e-5, rel=1e-7)
    sides = [float(every(0.1, PITCH * (1.0 + one))[0]) for one in (1e-6, -1e-6)]
    assert by_length == pytest.approx((sides[0] - sides[1]) / (2e-6 * PITCH), rel=1e-8)


def test_the_inverse_takes_arrays_and_says_nan():
    inverse = jax.jit(lambda gamma, coil: spring_strain(gamma, PITCH, coil, WIRE))
    many = inverse(jnp.asarray([[0.01], [0.1]]), jnp.asarray([COIL, 2 * COIL]))
    assert many.shape == (2, 2)
    np.testing.assert_allclose(many[1, 1], inverse(0.1, 2 * COIL), rtol=1e-13)
    broken = inverse(jnp.asarray([0.1, jnp.nan]), COIL)
    assert np.isfinite(broken).tolist() == [True, False]
    with pytest.raises(ValueError, match="`helix` must be one of"):
        spring_strain(0.1, PITCH, COIL, WIRE, helix="other")


def test_elongation_of_a_spring_from_its_strain():
    spring = pj.SpringGeometry(WIRE, COIL - WIRE, PITCH, 52.0, 14e-3)
    stretch = jnp.linspace(0.0, 80e-3, 9)
    back = jax.jit(lambda x: spring.elongation(spring.shear_strain(x)))(stretch)
    np.testing.assert_allclose(back, stretch, rtol=1e-12, atol=1e-16)


def test_force_stress_and_strain_of_an_elastic_spring_agree():
    """Eqs. 2.4, 2.5 and 2.6 are one law; Wahl's factor is what Eq. 2.8 adds to Eq. 2.5."""
    modulus, index = 3e9, spring_index(COIL, WIRE)
    initial = coil_angle(0.0, PITCH, COIL)
    for strain in (0.1, 1.0, 5.75):
        angle = coil_angle(strain, PITCH, COIL)
        gamma = shear_strain_of_angle(angle, initial, index)
        assert float(gamma) == pytest.approx(float(shear_strain(strain, PITCH, COIL, WIRE)), rel=1e-12)
        cosine, sine = np.cos(angle), np.sin(angle)
        force = np.pi * WIRE**4 / (8 * COIL**2) * modulus * np.cos(initial) ** 2 * (sine - np.sin(initial))
        force /= cosine**2 * (cosine**2 + sine**2 / 1.33)
        assert float(elastic_force(angle, initial, modulus, COIL, WIRE)) == pytest.approx(float(force), rel=1e-12)
        torsion = uncorrected_shear_stress(force, COIL, WIRE)
        polar = np.pi * WIRE**4 / 32
        assert float(torsion) == pytest.approx(float(force * (COIL / 2) * (WIRE / 2) / polar), rel=1e-12)
        assert float(torsion) == pytest.approx(float(modulus * gamma), rel=1e-12)
        ratio = shear_stress_of_force(force, COIL, WIRE) / torsion
        assert float(ratio) == pytest.approx(float(wahl_factor(index)), rel=1e-12)


def test_a_wire_of_constant_length_and_a_coil_of_constant_diameter_differ():
    """Eq. 2.3 fed with the angle of Eqs. 2.10 and 2.12 does not give the elongation back (correction 6)."""
    for helix, shares in (("printed", (1.549, 1.532, 1.184)), ("true", (0.994, 0.990, 0.878))):
        for strain, share in zip((0.01, 0.5, 5.75), shares, strict=True):
            angle, initial = coil_angle(strain, PITCH, COIL, helix), coil_angle(0.0, PITCH, COIL, helix)
            elongation = elongation_of_angle(angle, initial, 52.0, COIL)
            assert float(elongation / (52.0 * PITCH * strain)) == pytest.approx(share, abs=1e-3)
    assert float(elongation_of_angle(initial, initial, 52.0, COIL)) == 0.0


def test_the_phases_account_for_the_whole_wire():
    alloy, xi0 = pj.load_alloy("krl35"), jnp.linspace(0.0, 1.0, 6)[:, None]
    gamma = jnp.linspace(0.0, 0.19, 7)
    found = jax.jit(lambda xi0, gamma: pj.phase_fractions(alloy, xi0, gamma))(xi0, gamma)
    np.testing.assert_allclose(found.detwinned + found.twinned + found.austenite, 1.0, rtol=1e-14)
    np.testing.assert_allclose(found.martensite, xi0 + (1.0 - xi0) * alloy.xi_sa(gamma), rtol=1e-13)
    np.testing.assert_allclose(found.detwinned[-1], alloy.xi_sm(gamma), rtol=1e-13)
    np.testing.assert_allclose(found.detwinned[0], alloy.xi_sa(gamma), rtol=1e-13)
    np.testing.assert_allclose(found.twinned[0], 0.0, atol=1e-18)
    np.testing.assert_allclose(found.austenite[-1], 0.0, atol=1e-18)
    assert float(fractions.detwinned_fraction(0.25, 0.8, 0.4)) == pytest.approx(0.25 * 0.8 + 0.75 * 0.4)
    assert float(fractions.twinned_fraction(0.25, 0.8)) == pytest.approx(0.05)
    assert float(fractions.austenite_fraction(0.25, 0.4)) == pytest.approx(0.45)
