"""Who stays in the model: an effect that stood for two gives way, an idle one goes, and where all are looked for."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import explain, growing, pruning
from fitting.diagnosis.growing import Growth
from fitting.diagnosis.pruning import pruned
from fitting.diagnosis.stages import Explanation, Stage
from fitting.diagnosis.trials import Trial

SLUGS = ("gravity", "thick_wall", "tip_contact", "wrap_friction")


@dataclass(frozen=True)
class Model:
    slugs: tuple
    objective: float
    at_bound: tuple = ()
    u: np.ndarray = field(default_factory=lambda: np.arange(4.0))
    evaluation: str = "here"


def fit(slugs, objective, stopped=False):
    return Model(tuple(slugs), objective, (f"{slugs[-1]}.strength",) if stopped else ())


class Searched:
    """`gravity` entered first, `wrap_friction` beside it; what others are worth there is up to a test."""

    def __init__(self, monkeypatch):
        self.objectives = {("wrap_friction",): 300.0}
        self.beside = {"gravity": 200.0, "thick_wall": 190.0, "tip_contact": 250.0}
        self.stopped = set()
        self.program = SimpleNamespace(
            unknowns=SimpleNamespace(slugs=SLUGS, of=lambda names: np.array([SLUGS.index(n) for n in names]), neutral=np.zeros(4))
        )  # fmt: skip
        self.current = fit(("gravity", "wrap_friction"), 200.0)
        first = Stage(None, None, [Trial(s, fit([s], 500.0), 100.0 - 10.0 * k, 0.0) for k, s in enumerate(SLUGS)])
        second = Stage(None, None, [Trial("wrap_friction", self.current, 50.0, 0.0)])
        first.chosen, first.trials[0].left_out, second.chosen = "gravity", 3.0, "wrap_friction"
        self.stages = [first, second]

        def refit(slugs, start, rounds=0, near=None):
            assert near == "here"  # hidden courses begin with those of the model that it came from
            return fit(slugs, self.objectives[tuple(slugs)])

        monkeypatch.setattr(pruning, "Refitter", lambda program: SimpleNamespace(fit=refit))
        monkeypatch.setattr(pruning, "inflation_of", lambda program, fit: 2.0)
        monkeypatch.setattr(growing, "pruned", lambda program, fit: fit)
        monkeypatch.setattr(growing, "screened", lambda *_: None)
        monkeypatch.setattr(growing, "trials_of", self.trials)
        monkeypatch.setattr(growing, "fair", lambda program, current, trials: current)
        monkeypatch.setattr(growing, "weigh", self.weigh)

    def trials(self, program, current, found, progress, effort, most):
        assert current.slugs == ("wrap_friction",)  # without the effect that may give way
        return [Trial(s, fit((*current.slugs, s), objective, s in self.stopped), 0.0, 0.0) for s, objective in self.beside.items()]

    def weigh(self, program, current, trials):
        for trial in trials:
            trial.bayes = 0.5 * (current.objective - trial.fit.objective)
        trials.sort(key=lambda trial: -trial.bayes)

    def exchanged(self):
        growth = Growth(np.random.default_rng(0), lambda _: None, 1)
        return growth.exchanged(self.program, self.current, self.stages)


@pytest.fixture
def searched(monkeypatch):
    return Searched(monkeypatch)


def test_a_rival_of_more_evidence_beside_the_others_takes_the_place(searched):
    found, first = searched.exchanged(), searched.stages[0]
    assert found.slugs == ("thick_wall", "wrap_friction")  # in the order in which they entered
    assert first.chosen == "thick_wall" and first.entered.left_out == 3.0 and first.beside.slugs == ("wrap_friction",)
    assert [(t.slug, t.bayes) for t in first.trials] == [("thick_wall", 55.0), ("gravity", 50.0), ("tip_contact", 25.0)]


@pytest.mark.parametrize("why", ["worth less", "at a bound"])
def test_another_does_not_but_the_stage_tells_what_all_are_worth_there(searched, why):
    if why == "worth less":
        searched.beside["thick_wall"] = 210.0
    else:
        searched.stopped = {"thick_wall"}
    found, first = searched.exchanged(), searched.stages[0]
    assert found.slugs == ("gravity", "wrap_friction") and first.chosen == "gravity"
    assert {t.slug: t.bayes for t in first.trials}["gravity"] == 50.0 and len(first.trials) == 3


@pytest.mark.parametrize("worse", [None, 230.0])
def test_an_effect_that_is_not_found_again_stays_as_it_was(searched, worse):
    searched.beside = {"thick_wall": 240.0} | ({"gravity": worse} if worse else {})
    assert searched.exchanged().objective == 200.0
    assert [(t.slug, t.bayes) for t in searched.stages[0].trials] == [("gravity", 50.0), ("thick_wall", 30.0)]


def test_an_effect_that_another_made_idle_is_dropped_and_the_next_one_leads(searched):
    program, current, stages, objectives = searched.program, searched.current, searched.stages, searched.objectives
    objectives |= {("wrap_friction",): 210.0}
    rest = pruned(program, current)
    assert rest.slugs == ("wrap_friction",)
    assert Explanation(program, None, rest, stages, 0.0, True).leading is stages[1]
    objectives[("wrap_friction",)] = 300.0
    assert pruned(program, current) is current
    assert Explanation(program, None, current, stages, 0.0, True).leading is stages[0]


def test_a_search_that_comes_back_to_a_model_ends(monkeypatch):
    """Two effects each of which makes the other one idle would follow one another for ever."""
    found = {(): ("gravity",), ("gravity",): ("thick_wall",), ("thick_wall",): ("gravity",)}
    growth, asked = Growth(np.random.default_rng(0), lambda _: None, 1), []

    def choice(program, current, stage, base, original):
        asked.append(current.slugs)
        return Trial(found[current.slugs][0], fit(found[current.slugs], 100.0), 20.0, 0.0)

    monkeypatch.setattr(growing, "choice", choice)
    monkeypatch.setattr(growing, "screened", lambda *_: SimpleNamespace(p_value=0.001))
    monkeypatch.setattr(Growth, "fill", lambda growth, program, stage: None)
    base = fit((), 300.0)
    program = SimpleNamespace(unknowns=SimpleNamespace(slugs=SLUGS))
    explanation = Explanation(program, base, base, [], 0.001, True)
    growth.grown(explanation, growth.stage(program, base))
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
    monkeypatch.setattr(explain, "settled_fit", lambda program: (program, None))
    monkeypatch.setattr(explain, "screened", lambda *_: SimpleNamespace(p_value=chance))
    found = Explanation(program, None, final, [], chance, True)
    monkeypatch.setattr(explain, "_whole", lambda *_: found)
    monkeypatch.setattr(explain, "_contradicted", lambda _: contradicted)
    monkeypatch.setattr(explain, "_together", lambda *a: seen.append(a))
    assert explain.explain(program, None).final is final
    assert len(seen) == looks
