"""What a search names in a linear-Gaussian world, where evidence and held-out gain of every effect are known."""

from types import SimpleNamespace

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, SWELLING, World, fast, smooth, tubes

from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.search.decision import brings_back
from fitting.diagnose.search.explain import explain
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.conclude import conclude
from pneusma_jax.effects import CATALOGUE


def searched(world, measured, seed=1):
    return explain(world.program(measured), np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(8))
def test_noise_is_named_nothing(seed):
    rng = np.random.default_rng(100 + seed)
    world = tubes(seed=seed)
    conclusion = conclude(searched(world, world.truth(rng, rng.standard_normal(2))))
    assert not conclusion.mismatch and not conclusion.found and conclusion.nothing == DEFAULT.probability.tentative


def test_an_effect_too_weak_to_be_seen_stays_possible_whatever_the_chance_of_the_misfit():
    """Weak effects and none leave misfit of the same chance, so it cannot make "nothing" likelier."""
    found = []
    for seed, strength in ((100, 0.0), (101, 0.0), (102, 0.1), (103, 0.1)):
        rng = np.random.default_rng(seed)
        world = tubes(seed=seed)
        found.append(conclude(searched(world, world.truth(rng, rng.standard_normal(2), **{CONSTANT: strength}))))
    assert not any(one.mismatch for one in found)
    assert np.ptp([one.explanation.p_value for one in found]) > 0.2
    assert [one.nothing for one in found] == [DEFAULT.probability.tentative] * 4
    for one in found:
        others = sum(probability for probability, _ in one.candidates.values()) + one.unknown
        assert others == pytest.approx(1.0 - DEFAULT.probability.tentative)


@pytest.mark.parametrize(("slug", "strength"), [(CONSTANT, 1.0), (ANOTHER, (0.9, -0.7)), (DELAY, 1.5), (SWELLING, 1.2)])
def test_an_effect_is_named_with_its_strength(slug, strength, monkeypatch):
    monkeypatch.setattr(CATALOGUE[slug], "lookalike", "")  # which would stand beside the name
    rng = np.random.default_rng(3)
    world = tubes()
    conclusion = conclude(searched(world, world.truth(rng, (0.5, -0.8), **{slug: strength})))
    assert [f.slug for f in conclusion.found] == [slug] and conclusion.found[0].probability > 0.95
    fit, unknowns = conclusion.explanation.final, conclusion.explanation.program.unknowns
    for k, true in zip(unknowns.of([slug]), np.atleast_1d(strength), strict=True):
        assert abs(fit.u[k] - true) < 4.0 * fit.sd(k)
    assert fit.u[:2] == pytest.approx([0.5, -0.8], abs=0.5)  # the base returns
    assert conclusion.after.reduced_chi2 < 1.3 < conclusion.before.reduced_chi2


def test_two_effects_are_both_named():
    rng = np.random.default_rng(4)
    world = tubes()
    conclusion = conclude(searched(world, world.truth(rng, (0.2, 0.3), **{CONSTANT: 1.2, DELAY: 2.0})))
    assert {f.slug for f in conclusion.found} == {CONSTANT, DELAY}
    assert all(f.probability > 0.9 for f in conclusion.found)


def test_a_small_second_effect_is_named_where_nothing_else_is_left():
    """It makes less than a fortieth of the misfit, and what is left with it is noise."""
    rng = np.random.default_rng(4)
    world = fast()
    conclusion = conclude(searched(world, world.truth(rng, **{CONSTANT: 4.0, DELAY: 0.5})))
    assert {f.slug for f in conclusion.found} == {CONSTANT, DELAY}
    assert conclusion.left is None


@pytest.mark.parametrize(("along", "own", "named"), [(1.0, 0.15, {CONSTANT, DELAY}), (0.0, 0.24, {CONSTANT})])
def test_a_small_second_effect_is_named_beside_an_imperfect_form_where_it_brings_the_base_back(along, own, named):
    """Without it a base constant ends at its bound. What the form leaves could be fitted by chance."""
    rng, world = np.random.default_rng(4), fast()
    world.effects[DELAY][:] = along * world.base[..., :1] + own * world.effects[DELAY]
    imperfect = 0.9 * rng.standard_normal(world.base.shape[:2])
    conclusion = conclude(searched(world, world.truth(rng, **{CONSTANT: 4.8, DELAY: 5.0}) + imperfect))
    assert {f.slug for f in conclusion.found} - {"unmodelled"} == named
    u = conclusion.explanation.final.u
    assert (np.abs(u[0]) < 1.0) and u[2] == pytest.approx(4.8, abs=0.5)
    told = [note for note in conclusion.notes if note.startswith(f"{DELAY} beside {CONSTANT} would explain most")]
    assert len(told) == (DELAY not in named)  # where it is refused, a note says so


