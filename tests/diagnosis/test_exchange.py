"""Who stays in the model: an effect that stood for two gives way, an idle one goes, and where all are looked for."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import exchange, explain
from fitting.diagnosis.exchange import exchanged, pruned, retold
from fitting.diagnosis.stages import Explanation, Stage
from fitting.diagnosis.trials import Trial

SLUGS = ("gravity", "thick_wall", "tip_contact", "wrap_friction")


def fit(slugs, objective):
    return SimpleNamespace(slugs=tuple(slugs), objective=objective, u=np.arange(4.0), evaluation="here")


@pytest.fixture
def searched(monkeypatch):
    """`gravity` entered first, `wrap_friction` beside it; how well the others would do is up to a test."""
    objectives = {}

    class Refitter:
        def __init__(self, program):
            pass

        def fit(self, slugs, start, rounds=0, near=None):
            assert near == "here"  # hidden courses begin with those of the model that it came from
            return fit(slugs, objectives[slugs])

    monkeypatch.setattr(exchange, "Refitter", Refitter)
    monkeypatch.setattr(exchange, "inflation_of", lambda program, fit: 2.0)
    unknowns = SimpleNamespace(of=lambda names: np.array([SLUGS.index(n) for n in names]), neutral=np.zeros(4))
    first = Stage(None, None, [Trial(s, fit([s], 500.0), 100.0 - 10.0 * k, 0.0) for k, s in enumerate(SLUGS)])
    second = Stage(None, None, [Trial("wrap_friction", fit(("gravity", "wrap_friction"), 200.0), 50.0, 0.0)])
    first.chosen, first.trials[0].left_out, second.chosen = "gravity", 3.0, "wrap_friction"
    return SimpleNamespace(unknowns=unknowns), fit(("gravity", "wrap_friction"), 200.0), [first, second], objectives


def test_a_rival_that_fits_much_better_takes_the_place(searched):
    program, current, stages, objectives = searched
    objectives |= {("thick_wall", "wrap_friction"): 60.0, ("tip_contact", "wrap_friction"): 190.0}
    found = exchanged(program, current, stages)
    assert found.slugs == ("thick_wall", "wrap_friction")
    assert stages[0].chosen == "thick_wall" and stages[0].entered.left_out == 3.0
    assert [(t.slug, t.bayes) for t in stages[0].trials] == [
        ("thick_wall", 170.0),
        ("tip_contact", 105.0),
        ("gravity", 100.0),
    ]


def test_one_that_fits_a_little_better_does_not(searched):
    program, current, stages, objectives = searched
    objectives |= {("thick_wall", "wrap_friction"): 190.0, ("tip_contact", "wrap_friction"): 300.0}
    found = exchanged(program, current, stages)
    assert found is current and stages[0].chosen == "gravity" and len(stages[0].trials) == 4
    assert [t.bayes for t in stages[0].trials] == [100.0, 90.0, 80.0, 70.0]


def test_a_stage_may_be_told_anew_without_an_exchange(searched):
    program, current, stages, objectives = searched
    objectives |= {("thick_wall", "wrap_friction"): 190.0, ("tip_contact", "wrap_friction"): 300.0}
    retold(program, current, stages[0])
    beside = [(t.slug, t.bayes) for t in stages[0].trials]  # what each is worth now, beside the second
    assert beside == [("thick_wall", 105.0), ("gravity", 100.0), ("tip_contact", 50.0)]


def test_an_effect_that_another_made_idle_is_dropped_and_the_next_one_leads(searched):
    program, current, stages, objectives = searched
    objectives |= {("wrap_friction",): 210.0}
    rest = pruned(program, current)
    assert rest.slugs == ("wrap_friction",)
    assert Explanation(program, None, rest, stages, 0.0, True).leading is stages[1]
    objectives[("wrap_friction",)] = 300.0
    assert pruned(program, current) is current
    assert Explanation(program, None, current, stages, 0.0, True).leading is stages[0]


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
