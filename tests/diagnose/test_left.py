"""What names clearly leave: how much and in which regime is the first sentence, and then no name is to be trusted."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, World, fast, smooth, tubes

from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.search.explain import explain
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.conclusion import WithoutTurns
from fitting.diagnose.verdict.left import Left, left_of
from fitting.diagnose.verdict.regime import regime_of
from fitting.diagnose.verdict.text import unexplained, verdict_sentences
from fitting.report.diagnosis import text
from fitting.report.diagnosis.payload import content
from pneusma_jax.effects import CATALOGUE


def judged(rng, where=None, size=3.0, rows=160, recordings=4):
    """The base model of a campaign with more noise in some rows, by a function of pressure."""
    world = fast(recordings=recordings, rows=rows, effects=(CONSTANT,))
    y = world.truth(rng)
    if where is not None:
        y += size * where(world.drivers["pressure"]) * rng.standard_normal(y.shape)
    program, base = base_fit(world.program(y))
    return program, base


def test_a_regime_is_found_in_one_half_and_confirmed_in_the_other():
    program, base = judged(np.random.default_rng(1), lambda pressure: pressure > 800.0)
    found = regime_of(program, base)
    assert found.text.startswith("pressure above") and found.p_value < 1e-3
    assert found.share > 0.8 and found.rows < 0.7
    limit, unit = found.text.split()[-2:]
    assert unit == "kPa" and float(limit) == pytest.approx(0.8, abs=0.25)


def test_a_branch_is_a_regime():
    rng = np.random.default_rng(2)
    program, base = judged(rng, lambda pressure: np.gradient(pressure, axis=1) < 0.0)
    found = regime_of(program, base)
    assert found.text in ("pressure is falling", f"time above {found.text.split()[-2]} s") and found.share > 0.8


def test_a_regime_is_one_of_the_recordings_that_the_misfit_is_of():
    program, base = judged(np.random.default_rng(4), lambda pressure: np.arange(len(pressure))[:, None] == 2)
    assert regime_of(program, base).text == f"the recording is {program.recordings[2].name}"
    assert regime_of(program, base, np.arange(4) != 2) is None


@pytest.mark.slow
def test_noise_has_a_regime_no_more_often_than_the_level_of_the_test():
    found = [regime_of(program, base) for program, base in (judged(np.random.default_rng(k), rows=80) for k in range(40))]
    assert sum(one is not None for one in found) <= 2  # three of forty are as rare as one in a hundred


def test_a_name_that_leaves_more_than_noise_is_not_trusted():
    """An effect explains most of a misfit; a ripple of another kind is left, ten noise variances large."""
    rng = np.random.default_rng(3)
    world = tubes(effects=(CONSTANT, DELAY), rows=120)
    ripple = 6.0 * np.sin(0.6 * np.arange(120)) * (world.drivers["pressure"] > 800.0)
    y = world.truth(rng, (0.3, -0.2), **{CONSTANT: 4.0}) + ripple
    conclusion = conclude(explain(world.program(y), np.random.default_rng(1)))
    assert [f.slug for f in conclusion.found][:1] == ["unmodelled"] and conclusion.unknown > 0.5
    assert all(f.probability < 0.5 for f in conclusion.found[1:])
    first = verdict_sentences(conclusion)[0]
    assert "A reduced chi-square of" in first and "is where pressure above" in first
    said = content(conclusion)["left"]
    assert said["reduced_chi2"] > 5.0 and said["regime"]["p_value"] < 0.01 and said["recordings"] == "fitted"


def test_a_name_that_explains_everything_is_trusted():
    rng = np.random.default_rng(4)
    world = tubes(effects=(CONSTANT, DELAY))
    conclusion = conclude(explain(world.program(world.truth(rng, **{CONSTANT: 3.0})), np.random.default_rng(1)))
    assert [f.slug for f in conclusion.found] == [CONSTANT] and conclusion.left is None
    assert left_of(conclusion.explanation.program, conclusion.explanation.final) is None
    assert content(conclusion)["left"] is None


def test_what_validation_recordings_keep_counts_as_well():
    rng = np.random.default_rng(5)
    world = fast(recordings=6, roles=("fit",) * 4 + ("validation",) * 2, effects=(CONSTANT,))
    y = world.truth(rng)
    y[4:] += 5.0 * np.sin(0.6 * np.arange(y.shape[1]))
    program, base = base_fit(world.program(y))
    found = left_of(program, base)
    assert found.held_out and found.reduced_chi2 > 8.0 and "recordings that were not fitted" in found.text


def test_a_small_imperfection_of_a_right_form_leaves_its_name_trusted():
    rng = np.random.default_rng(6)
    world = tubes()
    wrong = world.effects[CONSTANT] + 0.05 * smooth(rng, *world.effects[CONSTANT].shape)
    truth = World(world.base, world.effects | {CONSTANT: wrong})
    conclusion = conclude(explain(world.program(truth.truth(rng, **{CONSTANT: 4.0})), np.random.default_rng(1)))
    assert conclusion.found[0].slug == CONSTANT and conclusion.left is None


@pytest.mark.parametrize(("off", "first"), [(0.15, CONSTANT), (0.4, "unmodelled")])
def test_a_small_share_of_a_large_misfit_speaks_against_no_name_however_little_the_noise_is(off, first):
    """A form that is off by 15 % leaves some 2 % of the misfit: many noise variances of an accurate instrument."""
    rng = np.random.default_rng(6)
    world = tubes()
    strong = 4.0 * world.effects[CONSTANT]
    wrong = strong + off * 4.0 * smooth(rng, *strong.shape)
    truth = World(world.base, world.effects | {CONSTANT: wrong})
    program = World(world.base, world.effects | {CONSTANT: strong}).program(truth.truth(rng, **{CONSTANT: 4.0}))
    conclusion = conclude(explain(program, np.random.default_rng(1)))
    left = conclusion.left
    assert left.reduced_chi2 - left.noise > DEFAULT.excess.clear
    assert (left.kept <= DEFAULT.share.small) is left.trusted is (first == CONSTANT)
    assert conclusion.found[0].slug == first and 0.25 <= conclusion.unknown
    said = verdict_sentences(conclusion)[0]
    assert "A reduced chi-square of" in said and ("no name is to be trusted" in said) is (first == "unmodelled")


@pytest.mark.parametrize(("names", "said"), [
    ((CONSTANT,), f"With {CONSTANT}, which is doubtful, and a smooth function of pressure"),
    ((CONSTANT, DELAY), f"With {CONSTANT} and {DELAY}, which are doubtful, and a smooth function of pressure"),
])  # fmt: skip
def test_doubtful_names_are_listed_in_one_clause(monkeypatch, names, said):
    """Each had a clause with commas of its own, and two commas stood side by side."""
    rng = np.random.default_rng(3)
    world = tubes(effects=(CONSTANT, DELAY), rows=120)
    y = world.truth(rng, **{CONSTANT: 4.0}) + 6.0 * np.sin(0.6 * np.arange(120))
    conclusion = conclude(explain(world.program(y), np.random.default_rng(1)))
    own, *_ = conclusion.found
    doubtful = [dataclasses.replace(own, slug=name, probability=0.3) for name in names]
    told = dataclasses.replace(
        conclusion, found=[own, *doubtful], remainder=SimpleNamespace(driver="pressure", quantity="length")
    )
    assert own.slug == "unmodelled" and any(sentence.startswith(said) for sentence in verdict_sentences(told))


def test_the_fall_of_the_misfit_is_told_of_names_and_of_the_smooth_function_together():
    """A page gave the smooth function alone what the names had explained, and called parts of one recording recordings."""
    final, program = SimpleNamespace(slugs=(CONSTANT,)), SimpleNamespace(kind="tube")
    before, after = (SimpleNamespace(how="within-recording", reduced_chi2=value) for value in (31.0, 10.0))
    told = SimpleNamespace(
        explanation=SimpleNamespace(final=final, program=program, left_out=(31.0, 11.0)), before=before, after=after,
        remainder=SimpleNamespace(driver="pressure", quantity="length", knots=np.array([0.0, 4e4])),
        discrepancy=SimpleNamespace(driver="pressure", quantity="length", left_out=2.0),
    )  # fmt: skip
    said = text.discrepancy(told)
    assert said.startswith(f"With {CONSTANT} and a smooth function of pressure between 0 and 40 kPa, added to length, the misfit of parts of")
    final.slugs = ()
    assert text.discrepancy(told).startswith("With a smooth function of pressure") and text.race(told) == ""
    final.slugs = (CONSTANT,)
    assert text.race(told).startswith("To choose effects, fitted recordings or parts of them were predicted")


def test_something_unknown_that_is_likelier_than_a_trusted_name_is_not_said_to_be_left_without_it():
    """The misfit that is told is that with the name."""
    left = Left(8.0, 1.0, False, (CONSTANT,), None, kept=0.02)
    told = SimpleNamespace(left=left, explanation=SimpleNamespace(misread=None), remainder=None)
    assert left.trusted and unexplained(told, "the base model") == (
        "The recordings contradict the base model, and something unknown is likelier than any name. "
        f"This is with {CONSTANT} fitted. {left.text}"
    )
    told.left, told.remainder = dataclasses.replace(left, names=()), SimpleNamespace(driver="max_strain")
    assert unexplained(told, "the base model").endswith(
        f"explains them. This is with a smooth function of max strain fitted. {left.text}"
    )


def test_much_of_a_noise_that_nobody_states_is_said_and_speaks_against_no_name():
    """Differences of filtered readings make an unstated noise too small."""
    stated = Left(8.0, 1.0, False, (CONSTANT,), None)
    assert "chi-square of 20100 is left in fitted recordings, where noise alone would leave 100." in Left(20051.0, 101.0, False, (), None).text
    assert not stated.trusted and dataclasses.replace(stated, stated=False).trusted
    world = tubes(effects=(CONSTANT,), stated=False, rows=200)
    y = world.truth(np.random.default_rng(8)) + 8.0 * np.sin(0.2 * np.arange(200))
    program, base = base_fit(world.program(y))
    found = left_of(program, base)
    assert found.reduced_chi2 > 3.0 + found.noise and found.trusted and not found.stated


def test_what_open_numbers_leave_is_said_and_speaks_against_no_name():
    """A score that predictions with their uncertainty do not have: a sentence of its own says so."""
    rng = np.random.default_rng(7)
    world = fast(effects=(CONSTANT,))
    program, base = base_fit(world.program(world.truth(rng)))
    assert left_of(program, base, score=1.5) is None
    found = left_of(program, base, score=28.0)
    assert found.open and found.trusted and found.reduced_chi2 == 28.0
    assert "missed by 5.3 times their noise (reduced chi-square 28, where noise alone would leave" in found.text
    assert "This does not contradict the model: its numbers are uncertain" in found.text


@pytest.mark.parametrize(("apart", "supported"), [(0.3, True), (0.03, False)])
def test_a_name_is_tentative_that_no_value_outside_the_fit_supports(monkeypatch, apart, supported):
    """Each of two recordings tells one sum of two strengths, and the other by `apart` only.

    Left out in turn each is missed more than by the base model. The open strengths excuse that, but do not support it.
    """
    monkeypatch.setattr(CATALOGUE[ANOTHER], "lookalike", "")  # which would stand beside it
    rng = np.random.default_rng(0)
    base = smooth(rng, 2, 60, 1)
    v, w = rng.standard_normal((2, 2, 60))
    first, second = (np.stack([v, v]) + apart * np.stack([w, -w]) for v, w in ((v[0], w[0]), (w[1], v[1])))
    second[1] -= 2.0 * w[1]
    world = World(base, {CONSTANT: rng.standard_normal((2, 60, 1)), ANOTHER: np.moveaxis(np.stack([first, second]), 1, 2)})
    y = world.truth(np.random.default_rng(3), (0.3,), **{ANOTHER: (3.0, 0.5)})
    found = conclude(explain(world.program(y), np.random.default_rng(1)))
    name, *beside = found.found
    assert name.slug == ANOTHER and name.tentative is not supported
    assert (found.after.reduced_chi2 < found.before.reduced_chi2) is supported
    if supported:
        assert not beside and found.left is None
        return
    (other,) = beside
    assert name.probability <= DEFAULT.probability.tentative and 0.25 <= other.probability <= 0.35
    assert other.slug == "unmodelled" and "nothing outside the fit supports it" in other.text
    assert found.left.open and f"Nor does it support {ANOTHER}: the base model misses these" in found.left.text
    said = verdict_sentences(found)
    assert said[0].startswith(f"The base model perhaps leaves out {ANOTHER}")
    (rise,) = (text for text in said if "rises from" in text)
    assert rise.endswith(", as numbers that the fit leaves open may explain.")  # no word that others allow it


@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("stated", [True, False])
def test_what_open_numbers_leave_is_said_after_the_effect_and_its_meaning(turns, stated):
    """Directly: what else may be the cause comes behind it."""
    rng = np.random.default_rng(6)
    world = tubes()
    conclusion = conclude(explain(world.program(world.truth(rng, **{CONSTANT: 4.0})), np.random.default_rng(1)))
    if stated:
        for recording in conclusion.explanation.program.recordings:
            recording.geometry["length_mm"] = 50.0
    if turns:
        rival = WithoutTurns([conclusion.found[0]], 12.0, 11.0, 0.7)
        conclusion = dataclasses.replace(conclusion, without_turns=rival)
    plain = verdict_sentences(conclusion)
    assert ("No [geometry] is stated" in " ".join(plain)) is not stated
    assert ("Or the drive did not turn" in " ".join(plain)) is turns
    assert conclusion.left is None and "is left in" not in " ".join(plain)
    left = Left(3.8, 1.0, True, (CONSTANT,), None, explained=0.96)
    said = verdict_sentences(dataclasses.replace(conclusion, left=left))
    (more,) = [sentence for sentence in said if sentence not in plain]
    assert said == [plain[0], more, *plain[1:]]
    assert more.startswith("Recordings that were not fitted are missed by 1.9 times their noise (reduced chi-square 3.8,")
    assert "This does not contradict the model" in more and more.endswith("leave 0.96 there.")
    much = dataclasses.replace(left, explained=None)
    assert "3.8 is left in" in verdict_sentences(dataclasses.replace(conclusion, left=much))[0]


def test_each_sentence_of_what_is_left_has_one_idea():
    """One sentence of over 60 words held the name, its strength, the size, the reason and the place."""
    regime = SimpleNamespace(share=0.57, text="pressure above 0.8 kPa")
    left = Left(38.2, 4.1, True, (CONSTANT, DELAY), regime)
    said = sentences(left.text)
    assert len(said) == 4 and max(len(one.split()) for one in said) <= 20
    explanation = SimpleNamespace(misread=None)
    told = SimpleNamespace(left=left, explanation=explanation, remainder=SimpleNamespace(driver="max_strain"))
    assert max(len(one.split()) for one in sentences(unexplained(told, "the base model (a law fitted first)"))) <= 20
    rng = np.random.default_rng(6)
    found = conclude(explain(tubes().program(tubes().truth(rng, **{CONSTANT: 4.0})), np.random.default_rng(1)))
    named = verdict_sentences(dataclasses.replace(found, left=left))[0]
    assert named.endswith(found.found[0].text) and left.text in named
    assert max(len(one.split()) for one in sentences(named)) <= 40


def sentences(text):
    return re.split(r"(?<=\.)\s+(?=[A-Z])", text)
