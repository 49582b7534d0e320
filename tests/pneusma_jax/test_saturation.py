"""How what cycles leave behind comes to its end: exponential, hyperbolic and everything between."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneusma_jax.effects import find_effect
from pneusma_jax.effects._saturation import LEAST, saturation

X = jnp.array([0.0, 0.1, 1.0, 4.0, 30.0])


def test_known_courses():
    np.testing.assert_allclose(saturation(X, 0.0), 1.0 - np.exp(-X), rtol=1e-14)
    np.testing.assert_allclose(saturation(X, 1.0), X / (1.0 + X), rtol=1e-14)
    np.testing.assert_allclose(saturation(X, 2.0), 1.0 - 1.0 / np.sqrt(1.0 + 2.0 * X), rtol=1e-14)


def test_its_rate_falls_as_the_power_of_what_is_to_come():
    for q in (0.0, 0.4, 1.0, 2.5):
        rate = jax.vmap(jax.grad(saturation), (0, None))(X, q)
        np.testing.assert_allclose(rate, (1.0 - saturation(X, q)) ** (1.0 + q), rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize("q", [0.0, 0.5 * LEAST, 2.0 * LEAST, 1.0])
def test_its_derivative_by_slowness_is_finite_and_right_where_the_form_changes(q):
    found = jax.vmap(jax.grad(saturation, argnums=1), (0, None))(X, q)
    step = 1e-3  # to one side: it is 0 or more
    at = [saturation(X, q + k * step) for k in (0, 1, 2)]
    np.testing.assert_allclose(found, (-3.0 * at[0] + 4.0 * at[1] - at[2]) / (2.0 * step), atol=2e-3)
    assert np.all(np.isfinite(found)) and found[0] == 0.0


def test_many_cycles_leave_all_and_no_number_is_lost():
    many = jnp.array([1e3, 1e5, 1e9])
    for q in (0.0, 1e-6, 0.9 * LEAST, 0.5, 1.0):
        found = jax.vmap(jax.value_and_grad(saturation, argnums=1), (0, None))(many, q)
        assert np.all(np.isfinite(found[0])) and np.all(np.isfinite(found[1]))
        assert found[0][-1] == pytest.approx(1.0, abs=1e-8 if q < 0.5 else 1e-4)


def test_a_slow_shakedown_leaves_less_early():
    quick, slow = (find_effect("cyclic_shakedown")(shift=0.01, cycles=1.0, slowness=q) for q in (0.0, 1.0))
    memory = {1: (jnp.asarray(1.0), jnp.asarray(0.0), jnp.asarray(2.0))}
    early = [float(effect._progress({"number": 1}, memory)) for effect in (quick, slow)]
    assert early[0] == pytest.approx(1.0 - np.exp(-2.0)) and early[1] == pytest.approx(2.0 / 3.0)
