"""Names of packages that documents promised before they moved still give the same objects."""

import importlib

import pytest

FORMER = [
    ("fitting.characterise", "fitting.calibrate", "fitting.calibrate.batch"),
    ("fitting.diagnosis", "fitting.diagnose"),
    ("fitting.own_base", "fitting.diagnose.custom_model"),
    ("fitting.parameters", "fitting.inference.parameters"),
    ("fitting.recordings", "fitting.data.recordings"),
    ("fitting.augmented", "fitting.specimens.saved_models"),
    ("pneusma_jax.chain", "pneusma_jax.pipeline"),
    ("pneusma_jax.outline", "pneusma_jax.section.outline"),
]


@pytest.mark.parametrize(("former", "names"), [(former, names) for former, *names in FORMER])
def test_a_former_name_gives_the_same_objects(former, names):
    old, new = importlib.import_module(former), [importlib.import_module(name) for name in names]
    assert old.__all__
    for each in old.__all__:
        assert any(value is getattr(old, each) for module in new for value in vars(module).values())
