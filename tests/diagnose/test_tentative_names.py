"""A name that is hardly likelier than not says "perhaps", and every strength shows its error."""

import dataclasses

import numpy as np
import pytest
from linear_world import CONSTANT, tubes

from fitting.diagnose.check import answers
from fitting.diagnose.search.explain import explain
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.report.diagnosis import text
from fitting.report.diagnosis.payload import content


@pytest.fixture(scope="module")
def conclusion():
    """One strong effect, found beyond doubt."""
    world = tubes(effects=(CONSTANT,))
    program = world.program(world.truth(np.random.default_rng(5), **{CONSTANT: 3.0}))
    return conclude(explain(program, np.random.default_rng(1), lambda _: None))


def but(conclusion, **changes):
    """The conclusion with another first name."""
    found = [dataclasses.replace(conclusion.found[0], **changes), *conclusion.found[1:]]
    return dataclasses.replace(conclusion, found=found)


def test_a_sure_name_is_told_with_its_strength_and_error(conclusion):
    first = verdict_sentences(conclusion)[0]
    assert first.startswith(f"The base model leaves out {CONSTANT} (shift = ") and "±" in first and "perhaps" not in first
    assert "end of its range" not in first
    assert content(conclusion)["effects"][0] | {"tentative": False, "strength": "shift"} == content(conclusion)["effects"][0]


@pytest.mark.parametrize("changes", [{"probability": 0.35}, {"probability": DEFAULT.probability.tentative}, {"errors": 0.8}])
def test_a_tentative_name_says_perhaps(conclusion, changes):
    doubted = but(conclusion, **changes)
    probability = doubted.found[0].probability
    first = verdict_sentences(doubted)[0]
    assert first.startswith(f"The base model perhaps leaves out {CONSTANT} (probability {probability:.2f}, shift = ")
    assert "±" in first
    assert "The name is tentative" in text.effect(doubted.found[0])
    assert "perhaps found" in answers([CONSTANT], doubted)[0]["text"]
    assert content(doubted)["effects"][0]["tentative"] is True


def test_of_two_names_the_tentative_one_comes_last(conclusion):
    first = conclusion.found[0]
    other = dataclasses.replace(first, slug="thick_wall", probability=np.float64(0.4))
    said = verdict_sentences(dataclasses.replace(conclusion, found=[other, first]))[0]
    assert f"leaves out {CONSTANT} (shift =" in said and ", and perhaps thick_wall (probability 0.40, shift =" in said


def test_an_effect_at_its_bound_is_tentative_and_says_so():
    world = tubes(effects=(CONSTANT,))
    program = world.program(world.truth(np.random.default_rng(5), **{CONSTANT: 6.0}))  # beyond what is physical
    found = conclude(explain(program, np.random.default_rng(1), lambda _: None)).found
    named = [f for f in found if f.slug == CONSTANT]
    assert named and named[0].tentative
    assert named[0].words.endswith(", an end of its range)")
