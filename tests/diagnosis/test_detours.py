"""Where one effect leaves more than noise, two others may take its place: only if they explain and predict better than
it does with its own best second one."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import explain
from fitting.diagnosis.stages import Explanation, Stage
from fitting.diagnosis.trials import Trial


def fit(*slugs):
    return SimpleNamespace(slugs=slugs, objective=0.0, at_bound=())


class World:
    """Effect `both` was found alone; `one` is its rival, `two` what comes second; a test says what each is worth."""

    def __init__(self, monkeypatch):
        self.seconds = {"both": [], "one": [("two", 60.0)]}
        self.left, self.unseen = {"both": 1.5, "one": 1.0}, {"both": 0.0, "one": 0.0}
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
        put("left_out", lambda program, found: np.array([self.left[found.slugs[0]]]))
        put("surprise", lambda program, found, mask: self.unseen[found.slugs[0]])
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
    assert first.left_out == 3.0 and second.entered.left_out == 1.0  # what a nameless correction is raced against
    assert np.isnan(world.tried[1].left_out)  # trials of the other explanation are left as they were
    assert ("far",) not in world.asked  # no rival: its evidence is far behind


@pytest.mark.parametrize("against", ["noise", "evidence", "its own second", "left out", "never fitted"])
def test_they_do_not_where_anything_speaks_against_it(world, against):
    if against == "noise":
        world.noticed = False
    elif against == "evidence":
        world.seconds["one"] = [("two", 12.0)]
    elif against == "its own second":
        world.seconds["both"] = [("two", 45.0)]
    elif against == "left out":
        world.left["one"] = 1.48
    else:
        world.unseen["one"] = 0.1
    assert world.found() == ("both",)
    assert [s.chosen for s in world.explanation.stages] == ["both"]
