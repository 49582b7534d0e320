"""Who stays in the model: an effect that weigh_effects for two gives way, an idle one goes, and where all are looked for."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit import cross_validation
from fitting.diagnose.fit.candidates import CandidateFit
from fitting.diagnose.fit.cross_validation import HeldOutScores
from fitting.diagnose.search import backward_elimination, explain, leave_one_out_evidence, stepwise
from fitting.diagnose.search.leave_one_out_evidence import leave_each_out
from fitting.diagnose.search.steps import Explanation, Named, Step
from fitting.diagnose.search.stepwise import StepwiseSearch

SLUGS = ("gravity", "thick_wall", "tip_contact", "wrap_friction")


@dataclass(frozen=True)
class Model:
    slugs: tuple
    objective: float
    at_bound: tuple = ()
    u: np.ndarray = field(default_factory=lambda: np.arange(4.0))
    evaluation: str = "here"


def fit(slugs, objective, at_a_bound=False):
    return Model(tuple(slugs), objective, (f"{slugs[-1]}.strength",) if at_a_bound else ())


class Searched:
    """`gravity` entered first, `wrap_friction` beside it; what every model explains is up to a test.

    Misfit counts by half, one effect costs nothing, and left-out recordings and drift have no say of their own.
    """

    def __init__(self, monkeypatch):
        self.objectives = {
            (): 600.0, ("gravity",): 350.0, ("wrap_friction",): 300.0, ("thick_wall",): 320.0,
            ("gravity", "wrap_friction"): 200.0, ("thick_wall", "wrap_friction"): 170.0, ("tip_contact", "wrap_friction"): 250.0,
            ("gravity", "thick_wall"): 300.0, ("thick_wall", "tip_contact"): 300.0, ("tip_contact",): 400.0,
        }  # fmt: skip
        self.at_a_bound, self.astray, self.unseen, self.drift = set(), {}, {}, {}
        self.filled = []
        self.program = SimpleNamespace(
            unknowns=SimpleNamespace(slugs=SLUGS, of=lambda names: np.array([SLUGS.index(n) for n in names]), neutral=np.zeros(4), base=[]),
            unseen=None, fitted=None, observations=lambda mask: 40.0,
        )  # fmt: skip
        self.current = self.fit("gravity", "wrap_friction")
        first = Step(self.fit(), None, self.candidates((), SLUGS), 9.0, "gravity")
        second = Step(self.fit("gravity"), None, self.candidates(("gravity",), ("wrap_friction", "thick_wall")), 6.0, "wrap_friction")
        self.steps = [first, second]

        def refit(slugs, start, rounds=0, near=None):
            assert near == "here"  # latent trajectories begin with those of the model that it came from
            return self.fit(*slugs)

        monkeypatch.setattr(backward_elimination, "Refitter", lambda program: SimpleNamespace(fit=refit))
        monkeypatch.setattr(leave_one_out_evidence, "weigh", self.weigh)
        for module in (backward_elimination, leave_one_out_evidence):
            monkeypatch.setattr(module, "inflation_of", lambda program, fit: 1.0)
        monkeypatch.setattr(backward_elimination, "evidence", lambda program, rest, fit, inflation: self.worth(rest, fit))
        monkeypatch.setattr(leave_one_out_evidence, "negative_log_predictive_density", lambda program, fit, mask: self.unseen.get(frozenset(fit.slugs), 0.0))
        whole = np.array([2.0, 1.0, 1.0])
        monkeypatch.setattr(
            cross_validation, "cross_validate", lambda program, fit: (whole if fit.slugs else whole + 1.0) + self.astray.get(frozenset(fit.slugs), 0.0)
        )
        drift = lambda program, base, fit: self.drift.get(frozenset(fit.slugs), 0.0)  # noqa: E731
        monkeypatch.setattr(leave_one_out_evidence, "drift_evidence", drift)
        monkeypatch.setattr(leave_one_out_evidence, "instrument_parts", lambda *fits: (drift(*fits), 0.0))

    def fit(self, *slugs):
        return fit(slugs, self.objectives[tuple(sorted(slugs))], bool(self.at_a_bound & set(slugs)))

    def worth(self, rest, model):
        return 0.5 * (rest.objective - model.objective)

    def candidates(self, base, slugs):
        known = [(*base, s) for s in slugs if tuple(sorted((*base, s))) in self.objectives]
        return sorted(
            (CandidateFit(x[-1], self.fit(*x), self.worth(self.fit(*base), self.fit(*x)), 0.0) for x in known), key=lambda t: -t.bayes
        )

    def weigh(self, program, current, candidates):
        for candidate in candidates:
            candidate.bayes = self.worth(current, candidate.fit)
        candidates.sort(key=lambda candidate: -candidate.bayes)

    def fill(self, rest):
        self.filled.append(rest.slugs)
        return Step(rest, None, self.candidates(rest.slugs, [s for s in SLUGS if s not in rest.slugs]))

    def weigh_effects(self, slugs=None):
        return leave_each_out(self.program, self.current if slugs is None else self.fit(*slugs), 4.0, self.steps, self.fill, HeldOutScores(self.program))


@pytest.fixture
def searched(monkeypatch):
    return Searched(monkeypatch)


def test_a_rival_of_more_evidence_beside_the_others_takes_the_place(searched):
    named = searched.weigh_effects()
    assert named.fit.slugs == ("thick_wall", "wrap_friction")  # in the order in which they entered
    first, second = (named.leave_one_out[slug] for slug in named.fit.slugs)
    assert first.base.slugs == ("wrap_friction",) and second.base.slugs == ("thick_wall",)
    assert [(t.slug, t.bayes) for t in first.candidates] == [("thick_wall", 65.0), ("gravity", 50.0), ("tip_contact", 25.0)]
    assert second.own.bayes == 75.0  # beside what took the place, not beside `gravity`
    assert searched.filled == [("wrap_friction",), ("thick_wall",)]
    assert [t.bayes for t in searched.steps[0].candidates] == [150.0, 140.0, 125.0, 100.0]  # the search stays as it was


@pytest.mark.parametrize("why", [
    "worth less", "at a bound", "drift", "more drift", "left out", "left out, in one part", "never fitted",
])
def test_another_does_not_where_anything_speaks_against_it(searched, why):
    pair = frozenset({"thick_wall", "wrap_friction"})
    if why == "worth less":
        searched.objectives[tuple(sorted(pair))] = 210.0
    elif why == "at a bound":
        searched.at_a_bound = {"thick_wall"}
    elif why == "drift":
        searched.drift[pair] = 61.0
    elif why == "more drift":  # than it has more evidence
        searched.drift[pair] = 16.0
    elif why == "left out":
        searched.astray[pair] = np.array([0.1, 0.2, 0.0])
    elif why == "left out, in one part":  # not astray: it predicts the rest little better
        searched.astray[pair] = np.array([3.0, -0.1, -0.1])
    else:
        searched.unseen[pair] = 16.0
    named = searched.weigh_effects()
    assert named.fit.slugs == ("gravity", "wrap_friction") and named.left_out == 4.0
    first, second = (named.leave_one_out[slug] for slug in named.fit.slugs)
    assert first.own.bayes == 50.0 and len(first.candidates) == 3
    assert second.own.bayes == 75.0 and searched.filled == [("wrap_friction",)]  # beside the first it has been tried


def test_what_takes_a_place_may_go_astray_without_one_part_of_the_recordings(searched):
    """Its score counts what it gains on the base model's 7, without that part, as that of any effect does."""
    searched.astray[frozenset({"thick_wall", "wrap_friction"})] = np.array([30.0, -0.5, 0.0])
    named = searched.weigh_effects()
    assert named.fit.slugs == ("thick_wall", "wrap_friction")
    assert named.left_out == named.leave_one_out["thick_wall"].own.left_out == 7.0 - 2.5


