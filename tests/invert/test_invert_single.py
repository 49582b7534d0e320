"""PneuSMA2 driven to curvatures: reachable, out of reach, and over time."""

import dataclasses

import jax
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.invert import Inverse, Inversion, Limits
from fitting.invert.electrical import heat, unheated
from fitting.invert.trajectory import follow
from fitting.report.invert.words import verdict
from pneusma_jax.errors import InputError

LIMITS = Limits((0.0, 50e3), 0.1)


@pytest.fixture(scope="module")
def inverse():
    return Inverse("pneusma2", LIMITS)


@pytest.fixture(scope="module")
def tube():
    """Of a design without springs."""
    return Inverse("pneuflex_s", LIMITS)


@pytest.mark.slow
def test_reachable_curvatures_are_met_and_the_rest_is_held_by_bounds(inverse):
    random = np.random.default_rng(3)
    drives = np.column_stack([random.uniform(0.0, 50e3, 60), random.uniform(0.1, inverse.highest, (60, 2))])
    reachable = np.asarray(inverse.verified(drives).only.curvature)
    wanted = np.concatenate([reachable, [75.0, -90.0, 120.0, -300.0]])[:, None]
    found = inverse.solve(("curvature",), wanted)
    assert found.met[:60].all() and not found.met[60:].any()
    assert np.max(found.misses["curvature"][:60]) < 1e-2
    assert all("xi0_" in words and "pressure" in words for words in found.held[60:])
    # the nearest point, by the atlas: nothing of it lies nearer
    seen = inverse.atlas.values(("curvature",))[:, 0]
    for k in range(60, 64):
        assert abs(found.values[k, 0] - wanted[k, 0]) <= np.min(np.abs(seen - wanted[k, 0])) * 1.01


@pytest.mark.slow
def test_another_way_that_meets_the_target_is_the_answer_where_the_first_search_does_not(
    inverse, monkeypatch
):
    candidates, goals, wanted = inverse._candidates, ("curvature",), np.array([[25.0]])
    (there,) = candidates(goals, wanted)[-1:]
    meets = jax.tree.map(lambda x: x[:, 0], there)
    rest = np.array([[0.0, 1.0, 1.0]])
    lost = dataclasses.replace(meets, place=rest, values=np.zeros((1, 1)), miss=np.array([25.0]))
    monkeypatch.setattr(inverse, "_candidates", lambda *_: [there])
    best, ways = inverse._ways(goals, wanted, lost)
    np.testing.assert_array_equal(best.place, meets.place)
    assert len(ways[0]) == 0  # the drives that miss the target are no way to it


@pytest.mark.slow
def test_drives_reproduce_the_curvature_in_the_plain_solver(inverse):
    found = inverse.solve(("curvature",), np.array([[25.0]]))
    given = tuple(pj.MartensiteFraction(x) for x in found.fractions[0])
    state = pj.solve(pj.make_actuator("pneusma2"), found.pressure[0], given)
    assert float(state.curvature) == pytest.approx(25.0, abs=1e-2)
    np.testing.assert_allclose([float(s.resistance) for s in state.springs], found.resistances[0], rtol=1e-8)


@pytest.mark.parametrize(("design", "goal"), [("pneuflex_s", "bend_angle"), pytest.param("pneuflex_t", "curvature", marks=pytest.mark.slow)])
def test_pressure_alone_drives_a_design_without_springs(request, design, goal):
    inverse = request.getfixturevalue("tube") if design == "pneuflex_s" else Inverse(design, LIMITS)
    wanted = inverse.verified(np.array([[20e3]])).only
    found = inverse.solve((goal,), np.asarray(getattr(wanted, goal))[:, None])
    assert found.met.all() and found.fractions.shape == found.currents.shape == (1, 0)
    assert found.pressure[0] == pytest.approx(20e3, rel=1e-3)


