"""Which set a search names in linear-Gaussian worlds: masked pairs, three effects, alike effects, nulls, imperfect forms."""

from types import SimpleNamespace

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, SWELLING, World, fast, smooth, tubes
from scipy.stats import kstest
from test_set_scores import masked

from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.decision import (
    BOUND_REMAINS,
    INSTRUMENTS,
    LEFT_OUT,
    LITTLE,
    REMAINS,
    UNSEEN,
    Judge,
)
from fitting.diagnose.search.explain import explain
from fitting.diagnose.search.pool import Pool
from fitting.diagnose.search.set_search import SetSearch, base_scored
from fitting.diagnose.search.steps import HeldOutScores
from fitting.diagnose.verdict.conclude import conclude
from pneusma_jax.effects import CATALOGUE


def searched(world, measured, seed=1):
    return explain(world.program(measured), np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(6))
def test_a_pair_is_named_whose_members_hide_each_other(seed):
    world = masked()
    found = conclude(searched(world, world.truth(np.random.default_rng(seed), (0.4, -0.2), **{CONSTANT: 4.0, DELAY: 4.0})))
    assert {f.slug for f in found.found} == {CONSTANT, DELAY} and found.unknown < 0.1
    assert found.after.reduced_chi2 < 1.3


@pytest.mark.parametrize(("part", "named"), [(1.5, True), (0.5, False)])
def test_effects_that_hide_each_other_are_named_where_they_leave_a_small_share_of_the_misfit(part, named):
    """A ripple beside them is more than noise: 2 % of what the one pair explains, 16 % of the other's.

    Right effects in forms that are not quite nature's leave as much as the first.
    """
    rng, base = np.random.default_rng(0), fast()
    v, w, other = (smooth(rng, 4, 60, 1) for _ in range(3))
    world = World(base.base, {CONSTANT: 5.0 * v, DELAY: -5.0 * v + part * w, SWELLING: other})
    y = world.truth(np.random.default_rng(2), (0.4, -0.2), **{CONSTANT: 4.0, DELAY: 4.0})
    found = conclude(searched(world, y + 1.1 * np.sin(np.linspace(0.0, 40.0, 60))))
    names = [f.slug for f in found.found]
    assert names == ([CONSTANT, DELAY, "unmodelled"] if named else ["unmodelled"])


@pytest.mark.parametrize("mix", [0.3, 0.6])
def test_an_incomplete_pair_is_named_before_a_single_effect_that_leaves_more(mix):
    """The pair leaves a ripple. An effect alike to a part of it, which would be named instead, leaves more."""
    rng, base = np.random.default_rng(0), fast()
    v, w, other = (smooth(rng, 4, 60, 1) for _ in range(3))
    world = World(base.base, {CONSTANT: 5.0 * v, DELAY: -5.0 * v + 0.5 * w, SWELLING: w + mix * other})
    y = world.truth(np.random.default_rng(2), (0.4, -0.2), **{CONSTANT: 4.0, DELAY: 4.0})
    found = conclude(searched(world, y + 1.1 * np.sin(np.linspace(0.0, 40.0, 60))))
    assert {f.slug for f in found.found} == {CONSTANT, DELAY, "unmodelled"}


class Stated(Judge):
    """A judge of stated reasons and shares."""

    def __init__(self, stated):
        fits = [(SimpleNamespace(slugs=slugs), worth) for slugs, (worth, _, _) in stated.items()]
        self.pool, self.stated = SimpleNamespace(ranked=lambda: fits, base=SimpleNamespace(slugs=())), stated

    def refusal(self, fit):
        return self.stated[fit.slugs][1]

    def _too_much_left(self, fit):
        return None

    def _kept(self, fit):
        return self.stated[fit.slugs][2]


@pytest.mark.parametrize("why", [REMAINS, BOUND_REMAINS])
@pytest.mark.parametrize(("left", "named"), [(0.2, ("a", "b")), (0.4, ("a", "b")), (0.5, ("e",))])
def test_what_ranks_behind_an_incomplete_set_is_not_said_to_have_more_evidence(left, named, why):
    stated = {("a", "b"): (100.0, why, left), ("c", "d"): (95.0, INSTRUMENTS, 0.0), ("e",): (60.0, None, 0.4)}
    told = Stated(stated).decide()
    assert told.fit.slugs == named
    assert told.refused == ([] if named == ("a", "b") else [(("a", "b"), why), (("c", "d"), INSTRUMENTS)])


