"""Where one effect leaves more than noise, two others may take its place: only if they explain and predict better than
it does with its own best second one."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import explain
from fitting.diagnosis.stages import Explanation, Stage
from fitting.diagnosis.trials import Trial

OBJECTIVES = {(): 300.0, ("both",): 150.0, ("one",): 160.0, ("far",): 250.0, ("one", "two"): 80.0, ("both", "odd"): 120.0}


def fit(*slugs):
    return SimpleNamespace(slugs=slugs, objective=OBJECTIVES[slugs], at_bound=())


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
        put = lambda name, value: monkeypatch.setattr(explain, name, value)  # noqa: E731
        put("Refitter", lambda program: None)
        put("screen", lambda *_: SimpleNamespace(p_value=0.001))
        put("trials_of", self._trials)
        put("polished", lambda program, found: found)
        put("pruned", lambda program, found: found)
        put("exchanged", lambda program, found, stages: found)
        put("retold", lambda program, found, stage: None)
        put("fair", lambda program, current, trials: current)
        put("left_out", lambda program, found: np.array(self.left[found.slugs]))
        put("surprise", lambda program, found, mask: self.unseen[found.slugs])
        put("inflation_of", lambda program, found: 1.0)
        put("_noticed", lambda program, found: self.noticed)

    def _trials(self, program, current, found, progress, effort):
        self.asked.append(current.slugs)
        return [Trial(s, fit(*current.slugs, s), bayes, 0.0) for s, bayes in self.seconds[current.slugs[0]]]

    def found(self):
        explain._Search(None, lambda _: None, 1)._detoured(self.explanation, self.tried)
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
    assert ("far",) not in world.asked  # no rival: its evidence is far behind


def test_they_do_beside_a_second_one_of_the_first_that_is_worth_less(world):
    world.seconds["both"] = [("odd", 20.0)]
    assert world.found() == ("one", "two")


@pytest.mark.parametrize("against", [
    "noise", "evidence", "the fit", "its own second", "left out", "a single fold", "never fitted", "its second is worse",
])  # fmt: skip
def test_they_do_not_where_anything_speaks_against_it(world, monkeypatch, against):
    pair = ("one", "two")
    if against == "noise":
        world.noticed = False
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
