"""The examples of docs/effects.md are run as they are printed."""

import inspect
import re
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.effects import CATALOGUE, register
from pneusma_jax.pipeline import Effect

PAGE = Path(__file__).resolve().parents[2] / "docs" / "effects.md"


@pytest.fixture(scope="module")
def examples():
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 2
    return [(block, {"__name__": "example"}) for block in blocks]


def test_the_first_example_runs(examples):
    code, names = examples[0]
    exec(compile(code, str(PAGE), "exec"), names)
    seen = names["pulled"].seen["stress"]
    time = np.asarray(names["time"])
    np.testing.assert_allclose(seen[1:], np.interp(time - 0.4, time, names["pulled"].rows.stress)[1:], rtol=1e-9)


def test_the_example_effect_joins_the_catalogue_and_acts(examples, monkeypatch):
    code, names = examples[1]
    exec(compile(code, str(PAGE), "exec"), names)
    monkeypatch.setattr("pneusma_jax.effects.CATALOGUE", dict(CATALOGUE))
    slip = register(names["BondSlip"])(rate=1e-7)
    assert pj.effects.find_effect("bond_slip") is names["BondSlip"]
    law, strain, time = pj.load_silicone(), jnp.full(30, 0.4), jnp.arange(30.0)
    absent = pj.simulate_coupon(law, strain, time=time, effects=(names["BondSlip"](),)).seen["stress"]
    np.testing.assert_allclose(absent, law(strain), rtol=1e-14)
    found = np.asarray(pj.simulate_coupon(law, strain, time=time, effects=(slip,)).seen["stress"])
    lost = np.concatenate([[0.0], np.cumsum(1e-7 * found[1:] * 1.0)])
    np.testing.assert_allclose(found[1:], law(strain[1:] - lost[:-1]), rtol=1e-10)


def test_the_table_of_slots_is_complete():
    slots = {name for name, one in vars(Effect).items() if not name.startswith("_") and inspect.isfunction(one)}
    listed = set(re.findall(r"^\| `(\w+)` \| ", PAGE.read_text(), re.MULTILINE))
    assert slots - {"begin", "remember", "acts_at_rest"} <= listed