def test_the_heat_of_all_ways_is_computed_together(inverse, monkeypatch):
    """One call for each of 1,000 targets took a third of the time of a batch."""
    random, calls = np.random.default_rng(0), []
    ways = [np.column_stack([np.zeros(n), random.uniform(0.1, 0.9, (n, 2))]) for n in (2, 0, 3, 0)]
    wanted = [heat(inverse.body, own[:, 1:]) for own in ways]
    monkeypatch.setattr("fitting.invert.run.heat", lambda *given: calls.append(1) or heat(*given))
    found = inverse._heat_of(ways)
    assert len(calls) == 1 and [len(one) for one in found] == [2, 0, 3, 0]
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("fractions", "words"),
    [
        ([[1.0, 0.981]], "No heating gives xi0_2 0.981: a spring without a current is at 0.973"),
        ([[0.5, 0.98], [0.99, 1.0], [0.4, 0.97]], "No heating gives xi0_1 and xi0_2 of 2 targets: "),
        ([[1.0, 0.97]], ""),
    ],
)
def test_fractions_that_no_heating_gives_are_said(inverse, fractions, words):
    count, blank = len(fractions), np.zeros((len(fractions), 2))
    result = Inversion(
        "pneusma2", ("curvature",), np.zeros((count, 1)), inverse.springs, np.zeros(count), np.array(fractions),
        blank, blank, np.zeros((count, 1)), {"curvature": np.zeros(count)}, np.ones(count, bool),
        ("",) * count, (np.zeros((0, 3)),) * count, unheated(inverse.body), np.ones(2),
        (np.zeros(0),) * count,
    )  # fmt: skip
    said = verdict(result)
    last = words or "Springs that are not named stay at 1.000."
    assert said[-1].startswith(last) and ("No heating" in " ".join(said)) == bool(words)


@pytest.mark.slow
def test_a_spring_without_a_current_is_the_bound_unless_told_otherwise(inverse):
    """In air of 22 degC the reversible curve of KRL35 is at 0.973."""
    natural = 1.0 / (1.0 + np.exp((22.0 - 31.0) / 2.5))
    np.testing.assert_allclose(inverse.highest, natural, rtol=1e-12)
    found = inverse.solve(("curvature",), np.array([[0.5], [25.0], [-40.0]]), all_ways=True)
    assert found.met.all() and np.all(found.fractions <= natural)
    assert all(np.all(ways[:, 1:] <= natural) for ways in found.ways)
    cold = found.fractions == natural
    assert cold.any() and np.all(found.currents[cold] == 0.0) and np.all(found.currents[~cold] > 0.0)
    assert "Springs that are not named stay at 0.973, their fraction without a current" in verdict(found)[-1]
    cooled = Inverse("pneusma2", Limits((0.0, 50e3), 0.1, 1.0)).solve(("curvature",), np.array([[25.0]]))
    assert cooled.met.all() and natural < cooled.fractions.max() <= 1.0


def test_fractions_that_leave_nothing_to_heat_are_refused():
    with pytest.raises(
        InputError, match="0.98, is not below that of the coldest, 0.9734, which has no current"
    ):
        Inverse("pneusma2", Limits((0.0, 50e3), 0.98))
    with pytest.raises(InputError, match=r"0.5, is not below that of the coldest, 0.3$"):
        Inverse("pneusma2", Limits((0.0, 50e3), 0.5, 0.3))


def test_pressures_without_any_equilibrium_are_refused():
    with pytest.raises(InputError, match=r"no state that was tried from -95 to -60 kPa has an equilibrium"):
        Inverse("pneusma2", Limits((-95e3, -60e3), 0.1)).solve(("curvature",), np.array([[40.0]]), all_ways=True)


def test_pressures_where_only_two_heated_springs_hold_have_an_answer():
    """At 600 to 900 kPa no state with one heated spring has an equilibrium, from which other ways would start."""
    inverse = Inverse("pneusma2", Limits((600e3, 900e3), 0.1))
    assert not inverse.lean_starts(("curvature",), np.array([[40.0]])).size
    found = inverse.solve(("curvature",), np.array([[40.0]]), all_ways=True)
    assert np.isfinite(found.values).all() and not found.met.any()


@pytest.mark.slow
def test_the_spring_that_was_heated_before_is_blamed_and_not_the_one_that_the_row_heats(inverse):
    """A spring heated to one side takes from the bend to the other, which a new actuator reaches."""
    alone = follow(inverse, ("curvature",), np.array([[0.0], [-60.0]]), np.array([0.0, 20.0]))
    assert alone.inversion.met.all()
    after = follow(inverse, ("curvature",), np.array([[0.0], [40.0], [-60.0]]), np.array([0.0, 10.0, 20.0]))
    assert after.lost.tolist() == [False, False, True]
    (said,) = after.warnings()
    assert "what spring 2 lost" in said and "at 10 s" in said


