"""The rule by which two phases' resistances mix, for nitinol and for other alloys (Section 2.4.6)."""

import dataclasses
from importlib import resources

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneusma_jax.calibration import load_calibration, unknown
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import load_alloy
from pneusma_jax.nitinol.resistivity import mixing_fraction
from pneusma_jax.numerics.safe import complement_power

XI0 = np.linspace(0.0, 1.0, 21)
STRAINS = (0.0, 0.03, 0.12)


def other(a: float, c: float):
    return dataclasses.replace(load_alloy("krl35"), a=jnp.asarray(a), c=jnp.asarray(c))


def test_second_exponent_of_one_is_the_power_law_bit_by_bit():
    for exponent in (0.7, 1.0, 7.8613):
        assert np.array_equal(mixing_fraction(XI0, exponent, 1.0), mixing_fraction(XI0, exponent))
        assert np.allclose(mixing_fraction(XI0, exponent), XI0**exponent, rtol=1e-15)


@eqx.filter_jit
def _read_back(alloy, gamma):
    """Fractions read from the resistances of fractions."""
    return alloy.martensite_fraction(alloy.resistivity(XI0, gamma), gamma).xi0


@pytest.mark.parametrize(("a", "c"), [(7.9, 1.0), (2.0, 3.0), (0.8, 0.6), (1.0, 2.5)])
def test_resistance_reads_back_the_fraction_it_was_made_from(a, c):
    alloy = other(a, c)
    for gamma in STRAINS:
        assert np.allclose(_read_back(alloy, gamma), XI0, atol=1e-9)


def test_weight_is_what_kumaraswamy_wrote():
    assert np.allclose(other(2.0, 3.0).mixing_fraction(XI0, 0.0), 1.0 - (1.0 - XI0**2) ** 3, atol=1e-15)


@pytest.mark.parametrize("c", [0.6, 1.0, 2.5])
def test_gradients_are_right_inside_and_finite_at_both_ends(c):
    def weight(xi0, a, c):
        return dataclasses.replace(load_alloy("krl35"), a=a, c=c).mixing_fraction(xi0, 0.03)

    weight, by_all = jax.jit(weight), jax.jit(jax.grad(weight, (0, 1, 2)))
    at = (jnp.asarray(0.4), jnp.asarray(2.0), jnp.asarray(c))
    for k in range(3):
        up, down = list(at), list(at)
        up[k], down[k] = at[k] + 1e-6, at[k] - 1e-6
        numeric = (weight(*up) - weight(*down)) / 2e-6
        assert np.isclose(by_all(*at)[k], numeric, rtol=1e-6)
    for end in (0.0, 1.0):
        slopes = by_all(jnp.asarray(end), *at[1:])
        assert all(np.isfinite(slope) for slope in slopes)
    assert np.isfinite(jax.grad(complement_power)(1.0, 0.5))


def test_tables_without_the_second_exponent_have_one(tmp_path):
    text = tmp_path / "mine.toml"
    shipped = resources.files("calibration_data").joinpath("krl35.toml")
    lines = shipped.read_text(encoding="utf-8").splitlines()
    text.write_text("\n".join(line for line in lines if not line.startswith("c =")))
    table = load_calibration(text)
    assert table.quantities["c"].value == 1.0 and table.quantities["c"].prior is None
    assert load_alloy(text).c == 1.0


def test_alloys_that_nobody_characterised_are_known_by_name():
    assert unknown() == ["new_nitinol", "new_sma"]
    assert load_calibration("new_nitinol").quantities["c"].prior is None
    assert load_calibration("new_sma").quantities["c"].prior is not None
    with pytest.raises(InputError, match="new_sma"):
        load_calibration("new_smaa", "alloy")
    with pytest.raises(ValueError, match="`c` must be positive"):
        dataclasses.replace(load_alloy("krl35"), c=0.0)
