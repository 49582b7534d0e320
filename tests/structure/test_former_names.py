"""Names of packages that documents promised before they moved still give the same objects."""

import importlib

import pytest

FORMER = [
    ("fitting.characterise", "fitting.calibrate"),
    ("fitting.diagnosis", "fitting.diagnose"),
    ("fitting.own_base", "fitting.diagnose.custom_model"),
    ("fitting.parameters", "fitting.inference.parameters"),
    ("fitting.recordings", "fitting.data.recordings"),
    ("fitting.augmented", "fitting.specimens.saved_models"),
    ("pneusma_jax.chain", "pneusma_jax.pipeline"),
    ("pneusma_jax.outline", "pneusma_jax.section.outline"),
]


@pytest.mark.parametrize(("former", "name"), FORMER)
def test_a_former_name_gives_the_same_objects(former, name):
    old, new = importlib.import_module(former), importlib.import_module(name)
    assert old.__all__ and all(getattr(old, each) is getattr(new, each) for each in old.__all__)
