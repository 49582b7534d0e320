"""The parts of a study that need no equilibrium: boxes, side-by-side searches, fronts, measures, the log."""

import json
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize, rosen, rosen_der
from scipy.stats import beta

from fitting.design.every_state import States, drives_of
from fitting.design.lockstep import run_together
from fitting.design.log import Evaluation, Log
from fitting.design.optimise import JOINED, NEAR, Problem, best_of, from_starts, optimise
from fitting.design.pareto import hypervolume, not_dominated
from fitting.design.program import Model, first_of
from fitting.design.search import start_places
from fitting.design.seen import LEVER, Seen
from fitting.design.space import Space
from fitting.design.study import Bound, Free, Objective, Pose, State
from fitting.design.uncertain import Draws, interval, reduced
from fitting.invert.goals import GOALS
from fitting.report.design.words import objective_shown, parameter_value
from pneusma_jax.errors import InputError


def free(name, low, high):
    return Free(name, "continuous", low, high, (), "mm")


def test_bounds_that_depend_on_others_become_a_box():
    space = Space(
        [free("wall", Bound(1.0), Bound(-1.0, "outer", 0.5)), free("outer", Bound(6.0), Bound(10.0))]
    )
    values = space.parameters(np.array([0.5, 1.0]))
    assert values == {"wall": pytest.approx(2.5), "outer": pytest.approx(10.0)}
    np.testing.assert_allclose(space.place(values), [0.5, 1.0])
    np.testing.assert_allclose(space.slopes(np.array([0.2, 0.0])), [[1.0, 0.2 * 0.5 * 4.0], [0.0, 4.0]])


def frame(tip, turn):
    """Frame of a tip that is turned about x [m, rad]."""
    pose = np.eye(4)
    pose[:3, 2], pose[:3, 3] = [0.0, np.sin(turn), np.cos(turn)], tip
    return pose


def test_a_tip_misses_several_poses_by_the_root_of_their_mean_square():
    states = States(("a", "b"), np.zeros(2), np.ones((2, 1)), (), {})
    frames = jnp.asarray([frame([3e-3, 0.0, 0.05], 0.0), frame([0.0, 4e-3, 0.05], np.radians(2.0))])
    parts = (None, None, frames, None)
    places = Pose("b", (0.0, 0.0, 0.05)), Pose("a", (0.0, 0.0, 0.05))
    miss = lambda *poses: Seen(states, {}, None, parts, {}).objective(  # noqa: E731
        Objective("miss", "tip_miss", "minimise", tuple(p.state for p in poses), poses=poses)
    )
    assert float(miss(places[0])) == pytest.approx(4e-3, rel=1e-4)
    assert float(miss(*places)) == pytest.approx(np.sqrt(0.5 * (16e-6 + 9e-6)), rel=1e-4)
    turned = Pose("b", (0.0, 4e-3, 0.05), (0.0, 0.0, 1.0))
    assert float(miss(turned)) == pytest.approx(1e-3, rel=1e-3)  # 2 deg count as 1 mm
    assert LEVER == pytest.approx(GOALS["tip"].size / GOALS["direction"].size)


@pytest.mark.parametrize("target", [0.0, 3e-3, -3e-3])
def test_a_target_of_any_sign_is_a_distance_with_a_finite_derivative(target):
    states = States(("a",), np.zeros(1), np.ones((1, 1)), (), {})
    aim = Objective("aim", "tip_y", "target", ("a",), target=(target,), unit="mm")

    def distance(y):
        frames = jnp.eye(4)[None].at[0, 1, 3].set(y)
        one = SimpleNamespace(chain=None)
        return Seen(states, {}, one, (jnp.zeros(1), (), frames, ()), {}).objective(aim)

    with_slope = jax.jit(jax.value_and_grad(distance))
    for off in (-4e-3, 4e-3):
        value, slope = with_slope(target + off)
        assert float(value) == pytest.approx(4e-3, rel=1e-4)
        assert float(slope) == pytest.approx(np.sign(off), rel=1e-4)
    value, slope = with_slope(target)
    assert float(value) < 1e-8 and float(slope) == 0.0


def test_a_distance_from_a_target_is_a_difference_in_its_unit():
    hot = Objective("hot", "temperature", "target", ("a",), target=(100.0,), unit="degF")
    assert hot.in_unit(10.0) == pytest.approx(18.0) and objective_shown(hot, 10.0) == "18 degF"
    warmest = Objective("hot", "temperature", "minimise", ("a",), unit="degF")
    assert objective_shown(warmest, 100.0) == "212 degF"


