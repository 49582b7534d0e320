"""Where one effect leaves more than noise, two others may take its place: only if they promise more, and then explain
and predict better than it does with its own best second one."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit import cross_validation
from fitting.diagnose.fit.candidates import CandidateFit
from fitting.diagnose.search import pair_search, stepwise
from fitting.diagnose.search.steps import Explanation, LeaveOneOutEvidence, Named, Step
from fitting.diagnose.search.stepwise import StepwiseSearch
from fitting.diagnose.verdict.probabilities import probabilities

GAINS = {"one": {"two": 150.0, "both": 20.0}, "far": {"two": 20.0}, "both": {"odd": 60.0}}
"""Decrease of chi-square that a second effect promises beside each first one."""
OBJECTIVES = {(): 300.0, ("both",): 150.0, ("one",): 160.0, ("far",): 250.0, ("one", "two"): 80.0, ("both", "odd"): 120.0}


def fit(*slugs):
    return SimpleNamespace(slugs=slugs, objective=OBJECTIVES[slugs], at_bound=())


def scored(program, current, rng):
    scores = [SimpleNamespace(slug=s, gain=g) for s, g in GAINS[current.slugs[0]].items()]
    return SimpleNamespace(p_value=0.001, scores=scores, scale=1.0)


class World:
    """Effect `both` was found alone; `one` is its rival, `two` what comes second; a test says what each is worth."""

    def __init__(self, monkeypatch):
        self.seconds = {"both": [], "one": [("two", 60.0)]}
        self.left = {(): [1.0, 1.0, 1.0], ("both",): [0.5, 0.5, 0.5], ("both", "odd"): [0.45, 0.45, 0.5], ("one", "two"): [0.3, 0.3, 0.4]}
        self.unseen = {("both",): 0.0, ("both", "odd"): 20.0, ("one", "two"): 0.0}
        self.leaves = 1.5
        self.worth = {("both",): 100.0, ("both", "odd"): 110.0, ("one", "two"): 150.0}
        self.program = SimpleNamespace(
            unknowns=SimpleNamespace(slugs=("both", "one", "two")), fitted=np.array([True]), unseen=np.array([False]),
            observations=lambda mask: 200.0, hidden=False,
        )  # fmt: skip
        tried = [CandidateFit("both", fit("both"), 100.0, 0.0), CandidateFit("one", fit("one"), 90.0, 0.0), CandidateFit("far", fit("far"), 40.0, 0.0)]
        step = Step(fit(), SimpleNamespace(p_value=0.001), list(tried), 3.0, "both")
        self.explanation = Explanation(self.program, fit(), Named(tried[0].fit), [step], 0.001, True)
        self.tried, self.asked = step.candidates, []
        def put(name, value):
            there = [module for module in (stepwise, pair_search) if hasattr(module, name)]
            assert there, name
            for module in there:
                monkeypatch.setattr(module, name, value)

        self.drift = 0.0
        put("scored", scored)
        put("candidate_fits", self._trials)
        put("drift_evidence", lambda program, old, new: self.drift)
        put("evidence", lambda program, base, found, inflation: self.worth[found.slugs])
        self.refitted = []
        refitter = SimpleNamespace(fit=lambda slugs, start: self.refitted.append(slugs) or start, promised=lambda found: found.objective)
        put("Refitter", lambda program: refitter)
        put("polished", lambda program, found: found)
        put("eliminated", lambda program, found: found)
        monkeypatch.setattr(StepwiseSearch, "weigh_effects", lambda search, *model: self._stood(*model))
        put("refitted_baseline", lambda program, current, candidates: current)
        monkeypatch.setattr(cross_validation, "cross_validate", lambda program, found: np.array(self.left[found.slugs]))
        put("negative_log_predictive_density", lambda program, found, mask: self.unseen[found.slugs])
        put("inflation_of", lambda program, found: 1.0)
        put("predictive_chi_square", lambda program, found, mask: self.leaves)
        put("spread", lambda program, mask: 0.01)

    def _stood(self, explanation, found, left, steps):
        self.beside = [s.base.slugs for s in steps]
        return Named(found, left, {s: LeaveOneOutEvidence(s, fit(), []) for s in found.slugs})

    def _trials(self, program, current, found, progress, effort, most):
        self.asked.append(current.slugs)
        return [CandidateFit(s, fit(*current.slugs, s), bayes, 0.0) for s, bayes in self.seconds[current.slugs[0]]]

    def found(self):
        pair_search.pair_search(StepwiseSearch(np.random.default_rng(0), lambda _: None, 1), self.explanation)
        return self.explanation.final.slugs


@pytest.fixture
def world(monkeypatch):
    return World(monkeypatch)


def test_two_that_explain_and_predict_better_take_the_place_of_one(world):
    assert world.found() == ("one", "two")
    first, second = world.explanation.steps
    assert (first.chosen, second.chosen) == ("one", "two") and world.explanation.leading.slug == "one"
    assert world.explanation.left_out == (3.0, pytest.approx(1.0))  # what a nameless correction is raced against
    assert world.beside == [(), ("one",)]  # what each is worth is told from candidates beside the other one
    assert ("far",) not in world.asked  # it promises less than was found


@pytest.mark.parametrize(("objective", "refitted"), [(455.0, True), (465.0, False)])
def test_a_rival_far_from_what_was_found_is_not_fitted_to_see_what_a_second_effect_promises(world, monkeypatch, objective, refitted):
    """`far` and a second effect promise 10 less than it leaves alone, what was found leaves 150."""
    monkeypatch.setitem(OBJECTIVES, ("far",), objective)
    world.explanation.steps[0].candidates[-1] = CandidateFit("far", fit("far"), 40.0, 0.0)
    assert world.found() == ("one", "two")
    assert ("one",) in world.refitted and (("far",) in world.refitted) is refitted


@pytest.mark.parametrize("where", ["a signature", "left out"])
def test_they_are_looked_for_where_only_a_signature_or_what_is_left_out_says_so(world, where):
    """A model may follow recordings to their noise and still be the wrong one."""
    world.leaves = 1.0
    if where == "a signature":
        last = Step(world.explanation.final, SimpleNamespace(p_value=0.001), [])
        world.explanation.steps.append(last)
    else:
        world.explanation.named.left_out = 1.5
    assert world.found() == ("one", "two")


def test_they_do_beside_a_second_one_of_the_first_that_is_worth_less(world):
    world.seconds["both"] = [("odd", 20.0)]
    assert world.found() == ("one", "two")


@pytest.mark.parametrize("against", [
    "noise", "promise", "drift", "evidence", "its own second", "left out", "a single fold", "never fitted", "its second is worse",
])  # fmt: skip
def test_they_do_not_where_anything_speaks_against_it(world, monkeypatch, against):
    pair = ("one", "two")
    if against == "noise":
        world.leaves = 1.05
    elif against == "promise":
        monkeypatch.setitem(GAINS, "one", {"two": 19.0})
    elif against == "drift":
        world.drift = 43.0
    elif against == "evidence":
        world.worth["one", "two"] = 107.0
    elif against == "its own second":
        world.seconds["both"], world.worth["both", "odd"] = [("odd", 45.0)], 143.0
    elif against == "left out":
        world.left[pair] = [0.49, 0.49, 0.49]
    elif against == "a single fold":
        world.left[pair] = [0.6, 0.6, 0.1]
    elif against == "never fitted":
        world.unseen[pair] = 43.0
    else:  # better than the first effect with a second that was refused, but not than the first effect
        world.seconds["both"], world.unseen[pair] = [("odd", 20.0)], 43.0
    assert world.found() == ("both",)
    assert [s.chosen for s in world.explanation.steps] == ["both"]
    assert world.explanation.contending == ([pair] if against == "drift" else [])


@pytest.mark.parametrize("against", [
    "nothing", "noise", "left over", "left out", "drift", "idle", "at a bound",
])  # fmt: skip
def test_two_neither_of_which_was_believed_alone_must_leave_nothing(world, monkeypatch, against):
    """Where no effect was, and the base model leaves more than noise."""
    monkeypatch.setitem(GAINS, "one", {"two": 200.0})
    world.explanation.named = Named(fit())
    world.explanation.steps[0].chosen = None
    world.explanation.steps[0].left_out = np.nan  # no single one had evidence enough to ask for it
    world.worth[()], world.left[()], world.unseen[()], world.seconds["far"] = 0.0, [1.0, 1.0, 1.0], 0.0, []
    pair = ("one", "two")
    leaves = {(): 1.0 if against == "noise" else 1.5, pair: 1.2 if against == "left over" else 1.0}
    monkeypatch.setattr(pair_search, "predictive_chi_square", lambda program, found, mask: leaves[found.slugs])
    if against == "noise":  # a signature stands out; the base model leaves nothing
        world.left[()], world.left[pair] = [0.35, 0.35, 0.34], [0.2, 0.2, 0.2]
    elif against == "at a bound":
        monkeypatch.setattr(pair_search, "at_its_bound", lambda found, slug: slug == "one")
    elif against == "left out":
        world.left["one", "two"] = [0.4, 0.4, 0.4]
    elif against == "drift":
        world.drift = 143.0
    elif against == "idle":  # one of them, once the other is there
        monkeypatch.setitem(OBJECTIVES, ("two",), 100.0)
        monkeypatch.setattr(StepwiseSearch, "weigh_effects", lambda search, *_: Named(fit("two"), 1.0))
    assert world.found() == (("one", "two") if against == "nothing" else ())
    assert world.explanation.contending == []
    if against == "nothing":
        assert world.explanation.left_out == (3.0, pytest.approx(1.0))


@pytest.mark.parametrize("good", [True, False])
def test_what_a_pair_gives_way_to_must_surpass_what_was_found_as_well(world, monkeypatch, good):
    other = ("one", "far")
    monkeypatch.setitem(OBJECTIVES, other, 70.0)
    monkeypatch.setattr(StepwiseSearch, "weigh_effects", lambda search, *_: Named(fit(*other), 1.0, {s: LeaveOneOutEvidence(s, fit(), []) for s in other}))
    world.worth[other], world.unseen[other] = (160.0 if good else 104.0), 0.0
    world.left[other] = [0.3, 0.3, 0.3]
    assert world.found() == (other if good else ("both",))


def test_the_same_two_in_another_order_are_no_detour(world, monkeypatch):
    """Where two were found, the second is a rival of the first: beside it another first one may be better."""
    monkeypatch.setitem(GAINS, "one", {"both": 400.0, "two": 20.0})
    world.explanation.named = Named(SimpleNamespace(slugs=("both", "one"), objective=148.0, at_bound=()))
    world.worth["both", "one"] = 110.0
    assert world.found() == ("both", "one") and world.asked == []


def test_a_second_one_of_the_first_is_looked_for_once(world, monkeypatch):
    """However many rivals ask for it."""
    for slug in ("one", "far"):
        monkeypatch.setitem(GAINS, slug, {"two": 300.0})
    monkeypatch.setitem(OBJECTIVES, ("far", "two"), 90.0)
    world.seconds["far"], world.worth["far", "two"], world.unseen["one", "two"] = [("two", 50.0)], 140.0, 60.0
    world.unseen["far", "two"] = 60.0
    assert world.found() == ("both",)
    assert sorted(world.asked) == [("both",), ("far",), ("one",)]


def test_the_pair_that_promises_most_is_tried_first_and_no_more_than_two_beside_hidden_courses(world, monkeypatch):
    world.program.hidden = True
    tried = [CandidateFit(s, fit("one"), 90.0, 0.0) for s in ("a", "b", "c", "d", "e")]
    for candidate in tried:
        monkeypatch.setitem(OBJECTIVES, (candidate.slug,), 160.0)
        candidate.fit = fit(candidate.slug)
        monkeypatch.setitem(GAINS, candidate.slug, {"two": {"c": 300.0, "d": 200.0}.get(candidate.slug, 100.0)})
        world.seconds[candidate.slug] = []
    monkeypatch.setitem(GAINS, "e", {"two": 900.0})  # fits as well alone, but is not among the first four
    world.tried[:] = tried
    assert world.found() == ("both",)
    assert world.asked == [("c",), ("d",)]


def test_nothing_at_all_lacks_what_both_effects_are_worth(monkeypatch):
    """An effect that is worth little beside another one is no sign that the recordings show nothing."""
    monkeypatch.setattr("fitting.diagnose.verdict.probabilities.evidence", lambda program, base, further, inflation: 300.0)
    monkeypatch.setattr("fitting.diagnose.verdict.probabilities.inflation_of", lambda program, fit: 1.0)
    monkeypatch.setitem(OBJECTIVES, ("two",), 100.0)
    program, pair = SimpleNamespace(unknowns=SimpleNamespace(slugs=["one", "two", "far"])), fit("one", "two")
    named = Named(pair, 1.0, {
        "one": LeaveOneOutEvidence("one", fit("two"), [CandidateFit("one", pair, 1.0, 0.0)]),
        "two": LeaveOneOutEvidence("two", fit("one"), [CandidateFit("two", pair, 40.0, 0.0)]),
    })  # fmt: skip
    candidates, nothing = probabilities(Explanation(program, fit(), named, [], 0.001, True), True, 0.0)
    assert nothing < 1e-6 and max(candidates, key=lambda slug: candidates[slug][0]) == "one"
    assert candidates["two"][1] == 40.0  # beside the first one; it is no candidate for the place of that