@pytest.mark.parametrize("found", [True, False])
def test_an_effect_that_is_not_found_again_stays_as_it_was(searched, found):
    searched.objectives["thick_wall", "wrap_friction"] = 240.0
    whole = searched.candidates

    def candidates(base, slugs):
        return [t for t in whole(base, slugs) if found or t.slug != "gravity"]

    searched.candidates = candidates
    one_out = searched.weigh_effects().leave_one_out["gravity"]
    assert one_out.own.fit.objective == 200.0
    assert [(t.slug, t.bayes) for t in one_out.candidates] == [("gravity", 50.0), ("thick_wall", 30.0), ("tip_contact", 25.0)]


def test_part_of_every_effect_that_drift_explains_is_told_beside_the_others(searched):
    searched.objectives["thick_wall", "wrap_friction"] = 240.0
    searched.drift[frozenset({"gravity", "wrap_friction"})] = 7.0
    assert [s.own.explained_by_instruments for s in searched.weigh_effects().leave_one_out.values()] == [7.0, 7.0]


def test_an_effect_that_another_made_idle_is_dropped_and_the_next_one_leads(searched):
    searched.objectives[("wrap_friction",)] = 208.0  # a log Bayes factor of 4 is less than what lets an effect in
    named = searched.weigh_effects()
    assert named.fit.slugs == ("wrap_friction",) and searched.filled == []
    assert named.leave_one_out["wrap_friction"].base.slugs == ()
    explanation = Explanation(searched.program, searched.fit(), named, searched.steps, 0.0, True)
    assert explanation.leading is named.leave_one_out["wrap_friction"] and explanation.left_out == (9.0, 4.0)
    searched.objectives[("wrap_friction",)] = 212.0
    searched.objectives["thick_wall", "wrap_friction"] = 240.0
    assert len(searched.weigh_effects().fit.slugs) == 2