@pytest.mark.parametrize(("count", "width"), [(1, 1), (3, 2), (5, 2), (5, 8), (2, 5)])
def test_places_that_only_fill_up_a_lot_are_not_computed(count, width):
    places = jnp.arange(10.0).reshape(5, 2)
    found = np.asarray(first_of(lambda x: x[:1] + 1.0, places, jnp.asarray(count), width))
    blocks = -(-count // min(width, 5)) * min(width, 5)
    np.testing.assert_array_equal(found[:count, 0], 2.0 * np.arange(count) + 1.0)
    assert not found[blocks:].any()


def test_a_lot_of_places_is_traced_once():
    traced = []
    found = first_of(lambda x: traced.append(1) or {"twice": 2.0 * x}, jnp.arange(6.0).reshape(3, 2), jnp.asarray(3), 2)
    np.testing.assert_array_equal(found["twice"], 2.0 * np.arange(6.0).reshape(3, 2))
    assert len(traced) == 1


@pytest.mark.parametrize(("count", "computed"), [(3, 3), (4, 4), (5, 8), (9, 12)])
def test_draws_are_computed_in_lots_of_one_size(count, computed, monkeypatch):
    """The rest of 10,000 draws was another loop in the program, which was traced and compiled, too."""
    asked = []

    def spread(place, draws, materials):
        asked.append(len(draws["weight"]))
        return draws["added"]["length"] + place[0], jnp.zeros((len(draws["weight"]), 2))

    monkeypatch.setattr(Model, "_draws_together", 4)
    model = object.__new__(Model)
    model._spread, model.materials = spread, ()
    values, margins = model.spread(np.array([1.0]), Draws(count, {"length": np.arange(float(count))}, {}, None))
    assert asked == [computed] and margins.shape == (count, 2)
    np.testing.assert_array_equal(values, 1.0 + np.arange(count))


def test_searches_side_by_side_end_as_each_alone_and_are_evaluated_together():
    starts = [np.array([-1.0, 2.0]), np.array([0.5, 0.5]), np.array([2.0, -1.0])]
    sizes = []

    def evaluate(places):
        sizes.append(len(places))
        return [(rosen(x), rosen_der(x)) for x in places]

    def worker(start):
        return lambda ask: minimize(lambda x: ask(x), start, jac=True, method="SLSQP").x

    found = run_together([worker(s) for s in starts], evaluate)
    for x, start in zip(found, starts, strict=True):
        np.testing.assert_array_equal(
            x, minimize(lambda x: (rosen(x), rosen_der(x)), start, jac=True, method="SLSQP").x
        )
    assert sizes[0] == 3 and sorted(sizes, reverse=True) == sizes


@pytest.mark.parametrize("where", ["worker", "evaluation"])
def test_an_error_anywhere_ends_all_searches(where):
    def evaluate(places):
        if where == "evaluation":
            raise InputError("broken")
        return [0.0] * len(places)

    def worker(ask):
        ask(np.zeros(1))
        raise InputError("broken")

    with pytest.raises(InputError, match="broken"):
        run_together([worker, worker], evaluate)


def test_hypervolume_of_known_points():
    flat = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])
    assert hypervolume(flat, np.array([3.0, 3.0])) == pytest.approx(6.0)
    assert hypervolume(np.zeros((1, 3)), np.array([1.0, 2.0, 3.0])) == pytest.approx(6.0)
    random = np.random.default_rng(0)
    points, samples = random.random((12, 3)), random.random((200_000, 3))
    inside = np.any(np.all(samples[:, None] >= points[None], axis=2), axis=1)
    assert hypervolume(points, np.ones(3)) == pytest.approx(inside.mean(), abs=4e-3)


def test_points_that_another_beats_are_left_out():
    values = np.array([[1.0, 1.0], [0.0, 2.0], [2.0, 2.0], [1.0, 1.0], [2.0, 0.0]])
    assert [tuple(values[k]) for k in not_dominated(values)] == [(0.0, 2.0), (1.0, 1.0), (2.0, 0.0)]


def test_measures_of_a_spread():
    values = np.arange(100.0)[:, None]
    assert reduced(values, "mean", 1.0, 0.9)[0] == pytest.approx(49.5)
    assert reduced(values, "cvar", 1.0, 0.9)[0] == pytest.approx(np.arange(90.0, 100.0).mean())
    assert reduced(values, "cvar", 1.0, 0.895)[0] == pytest.approx(
        (np.arange(90.0, 100.0).sum() + 0.5 * 89) / 10.5
    )
    assert reduced(values, "mean_plus_sigma", 2.0, 0.9)[0] == pytest.approx(
        49.5 + 2 * np.arange(100.0).std(ddof=1)
    )


def test_the_interval_of_a_probability_is_clopper_and_pearsons():
    assert interval(0, 100) == (0.0, pytest.approx(1.0 - 0.025 ** (1 / 100)))
    low, high = interval(30, 100)
    assert (low, high) == (pytest.approx(beta.ppf(0.025, 30, 71)), pytest.approx(beta.ppf(0.975, 31, 70)))


