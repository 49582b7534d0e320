"""A constant within its tolerance and an error of an instrument that explain the same: the report says so."""

import numpy as np
import pytest
from linear_world import World, smooth

from fitting.diagnose.search.explain import explain
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.exchangeable import exchanges_of
from fitting.diagnose.verdict.text import exchange_sentences, verdict_sentences
from fitting.report.diagnosis.payload import content

OFFSET, GAIN, DRIFT = range(3)


def pressurised(alike):
    """A world whose first constant changes the output as an offset of the pressure does, in a share of it."""
    rng = np.random.default_rng(2)
    instrument = 3.0 * smooth(rng, 3, 60, 3)
    base = smooth(rng, 3, 60, 2)
    base[..., 0] = 4.0 * (alike * instrument[..., OFFSET] + (1.0 - alike) * base[..., 0])
    instrument[..., GAIN] *= 10.0
    return World(base, {"pressure_calibration": instrument})


def concluded(world, **truth):
    program = world.program(world.truth(np.random.default_rng(4), **truth))
    return conclude(explain(program, np.random.default_rng(1), lambda _: None))


def test_a_constant_that_hides_an_offset_is_told_with_the_offset():
    world = pressurised(alike=1.0)
    conclusion = concluded(world, pressure_calibration=(1.5, 0.0, 0.0))
    assert not conclusion.mismatch
    (one,) = conclusion.exchanges
    unknowns = conclusion.explanation.program.unknowns
    assert unknowns.items[one.constant].name == "constant_0" and unknowns.items[one.strength].name == "offset"
    assert one.value == pytest.approx(1.5, abs=0.15) and not one.named
    (sentence,) = exchange_sentences(conclusion, conclusion.exchanges)
    assert "constant_0" in sentence and "offset = 15" in sentence and "Pa" in sentence and "explains the same" in sentence
    assert verdict_sentences(conclusion)[-1] == sentence
    (told,) = content(conclusion)["exchangeable"]
    assert told["effect"] == "pressure_calibration" and told["parameter"] == "offset" and told["unit"] == "Pa"


def test_a_constant_that_nobody_states_is_told_with_no_stated_value(monkeypatch):
    """Of a silicone that was to be identified, the report said what an offset is "with silicone_stiffness as stated"."""
    world = pressurised(alike=1.0)
    program = world.program(world.truth(np.random.default_rng(4), pressure_calibration=(1.5, 0.0, 0.0)))
    conclusion = conclude(explain(program, np.random.default_rng(1), lambda _: None))
    program, fit = conclusion.model
    assert len(exchanges_of(program, fit)) == 1
    monkeypatch.setattr("fitting.diagnose.verdict.exchangeable.FACTOR", "constant_0")
    assert len(exchanges_of(program, fit)) == 1  # its material is known
    for recording in program.recordings:
        recording.geometry["material"] = "fit"
    assert exchanges_of(program, fit) == [] and conclusion.exchanges == []


def test_a_constant_that_moved_by_itself_is_not_told_where_no_instrument_does_the_same():
    conclusion = concluded(pressurised(alike=0.0), base=(0.8,))
    assert not conclusion.mismatch and conclusion.exchanges == [] and exchange_sentences(conclusion, conclusion.exchanges) == []


def test_a_constant_at_its_nominal_value_hides_nothing():
    assert concluded(pressurised(alike=1.0)).exchanges == []


def test_a_named_effect_that_goes_with_a_constant_is_told_with_its_value_at_the_nominal_one():
    """The offset of a tube's pressure was 0.7 kPa beside a rest length that had moved, and -1.8 kPa without that."""
    world = pressurised(alike=1.0)
    conclusion = concluded(world, pressure_calibration=(1.5, 2.0, 0.0))
    assert conclusion.found[0].slug == "pressure_calibration"
    program, fit = conclusion.model
    (one,) = exchanges_of(program, fit)
    assert one.named and one.value == pytest.approx(1.5, abs=0.15)
    (sentence,) = exchange_sentences(conclusion, conclusion.exchanges)
    assert verdict_sentences(conclusion)[-1] == sentence
    assert "do not tell pressure_calibration from" in sentence and "Measure constant_0 again" in sentence