@pytest.mark.parametrize(("alike", "named"), [(2.0, {CONSTANT, DELAY}), (0.0, {CONSTANT})])
def test_rivals_are_tried_together_though_no_score_stands_out(alike, named, monkeypatch):
    """A coupon's stiffening had taken up a compliant load train, up to its bounds. Both together had 12.6 nat more."""
    monkeypatch.setattr(SetSearch, "_goes_on", lambda *_: False)
    rng = np.random.default_rng(11)
    world = tubes(effects=(CONSTANT, DELAY, ANOTHER))
    world.effects[DELAY][:] += alike * world.effects[CONSTANT]
    found = searched(world, world.truth(rng, **{CONSTANT: 4.0, DELAY: 2.0}))
    assert set(found.final.slugs) == named


def test_three_effects_are_named(monkeypatch):
    monkeypatch.setattr(CATALOGUE[ANOTHER], "lookalike", "")  # which would stand beside them
    rng = np.random.default_rng(4)
    world = tubes()
    y = world.truth(rng, (0.2, 0.3), **{CONSTANT: 2.0, DELAY: 3.0, ANOTHER: (2.0, -1.5)})
    found = conclude(searched(world, y))
    assert {f.slug for f in found.found} == {CONSTANT, DELAY, ANOTHER}


@pytest.mark.parametrize(
    ("larger", "delay", "named"),
    [(1.0, 0.5, {CONSTANT, DELAY}), (100.0, 0.5, {CONSTANT}), (100.0, 2.5, {CONSTANT, DELAY})],
)
def test_a_further_effect_explains_more_than_the_form_of_the_first_is_known_by(larger, delay, named):
    """A lag below the noise is told beside an effect six times as strong. Beside one 600 times as strong nobody knows
    its form so well. A lag of twice the noise is clearly left over there, and told."""
    world = tubes(effects=(CONSTANT, DELAY))
    world.effects[CONSTANT][:] *= larger
    found = conclude(searched(world, world.truth(np.random.default_rng(6), **{CONSTANT: 3.0, DELAY: delay})))
    assert {f.slug for f in found.found} == named


def test_a_pair_is_named_beside_a_rival_of_one_member():
    """A sensitivity alike to one of the two is said to be one that it is not told from."""
    rng = np.random.default_rng(5)
    world = tubes(effects=(CONSTANT, DELAY, SWELLING))
    world.effects[SWELLING][:] = world.effects[DELAY]
    found = conclude(searched(world, world.truth(rng, **{CONSTANT: 2.0, DELAY: 2.0})))
    names = {f.slug for f in found.found}
    assert CONSTANT in names and len(names & {DELAY, SWELLING}) == 1 and len(names) == 2
    (alike,) = [f for f in found.found if f.slug != CONSTANT]
    assert set(alike.confusable) == {DELAY, SWELLING} - names


def test_noise_alone_stands_out_no_more_often_than_chance_has_it():
    """Probabilities by chance of thirty worlds of noise, by Kolmogorov's one-sided distance at a level of 0.001.

    A search of noise ends at the scores but once in a hundred, so that no later rule has to refuse anything.
    """
    found = []
    for seed in range(30):
        rng, world = np.random.default_rng(500 + seed), tubes(seed=seed, recordings=3, rows=40)
        program, base = base_fit(world.program(world.truth(rng, rng.standard_normal(2))))
        found.append(base_scored(program, base, rng).p_value)
    assert kstest(found, "uniform", alternative="greater").pvalue > 0.001


def judged(world, measured, *sets):
    """The reasons for which a judge refuses sets."""
    program, base = base_fit(world.program(measured))
    pool = Pool(program, base)
    for slugs in sets:
        start = base.u.copy()
        start[program.unknowns.of(slugs)] = 1.0
        pool.add([Refitter(program).fit(slugs, start)])
    judge = Judge(pool, HeldOutScores(program))
    return [judge.refusal(pool.get(slugs)) for slugs in sets]


def test_a_set_is_refused_for_the_effect_that_earns_nothing():
    rng = np.random.default_rng(6)
    world = fast()
    y = world.truth(rng, **{CONSTANT: 1.0})
    assert judged(world, y, (CONSTANT,), (CONSTANT, DELAY)) == [None, LITTLE]


def test_a_set_is_refused_that_recordings_for_validation_contradict():
    rng = np.random.default_rng(7)
    world = fast(recordings=6, roles=("fit",) * 4 + ("validation",) * 2)
    y = world.truth(rng, **{CONSTANT: 1.0, DELAY: 2.0})
    y[4:] = world.truth(rng, **{CONSTANT: 1.0})[4:]
    assert judged(world, y, (CONSTANT,), (CONSTANT, DELAY)) == [None, UNSEEN]


