"""Where one effect leaves more than noise, two others may take its place: only if they promise more, and then explain
and predict better than it does with its own best second one."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import detours, growing
from fitting.diagnosis.growing import Growth
from fitting.diagnosis.stages import Explanation, Stage
from fitting.diagnosis.trials import Trial

GAINS = {"one": {"two": 150.0, "both": 20.0}, "far": {"two": 20.0}, "both": {"odd": 60.0}}
"""Decrease of chi-square that a second effect promises beside each first one."""
OBJECTIVES = {(): 300.0, ("both",): 150.0, ("one",): 160.0, ("far",): 250.0, ("one", "two"): 80.0, ("both", "odd"): 120.0}


def fit(*slugs):
    return SimpleNamespace(slugs=slugs, objective=OBJECTIVES[slugs], at_bound=())


def screened(program, current, rng):
    scores = [SimpleNamespace(slug=s, gain=g) for s, g in GAINS[current.slugs[0]].items()]
    return SimpleNamespace(p_value=0.001, scores=scores, scale=1.0)


class World:
    """Effect `both` was found alone; `one` is its rival, `two` what comes second; a test says what each is worth."""

    def __init__(self, monkeypatch):
        self.seconds = {"both": [], "one": [("two", 60.0)]}
        self.left = {("both",): [0.5, 0.5, 0.5], ("both", "odd"): [0.45, 0.45, 0.5], ("one", "two"): [0.3, 0.3, 0.4]}
        self.unseen = {("both",): 0.0, ("both", "odd"): 20.0, ("one", "two"): 0.0}
        self.noticed = True
        self.program = SimpleNamespace(
            unknowns=SimpleNamespace(slugs=("both", "one", "two")), fitted=np.array([True]), unseen=np.array([False]),
            observations=lambda mask: 200.0, hidden=False,
        )  # fmt: skip
        tried = [Trial("both", fit("both"), 100.0, 0.0), Trial("one", fit("one"), 90.0, 0.0), Trial("far", fit("far"), 40.0, 0.0)]
        stage = Stage(fit(), SimpleNamespace(p_value=0.001), list(tried), 3.0, "both")
        self.explanation = Explanation(self.program, fit(), tried[0].fit, [stage], 0.001, True)
        self.tried, self.asked = tried, []
        def put(name, value):
            there = [module for module in (growing, detours) if hasattr(module, name)]
            assert there, name
            for module in there:
                monkeypatch.setattr(module, name, value)

        self.drift = 0.0
        put("screened", screened)
        put("trials_of", self._trials)
        put("explained_by_drift", lambda program, old, new: self.drift)
        put("_beside", lambda program, found, slug: 40.0)
        put("polished", lambda program, found: found)
        put("pruned", lambda program, found: found)
        put("exchanged", lambda program, found, stages: found)
        put("retold", lambda program, found, stage: None)
        put("fair", lambda program, current, trials: current)
        put("left_out", lambda program, found: np.array(self.left[found.slugs]))
        put("surprise", lambda program, found, mask: self.unseen[found.slugs])
        put("inflation_of", lambda program, found: 1.0)
        put("_noticed", lambda program, found: self.noticed)

    def _trials(self, program, current, found, progress, effort, most):
        self.asked.append(current.slugs)
        return [Trial(s, fit(*current.slugs, s), bayes, 0.0) for s, bayes in self.seconds[current.slugs[0]]]

    def found(self):
        detours.detour(Growth(np.random.default_rng(0), lambda _: None, 1), self.explanation, self.tried)
        return self.explanation.final.slugs


@pytest.fixture
def world(monkeypatch):
    return World(monkeypatch)


def test_two_that_explain_and_predict_better_take_the_place_of_one(world):
    assert world.found() == ("one", "two")
    first, second = world.explanation.stages
    assert (first.chosen, second.chosen) == ("one", "two") and world.explanation.leading is first
    assert first.left_out == 3.0 and second.entered.left_out == pytest.approx(1.0)  # what a nameless correction is raced against
    assert np.isnan(world.tried[1].left_out)  # trials of the other explanation are left as they were
    assert first.entered.bayes == 40.0  # beside the other one, not alone
    assert ("far",) not in world.asked  # it promises less than was found


def test_they_do_beside_a_second_one_of_the_first_that_is_worth_less(world):
    world.seconds["both"] = [("odd", 20.0)]
    assert world.found() == ("one", "two")


@pytest.mark.parametrize("against", [
    "noise", "promise", "drift", "evidence", "the fit", "its own second", "left out", "a single fold", "never fitted", "its second is worse",
])  # fmt: skip
def test_they_do_not_where_anything_speaks_against_it(world, monkeypatch, against):
    pair = ("one", "two")
    if against == "noise":
        world.noticed = False
    elif against == "promise":
        monkeypatch.setitem(GAINS, "one", {"two": 19.0})
    elif against == "drift":
        world.drift = 65.0
    elif against == "evidence":
        world.seconds["one"] = [("two", 12.0)]
    elif against == "the fit":
        monkeypatch.setitem(OBJECTIVES, pair, 145.0)
    elif against == "its own second":
        world.seconds["both"] = [("odd", 45.0)]
    elif against == "left out":
        world.left[pair] = [0.49, 0.49, 0.49]
    elif against == "a single fold":
        world.left[pair] = [0.6, 0.6, 0.1]
    elif against == "never fitted":
        world.unseen[pair] = 0.1
    else:  # better than the first effect with a second that was refused, but not than the first effect
        world.seconds["both"], world.unseen[pair] = [("odd", 20.0)], 15.0
    assert world.found() == ("both",)
    assert [s.chosen for s in world.explanation.stages] == ["both"]


def test_the_same_two_in_another_order_are_no_detour(world, monkeypatch):
    """Where two were found, the second is a rival of the first: beside it another first one may be better."""
    monkeypatch.setitem(GAINS, "one", {"both": 400.0, "two": 20.0})
    world.explanation.final = SimpleNamespace(slugs=("both", "one"), objective=148.0, at_bound=())
    assert world.found() == ("both", "one") and world.asked == []
