"""What holds for every number: round trips of units and files, limits and symmetries of laws and sections."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pneusma_jax as pj
from fitting.data.recordings import Recording, read_recording, write_recording
from fitting.data.recordings.table import parse_number
from pneusma_jax.calibration.toml import parse_calibration, render_calibration
from pneusma_jax.nitinol.detwinning import generalised_logistic
from pneusma_jax.nitinol.residual_strain import residual_strain, residual_strain_limit
from pneusma_jax.nitinol.resistivity import martensite_fraction, mixed_resistivity, mixing_fraction
from pneusma_jax.silicone.hyperelastic import gent_stress, neo_hookean_stress, ogden_stress, yeoh_stress
from pneusma_jax.units import UNITS, from_si, to_si

# the same examples in every run; compiling is no fault of an example
steady = settings(derandomize=True, deadline=None, max_examples=40)
numbers = st.floats(-1e12, 1e12)


@steady
@given(st.sampled_from(sorted(UNITS)), numbers)
def test_a_unit_there_and_back_is_the_same_number(unit, value):
    offset = abs(UNITS[unit].offset) if hasattr(UNITS[unit], "offset") else 300.0
    assert from_si(to_si(value, unit), unit) == pytest.approx(value, rel=1e-12, abs=1e-12 * (1.0 + offset))


@steady
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_as_python_writes_it_is_read_as_it_is(value):
    assert parse_number(repr(value)) == value


@steady
@given(st.text(max_size=12))
def test_a_field_is_a_finite_number_or_missing_or_refused(text):
    try:
        value = parse_number(text)
    except ValueError:
        return
    assert math.isfinite(value) or text.strip() == "" or text.lower() == "nan"


@steady
@given(
    st.lists(st.tuples(st.floats(-0.5, 5.0), st.floats(-1e6, 1e6)), min_size=8, max_size=30),
    st.floats(1e-3, 10.0),
)
def test_a_recording_reads_back_with_the_same_bits(tmp_path_factory, rows, noise):
    strain, stress = np.array(rows).T
    folder = tmp_path_factory.mktemp("round")
    columns = {"time_s": np.arange(len(rows), dtype=float), "strain": strain, "stress_kPa": stress}
    made = Recording(
        "a", None, "elastomer", specimen="é", real=False, noise={"stress_kPa": noise}, columns=columns
    )
    again = read_recording(write_recording(made, folder))
    assert again.specimen == "é" and again.noise == {"stress_kPa": noise}
    for name, values in columns.items():
        np.testing.assert_array_equal(again.columns[name], values)


@pytest.mark.parametrize("name", pj.available())
def test_a_table_of_constants_reads_back_equal(name):
    table = pj.load_calibration(name)
    again = parse_calibration(render_calibration(table), table.path)
    assert again.values() == pytest.approx(table.values(), rel=1e-12)
    assert again.text == table.text


@steady
@given(st.floats(0.3, 4.0), st.floats(1e4, 1e6))
def test_rubbers_resist_and_do_nothing_at_rest(stretch, mu):
    laws = {
        "neo-Hookean": lambda x: neo_hookean_stress(x, mu),
        "Yeoh": lambda x: yeoh_stress(x, 0.5 * mu, 0.01 * mu, 1e-4 * mu),
        "Gent": lambda x: gent_stress(x, mu, 60.0),
        "Ogden": lambda x: ogden_stress(x, jnp.asarray([mu]), jnp.asarray([2.0])),
    }
    for name, law in laws.items():
        assert abs(float(law(jnp.asarray(1.0)))) < 1e-9 * mu, name
        assert float(law(jnp.asarray(stretch))) * (stretch - 1.0) >= 0.0, name


@steady
@given(st.floats(0.5, 2.5), st.floats(1e4, 1e6))
def test_laws_of_rubber_have_each_other_as_limits(stretch, mu):
    plain = float(neo_hookean_stress(jnp.asarray(stretch), mu))
    limits = {
        "Yeoh": yeoh_stress(jnp.asarray(stretch), 0.5 * mu, 0.0, 0.0),
        "Gent": gent_stress(jnp.asarray(stretch), mu, 1e12),
        "Ogden": ogden_stress(jnp.asarray(stretch), jnp.asarray([mu]), jnp.asarray([2.0])),
    }
    for name, value in limits.items():
        assert float(value) == pytest.approx(plain, rel=1e-6, abs=1e-6 * mu), name


@steady
@given(st.floats(0.0, 0.3), st.floats(0.0, 0.3))
def test_detwinning_is_a_fraction_that_grows(low, high):
    alloy = pj.load_calibration("krl35").values()
    shape = (alloy["beta_1"], alloy["beta_2"], alloy["beta_3"])
    low, high = sorted((low, high))
    one, other = (float(generalised_logistic(jnp.asarray(x), *shape)) for x in (low, high))
    assert 0.0 <= one <= other <= 1.0


@steady
@given(st.floats(0.02, 0.98), st.floats(0.5, 8.0), st.floats(10.0, 30.0), st.floats(1.0, 9.0))
def test_the_phase_comes_back_from_its_own_resistance(xi0, exponent, rho_m, contrast):
    weight = mixing_fraction(jnp.asarray(xi0), exponent)
    rho_a = rho_m - contrast
    reading = martensite_fraction(mixed_resistivity(weight, rho_m, rho_a), rho_m, rho_a, exponent)
    if not bool(reading.clipped):
        # near full heat the fraction goes as a high root of the reading, and so do its rounding errors
        assert float(reading.xi0) == pytest.approx(xi0, rel=1e-9 / xi0**exponent)


@steady
@given(st.floats(0.0, 0.3), st.floats(0.0, 1.0))
def test_heat_takes_residual_strain_away(prestrain, xi0):
    alloy = pj.load_calibration("krl35").values()
    shape = (alloy[name] for name in ("gR_amplitude", "gR_slope", "gR_shift"))
    limit = residual_strain_limit(jnp.asarray(prestrain), *shape, jnp.asarray(prestrain))
    left = float(residual_strain(limit, jnp.asarray(xi0), alloy["gR_decay"]))
    assert -1e-15 <= left <= float(limit) * (1.0 + 1e-12)


@settings(steady, max_examples=12)
@given(st.floats(4e-3, 3e-2), st.floats(4e-3, 3e-2), st.floats(0.05, 0.4), st.floats(0.2, 5.0))
def test_a_section_scales_and_does_not_know_left_from_right(width, height, share, factor):
    wall = share * min(width, height)
    area, first, second = (np.asarray(x) for x in pj.rectangle(width, height, wall).moments())
    assert area == pytest.approx(width * height - (width - 2 * wall) * (height - 2 * wall), rel=1e-12)
    np.testing.assert_allclose(first, 0.0, atol=1e-12 * area * height)
    assert second[0, 1] == pytest.approx(0.0, abs=1e-12 * np.trace(second))
    large = pj.rectangle(factor * width, factor * height, factor * wall).moments()
    assert float(large[0]) == pytest.approx(float(area) * factor**2, rel=1e-12)
    np.testing.assert_allclose(
        large[2], second * factor**4, rtol=1e-9, atol=1e-12 * np.trace(second) * factor**4
    )
    turned = np.asarray(pj.rectangle(height, width, wall).moments()[2])
    np.testing.assert_allclose(np.diag(turned), np.diag(second)[::-1], rtol=1e-9)