@pytest.mark.parametrize(("strength", "why"), [(8.0, None), (14.0, BOUND_REMAINS)])
def test_a_further_effect_at_a_bound_that_leaves_more_than_noise_is_no_free_choice(strength, why):
    """The bound is at 10. A pair behind it has earned its place in all else."""
    rng = np.random.default_rng(7)
    world = fast(effects=(CONSTANT, DELAY))
    world.effects[CONSTANT][:] *= 5.0
    y = world.truth(rng, **{CONSTANT: 4.0, DELAY: strength})
    assert judged(world, y, (CONSTANT,), (CONSTANT, DELAY)) == [None, why]


def test_a_set_is_refused_that_helps_one_recording_alone():
    rng = np.random.default_rng(8)
    world = fast(effects=(CONSTANT, DELAY))
    world.effects[DELAY][1:] = 0.0
    y = world.truth(rng, **{CONSTANT: 1.0})
    y[0] += 3.0 * world.effects[DELAY][0, :, 0] * np.sign(np.arange(y.shape[1]) % 2 - 0.5)  # in half of its rows the other way
    assert judged(world, y, (CONSTANT, DELAY))[0] in (LITTLE, LEFT_OUT)


ZEROS = np.array([0.6, 0.0, 0.6, 0.0])[:, None]
"""Errors of the zero of each recording, in standard deviations of the noise."""


@pytest.mark.parametrize(("zeros", "refused"), [(ZEROS, [INSTRUMENTS]), (0.35 + 0.0 * ZEROS, [None])])
def test_what_slow_drift_explains_better_is_refused(zeros, refused):
    rng = np.random.default_rng(9)
    world = fast(effects=(CONSTANT, DELAY), rows=120)
    world.effects[CONSTANT][:] = 1.0
    assert judged(world, world.truth(rng) * 0.9 + zeros, (CONSTANT,)) == refused


def test_what_slow_drift_explains_is_said_where_nothing_is_named():
    rng = np.random.default_rng(9)
    world = fast(effects=(CONSTANT, DELAY), rows=120)
    world.effects[CONSTANT][:] = 1.0
    told = conclude(searched(world, world.truth(rng) * 0.9 + ZEROS))
    assert not told.mismatch and not told.found
    (remark,) = [note for note in told.notes if "drift or noise" in note]
    assert remark.startswith(f"{CONSTANT} explains and predicts the recordings better than the base model")
    quiet = conclude(searched(world, world.truth(rng) * 0.9))
    assert not any("drift or noise" in note for note in quiet.notes)


def test_a_set_is_better_by_its_best_fit_and_never_loses_it():
    rng = np.random.default_rng(10)
    world = tubes()
    program, base = base_fit(world.program(world.truth(rng, **{CONSTANT: 2.0})))
    pool, good = Pool(program, base), Refitter(program).fit((CONSTANT,))
    worse = Refitter(program).fit((CONSTANT,), rounds=0)
    pool.add([good, worse])
    assert worse.objective > good.objective and pool.get([CONSTANT]) is good
    assert [fit.slugs for fit, _ in pool.ranked()] == [(CONSTANT,)] and pool.without(good, CONSTANT) is base


def test_sets_stop_growing_where_evidence_does(seed=3):
    """One effect explains all but a ripple that none has. Pairs are tried, gain nothing, and no triple is."""
    rng = np.random.default_rng(seed)
    world = tubes()
    y = world.truth(rng, (0.2, 0.3), **{CONSTANT: 8.0})
    y = y + 0.9 * np.sin(np.linspace(0.0, 40.0, y.shape[1]))
    said = []
    found = explain(world.program(y), np.random.default_rng(1), said.append)
    assert found.final.slugs == (CONSTANT,)
    assert any("sets of 2 effects" in line for line in said)
    assert not any("sets of 3 effects" in line for line in said)


@pytest.mark.parametrize("ripple", (0.0, 1.1))
def test_a_name_that_leaves_more_than_noise_in_unseen_recordings_is_not_given_without_reserve(ripple):
    """The ripple is far less than a twentieth of the misfit that the effect explains."""
    rng = np.random.default_rng(8)
    world = tubes(recordings=5, roles=("fit",) * 3 + ("validation",) * 2)
    y = world.truth(rng, (0.2, 0.3), **{CONSTANT: 5.0})
    y[3:] += ripple * np.sin(np.linspace(0.0, 40.0, y.shape[1]))
    found = conclude(searched(world, y))
    name = next(f for f in found.found if f.slug == CONSTANT)
    if ripple:
        assert [f.slug for f in found.found] == [CONSTANT, "unmodelled"]
        assert name.probability < 0.76 and found.unknown > 0.24
    else:
        assert [f.slug for f in found.found] == [CONSTANT] and name.probability > 0.9
