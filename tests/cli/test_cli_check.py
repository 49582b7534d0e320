"""`pneusma check`: the model passes, a broken law does not."""

import math

import pytest

from pneusma_jax.nitinol import geometry
from pneusma_jax.silicone import hyperelastic
from validation import self_check
from validation.self_check import silicone, springs


@pytest.mark.slow
def test_the_model_passes(run):
    result = run("check")
    lines = result.stdout.splitlines()
    assert result.exit_code == 0, result.stdout
    assert sum(line.startswith("PASS") for line in lines) > 80 and not any(
        line.startswith("FAIL") for line in lines
    )
    assert lines[-1].endswith("claims hold")


@pytest.mark.parametrize(
    ("module", "name", "room"),
    [(hyperelastic, "neo_hookean_stress", silicone), (geometry, "wahl_factor", springs)],
)
def test_a_broken_law_fails(monkeypatch, module, name, room):
    law = getattr(module, name)
    monkeypatch.setattr(module, name, lambda *a: 1.001 * law(*a))
    assert any(not outcome.passed for outcome in self_check.run(list(room.claims())))


def test_a_law_that_raises_fails_and_stops_nothing(monkeypatch, run):
    def broken(*_):
        raise RuntimeError("no such law")

    monkeypatch.setattr(self_check, "all_claims", lambda: list(silicone.claims()))
    monkeypatch.setattr(hyperelastic, "neo_hookean_stress", broken)
    result = run("check", "--failed")
    assert result.exit_code == 1
    assert (
        "FAIL" in result.stdout
        and "RuntimeError: no such law" in result.stdout
        and "PASS" not in result.stdout
    )


def test_a_room_that_cannot_be_set_up_fails(monkeypatch):
    def broken(*_):
        raise RuntimeError("no such alloy")

    monkeypatch.setattr(springs.pj, "load_alloy", broken)
    outcomes = list(self_check.run(self_check.claims_of(springs)))
    assert [o.problem for o in outcomes if not o.passed] == ["RuntimeError: no such alloy"]


def test_what_is_not_a_number_never_passes():
    claim = self_check.Claim("", "", lambda: (0.0, 0.0))
    assert not self_check.Outcome(claim, math.nan, 1.0).passed
    assert not self_check.Outcome(claim, 1.0, math.inf).passed
    assert self_check.Outcome(claim, 0.0, 0.0).passed
