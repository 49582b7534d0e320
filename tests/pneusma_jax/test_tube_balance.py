"""A wrapped tube under pressure: the balance of its wall, and what is answered where there is none."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.silicone import NeoHookean, tube_strain

SIZES = (7e-3, 1e-3)  # outer diameter and wall [m]


@pytest.fixture(scope="module", autouse=True)
def _float64():
    pj.enable_float64()


def law(stiffness: float) -> NeoHookean:
    return NeoHookean(jnp.asarray(stiffness))


@pytest.mark.parametrize("throw", [True, False])
def test_the_wall_balances_the_end_cap(throw):
    strain = tube_strain(20e3, *SIZES, law(60e3), throw=throw)
    bore = SIZES[0] - 2.0 * SIZES[1]
    assert float(law(60e3)(strain)) == pytest.approx(20e3 * bore**2 / (SIZES[0] ** 2 - bore**2), rel=1e-9)


def test_where_there_is_no_balance_the_answer_is_nan_or_an_error():
    rows = jax.vmap(lambda p: tube_strain(p, *SIZES, law(6.0), throw=False))(jnp.array([0.0, 20e3]))
    np.testing.assert_array_equal(np.isfinite(rows), [True, False])
    with pytest.raises(Exception, match="cannot balance this pressure"):
        tube_strain(20e3, *SIZES, law(6.0))
