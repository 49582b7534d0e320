"""Warnings of the report of a spring: constants of one status share a sentence."""

from types import SimpleNamespace

from fitting.report.spring import text as spring_text


def test_constants_that_stayed_share_one_warning(monkeypatch):
    entries = [{"kind": "at_start", "parameters": [name], "text": f"{name} ..."} for name in ("gR_slope", "gR_shift")]
    for name, said in {"unended": [], "lead": 0.0, "far_from_nominal": [], "lasting_zeros": [], "doubts": [1], "limits": []}.items():
        monkeypatch.setattr(spring_text, name, lambda *_, said=said: said)
    monkeypatch.setattr(spring_text, "fitted_only", lambda *_: {})
    monkeypatch.setattr(spring_text.profile_likelihood, "warnings", lambda _: [])
    joint = SimpleNamespace(result=None, values={})
    result = SimpleNamespace(identifiability=entries, joint=joint, tests=[], fitted={}, lasting={}, parameters={}, scores=[], path="")
    (said,) = spring_text.warnings(result)
    assert said.startswith("gR_slope and gR_shift are still at the values they started from")
