"""A quantity may jump with a design; a study must not end beside a better design that it could have seen."""

from types import SimpleNamespace

import numpy as np
import pytest
from study_files import changed, write_study

from fitting.design import read_study, run_study
from fitting.design.discrete import blocked_steps, made_from
from fitting.design.log import Evaluation
from fitting.design.neighbours import jumps, search_past_jumps
from fitting.design.optimise import Outcome, Problem, better_seen
from fitting.design.pareto import none_better
from fitting.design.search import LEAST_SIZE
from fitting.design.space import Space
from fitting.design.study import Bound, Free
from fitting.report.design.words import _on_jumps
from fitting.report.results import text

STIFF = """
schema = "pneusma-study/1"
name = "stiff_and_far"
design = "pneusma2"
starts = 2
[free]
mandrel_diameter = {made = "continuous", from = 1.1, to = 1.4, unit = "mm"}
[state.hot]
pressure = {value = 30, unit = "kPa"}
xi0_2 = 0.3
[objective.bend]
quantity = "bend_magnitude"
goal = "maximise"
state = "hot"
[constraint.stiff]
quantity = "bending_stiffness"
at_least = {value = 1.9, unit = "N mm/rad"}
"""


@pytest.fixture(scope="module")
def stiff(tmp_path_factory):
    return run_study(read_study(write_study(tmp_path_factory.mktemp("stiff"), STIFF)))


@pytest.mark.slow
def test_a_search_passes_the_jump_of_a_stiffness(stiff):
    places = np.linspace(0.0, 1.0, 301)[:, None]
    size = max(stiff.study.starts, LEAST_SIZE)  # the search's own program
    lots = [stiff.model.evaluate(places[k : k + size], size)[0] for k in range(0, len(places), size)]
    bend, room = np.concatenate(lots).T
    kept = room <= 0.0
    ends = np.flatnonzero(np.diff(kept.astype(int)) == -1)
    assert len(ends) == 2  # two ranges keep the limit, with a gap that a search by gradients does not pass
    best = float(np.max(-bend[kept]))
    assert best > 1.02 * float(-bend[ends[0]])
    assert stiff.made.objectives[0] >= best and stiff.made.violation <= 1e-6


@pytest.mark.slow
def test_the_report_says_which_quantity_jumps(stiff):
    assert _on_jumps(stiff)[0] in " ".join(text(stiff).split())


def test_a_quantity_that_jumps_is_named(tmp_path):
    study = read_study(write_study(tmp_path, STIFF))
    assert jumps(study) == ["bending_stiffness"]
    one = _on_jumps(SimpleNamespace(study=study, front=None))[0]
    assert one.startswith("bending_stiffness jumps with the design. So neighbours were looked at")
    front = SimpleNamespace(study=study, front=object())
    assert (
        "So neighbours of the best design of each objective alone, not of the others," in _on_jumps(front)[0]
    )


class Sawtooth:
    """Objective -x; the limit is kept up to 0.4 and, beyond a jump, from 0.45 to 0.6."""

    def __init__(self):
        self.seen = {}

    def __call__(self, places):
        found = []
        for place in places:
            x = float(place[0])
            over = x - 0.4 if x < 0.45 else x - 0.6
            one = Evaluation(np.array(place), np.array([-x, over]), np.array([[-1.0], [1.0]]))
            self.seen[one.place.tobytes()] = one
            found.append(one)
        return found


def test_what_was_evaluated_is_not_forgotten():
    problem = Problem(np.array([1.0, 0.0]), np.array([1]), np.zeros(1), np.ones(1))
    world = Sawtooth()
    (end,) = world([np.array([0.4])])
    best = Outcome(end, -0.4, 0.0, "", 1)
    assert better_seen(best, problem, world) is None
    world([np.array([0.5]), np.array([0.43]), np.array([0.9])])
    assert better_seen(best, problem, world).objective == -0.5
    assert better_seen(best, problem, world, lambda place: place[0] < 0.45) is None
    assert search_past_jumps(best, problem, world, "slsqp").objective == pytest.approx(-0.6)


