"""A long characterisation says which stage of how many runs, and how many of its profiles have begun."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.general import pipeline as general
from fitting.calibrate.spring import searched as spring
from fitting.characterise import characterise
from fitting.inference.progress import Stages
from fitting.synthesise import synthesise, write_synthetic


def begun(names, progress):
    """Profiles that only say which of them begin."""
    for name in names:
        progress(name)
    return {}


def test_profiles_of_a_spring_are_counted(monkeypatch):
    """An open alloy's 22 profiles took minutes, and a line had the name of one and a step of nobody knew how many."""
    lines, joint = [], SimpleNamespace(problem=None, parameters=None)
    monkeypatch.setattr(spring, "information", lambda *_: SimpleNamespace(names=("G_m", "a")))
    monkeypatch.setattr(spring, "zeros", lambda *_: SimpleNamespace(variance=np.ones(2)))
    monkeypatch.setattr(spring, "profiles", lambda _, names, variances, progress, leave: begun(names, progress))
    told = Stages(lines.append, (spring.FITS, spring.ZERO, spring.PROFILE, spring.LAST))
    spring._profiled(joint, ["G_m", "a"], told, False)
    assert lines == ["stage 3 of 4, profile 1 of 2: G_m", "stage 3 of 4, profile 2 of 2: a"]
    assert spring._profiled(joint, [], Stages(lines.append, (spring.FITS,)), False)[0] == {} and len(lines) == 2


def test_profiles_of_a_wire_are_counted(monkeypatch):
    lines, fit = [], SimpleNamespace(result=SimpleNamespace(parameters={}))
    now = SimpleNamespace(fit=fit, information=SimpleNamespace(names=()), lasting=SimpleNamespace(variance=1.0))
    monkeypatch.setattr(general, "_wanted", lambda fit, names: names)
    monkeypatch.setattr(general, "profiles", lambda _, names, variances, leave, progress: begun(names, progress))
    general._profiled(now, {}, ["E_m", "E_a"], Stages(lines.append, (general.FITS, general.PROFILE)))
    assert lines == ["stage 2 of 2, profile 1 of 2: E_m", "stage 2 of 2, profile 2 of 2: E_a"]


@pytest.mark.slow
def test_laws_of_an_elastomer_are_counted(tmp_path):
    lines = []
    write_synthetic(synthesise("elastomer", seed=1), tmp_path / "made")
    characterise(tmp_path / "made", law="neo_hookean", progress=lines.append)
    assert lines[0].startswith("stage 1 of ") and "law 1 of 1: " in lines[0]
    assert len(lines) == int(lines[0][len("stage 1 of ")])
