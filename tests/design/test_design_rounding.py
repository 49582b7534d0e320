"""From the best continuous design to the best that can be made, and what limits that one."""

import dataclasses
import itertools
import re
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.design import read_study, run_study
from fitting.design.bodies import plan_of
from fitting.design.discrete import Step, blocked_steps, coarsest_first, made_from, near, places_of
from fitting.design.log import Evaluation
from fitting.design.optimise import Outcome, Problem, optimise
from fitting.design.program import Model
from fitting.design.space import Space
from fitting.design.study import Bound, Free
from fitting.report.results import text

WIRES = (0.2, 0.25, 0.3)


class Ridge:
    """Bend that grows with coils and falls with the square of the wire; it must stay below 1.

    Every wire bends as far before rounding, with another number of coils each.
    """

    def __init__(self, most: float = 70.0):
        wire = Free("wire", "catalogue", Bound(0.2), Bound(0.3), WIRES, "mm")
        coils = Free("coils", "integer", Bound(40.0), Bound(most), tuple(np.arange(40.0, most + 1)), "1")
        self.model = SimpleNamespace(space=Space((coils, wire)))
        self.seen: dict[bytes, Evaluation] = {}

    def bend(self, coils: float, wire: float) -> float:
        return coils / 66.31 * (0.2424 / wire) ** 2

    def __call__(self, places):
        found, span = [], np.diag(self.model.space.slopes(np.zeros(2)))
        for place in places:
            size = self.model.space.parameters(place)
            bend = self.bend(size["coils"], size["wire"])
            slope = bend * np.array([1.0 / size["coils"], -2.0 / size["wire"]]) * span
            found.append(Evaluation(place, np.array([-bend, bend - 1.0]), np.array([-slope, slope])))
        self.seen.update((one.place.tobytes(), one) for one in found)
        return found


def test_the_rest_makes_up_for_a_parameter_that_is_rounded():
    """66 or 67 coils are next to the continuous design, but the thinner wire does best with 45 of them."""
    study = Ridge()
    space = study.model.space
    problem = Problem(np.array([1.0, 0.0]), np.array([1]), np.zeros(1), np.ones(1))
    start = space.place({"coils": 66.31, "wire": 0.2424})
    (ideal,) = optimise([problem], [start], study)
    best, left = made_from(ideal, problem, study, "slsqp")
    every = [(study.bend(n, d), n, d) for n, d in itertools.product(np.arange(40.0, 71.0), WIRES)]
    most = max(one for one in every if one[0] <= 1.0)
    found = {name: float(x) for name, x in space.parameters(best.evaluation.place).items()}
    assert (found["coils"], found["wire"]) == pytest.approx(most[1:]) == (45.0, 0.2)
    assert set(left.held) == {0, 1}
    assert blocked_steps(best, left, study) == [Step(1, False), Step(0, True, (1,))]


class Broken(Ridge):
    """A ridge without an equilibrium at both of the wires next to the best, above some number of coils."""

    def __init__(self, above: float):
        super().__init__()
        self.above = above

    def bend(self, coils: float, wire: float) -> float:
        made = min(abs(wire - one) for one in WIRES[:2]) < 1e-9
        return np.nan if made and coils > self.above else super().bend(coils, wire)


@pytest.mark.parametrize(("above", "expected"), [(0.0, None), (66.2, (66.0, 0.25))])
def test_rounding_goes_on_from_the_ideal_place_where_no_neighbour_can_be_evaluated(above, expected):
    """The wire is fixed first, and neither neighbour has an equilibrium with 66.31 coils; one has with 66."""
    study = Broken(above)
    space = study.model.space
    problem = Problem(np.array([1.0, 0.0]), np.array([1]), np.zeros(1), np.ones(1))
    (ideal,) = optimise([problem], [space.place({"coils": 66.31, "wire": 0.2424})], study)
    assert ideal.kept
    found = made_from(ideal, problem, study, "slsqp")
    if expected is None:
        assert found is None
        return
    sizes = space.parameters(found[0].evaluation.place)
    assert (float(sizes["coils"]), float(sizes["wire"])) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("bend", "steps"), [(np.nan, [Step(0, True, lost=True)]), (0.2, []), (2.0, [Step(0, True, (1,))])]
)
def test_a_step_is_forbidden_only_if_it_would_help_or_cannot_be_computed(bend, steps, monkeypatch):
    """More coils lie beyond the slope: without equilibrium, with less bend, or with more than is allowed."""
    study = Ridge()
    problem = Problem(np.array([1.0, 0.0]), np.array([1]), np.zeros(1), np.ones(1))
    place = study.model.space.place({"coils": 50.0, "wire": 0.25})
    (here,) = study([place])
    made = Outcome(here, float(here.values[0]), float(here.values[1]), "", 0)
    problem = dataclasses.replace(problem, held={0: float(place[0])})
    beyond = dataclasses.replace(here, values=np.array([-bend, 0.1 + 0.0 * bend]))
    monkeypatch.setattr(Ridge, "__call__", lambda self, places: [beyond for _ in places])
    assert blocked_steps(made, problem, study) == steps


def test_nothing_is_made_from_what_cannot_be_evaluated():
    problem = Problem(np.array([1.0, 0.0]), np.array([1]), np.zeros(1), np.ones(1))
    assert made_from(Outcome(None, np.inf, np.inf, "", 0), problem, Ridge(), "slsqp") is None


def test_the_coarsest_parameter_is_fixed_first_and_at_values_that_can_be_made():
    space = Ridge().model.space
    assert coarsest_first(space) == [1, 0]
    np.testing.assert_allclose(near(space, 1, 0.4), [0.0, 0.5])
    np.testing.assert_allclose(near(space, 1, 0.5 + 1e-12), [0.5])
    np.testing.assert_allclose(near(space, 0, 2.0), [1.0])


@pytest.mark.slow
def test_the_shipped_choice_among_materials_is_the_best_of_its_catalogue():
    study = read_study("which_materials")
    study = dataclasses.replace(study, designs=("pneusma1",), alloys=("krl45",))
    result = run_study(study)
    model = Model(study, plan_of(*result.made.choice.__dict__.values()))
    every = np.array(list(itertools.product(*(places_of(model.space, k) for k in range(len(model.space))))))
    lots = [model.values(every[k : k + 256], 256) for k in range(0, len(every), 256)]
    values = np.concatenate(lots)
    kept = np.all(values[:, 1:] <= 1e-6, axis=1)
    assert result.made.objectives[0] == pytest.approx(-values[kept, 0].min(), rel=1e-9)
    assert result.evaluations < len(every) / 10
    assert "limited by constraint 'contact', the lower end of wall_thickness and the upper end" in re.sub(
        r"\s+", " ", text(result)
    )