def test_the_log_drops_a_line_that_was_cut_short_and_refuses_another_study(tmp_path):
    path = tmp_path / "evaluations.jsonl"
    log = Log(path, "mine")
    log.add(0, np.array([[0.1, 0.2]]), np.array([[1.0, np.nan]]), np.zeros((1, 2, 2)))
    whole = path.read_bytes()
    path.write_bytes(whole + json.dumps({"choice": 0, "places": [[0.3, 0.4]]})[:20].encode())
    again = Log(path, "mine")
    assert path.read_bytes() == whole and again.reused == 1
    one = next(iter(again.known.values()))
    np.testing.assert_array_equal(one.place, [0.1, 0.2])
    assert np.isnan(one.values[1]) and not one.finite
    with pytest.raises(InputError, match="another study"):
        Log(path, "other")


@pytest.mark.parametrize(("held", "asked"), [(0.9, 1), (0.4, None)])
def test_a_search_whose_held_sizes_break_a_limit_ends_after_one_evaluation(held, asked):
    """Minimise (x - 0.3)^2 with y held; the limit is y <= 0.5, which x does not move."""
    seen = []

    def evaluate(places):
        seen.extend(places)
        return [
            Evaluation(
                np.array([x, y]),
                np.array([(x - 0.3) ** 2, y]),
                np.array([[2.0 * (x - 0.3), 0.0], [0.0, 1.0]]),
            )
            for x, y in places
        ]

    problem = Problem(np.array([1.0, 0.0]), np.array([1]), np.array([0.5]), np.ones(1), held={1: held})
    (found,) = optimise([problem], [np.array([0.8, 0.0])], evaluate)
    assert found.kept == (held <= 0.5)
    if asked:
        assert len(seen) == asked
    else:
        assert found.evaluation.place[0] == pytest.approx(0.3, abs=1e-4) and len(seen) > 1


def test_rounding_error_at_a_bound_of_zero_is_told_as_zero():
    pressure = Free("hold.pressure", "continuous", Bound(0.0), Bound(45e3), (), "kPa")
    assert parameter_value(pressure, 6.6e-11) == 0.0
    assert parameter_value(pressure, 1.0) == 1.0
    assert parameter_value(free("wall", Bound(1e-3), Bound(2e-3)), 1e-3) == 1e-3


class Bowl:
    """Evaluations of a function of two parameters that has two minima, at (0.2, 0.5) and (0.8, 0.5)."""

    def __init__(self):
        self.asked = 0

    def __call__(self, places):
        self.asked += len(places)
        found = []
        for x, y in places:
            value = 50.0 * (x - 0.2) ** 2 * (x - 0.8) ** 2 + (y - 0.5) ** 2 - 0.1 * x
            slope = 100.0 * (x - 0.2) * (x - 0.8) * (2.0 * x - 1.0) - 0.1, 2.0 * (y - 0.5)
            found.append(Evaluation(np.array([x, y]), np.array([value]), np.array([slope])))
        return found


def test_searches_that_lead_to_a_known_optimum_join_it_and_others_do_not():
    problem = Problem(np.ones(1), np.zeros(0, int), np.zeros(0), np.ones(0))
    starts = [np.array([0.25, 0.4]), np.array([0.75, 0.9]), np.array([0.9, 0.1]), np.array([0.3, 0.55])]
    alone, together = Bowl(), Bowl()
    each = optimise([problem] * 4, starts, alone)
    found = from_starts(problem, starts, together)
    ends = [o.evaluation.place for o in found]
    for end, own in zip(ends, each, strict=True):
        np.testing.assert_allclose(end, own.evaluation.place, atol=NEAR)
    assert {o.message == JOINED for o in found} == {True, False} and together.asked < alone.asked
    assert best_of(found).evaluation.place[0] == pytest.approx(0.8, abs=0.02)


def test_starts_are_a_latin_hypercube():
    """Every fifth of every parameter holds one start; there is no design of the tables in this box."""
    model = SimpleNamespace(
        space=Space([free("a", Bound(0.0), Bound(1.0)), free("b", Bound(0.0), Bound(2.0))]),
        plan=SimpleNamespace(tables=[SimpleNamespace(values=lambda: {})]),
    )
    places = np.array(start_places(SimpleNamespace(starts=5, seed=3), model))
    np.testing.assert_array_equal(np.sort(np.floor(5.0 * places), axis=0), np.arange(5.0)[:, None].repeat(2, 1))


def test_what_a_state_says_of_one_segment_replaces_what_it_says_of_all():
    state = State("bent", 20e3, {(0, 1): None, (2, 1): 0.25, (3, 1): None})
    fractions, free = drives_of(state, 0, [(1, 1), (2, 1), (3, 1), (1, 2)])
    assert list(fractions) == [1.0, 0.25, 1.0, 1.0]
    assert [(one.spring, one.parameter) for one in free] == [(0, "bent.xi0_1"), (2, "bent.xi0_3.1")]