def test_on_a_front_a_better_design_is_worse_in_no_objective():
    """Places are the objectives themselves; the second one has a limit of 1."""
    problem = Problem(np.array([1.0, 0.0]), np.array([1]), np.ones(1), np.ones(1))
    one = lambda a, b: Evaluation(np.array([a, b]), np.array([a, b]), np.eye(2))  # noqa: E731
    end, costly, better = one(0.5, 0.5), one(0.4, 0.9), one(0.45, 0.5)
    best = Outcome(end, 0.5, -0.5, "", 1)
    world = SimpleNamespace(seen={k: x for k, x in enumerate((end, costly))})
    assert better_seen(best, problem, world, objectives=2) is None
    assert better_seen(best, problem, world).evaluation is costly
    world.seen[2] = better
    assert better_seen(best, problem, world, objectives=2).evaluation is better


@pytest.mark.slow
def test_a_better_design_that_can_be_made_is_returned_even_if_rounding_misses_it(tmp_path, monkeypatch):
    """Rounding looks beside the continuous optimum alone; here it is made to look on the wrong side."""
    monkeypatch.setattr("fitting.design.discrete.near", lambda space, k, x: [0.0])
    monkeypatch.setattr("fitting.design.discrete.MOST_ROUNDS", 0)
    wall = 'wall_thickness = {made = "continuous", from = 0.7, to = 1.6, unit = "mm"}\n'
    found = run_study(read_study(write_study(tmp_path, changed(wall, ""))))
    assert found.base.violation <= 0.0 and found.made.objectives[0] >= found.base.objectives[0]
    assert found.made.parameters["active_coils"] > 40.0


class Steps(Sawtooth):
    """The same with whole numbers from 0 to 2, each of which gains 0.3 beyond the jump and costs as much before."""

    def __init__(self):
        super().__init__()
        whole = Free("whole", "integer", Bound(0.0), Bound(2.0), (0.0, 1.0, 2.0), "1")
        free = Free("free", "continuous", Bound(0.0), Bound(1.0), (), "1")
        self.model = SimpleNamespace(space=Space((free, whole)))

    def __call__(self, places):
        found = []
        for place in places:
            x, more = float(place[0]), 0.6 if place[0] > 0.45 else -0.6
            over = x - 0.4 if x < 0.45 else x - 0.6
            values = np.array([-x - more * place[1], over])
            found.append(Evaluation(np.array(place), values, np.array([[-1.0, -more], [1.0, 0.0]])))
        self.seen.update((one.place.tobytes(), one) for one in found)
        return found


def test_single_steps_follow_beyond_a_jump():
    problem, world = Problem(np.array([1.0, 0.0]), np.array([1]), np.zeros(1), np.ones(1)), Steps()
    (end,) = world([np.array([0.4, 0.0])])
    ideal = Outcome(end, -0.4, 0.0, "", 1)
    past = lambda best, rest: search_past_jumps(best, rest, world, "slsqp")  # noqa: E731
    best, rest = made_from(ideal, problem, world, "slsqp", beyond=past)
    assert best.objective == pytest.approx(-1.2) and rest.held == {1: 1.0}
    assert not any(step.rows == () and not step.up for step in blocked_steps(best, rest, world))


def test_a_point_of_a_front_gives_way_to_a_design_that_a_later_point_evaluated():
    problem, world = Problem(np.array([1.0, 0.0]), np.array([1]), np.ones(1), np.ones(1), {1: 0.0}), Steps()
    first, made, between = (np.array(x) for x in ([0.5, 0.0], [0.5, 1.0], [0.55, 0.4]))
    (old,) = world([first])
    world([made, between])
    ((new, rest),) = none_better([(Outcome(old, -0.5, -1.1, "", 1), problem)], world, 1)
    np.testing.assert_array_equal(new.evaluation.place, made)  # between two whole numbers nothing can be made
    assert rest.held == {1: 1.0}