@pytest.mark.slow
def test_what_heat_has_taken_is_said(inverse):
    # bent as far as it goes to one side, and then straight and long: the heated spring does not let go again
    held = Inverse("pneusma2", Limits((30e3, 30e3), 0.1))
    cold = float(held.verified(np.array([[30e3, *held.highest]])).only.length[0])
    hot = held.verified(np.array([[30e3, held.highest[0], 0.12]])).only
    wanted = np.array([[float(hot.curvature[0]), float(hot.length[0])], [0.0, cold]])
    found = follow(held, ("curvature", "length"), wanted, np.array([0.0, 10.0]))
    assert found.without_memory.all() and found.lost.tolist() == [False, True]
    assert found.disagreement < 1e-6
    assert "Only stretching the spring again brings it back" in found.warnings()[0]


@pytest.mark.slow
def test_a_first_row_is_heated_no_more_than_a_target_without_time(inverse):
    """The states nearest to 10 deg are warm, and a search from them alone ended in 0.34 of heat, not 0.0004."""
    wanted = np.radians([[10.0]])
    alone = inverse.solve(("bend_angle",), wanted)
    first = follow(inverse, ("bend_angle",), wanted, np.zeros(1))
    assert alone.met.all() and first.inversion.met.all() and first.disagreement < 1e-6
    heat = [np.sum((inverse.highest - x.fractions) ** 2) for x in (alone, first.inversion)]
    assert heat[1] < 1.01 * heat[0] + 1e-6
    np.testing.assert_allclose(first.remembered, first.inversion.fractions, rtol=1e-9)


@pytest.mark.slow
def test_a_curvature_is_met_with_little_more_heat_than_a_grid_needs(inverse):
    """At 40 1/m the curvature has a maximum over the pressure, where a search once came to nothing."""
    near = inverse.atlas.nearest(("curvature",), np.array([[40.0]]), 1, lean=True)
    stuck = inverse._searched(("curvature",), np.array([[40.0]]), near, heated=(1,))
    assert abs(float(stuck.values[0, 0, 0]) - 40.0) < 1e-3
    found = inverse.solve(("curvature",), np.array([[40.0], [-40.0]]), all_ways=True)
    assert found.met.all()
    pressure, fraction = (
        x.ravel() for x in np.meshgrid(np.linspace(0, 50e3, 26), np.linspace(0.1, inverse.highest[0], 451))
    )
    bends = np.asarray(
        inverse.verified(
            np.column_stack([pressure, 0 * pressure + inverse.highest[0], fraction])
        ).only.curvature
    )
    least = np.min((inverse.highest[0] - fraction[np.abs(bends - 40.0) < 0.5]) ** 2)
    heat = np.sum((inverse.highest - found.fractions) ** 2, axis=1)
    np.testing.assert_allclose(heat[0], heat[1], rtol=1e-6)  # its mirror image
    assert heat[0] < 1.05 * least  # searches from the four nearest states took 1.5 times as much


def test_few_targets_begin_where_many_do(tube):
    """Up to `WITHOUT_TREE` targets are compared with all states, more go through a tree."""
    atlas = tube.atlas
    random = np.random.default_rng(3)
    wanted = np.column_stack([random.uniform(-60.0, 60.0, 40), random.uniform(0.05, 0.07, 40)])
    goals, sizes = ("curvature", "length"), np.array([1.0, 1e-3])
    for ranks, lean in ((1, False), (1, True), (range(2, 6), False)):
        many = atlas.nearest(goals, wanted, ranks, lean)
        few = np.concatenate([atlas.nearest(goals, wanted[k : k + 2], ranks, lean) for k in range(0, 40, 2)])
        away = [
            np.linalg.norm((atlas.values(goals)[k] - wanted[:, None]) / sizes, axis=2) for k in (few, many)
        ]
        np.testing.assert_allclose(*away, rtol=1e-12)  # two states may be equally near
