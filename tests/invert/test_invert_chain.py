"""A chain of four driven to tip poses, and through a lumen."""

import equinox as eqx
import jax
import numpy as np
import pytest

from fitting.invert import Inverse, Limits
from fitting.invert.derivatives import values_with_slope
from fitting.invert.electrical import electrical
from fitting.invert.forward import first_guess, fresh
from fitting.invert.lumen import Lumen, distances, refined
from fitting.invert.passage import pass_through
from pneusma_jax.errors import InputError

LIMITS = Limits((0.0, 50e3), 0.1)


@pytest.fixture(scope="module")
def inverse():
    return Inverse("orthogonal_chain", LIMITS)


@pytest.mark.slow
def test_derivatives_along_few_directions_are_those_of_every_drive(inverse):
    goals, box = ("tip", "direction"), inverse.box()
    place, h = np.array([0.6, 0.9, 0.4, 0.7, 0.95, 0.5, 0.8, 0.3, 0.85]), 1e-5
    memories, guess = fresh(inverse.body), first_guess(inverse.body)
    look = eqx.filter_jit(values_with_slope)
    values, slope, unknowns = look(inverse.body, goals, box.drives, place, memories, guess)
    around = np.array([place, *(place + h * np.eye(9)), *(place - h * np.eye(9))])
    solved = inverse.verified(np.array([box.drives(x) for x in around]))
    pose = np.asarray(solved.end_pose)
    exact = np.column_stack([pose[:, :3, 3], pose[:, :3, 2]])
    np.testing.assert_allclose(values, exact[0], rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(slope, (exact[1:10] - exact[10:]).T / (2.0 * h), rtol=1e-5, atol=1e-7)
    assert unknowns.shape == guess.shape


@pytest.mark.slow
def test_poses_of_random_drives_are_met(inverse):
    random = np.random.default_rng(5)
    drives = np.column_stack(
        [random.uniform(0.0, 50e3, 60), random.uniform(0.3, inverse.highest, (60, len(inverse.springs)))]
    )
    pose = np.asarray(inverse.verified(drives).end_pose)
    found = inverse.solve(("tip", "direction"), np.column_stack([pose[:, :3, 3], pose[:, :3, 2]]))
    assert found.met.mean() >= 0.98
    far = inverse.solve(("tip",), np.array([[0.0, 0.0, 0.9]]))
    assert not far.met[0] and "pressure at its highest" in far.held[0]


@pytest.mark.slow
def test_the_nearest_pose_is_as_near_as_a_long_search_finds(inverse):
    wanted = np.array([[0.0, 0.2, 0.3], [0.25, -0.2, 0.25], [-0.1, 0.0, -0.4]])
    found = inverse.solve(("tip",), wanted)
    assert not found.met.any()
    random = np.random.default_rng(6)
    drives = np.column_stack([random.uniform(0.0, 50e3, 20_000), random.uniform(0.1, 1.0, (20_000, 8))])
    tips = np.asarray(inverse.verified(drives).end_pose)[:, :3, 3]
    for k, target in enumerate(wanted):
        assert found.misses["tip"][k] <= 1.01 * np.min(np.linalg.norm(tips - target, axis=1))


@pytest.mark.slow
def test_ends_of_a_search_in_tables_are_those_of_the_exact_model(inverse):
    goals, wanted = ("tip",), np.array([[0.02, -0.03, 0.2], [0.0, 0.05, 0.19]])
    near = inverse.atlas.nearest(goals, wanted, 1)
    ended = jax.tree.map(lambda x: x[:, 0], inverse.by_tables.searched(goals, wanted, near))
    exact = inverse.by_tables.corrected(goals, wanted, ended)
    drives = np.array([inverse.box().drives(x) for x in exact.place])
    tips = np.asarray(inverse.verified(drives).end_pose)[:, :3, 3]
    np.testing.assert_allclose(exact.values, tips, atol=1e-12)
    np.testing.assert_allclose(exact.miss, np.linalg.norm(tips - wanted, axis=1) / 1e-3, rtol=1e-9)
    assert np.all(exact.miss < 0.02)


@pytest.mark.slow
def test_the_chain_follows_a_bent_lumen_clear_of_its_wall(inverse):
    s = np.linspace(0.0, 1.0, 80)
    angle = 0.6 * np.sin(np.pi * s) ** 2
    step = 0.23 / (len(s) - 1)
    slope = np.stack([np.zeros_like(s), np.sin(angle), np.cos(angle)], axis=1)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(slope[:-1] * step, axis=0)])
    lumen = Lumen("bent", points, np.full(len(points), 18e-3))
    found = pass_through(inverse, lumen)
    assert found.passes and found.offset < 3e-3
    assert found.reached > 0.17  # of 0.23 m; with a tenth of the weight on reach it shortened to 0.158
    away, room = (np.asarray(x) for x in distances(found.line, (points, lumen.diameter)))
    radius = float(inverse.body.segments[0].section.radius)
    assert np.min(room - away) - radius == pytest.approx(found.clearance, abs=1e-9)


