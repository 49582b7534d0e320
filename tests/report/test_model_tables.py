"""Constants of one name in several tables go to that of their specimen: an alloy's alpha_1, and Ogden's."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.report.diagnosis.model import model_of
from fitting.specimens.saved_models import load_model, save_model


def concluded(kind, names):
    """A conclusion whose base model has these free constants, each 2."""
    items = [SimpleNamespace(name=name, value=lambda u: 2.0, spread=lambda u, sd: 0.1) for name in names]
    unknowns = SimpleNamespace(base=range(len(names)), items=items)
    recording = SimpleNamespace(specimen="s", full_geometry=dict)
    program = SimpleNamespace(kind=kind, unknowns=unknowns, recordings=[recording])
    fit = SimpleNamespace(u=np.zeros(len(names)))
    start = SimpleNamespace(tables={})
    return SimpleNamespace(model=(program, fit), start=start, found=(), mismatch=False, remainder=None, sd=lambda k: 0.1)


@pytest.mark.parametrize(
    ("kind", "names", "table", "unit"), [("elastomer", ("mu_1", "alpha_1"), "silicone", "1"), ("spring", ("alpha_1",), "alloy", "ohm/m")]
)
def test_a_constant_goes_to_the_table_of_its_specimen(tmp_path, kind, names, table, unit):
    model = model_of(concluded(kind, names), "a test")
    loaded = load_model(save_model(model, tmp_path / "augmented.toml"))
    for one in (model, loaded):
        assert set(one.base) == {table} and one.base[table]["alpha_1"].value == 2.0
    assert loaded.base[table]["alpha_1"].unit == unit
