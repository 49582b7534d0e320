"""Turning points between rows and effects that act alike: told apart where readings do so, else both are reported."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from linear_world import CONSTANT, DELAY, SIGMA, SWELLING, World, fast, log_density

from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.explain import explain
from fitting.diagnose.search.steps import Explanation, Named
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict import turns
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.diagnose.verdict.turns import TriedTurns, common_rows, weighed, with_turns
from fitting.inference.channels import Channel
from fitting.report.diagnosis.payload import content

ADDED = 20
"""Row without readings in every recording."""
STRENGTH = 1.5


@dataclass(frozen=True)
class Turned(World):
    """A world whose drives pass through a turning point, which changes the outputs.

    Attributes:
        turn: what it changes, in standard deviations of the noise, (recordings, rows); the row `ADDED` is new.
    """

    turn: np.ndarray | None = None

    @classmethod
    def of(cls, world, turn):
        """A world with one more row than another one, where that has none."""
        more = {slug: np.insert(J, ADDED, 0.0, axis=1) for slug, J in world.effects.items()}
        base = np.insert(world.base, ADDED, 0.0, axis=1)
        return cls(base, more, world.roles, world.stated, np.insert(turn, ADDED, 0.0, axis=1))

    def run(self, u, columns, stacked, chosen=None):
        raw = super().run(u, columns, stacked, chosen)
        return replace(raw, found={"length": raw.found["length"] + SIGMA * self.turn})

    def program(self, measured):
        """The campaign of these readings, with a row without readings between two of them."""
        made = super().program(np.insert(measured, ADDED, 0.0, axis=1))
        count, rows = np.asarray(made.stacked.mask).shape
        time = np.insert(np.arange(rows - 1.0), ADDED, ADDED - 0.5)
        channels = [[replace(c, sigma=np.where(time % 1.0 == 0.0, c.sigma, np.inf)) for c in row] for row in made.channels]
        stacked = replace(made.stacked, time=np.tile(time, (count, 1)))
        return replace(made, channels=channels, bare=channels, stacked=stacked)


def searched(world, y):
    return explain(world.program(y), np.random.default_rng(1))


def acting(alike, acts):
    """A world, what turning points change in it, and readings under these or under an effect that acts much alike.

    Args:
        alike: correlation of what both change.
        acts: "turn" or "effect".
    """
    rng = np.random.default_rng(3)
    world = fast(recordings=3)
    form = STRENGTH * world.effects[CONSTANT][..., 0]
    other = STRENGTH * rng.standard_normal(form.shape)
    turn = alike * form + np.sqrt(1.0 - alike**2) * other
    return world, turn, world.truth(rng, (0.5, -0.3)) + (turn if acts == "turn" else form)


def concluded(alike, acts):
    """Both searches and the conclusion about `acting`."""
    world, turn, y = acting(alike, acts)
    explanations = searched(Turned.of(world, turn), y), searched(world, y)
    return *explanations, *with_turns(*explanations)


@pytest.mark.parametrize(
    ("alike", "acts", "matter"),
    [(0.0, "effect", False), (0.6, "effect", False), (1.0, "effect", True)] + [(a, "turn", True) for a in (0.0, 0.85, 1.0)],
)
def test_turning_points_are_searched_with_only_where_they_may_explain_as_much(alike, acts, matter):
    """An effect without which the base model seems to need them is no reason: it is what explains the readings."""
    world, turn, y = acting(alike, acts)
    turned, plain = Turned.of(world, turn).program(y), searched(world, y)
    tried = TriedTurns.beside(turned, plain)
    assert (tried.help_base and tried.matter()) is matter


@pytest.mark.parametrize("size", [0.0, 0.3, 0.6])
def test_turning_points_that_are_not_there_are_not_searched_with(size):
    """Beside a strong effect and one of a tenth of its evidence."""
    rng, world = np.random.default_rng(1), fast(recordings=3)
    turn = size * rng.standard_normal(world.base.shape[:2])
    y = world.truth(rng, (0.5, -0.3), **{CONSTANT: 0.9, DELAY: 4.0})
    assert not TriedTurns.beside(Turned.of(world, turn).program(y), searched(world, y)).help_base


@pytest.mark.parametrize("seed", range(4))
def test_turning_points_that_look_like_two_effects_are_searched_with(seed):
    """Beside them neither effect is there, but together they are a rival of both."""
    rng, world = np.random.default_rng(seed), fast(recordings=3, effects=(SWELLING, DELAY, CONSTANT))
    turn = STRENGTH * (world.effects[SWELLING][..., 0] + 2.0 * world.effects[DELAY][..., 0])
    y = world.truth(rng, (0.5, -0.3)) + turn
    plain = searched(world, y)
    turned = Turned.of(world, turn).program(y)
    tried = TriedTurns.beside(turned, plain)
    assert len(plain.final.slugs) == 2 and tried.help_base and tried.matter()


@pytest.mark.parametrize("acts", ["turn", "effect"])
def test_both_are_reported_where_readings_do_not_tell_them_apart(acts):
    turned, plain, conclusion, note = concluded(1.0, acts)
    odds = weighed(turned, plain)
    assert not odds.turns_lead and not odds.effects_lead and not conclusion.mismatch and not conclusion.found
    (effect,) = conclusion.reported
    assert effect.slug == CONSTANT and 0.1 < effect.probability <= odds.share < 0.9
    assert conclusion.without_turns.probability == pytest.approx(1.0 - odds.share)
    total = sum(p for p, _ in conclusion.candidates.values()) + conclusion.nothing + conclusion.unknown
    unseen = (1.0 - odds.share) * (1.0 - DEFAULT.probability.tentative)  # it may be too weak to be seen, too
    assert total == pytest.approx(1.0) and conclusion.candidates[CONSTANT][0] <= odds.share + unseen
    assert conclusion.explanation_set == [CONSTANT]
    assert verdict_sentences(conclusion)[0].startswith("One of two acts.") and "is as much" in note
    assert not conclusion.model[1].slugs  # no model has an effect that may not be there


def test_a_report_states_both():
    *_, conclusion, _ = concluded(1.0, "effect")
    report = content(conclusion)
    assert report["verdict"] == "consistent" and [e["name"] for e in report["effects"]] == [CONSTANT]
    assert report["turning_points"]["instead_of"] == [CONSTANT] == report["next_experiment"]["separates"]
    assert report["turning_points"]["probability"] + report["effects"][0]["probability"] <= 1.0


@pytest.mark.parametrize(("alike", "named"), [(0.0, ()), (0.6, (CONSTANT,)), (0.85, (CONSTANT,))])
def test_a_drive_that_turned_between_rows_is_no_mismatch(alike, named):
    """Without turning points an effect explains a part of what they change, and has no place beside them."""
    _, plain, conclusion, _ = concluded(alike, "turn")
    assert not conclusion.mismatch and not conclusion.reported and conclusion.without_turns is None
    assert plain.final.slugs == named


@pytest.mark.parametrize("alike", [0.6, 0.85])
def test_an_effect_with_clearly_more_evidence_than_turning_points_is_named(alike):
    turned, plain, conclusion, note = concluded(alike, "effect")
    assert conclusion.mismatch and conclusion.reported[0].slug == CONSTANT
    assert conclusion.without_turns is None and "is clearly more" in note
    assert conclusion.explanation is plain and not turned.final.slugs  # with them nothing would be named


def test_an_effect_that_is_named_with_turning_points_as_well_changes_nothing():
    world, rng = fast(recordings=3), np.random.default_rng(3)
    turn = STRENGTH * rng.standard_normal(world.base.shape[:2])
    y = world.truth(rng, **{CONSTANT: STRENGTH}) + turn
    turned, plain = searched(Turned.of(world, turn), y), searched(world, y)
    conclusion, note = with_turns(turned, plain)
    assert CONSTANT in turned.final.slugs and conclusion.explanation is turned
    assert conclusion.without_turns is None and "No other effect" in note


def test_an_effect_that_acts_either_way_leads_and_the_other_one_is_told_beside_it():
    world, rng = fast(recordings=3), np.random.default_rng(3)
    y = world.truth(rng, **{CONSTANT: STRENGTH, DELAY: 2.0 * STRENGTH})
    turned = searched(Turned.of(world, STRENGTH * world.effects[CONSTANT][..., 0]), y)
    plain = searched(world, y)
    assert turned.final.slugs == (DELAY,) and set(plain.final.slugs) == {CONSTANT, DELAY}
    conclusion, _ = with_turns(turned, plain)
    sure, hidden = conclusion.reported
    assert conclusion.mismatch and sure.slug == DELAY and sure.probability > 0.9
    assert hidden.slug == CONSTANT and hidden.probability <= weighed(turned, plain).share < 0.9
    said = verdict_sentences(conclusion)
    assert DELAY in said[0] and not [one for one in said if one.startswith("One of two")]
    assert f"Or the drive did not turn between rows, and {CONSTANT} ({hidden.probability:.2f}) acts." in said
    total = sum(p for p, _ in conclusion.candidates.values()) + conclusion.nothing + conclusion.unknown
    assert total == pytest.approx(1.0)


def in_other_recordings(found, program):
    """The same search, had the recordings of a program been what was kept for validation."""
    refit = lambda fit: Refitter(program).fit(fit.slugs, fit.u)  # noqa: E731
    named, steps = replace(found.named, fit=refit(found.final)), [replace(s, base=refit(s.base)) for s in found.steps]
    return replace(found, program=program, base=refit(found.base), named=named, steps=steps)


def test_turning_points_are_weighed_without_effects_that_validation_contradicts():
    """An effect acts as turning points would. Another one, of fitted recordings alone, holds its place on no side."""
    rng = np.random.default_rng(3)
    world = fast(recordings=6, roles=("fit",) * 4 + ("validation",) * 2)
    form = STRENGTH * world.effects[CONSTANT][..., 0]
    turn = 0.85 * form + np.sqrt(1.0 - 0.85**2) * STRENGTH * rng.standard_normal(form.shape)
    y = world.truth(rng, (0.5, -0.3), **{DELAY: 1.0}) + form
    turning = Turned.of(world, turn)
    turned, plain = searched(turning, y), searched(world, y)
    assert turned.final.slugs == (DELAY,) and set(plain.final.slugs) == {CONSTANT, DELAY}
    y[4:] -= 2.0 * world.effects[DELAY][4:, :, 0]
    turned, plain = in_other_recordings(turned, turning.program(y)), in_other_recordings(plain, world.program(y))
    conclusion, note = with_turns(turned, plain)
    assert conclusion.mismatch and [f.slug for f in conclusion.found if f.probability > 0.5] == [CONSTANT]
    assert "is clearly more" in note


def explanation_of(program, slugs=()):
    """A model of a campaign that nobody searched for."""
    refitter = Refitter(program)
    base = refitter.fit(())
    return Explanation(program, base, Named(refitter.fit(slugs, base) if slugs else base), [], 0.001, True)


@pytest.mark.parametrize("noise", [1.0, 2.0])
def test_both_have_the_evidence_of_their_marginal_likelihoods(noise):
    """Under the noise that the model with turning points shows, whatever that without them was fitted with."""
    world, rng = fast(recordings=2, effects=(CONSTANT, DELAY)), np.random.default_rng(5)
    turn = 0.5 * rng.standard_normal(world.base.shape[:2])
    opposite = 0.8 * (-1.0) ** np.arange(world.base.shape[1])  # neighbours: evidence is not deflated
    y = noise * opposite + 0.4 * world.effects[CONSTANT][..., 0]
    program = Turned.of(world, turn).program(y)
    channels = [[replace(c, sigma=noise * c.sigma) for c in row] for row in program.bare]
    program = replace(program, bare=channels, channels=channels)
    odds = weighed(explanation_of(program), explanation_of(world.program(y), (CONSTANT,)))
    J = world.design() / noise
    without = np.eye(len(J)) + J @ J.T
    base = log_density(y.ravel() / noise, without)
    turns = log_density((y - turn).ravel() / noise, without) - base - np.log(len(world.effects))
    (own,) = world.program(y).unknowns.of([CONSTANT])
    low, high = (getattr(world.program(y).unknowns, end)[own] for end in ("low", "high"))
    v, values = world.effects[CONSTANT].ravel() / noise, np.linspace(low, high, 4001)
    pull, size = v @ np.linalg.solve(without, y.ravel() / noise), v @ np.linalg.solve(without, v)
    gains = values * pull - 0.5 * values**2 * size
    effects = gains.max() + np.log(np.trapezoid(np.exp(gains - gains.max()), values) / (high - low))
    effects -= np.log(len(world.effects))
    near = 4.0 * DEFAULT.optimiser.minimum_decrease
    assert odds.turns == pytest.approx(turns, abs=near) and odds.effects == pytest.approx(effects, abs=near)


def test_rows_that_were_recorded_are_found_among_those_with_turning_points():
    world = fast(recordings=2)
    y = world.truth(np.random.default_rng(1))
    turned = Turned.of(world, np.zeros(y.shape)).program(y)
    rows, recorded = common_rows(turned, world.program(y), 1)
    assert np.array_equal(rows, np.delete(np.arange(y.shape[1] + 1), ADDED))
    assert np.array_equal(recorded, np.arange(y.shape[1]))
    assert np.all(np.isfinite(turned.bare[1][0].sigma[rows]))


def test_rows_of_a_clock_that_stands_still_are_told_apart():
    """Such a recording has no turning points; a reading that does not count stays the one that does not."""
    world = fast(recordings=2)
    y = world.truth(np.random.default_rng(1))
    plain = world.program(y)
    time = np.array(plain.stacked.time)
    time[1, 10:13] = time[1, 10]
    plain = replace(plain, stacked=replace(plain.stacked, time=time))
    assert all(np.array_equal(rows, np.arange(y.shape[1])) for rows in common_rows(plain, plain, 1))


@pytest.mark.parametrize("correlation", [0.6, np.linspace(0.3, 0.7, 30)])
def test_turning_points_between_rows_do_not_change_what_readings_of_no_memory_are_worth(correlation):
    """They have no readings, so errors on both sides of one are parted, in either program."""
    rng, added = np.random.default_rng(4), np.array([7, 20])
    missed, rows = rng.standard_normal(30), np.setdiff1d(np.arange(32), added)
    wide = np.zeros(32)
    wide[rows] = missed
    sigma = np.full(32, np.inf)
    sigma[rows] = 0.5
    turned = Channel("stress", wide, sigma, turns._parted(correlation, rows, np.arange(30), 32))
    back = turns._parted(turned.correlation, np.arange(30), rows, 30)
    plain = Channel("stress", missed, np.full(30, 0.5), back)
    np.testing.assert_allclose(plain.whitened(missed), turned.whitened(wide)[rows], atol=1e-12)
    chain = Channel("stress", missed, np.full(30, 0.5), correlation).whitened(missed)
    assert np.flatnonzero(np.abs(chain - plain.whitened(missed)) > 0.01).tolist() == [7, 19]