def test_an_effect_that_is_idle_beside_a_fair_fit_of_the_others_goes(searched):
    """That fit is found only once rivals are fitted: latent trajectories shut the first one in."""
    searched.objectives["thick_wall", "wrap_friction"] = 240.0
    whole = searched.fill

    def fill(rest):
        step = whole(rest)
        step.base = fit(rest.slugs, 208.0)
        return step

    searched.fill = fill
    named = searched.weigh_effects()
    assert (named.fit.slugs, named.fit.objective) == (("wrap_friction",), 208.0) and set(named.leave_one_out) == {"wrap_friction"}


def test_a_better_fit_that_turns_up_among_rivals_is_what_all_effects_are_weighed_by(searched):
    """The model is fitted anew while rivals of its second effect are."""
    searched.objectives["thick_wall", "wrap_friction"] = 240.0
    searched.steps[1].candidates = []  # the second was not tried beside the first one
    whole = searched.fill

    def fill(rest):
        step = whole(rest)
        if rest.slugs == ("gravity",):
            candidate = next(t for t in step.candidates if t.slug == "wrap_friction")
            candidate.fit = fit(("gravity", "wrap_friction"), 150.0)
        return step

    searched.fill = fill
    named = searched.weigh_effects()
    assert named.fit.objective == 150.0
    assert [s.own.fit.objective for s in named.leave_one_out.values()] == [150.0, 150.0]
    assert [s.own.bayes for s in named.leave_one_out.values()] == [75.0, 100.0]
    assert sorted(searched.filled) == [("gravity",), ("wrap_friction",)]  # each once