@pytest.mark.parametrize("seed", [100, 101, 102])
def test_a_constant_outside_its_stated_tolerance_names_no_effect_that_acts_alike(seed):
    """It lies at 3.5 standard deviations. The effect brings it back, and explains a tenth of what an imperfect form leaves."""
    rng, world = np.random.default_rng(seed), fast()
    form, other = 0.9 * rng.standard_normal((2, *world.base.shape[:2]))
    world.effects[DELAY][:] = world.base[..., :1] + 0.05 * (form + 3.0 * other)[..., None]
    assert searched(world, world.truth(rng, (3.5,), **{CONSTANT: 4.8}) + form).final.slugs == (CONSTANT,)


def test_constants_that_only_pass_the_limit_of_chance_are_not_brought_back():
    program = SimpleNamespace(unknowns=SimpleNamespace(base=np.arange(2)))
    fit = lambda squares: SimpleNamespace(u=np.array([np.sqrt(squares), 0.0]))  # noqa: E731
    limit = 2.0 + DEFAULT.chance.deviations * 2.0
    assert brings_back(program, fit(2.1 * limit), fit(limit - 0.1))
    assert not brings_back(program, fit(limit + 0.1), fit(limit - 0.1))
    assert not brings_back(program, fit(3.0 * limit), fit(limit + 0.1))


def test_the_base_is_scored_where_only_a_pair_explains():
    """Neither effect has evidence alone, so that no question about it needs the base model's left-out score."""
    world = fast()
    apart, alike = (world.effects[slug].copy() for slug in (CONSTANT, DELAY))
    world.effects[CONSTANT][:], world.effects[DELAY][:] = apart + 0.15 * alike, 0.15 * alike - apart
    rng = np.random.default_rng(1)
    found = searched(world, world.truth(rng, **{CONSTANT: 4.0, DELAY: 4.0}))
    assert set(found.final.slugs) == {CONSTANT, DELAY}
    before, after = found.left_out
    assert before > 1.5 * after > 0.0


def test_two_effects_of_one_sensitivity_are_not_told_apart():
    rng = np.random.default_rng(5)
    world = tubes(effects=(DELAY, SWELLING, CONSTANT))
    world.effects[SWELLING][:] = world.effects[DELAY]
    conclusion = conclude(searched(world, world.truth(rng, (0.2, 0.3), **{DELAY: 2.0})))
    (found,) = conclusion.found
    other = {DELAY: SWELLING, SWELLING: DELAY}[found.slug]
    assert found.probability < 0.8 and found.confusable == [other]
    assert {DELAY, SWELLING} <= set(conclusion.explanation_set)


def test_what_the_base_absorbs_is_named_nothing():
    """The effect is a sum of the base's sensitivities: it costs a fraction of a standard deviation of theirs."""
    rng = np.random.default_rng(6)
    world = tubes(effects=(CONSTANT, DELAY))
    world.effects[CONSTANT][:] = world.base.sum(axis=2, keepdims=True)
    explanation = searched(world, world.truth(rng, **{CONSTANT: 0.5}))
    assert explanation.final.slugs == ()
    assert explanation.base.u[:2] == pytest.approx([0.5, 0.5], abs=0.3)


def test_what_no_effect_explains_is_unmodelled():
    rng = np.random.default_rng(7)
    whole = tubes()
    world = World(whole.base, {slug: v for slug, v in whole.effects.items() if slug not in (CONSTANT, SWELLING)})
    pressure = world.drivers["pressure"] / 1e3
    conclusion = conclude(searched(world, world.truth(rng, (0.3, 0.1)) + 6.0 * np.sin(7.0 * pressure)))
    assert conclusion.mismatch and conclusion.found[0].slug == "unmodelled" and conclusion.unknown > 0.8
    assert conclusion.place.drivers[0] == "pressure"
    assert conclusion.after.reduced_chi2 < 0.2 * conclusion.before.reduced_chi2


def still(world, rng):
    """Noise of unit size without a share in any direction of a world: what is measured has the evidence of its truth."""
    noise = rng.standard_normal(world.base.shape[:2])
    q, _ = np.linalg.qr(world.design(tuple(world.effects)))
    noise -= (q @ (q.T @ noise.ravel())).reshape(noise.shape)
    return noise / np.sqrt(np.mean(noise**2))


def strength_of(world, slug, log_bayes_factor, beside=()):
    """Strength of an effect of one number that is worth so much, with those beside it free."""
    A, v = world.design(beside), world.effects[slug].ravel()
    prior = np.diag(np.concatenate([np.ones(world.base.shape[2]), np.full(len(beside), 1e-9)]))
    size = v @ v - v @ A @ np.linalg.solve(A.T @ A + prior, A.T @ v)
    occam = np.log(np.sqrt(2.0 * np.pi / size) / 10.0) - np.log(len(world.effects))  # bounds ten apart
    return np.sqrt(2.0 * (log_bayes_factor - occam) / size)