@pytest.mark.parametrize(
    ("length", "clearance", "words"),
    [
        (0.05, 0.0, "the lumen is 50 mm long, but orthogonal_chain at least"),
        (0.25, 9e-3, "no chain keeps 9 mm from the wall, since the lumen is at most 18 mm wide"),
    ],
)
def test_a_lumen_that_says_too_little_is_refused(inverse, length, clearance, words):
    lumen = Lumen("straight", np.array([[0.0, 0.0, 0.0], [0.0, 0.0, length]]), np.full(2, 18e-3))
    with pytest.raises(InputError, match=words):
        pass_through(inverse, lumen, clearance)


@pytest.mark.slow
def test_a_lumen_that_is_too_narrow_says_where_and_what_holds(inverse):
    line = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.03], [0.0, 0.0, 0.031], [0.0, 0.0, 0.3]])
    lumen = Lumen("narrow", line, np.array([12e-3, 12e-3, 8e-3, 8e-3]))
    found = pass_through(inverse, lumen)
    assert not found.passes and found.clearance == pytest.approx(-1e-3, abs=1e-5)  # a straight tube of 10 mm
    assert 0.03 < found.touch.stretches[0, 0] < 0.04 and found.touch.stretches[-1, 1] > 0.15


@pytest.mark.parametrize(
    ("diameter", "words"),
    [
        ([8e-3, 8e-3], "the lumen is 8 mm wide where it begins, but the body of .* has a diameter of 10 mm"),
        (
            [9.9e-3, 20e-3],
            "the lumen is 9.9 mm wide where it begins, but the body .* diameter of 10 mm; no drive",
        ),
    ],
)
def test_a_lumen_narrower_than_the_body_is_refused_before_anything_is_solved(diameter, words):
    fresh_one = Inverse("orthogonal_chain", LIMITS)
    lumen = Lumen("narrow", np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]]), np.array(diameter))
    with pytest.raises(InputError, match=words):
        pass_through(fresh_one, lumen)
    assert "atlas" not in vars(fresh_one)  # nothing was computed


@pytest.mark.slow
def test_the_answer_needs_the_least_heat_of_all_ways(inverse):
    """The first search of the fourth target needed 2.9 times the heat of another way."""
    at = np.random.default_rng(3).choice(len(inverse.atlas.drives), 20, replace=False)[3:4]
    goals = ("tip", "direction")
    wanted = inverse.atlas.values(goals)[at]
    quick, best = inverse.solve(goals, wanted), inverse.solve(goals, wanted, all_ways=True)
    assert best.met[0] and len(best.way_heat[0]) == len(best.ways[0]) > 0
    assert best.heat[0] < 0.5 * quick.heat[0]
    assert best.heat[0] <= 1.02 * best.way_heat[0].min() and np.all(np.diff(best.way_heat[0]) >= 0.0)
    row = inverse.verified(best.ways[0])
    resistances, currents = electrical(row)
    np.testing.assert_allclose(best.way_heat[0], np.sum(currents**2 * resistances, axis=1), rtol=1e-6)


def test_a_refined_line_is_the_same_line():
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [0.0, 0.03, 0.12]])
    lumen = Lumen("bent", points, np.array([10e-3, 12e-3, 8e-3]))
    line, diameter = refined(lumen)
    assert len(line) == len(diameter) == 4
    away, room = (np.asarray(x) for x in jax.jit(distances)(line, (points, lumen.diameter)))
    np.testing.assert_allclose(away, 1e-9, rtol=1e-6)
    np.testing.assert_allclose(room, 0.5 * diameter)


@pytest.mark.slow
def test_a_loaded_chain_has_no_lean_state_and_is_searched_from_the_nearest(monkeypatch):
    monkeypatch.setattr("fitting.invert.atlas.LOADED", 16)
    inverse = Inverse("loaded_chain")
    wanted = inverse.atlas.values(("tip",))[:1]
    assert not inverse.atlas.lean.any() and inverse.solve(("tip",), wanted).met.all()