def test_each_of_three_effects_is_weighed_beside_the_two_others(searched):
    three = ("gravity", "tip_contact", "wrap_friction")
    searched.objectives |= {three: 100.0, ("gravity", "tip_contact"): 280.0}
    named = searched.weigh_effects(("gravity", "wrap_friction", "tip_contact"))
    assert named.fit.slugs == ("gravity", "wrap_friction", "tip_contact")
    assert {s.slug: (set(s.base.slugs), s.own.bayes) for s in named.leave_one_out.values()} == {
        "gravity": ({"wrap_friction", "tip_contact"}, 75.0),
        "wrap_friction": ({"gravity", "tip_contact"}, 90.0),
        "tip_contact": ({"gravity", "wrap_friction"}, 50.0),
    }


def test_rivals_that_surpass_each_other_in_turn_do_not_go_on_for_ever(searched, monkeypatch):
    given = []

    def successor(program, one_out, score):
        given.append(one_out.slug)
        return next(t for t in one_out.candidates if t.slug != one_out.slug)

    monkeypatch.setattr(leave_one_out_evidence, "_successor", successor)
    named = searched.weigh_effects()
    assert len(given) == 4 and set(named.leave_one_out) == set(named.fit.slugs)


def test_one_effect_that_was_chosen_before_others_of_more_evidence_stays(searched):
    """Left-out recordings refused `thick_wall`, whose evidence is larger."""
    searched.objectives[("thick_wall",)] = 300.0
    assert searched.weigh_effects(("gravity",)).fit.slugs == ("gravity",)


def test_a_search_that_comes_back_to_a_model_ends(monkeypatch):
    """Two effects each of which makes the other one idle would follow one another for ever."""
    found = {(): ("gravity",), ("gravity",): ("thick_wall",), ("thick_wall",): ("gravity",)}
    search, asked = StepwiseSearch(np.random.default_rng(0), lambda _: None, 1), []

    def choice(program, current, step, base, original, scores):
        asked.append(current.slugs)
        assert len(asked) < 9
        return CandidateFit(found[current.slugs][0], fit(found[current.slugs], 100.0), 20.0, 0.0)

    monkeypatch.setattr(stepwise, "choice", choice)
    monkeypatch.setattr(stepwise, "scored", lambda *_: SimpleNamespace(p_value=0.001))
    monkeypatch.setattr(StepwiseSearch, "fill", lambda search, program, step: None)
    base = fit((), 300.0)
    program = SimpleNamespace(unknowns=SimpleNamespace(slugs=SLUGS))
    monkeypatch.setattr(stepwise, "polished", lambda program, fit: fit)
    monkeypatch.setattr(stepwise, "leave_each_out", lambda program, fit, left, *_: Named(fit, left))
    explanation = Explanation(program, base, Named(base), [], 0.001, True)
    search.run(explanation, search.step(program, base))
    assert asked == [(), ("gravity",), ("thick_wall",)] and explanation.final.slugs == ("gravity",)


@pytest.mark.parametrize(("chance", "named", "contradicted", "looks"), [
    (0.001, False, True, 1),  # the fitted recordings are odd, but name nothing
    (0.001, True, True, 1),  # what they name is contradicted
    (0.001, False, False, 0),
    (0.5, False, True, 1),  # the fitted ones agree: looked at once, whatever it says
])  # fmt: skip
def test_all_recordings_are_fitted_where_those_to_fit_name_nothing(monkeypatch, chance, named, contradicted, looks):
    program = SimpleNamespace(fitted=np.array([True, False]), unknowns=SimpleNamespace(slugs=SLUGS))
    final, seen = fit(("gravity",) if named else (), 10.0), []
    monkeypatch.setattr(explain, "base_fit", lambda program, **more: (program, None))
    monkeypatch.setattr(explain, "scored", lambda *_: SimpleNamespace(p_value=chance))
    found = Explanation(program, None, Named(final), [], chance, True)
    monkeypatch.setattr(explain, "_whole", lambda *_: found)
    monkeypatch.setattr(explain, "_contradicted", lambda _: contradicted)
    monkeypatch.setattr(explain, "_together", lambda *a: seen.append(a))
    assert explain.explain(program, None).final is final
    assert len(seen) == looks