@pytest.mark.parametrize(("expected", "named"), [(4.0, False), (7.0, False), (9.5, True), (40.0, True)])
def test_evidence_decides_about_a_first_effect(expected, named):
    """From a log Bayes factor of 8 on."""
    world = fast(effects=(CONSTANT, DELAY))
    y = still(world, np.random.default_rng(8)) + world.truth(None, **{CONSTANT: strength_of(world, CONSTANT, expected)})
    explanation = searched(world, y)
    assert (explanation.final.slugs == (CONSTANT,)) is named
    if named:
        assert explanation.first.bayes == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize(("expected", "named"), [(3.0, False), (7.0, True), (40.0, True)])
def test_a_further_effect_needs_less_evidence_than_the_first(expected, named):
    """Of 5: that something is missing is certain once the first one is in."""
    world = fast(effects=(CONSTANT, DELAY))
    second = strength_of(world, DELAY, expected, beside=(CONSTANT,))
    first = strength_of(world, CONSTANT, 60.0)
    y = still(world, np.random.default_rng(8)) + world.truth(None, **{CONSTANT: first, DELAY: second})
    assert (set(searched(world, y).final.slugs) == {CONSTANT, DELAY}) is named


@pytest.mark.parametrize(("zeros", "named"), [((0.35, 0.35), True), ((0.6, 0.0), False)])
def test_what_slow_drift_explains_better_lets_nothing_in(zeros, named):
    """An effect that adds the same to every recording: zeros that differ by half the noise are drift instead."""
    world = fast(effects=(CONSTANT, DELAY), rows=120)
    world.effects[CONSTANT][:] = 1.0
    y = still(world, np.random.default_rng(8)) + np.array(2 * zeros)[:, None]
    explanation = searched(world, y)
    (candidate,) = [t for t in explanation.steps[0].candidates if t.slug == CONSTANT]
    net = candidate.bayes - candidate.explained_by_instruments
    assert candidate.bayes > DEFAULT.evidence.minimum_first > net and (net > 0.0) == named
    assert explanation.final.slugs == ((CONSTANT,) if named else ())
    if named:  # drift explains nearly as much
        assert all(f.tentative for f in conclude(explanation).found if f.slug == CONSTANT)


def test_the_imperfect_form_of_an_effect_breeds_no_second_one():
    """Nature's form differs from the candidate's by a tenth, in a direction that another effect shares in part."""
    rng = np.random.default_rng(9)
    world = tubes()
    wrong = world.effects[CONSTANT] + 0.1 * smooth(rng, *world.effects[CONSTANT].shape)
    truth = World(world.base, world.effects | {CONSTANT: wrong})
    conclusion = conclude(searched(world, truth.truth(rng, (0.3, -0.2), **{CONSTANT: 4.0})))
    named = [f.slug for f in conclusion.found if f.slug != "unmodelled"]
    assert named == [CONSTANT]


def test_a_reading_that_stands_apart_is_not_counted():
    rng = np.random.default_rng(10)
    world = tubes(rows=120)
    y = world.truth(rng, (0.4, 0.2))
    y[1, 37] += 25.0
    program, fit = base_fit(world.program(y))
    assert [(one.recording, one.times) for one in program.outliers] == [("r1", (37.0,))]
    assert np.isinf(program.channels[1][0].sigma[37]) and np.isfinite(fit.objective)
    assert searched(world, y).final.slugs == ()


def test_validation_recordings_let_nothing_in_and_keep_out_what_they_contradict():
    """The fitted recordings show an effect; those for validation show that it is not there."""
    rng = np.random.default_rng(11)
    world = tubes(recordings=6, roles=("fit",) * 4 + ("validation",) * 2, effects=(CONSTANT, DELAY))
    honest = world.truth(rng, (0.1, 0.2), **{CONSTANT: 1.0})
    assert searched(world, honest).final.slugs == (CONSTANT,)
    contradicted = honest.copy()
    contradicted[4:] = world.truth(rng, (0.1, 0.2))[4:]
    conclusion = conclude(searched(world, contradicted))
    assert conclusion.found == [] and not conclusion.mismatch


def test_an_effect_is_named_although_the_stated_noise_is_too_large():
    """Four times: evidence is less than it could be, and what is there is still named."""
    rng = np.random.default_rng(12)
    world = tubes()
    explanation = searched(world, 0.25 * world.truth(rng, **{CONSTANT: 6.0}))
    assert explanation.final.slugs == (CONSTANT,) and explanation.named.left_out < 0.5
    assert searched(world, 0.25 * world.truth(rng)).final.slugs == ()
