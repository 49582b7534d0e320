"""A pressure of a Python call that rather is in kPa, or a thousand times too large, is warned of."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.control import Loop
from fitting.invert.run import Limits
from pneusma_jax.errors import Implausible
from pneusma_jax.implausible import warn_of_pressure

CALLS = {
    "a number": lambda p: warn_of_pressure(p),
    "a sweep": lambda p: warn_of_pressure(np.linspace(0.0, p, 7)),
    "a list": lambda p: warn_of_pressure([0.0, p / 2, p]),
    "a held pressure": lambda p: warn_of_pressure(jnp.full(5, p)),
    "limits": lambda p: Limits(pressure=(0.0, p)),
    "a loop": lambda p: Loop(np.arange(3.0), np.zeros(3), pressure=p),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize(("pressure", "said"), [(30.0, "30 Pa, .* in Pa. For kPa give 30e3"), (3e7, "30000 Pa")])
def test_kilopascals_and_thousands_of_them_are_warned_of(call, pressure, said):
    with pytest.warns(Implausible, match=said):
        CALLS[call](pressure)


def test_what_a_person_may_mean_is_not_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for call in CALLS.values():
            call(0.0)
            call(30e3)
        warn_of_pressure(np.random.default_rng(1).normal(0.0, 20.0, 50))  # a vented sensor
        for reading in (np.float64(23.4171), 1e-6, np.array([12.3491, 45.6213])):
            warn_of_pressure(reading)
        warn_of_pressure(np.nan)
        jax.jit(warn_of_pressure)(jnp.asarray(30.0))
