"""A loop of a wire's law is put down to the residual strain only where the law has one."""

from types import SimpleNamespace

import pytest

from fitting.report.general import wires


@pytest.mark.parametrize(("held", "told"), [({}, 1), ({"gR_amplitude": SimpleNamespace(value=0.01)}, 1), ({"gR_amplitude": SimpleNamespace(value=0.0)}, 0)])
def test_a_law_without_residual_strain_has_no_loop_by_it(monkeypatch, held, told):
    """A report said that the law was fitted without residual strain, and that this strain made its loop of 5.9 K."""
    result = SimpleNamespace(unseen=held, model=None, fit=SimpleNamespace(recordings=[], misses=True), campaign=None, parameters={})
    monkeypatch.setattr(wires, "bracket", lambda campaign: None)
    monkeypatch.setattr(wires, "_over_temperature", lambda result: [SimpleNamespace(name="a")])
    monkeypatch.setattr(wires, "_crossings", lambda score: [(True, 56.0), (False, 50.0)])
    said = " ".join(wires.warnings(result))
    assert ("draws a loop of 6 K" in said) == bool(told)
    assert ("draws one curve" in said) != bool(told)
