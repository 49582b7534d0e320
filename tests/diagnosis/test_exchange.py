"""An effect that stood for two gives way to the one that fits beside the other."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis import explain
from fitting.diagnosis.explain import Stage, _exchanged
from fitting.diagnosis.trials import Trial

SLUGS = ("gravity", "thick_wall", "tip_contact", "wrap_friction")


def fit(slugs, objective):
    return SimpleNamespace(slugs=tuple(slugs), objective=objective, u=np.arange(4.0))


@pytest.fixture
def searched(monkeypatch):
    """`gravity` entered first, `wrap_friction` beside it; how well the others would do is up to a test."""
    objectives = {}

    class Refitter:
        def __init__(self, program):
            pass

        def fit(self, slugs, start, rounds):
            return fit(slugs, objectives[slugs])

    monkeypatch.setattr(explain, "Refitter", Refitter)
    monkeypatch.setattr(explain, "inflation_of", lambda program, fit: 2.0)
    unknowns = SimpleNamespace(of=lambda names: np.array([SLUGS.index(n) for n in names]), neutral=np.zeros(4))
    first = Stage(None, None, [Trial(s, fit([s], 500.0), 100.0 - 10.0 * k, 0.0) for k, s in enumerate(SLUGS)])
    second = Stage(None, None, [Trial("wrap_friction", fit(("gravity", "wrap_friction"), 200.0), 50.0, 0.0)])
    first.chosen, first.trials[0].left_out, second.chosen = "gravity", 3.0, "wrap_friction"
    return SimpleNamespace(unknowns=unknowns), fit(("gravity", "wrap_friction"), 200.0), [first, second], objectives


def test_a_rival_that_fits_much_better_takes_the_place(searched):
    program, current, stages, objectives = searched
    objectives |= {("thick_wall", "wrap_friction"): 60.0, ("tip_contact", "wrap_friction"): 190.0}
    found, fits = _exchanged(program, current, stages)
    assert found.slugs == ("thick_wall", "wrap_friction") and fits == 2
    assert stages[0].chosen == "thick_wall" and stages[0].entered.left_out == 3.0
    assert [(t.slug, t.bayes) for t in stages[0].trials] == [
        ("thick_wall", 170.0),
        ("tip_contact", 105.0),
        ("gravity", 100.0),
    ]


def test_one_that_fits_a_little_better_does_not(searched):
    program, current, stages, objectives = searched
    objectives |= {("thick_wall", "wrap_friction"): 190.0, ("tip_contact", "wrap_friction"): 300.0}
    found, _ = _exchanged(program, current, stages)
    assert found is current and stages[0].chosen == "gravity" and len(stages[0].trials) == 4
