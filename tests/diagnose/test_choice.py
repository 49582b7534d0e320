"""Which further effect enters a model: what it must take of the base model's misfit."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit.candidates import CandidateFit
from fitting.diagnose.search import choose
from fitting.diagnose.search.steps import Step
from fitting.diagnose.settings import DEFAULT

LEFT_OUT = {"first": [1.6, 1.5, 1.5], "second": [0.5, 0.45, 0.4]}
PROGRAM = SimpleNamespace(fitted=np.array([True]), unseen=np.array([True]), observations=lambda mask: 400.0)


def fit(name, fitted):
    return SimpleNamespace(slugs=() if name == "base" else (name,), name=name, fitted=fitted, at_bound=())


def scores(fit):
    """What a model leaves of recordings left out in turn, by fold."""
    return np.array(LEFT_OUT[fit.name])


@pytest.fixture
def world(monkeypatch):
    for name, value in {
        "reduced": lambda program, fit, mask: fit.fitted,
        "drift_evidence": lambda *_: 0.0,
        "inflation_of": lambda *_: 1.0,
        "negative_log_predictive_density": lambda *_: 0.0,
    }.items():
        monkeypatch.setattr(choose, name, value)


@pytest.mark.parametrize(("base", "original", "enters"), [
    (90.0, 20.0, True),  # 3.2 of 19 are gone
    (6.0, 190.0, True),  # astray without them, but much of what was fitted is gone
    (90.0, 190.0, False),  # the imperfect form of the first one leaves as much
])  # fmt: skip
def test_a_further_effect_takes_much_of_what_the_base_model_missed(world, base, original, enters):
    first, second = fit("first", 4.0), fit("second", 1.1)
    stage = Step(first, None, [CandidateFit("second", second, 300.0, 1.0)])
    found = choose.choice(PROGRAM, first, stage, fit("base", base), original, scores)
    assert (found is not None) is enters


@pytest.mark.parametrize(("fitted", "enters"), [(1.2, True), (2.2, False)])
def test_what_takes_a_large_part_of_all_may_leave_more_behind(world, monkeypatch, fitted, enters):
    """What the imperfect form of a true effect leaves is not a fifth of all misfit."""
    monkeypatch.setitem(LEFT_OUT, "second", [1.2, 1.1, 1.1])  # a third of what is left out
    current = fit("first", 3.0)
    stage = Step(current, None, [CandidateFit("second", fit("second", fitted), 300.0, 1.0)])
    found = choose.choice(PROGRAM, current, stage, fit("base", 6.0), 20.0, scores)
    assert (found is not None) is enters


@pytest.mark.parametrize(("bayes", "drift", "first", "further"), [
    (9.0, 0.0, True, True),
    (7.0, 0.0, False, True),  # that something is missing is certain once the first one is in
    (12.0, 6.0, False, True),
    (9.0, 5.0, False, False),
    (4.0, 0.0, False, False),
])  # fmt: skip
def test_a_further_effect_needs_less_evidence_than_the_first(world, monkeypatch, bayes, drift, first, further):
    monkeypatch.setattr(choose, "drift_evidence", lambda *_: drift)
    for name, enters in (("base", first), ("first", further)):
        trial = CandidateFit("second", fit("second", 1.1), bayes, 1.0)
        monkeypatch.setitem(LEFT_OUT, "base", LEFT_OUT["first"])
        current = fit(name, 4.0)
        found = choose.choice(PROGRAM, current, Step(current, None, [trial]), fit("base", 6.0), 20.0, scores)
        assert (found is trial) is enters
        assert trial.adrift == (drift if bayes > (8.0 if name == "base" else 5.0) else 0.0)


@pytest.mark.parametrize("name", ["base", "first"])
def test_nothing_enters_where_the_model_predicts_better_than_noise_lets_it(world, monkeypatch, name):
    monkeypatch.setitem(LEFT_OUT, name, [0.25, 0.24, 0.25])
    monkeypatch.setitem(LEFT_OUT, "second", [0.2, 0.2, 0.2])
    current = fit(name, 4.0)
    stage = Step(current, None, [CandidateFit("second", fit("second", 1.1), 300.0, 1.0)])
    assert choose.choice(PROGRAM, current, stage, fit("base", 6.0), 20.0, scores) is None
    assert stage.left_out < DEFAULT.entry.minimum_left


def test_what_a_model_leaves_of_recordings_left_out_is_asked_for_once(monkeypatch):
    from fitting.diagnose.fit import cross_validation

    asked = []
    monkeypatch.setattr(cross_validation, "cross_validate", lambda program, fit: asked.append(fit.name) or np.array(LEFT_OUT[fit.name]))
    first, second, again = fit("first", 4.0), fit("second", 1.1), fit("first", 4.0)
    known = cross_validation.HeldOutScores(PROGRAM)
    assert known(first).sum() == pytest.approx(4.6)
    assert known.gained(first, second) == pytest.approx(1.35)
    assert asked == ["first", "second"]
    known(again)  # another fit, however alike
    assert asked == ["first", "second", "first"]
