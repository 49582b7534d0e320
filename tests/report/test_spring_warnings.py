"""Warnings of the report of a spring: constants of one status share a sentence."""

from types import SimpleNamespace

from fitting.report.open_constants import first_sentence, open_sentences
from fitting.report.spring import text as spring_text

MEMORY = ("gR_amplitude", "gR_slope", "gR_shift")


def stayed(name, reason="tests with unloading up to 575 % spring strain do not show it"):
    return {"kind": "at_start", "parameters": [name], "reason": reason, "text": f"{name} ..."}


def pair(kind, one, other):
    names = f"{one} and {other}"
    return {"kind": kind, "parameters": [one, other], "group": f"{names} (...)", "text": f"{names} are ..."}


def test_constants_that_stayed_share_one_warning(monkeypatch):
    """The same sentence had been told of three constants in the verdict, in warnings and in a list: seven times."""
    entries = [stayed(name) for name in MEMORY]
    for name, said in {"unended": [], "lead": 0.0, "far_from_nominal": [], "lasting_zeros": [], "doubts": [1], "limits": []}.items():
        monkeypatch.setattr(spring_text, name, lambda *_, said=said: said)
    monkeypatch.setattr(spring_text, "fitted_only", lambda *_: {})
    monkeypatch.setattr(spring_text.profile_likelihood, "warnings", lambda _: [])
    joint = SimpleNamespace(result=None, values={})
    result = SimpleNamespace(identifiability=entries, joint=joint, tests=[], fitted={}, lasting={}, parameters={}, scores=[], path="")
    (said,) = spring_text.warnings(result)
    assert said.startswith("gR_amplitude, gR_slope and gR_shift are still at the values they started from: tests with")
    assert "do not show them. Their errors come from the priors." in said
    assert open_sentences(entries) == [said] == [first_sentence(entries)]
    apart = open_sentences([*entries, stayed("a", "no tests between cold and hot were made")])
    assert len(apart) == 1 and "these recordings do not show them" in apart[0]


def test_several_groups_share_a_sentence_and_the_verdict_tells_the_first():
    together = [pair("known_together", "beta_2", "beta_3"), pair("known_together", "km_1", "km_3")]
    loose = [pair("loose_direction", "a", "b"), pair("loose_direction", "c", "d")]
    first, second = open_sentences([*loose, *together])
    assert "a and b (...); c and d (...)" in first and "beta_2 and beta_3 (...); km_1 and km_3 (...)" in second
    assert first_sentence([*loose, *together]) == "a and b are ..."
    assert open_sentences(together[:1]) == ["beta_2 and beta_3 are ..."]
