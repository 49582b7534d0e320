"""How what is left is judged: recordings that a fit has not seen, slow drift, and what is said of names."""

import dataclasses

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, World, smooth, tubes

from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit import instrument_drift
from fitting.diagnose.fit.candidates import CandidateFit
from fitting.diagnose.fit.evidence import inflation_of
from fitting.diagnose.fit.instrument_drift import drift_columns, drifted_chi_square
from fitting.diagnose.fit.misread import Misread
from fitting.diagnose.fit.prediction import predictive_chi_square
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.explain import explain
from fitting.diagnose.search.steps import Explanation, LeaveOneOutEvidence, Named, Step
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict import unknown
from fitting.diagnose.verdict.assess import Assessment
from fitting.diagnose.verdict.conclude import _left_over, conclude
from fitting.diagnose.verdict.discrepancy_evidence import DiscrepancyEvidence, best_discrepancy
from fitting.diagnose.verdict.locate import _region, sized
from fitting.diagnose.verdict.probabilities import (
    Found,
    effects_found,
    none_likelier_than_acting,
    probabilities,
)
from fitting.diagnose.verdict.separating import SEPARATE_OF, separating
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.diagnose.verdict.unexplained import (
    chance_without_a_name,
    contradicted,
    discrepancy_probability,
    equalled,
    gain_over_named,
    lead_of_named,
    missed_beyond_drift,
    without_drift,
)
from fitting.diagnose.verdict.unknown import Signs, probability_of_unknown, signs_of
from fitting.report.diagnosis.text import next_experiment
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.pipeline import mimicked_in

ROWS = 200


def named(slugs=(CONSTANT,), before=300.0, after=100.0, evidence=None, validated=False, left_out=(np.nan, np.nan), stated=True):
    """An explanation that leaves stated objectives.

    Args:
        slugs: effects of its model.
        before, after: objective of the base model and of the model with the effects.
        evidence: by effect, the objective without it, and the log Bayes factors of it and its rivals.
        validated: whether half of the recordings were not fitted.
        left_out: reduced chi-square on values left out in turn, of the base model and of the model.
        stated: whether the size of the noise is.
    """
    world = tubes(roles=("fit", "fit", "validation", "validation") if validated else ())
    world = dataclasses.replace(world, stated=stated)
    program = world.program(world.truth(np.random.default_rng(2)))
    fit = Refitter(program).fit(())
    base = dataclasses.replace(fit, objective=before)
    final = dataclasses.replace(fit, slugs=slugs, objective=after)
    leave_one_out = {}
    for slug, (left, bayes) in (evidence or {s: (before, {s: 50.0}) for s in slugs}).items():
        far = lambda s, own=slug: final if s == own else dataclasses.replace(final, objective=before)  # noqa: E731
        candidates = [CandidateFit(s, far(s), b, 0.0) for s, b in sorted(bayes.items(), key=lambda item: -item[1])]
        rest = dataclasses.replace(fit, slugs=tuple(s for s in slugs if s != slug), objective=left)
        leave_one_out[slug] = LeaveOneOutEvidence(slug, rest, candidates)
    first = Step(base, None, [], left_out[0])
    return Explanation(program, base, Named(final, left_out[1], leave_one_out), [first], 0.001, True)


def test_drift_excuses_what_passes_for_noise_and_no_more():
    discrepancy = DiscrepancyEvidence("stress", "time", 3.0, 1.0, 1.05)
    assert without_drift(1.5, discrepancy) == pytest.approx(1.05)
    assert without_drift(3.9, discrepancy) == pytest.approx(3.9 - DEFAULT.drift.maximum_explained)
    assert without_drift(3.9, None) == 3.9


@pytest.mark.parametrize(("left", "told"), [(1.3, False), (1.6, False), (5.5, True), (9.0, True)])
def test_a_name_that_leaves_half_of_a_misfit_is_told_with_something_unknown(left, told):
    signs = signs_of(named(validated=True), None, None, [9.0, 9.0], [1.0, left], [1.0, 1.0])
    assert (probability_of_unknown(signs) >= DEFAULT.probability.beside) is told


@pytest.mark.parametrize(("before", "after", "kept"), [
    ([3.0, 9.0], [1.0, 1.8], 0.068),  # two standard deviations of 0.13 are chance
    ([3.0, 9.0], [1.0, 1.25], 0.0),
    ([3.0, 5.0], [2.0, 1.0], 0.371),  # what was fitted is missed
    ([3.0, 1.28], [1.0, 2.4], 1.0),  # names make unseen recordings worse
    ([3.0, 0.9], [1.0, 0.9], 0.0),
])  # fmt: skip
def test_the_share_that_names_keep_is_what_chance_does_not_leave(before, after, kept):
    signs = signs_of(named(validated=True), None, None, before, after, [1.0, 1.0])
    assert signs.kept == pytest.approx(kept, abs=0.002) and signs.outdone == 0.0
    assert signs_of(named(validated=True), None, None, before, after, [2.0, 2.4]).kept <= signs.kept  # as neighbouring rows differ


@pytest.mark.parametrize(("discrepancy", "left_out", "share"), [
    (1.0, (3.0, 2.0), 0.5), (2.0, (3.0, 1.0), 0.0), (1.0, (np.nan, np.nan), 0.0), (1.0, (np.nan, 2.0), 0.0), (0.9, (1.0, 1.1), 1.0),
])  # fmt: skip
def test_a_discrepancy_that_predicts_better_counts_by_its_share_of_the_misfit(discrepancy, left_out, share):
    rival = DiscrepancyEvidence("length", "time", 9.0, discrepancy, 1.0)
    assert signs_of(named(left_out=left_out), rival, None, [3.0, 3.0], [1.0, 1.0], [1.0, 1.0]).outdone == pytest.approx(share)


def test_no_sign_makes_something_unknown_less_likely_and_none_leaves_it_unlikely():
    shares = np.linspace(0.0, 1.0, 21)
    for signs in (
        [Signs(s, 0.2, 5.0) for s in shares],
        [Signs(0.2, s, 5.0) for s in shares],
        [Signs(0.2, 0.2, 100.0 * s) for s in shares],
    ):
        assert np.all(np.diff([probability_of_unknown(s) for s in signs]) >= 0.0)
    assert probability_of_unknown(Signs(0.0, 0.0, 0.0)) < 0.05 and probability_of_unknown(Signs(1.0, 1.0, 100.0)) > 0.9


@pytest.mark.parametrize(("bayes", "sign"), [(25.0, 25.0), (-3.0, 0.0)])
def test_evidence_of_a_discrepancy_beside_the_names_is_a_sign_of_its_own(monkeypatch, bayes, sign):
    """Even where names leave no more than noise, by any reduced chi-square."""
    beside = DiscrepancyEvidence("stress", "time", bayes, 1.0, 1.0)
    for worth, unit in ((60.0, 3.0), (2000.0, 100.0), (10.0, 1.0)):  # a right form may leave a twentieth
        monkeypatch.setattr(unknown, "evidence", lambda *_, worth=worth: worth)
        signs = signs_of(named(validated=True), None, beside, [9.0, 9.0], [1.0, 1.0], [1.0, 1.0])
        assert (signs.kept, signs.outdone, signs.beside) == (0.0, 0.0, pytest.approx(sign / unit))


def imperfect(strength):
    """The conclusion about an effect whose form in nature differs by two fifths, in a direction of its own."""
    world, rng = tubes(), np.random.default_rng(4)
    truth = world.effects | {CONSTANT: world.effects[CONSTANT] + 0.4 * smooth(rng, 4, 60, 1)}
    y = World(world.base, truth).truth(rng, **{CONSTANT: strength})
    return conclude(explain(world.program(y), rng))


def test_an_effect_whose_form_is_not_natures_has_something_unmodelled_beside_it():
    """It leaves more than noise, and less than makes no name trusted; the verdict says how much."""
    conclusion = imperfect(3.5)
    assert conclusion.left.trusted and "A reduced chi-square of" in verdict_sentences(conclusion)[0]
    first, beside = conclusion.found[:2]
    assert (first.slug, beside.slug, beside.confusable) == (CONSTANT, "unmodelled", [CONSTANT])
    assert beside.probability == pytest.approx(DEFAULT.probability.beside)
    assert beside.text.startswith(f"{CONSTANT} leaves more than noise")


def test_an_effect_that_something_without_a_name_looks_like_has_that_beside_it(monkeypatch):
    """The recordings are explained to the noise, so nothing in them speaks against the name."""
    world, rng = tubes(), np.random.default_rng(4)
    y = world.truth(rng, **{CONSTANT: 3.5})
    alone = conclude(explain(world.program(y), np.random.default_rng(5)))
    monkeypatch.setattr(CATALOGUE[CONSTANT], "lookalike", "a dent in the tube")
    found = conclude(explain(world.program(y), np.random.default_rng(5)))
    assert [f.slug for f in alone.found] == [CONSTANT] and [f.slug for f in found.found] == [CONSTANT, "unmodelled"]
    assert found.found[0].probability == pytest.approx(0.75 * alone.found[0].probability) and found.left is None
    assert found.found[1].probability == pytest.approx(DEFAULT.probability.beside)
    assert found.nothing + found.unknown + sum(p for p, _ in found.candidates.values()) == pytest.approx(1.0)
    assert f"A dent in the tube looks the same as {CONSTANT}." in verdict_sentences(found)
    assert "unmodelled" in found.explanation_set and found.remainder is None


def test_a_unit_that_may_be_wrong_is_asked_about_before_the_names():
    """No name is to be trusted then, however well it explains the recordings."""
    world, rng = tubes(), np.random.default_rng(4)
    explanation = explain(world.program(world.truth(rng, **{CONSTANT: 3.5})), np.random.default_rng(5))
    asked = Misread("pressure_kPa", 0.1, (), 4.8, 0.01, 1e-4)
    found = conclude(dataclasses.replace(explanation, misread=asked))
    assert [f.slug for f in found.found] == ["unmodelled", CONSTANT]
    assert found.found[0].probability == pytest.approx(DEFAULT.probability.tentative)
    assert verdict_sentences(found)[0].startswith(asked.text) and found.found[0].text.startswith(asked.text)
    assert next_experiment(found).startswith("None before it is known what pressure_kPa holds.")


@pytest.mark.parametrize(("delay", "shares"), [(1.0, True), (4.0, False)])
def test_a_weaker_effect_shares_the_doubt_of_the_name_beside_it(monkeypatch, delay, shares):
    """Its evidence was computed beside a name in whose place something else may act."""
    world, rng = tubes(), np.random.default_rng(4)
    y = world.truth(rng, **{CONSTANT: 2.0, DELAY: delay})
    alone = conclude(explain(world.program(y), np.random.default_rng(5)))
    monkeypatch.setattr(CATALOGUE[CONSTANT], "lookalike", "a dent in the tube")
    found = conclude(explain(world.program(y), np.random.default_rng(5)))
    before, after = ({f.slug: f.probability for f in one.found} for one in (alone, found))
    evidence = {f.slug: f.bayes for f in found.found}
    assert (evidence[DELAY] < evidence[CONSTANT]) is shares
    assert after[CONSTANT] == pytest.approx(0.75 * before[CONSTANT])
    assert after[DELAY] == pytest.approx((0.75 if shares else 1.0) * before[DELAY])


def test_a_lookalike_counts_in_the_kinds_of_recordings_that_it_is_told_for():
    stiffening, shakedown = CATALOGUE["strain_stiffening"], CATALOGUE["cyclic_shakedown"]
    assert [mimicked_in(stiffening, kind) for kind in "AET"] == [False, False, True]
    assert [mimicked_in(shakedown, kind) for kind in "ASWT"] == [True, True, True, False]
    assert not mimicked_in(CATALOGUE["gravity"], "A")


def test_an_effect_that_leaves_far_more_than_noise_is_not_first():
    conclusion = imperfect(6.0)
    assert conclusion.found[0].slug == "unmodelled" and conclusion.left.reduced_chi2 > 3.0 and not conclusion.left.trusted
    assert conclusion.unknown >= DEFAULT.probability.tentative


@pytest.mark.parametrize(("discrepancy", "left", "units"), [
    (1.0, 1.2, 4.0), (1.0, 1.06, 1.2), (1.0, 1.04, 0.0), (1.3, 1.0, 0.0), (1.0, np.nan, 0.0), (None, 1.2, 0.0),
])  # fmt: skip
def test_a_discrepancy_that_predicts_better_speaks_against_a_name(discrepancy, left, units):
    """By what a held-out log-likelihood of 5 is for an effect: in units of it, once as much."""
    explanation = named(left_out=(3.0, 1.0))
    program = explanation.program
    unit = DEFAULT.evidence.minimum_difference * inflation_of(program, explanation.final) / (0.5 * program.observations(program.fitted))
    scaled = lambda x: 1.0 + (x - 1.0) * unit / 0.05  # noqa: E731
    explanation.named.left_out = scaled(left)
    rival = None if discrepancy is None else DiscrepancyEvidence("length", "time", 9.0, scaled(discrepancy), 1.0)
    assert gain_over_named(explanation, rival) == pytest.approx(units * DEFAULT.evidence.minimum_difference)


@pytest.mark.parametrize(("ahead", "bayes", "told"), [(3.9, 9.0, True), (4.1, 9.0, False), (-50.0, 4.1, True), (-50.0, 3.9, False)])
def test_a_name_is_to_be_told_from_a_function_that_is_not_drift(ahead, bayes, told):
    """By a log-likelihood of 4 in what was left out; the function has an evidence of 4 beyond that of drift."""
    explanation = named(left_out=(3.0, 1.0))
    unit = inflation_of(explanation.program, explanation.final) / (0.5 * explanation.program.observations(explanation.program.fitted))
    rival = DiscrepancyEvidence("length", "time", bayes, 1.0 + ahead * unit, 1.0)
    assert equalled(explanation, rival) is told and lead_of_named(explanation, rival) == pytest.approx(ahead)
    assert not equalled(explanation, None) and not equalled(named(), rival), "no race, no doubt"


@pytest.mark.parametrize(("signs", "lost", "said"), [
    (Signs(0.0, 0.3, 0.0), 12.0, "function of pressure rate without a name predicts recordings that are left out better than"),
    (Signs(0.0, 0.0, 0.0), 0.0, "left out about as well as"),
    (Signs(0.2, 0.1, 0.0), 12.0, "leaves more than noise"),  # which is the larger share
])  # fmt: skip
def test_what_is_said_where_a_discrepancy_predicts_as_well(signs, lost, said):
    explanation, rival = named(), DiscrepancyEvidence("length", "pressure_rate", 9.0, 1.0, 1.0)
    judged = Assessment(True, True, (0.001, True), 0.25, True, (), [0.9, 0.9], signs, lost, rival, None, None, equalled=True)
    found = _left_over(explanation, 0.25, judged, effects_found(explanation, 0.25))
    assert found.bayes == lost and said in found.text


@pytest.mark.parametrize("alike", [True, False])
def test_a_name_that_a_function_of_one_driver_equals_is_tentative(alike):
    """The effect is a function of the pressure, so one without a name predicts left-out parts as well.

    An effect with a course of its own in every recording is far ahead of any function of one driver.
    """
    world, rng = tubes(), np.random.default_rng(1)
    if alike:
        along = np.cos(3e-3 * world.drivers["pressure"])[:, :, None]
        world = World(world.base, world.effects | {CONSTANT: along})
    explanation = explain(world.program(world.truth(rng, **{CONSTANT: 1.0})), rng)
    lead = lead_of_named(explanation, best_discrepancy(explanation.program, explanation.base))
    found = conclude(explanation)
    assert (abs(lead) < DEFAULT.evidence.minimum_difference) if alike else lead > 50.0
    assert [f.slug for f in found.found] == [CONSTANT, *(["unmodelled"] if alike else [])]
    assert found.found[0].tentative is alike and found.found[0].probability > (0.65 if alike else 0.95)
    if alike:
        assert found.found[1].probability == pytest.approx(1.0 - DEFAULT.probability.tentative)
        assert found.found[1].text.startswith("A smooth function of pressure without a name predicts")


@pytest.mark.parametrize(("bayes", "told"), [(25.0, True), (5.0, False)])
def test_a_discrepancy_beside_the_names_is_said_with_its_evidence(bayes, told):
    further = DiscrepancyEvidence("silicone_stiffness", "time", bayes, 1.0, 1.0)
    judged = Assessment(True, True, (0.001, True), 0.25, True, (), [1.2, 1.2], Signs(0.1, 0.0, bayes), 0.0, None, further, None)
    found = _left_over(named(), 0.25, judged, effects_found(named(), 0.25))
    said = f"Beside {CONSTANT}, a change of silicone stiffness with time has a log Bayes factor of 25"
    assert found.text.startswith(said) is told and ("leaves more than noise" in found.text) is not told
    assert found.bayes >= (bayes if told else 0.0)


LEAVES_MORE, NOISE_ALONE = 2.0, 1.0


@pytest.mark.parametrize(("second", "left", "least", "most"), [
    (200.0, LEAVES_MORE, 0.45, 0.55), (700.0, LEAVES_MORE, 0.6, 0.8), (2500.0, LEAVES_MORE, 0.95, 1.0),
    (100.0, NOISE_ALONE, 0.45, 0.55), (200.0, NOISE_ALONE, 0.7, 0.85), (700.0, NOISE_ALONE, 0.95, 1.0),
])  # fmt: skip
def test_a_further_effect_that_explains_little_may_be_what_the_form_of_the_first_leaves(second, left, least, most):
    """Of 5000 of misfit explained: evidence of 200 is beyond doubt for something, not for a second effect.

    Where noise alone is left the forms are right to a few percent. Two effects of 2151 and 1984 had 0.50 each.
    """
    alone = {CONSTANT: 6000.0 - second, DELAY: 1000.0 + second}
    evidence = {slug: (left, {slug: left - 1000.0}) for slug, left in alone.items()}
    explanation = named((CONSTANT, DELAY), 6000.0, 1000.0, evidence, left_out=(9.0, left))
    first, further = effects_found(explanation, 0.01)
    assert first.probability > (0.8 if second < 2000.0 else 0.95)
    assert least < further.probability < most


def test_the_strongest_effect_is_not_what_the_form_of_another_leaves():
    """It had 0.77 beside one of less evidence, and was the strongest with 0.98."""
    alone = {CONSTANT: (1500.0, {CONSTANT: 400.0}), DELAY: (1300.0, {DELAY: 250.0})}
    first, further = effects_found(named((CONSTANT, DELAY), 6000.0, 1000.0, alone, left_out=(9.0, 2.0)), 0.01)
    assert first.probability > 0.95 and further.probability == pytest.approx(0.5)


def test_no_effect_is_likelier_the_strongest_than_it_acts_at_all():
    """A report had 0.98 for the strongest effect, of which its verdict said 0.77."""
    first, second = (Found(slug, p, 50.0, {}, [], "") for slug, p in ((CONSTANT, 0.77), (DELAY, 0.5)))
    before = {CONSTANT: (0.93, 50.0), DELAY: (0.0, 9.0), ANOTHER: (0.02, 3.0), "gravity": (0.01, 2.0)}
    after, nothing, unknown = none_likelier_than_acting(before, 0.01, 0.03, [first, second])
    assert after[CONSTANT] == (0.77, 50.0) and after[DELAY] == (0.0, 9.0)
    told = [after[ANOTHER][0], after["gravity"][0], nothing, unknown]
    np.testing.assert_allclose(told, np.array([0.02, 0.01, 0.01, 0.03]) * 0.23 / 0.07)
    certain = [Found(CONSTANT, 0.98, 50.0, {}, [], "")]
    assert none_likelier_than_acting(before, 0.01, 0.03, certain) == (before, 0.01, 0.03)
    alone = none_likelier_than_acting({CONSTANT: (0.95, 50.0)}, 0.0, 0.05, [first])  # something unknown has the rest
    assert alone == ({CONSTANT: (0.77, 50.0)}, 0.0, pytest.approx(0.23))


def test_a_doubt_of_the_name_makes_no_refuted_rival_likely():
    """A name at its bound had lost 0.3 to a rival of 5,700 nats less, since that was the best of the others."""
    name = Found(CONSTANT, 0.68, 7216.0, {}, [], "")
    before = {CONSTANT: (0.98, 7216.0), ANOTHER: (1e-7, 1494.0), "gravity": (1e-9, 20.0)}
    after, nothing, unknown = none_likelier_than_acting(before, 0.0, 0.02, [name])
    assert after[ANOTHER][0] < 1e-5 and unknown == pytest.approx(0.32, abs=1e-4)
    assert sum(p for p, _ in after.values()) + nothing + unknown == pytest.approx(1.0, abs=1e-6)


def test_what_a_refused_rival_has_more_makes_it_no_likelier():
    """Drift, left-out recordings or those never fitted spoke against it."""
    explanation = named((CONSTANT,), 300.0, 100.0, {CONSTANT: (300.0, {DELAY: 65.0, CONSTANT: 50.0})})
    (found,) = effects_found(explanation, 0.0)
    assert found.probability == pytest.approx(0.5) and found.confusable == [DELAY]
    candidates, _ = probabilities(explanation, True, 0.0)
    assert candidates[CONSTANT] == (pytest.approx(0.5), 50.0) and candidates[DELAY] == (pytest.approx(0.5), 65.0)


def test_a_rival_without_luck_is_as_good_as_an_effect_is_without_its_own():
    """A delay that averages noise of an input, and a rival that does not."""
    explanation = named((DELAY,), 300.0, 100.0, {DELAY: (300.0, {DELAY: 64.0, CONSTANT: 43.0})})
    own = explanation.leave_one_out[0].own
    own.explained_by_instruments = 18.0
    (found,) = effects_found(explanation, 0.0)
    assert found.probability > 0.99 and found.confusable == []
    own.explained_by_inputs = 18.0
    (found,) = effects_found(explanation, 0.0)
    assert found.probability < 0.85 and found.confusable == [CONSTANT] and found.bayes == 64.0


def test_an_effect_is_not_certain_that_drift_or_a_contending_explanation_may_stand_for():
    explanation = named((CONSTANT,), 300.0, 100.0, {CONSTANT: (300.0, {CONSTANT: 200.0})})
    entered = explanation.leave_one_out[0].own
    assert effects_found(explanation, 0.01)[0].probability > 0.95
    entered.bayes, entered.explained_by_instruments = 12.0, 6.0  # a further one, of which drift makes half
    assert effects_found(explanation, 0.01)[0].probability == 0.7
    entered.bayes, entered.explained_by_instruments = 9.0, 0.0  # enough to enter first, and some null in a hundred gets as far
    assert effects_found(explanation, 0.01)[0].probability == 0.7
    entered.bayes = 200.0
    explanation.contending = [(CONSTANT, DELAY)]  # it is part of both
    assert effects_found(explanation, 0.01)[0].probability > 0.95
    explanation.contending = [(ANOTHER, DELAY), (ANOTHER, CONSTANT)]
    found = effects_found(explanation, 0.01)[0]
    assert found.probability == 0.5 and found.confusable == [ANOTHER, DELAY]


@pytest.mark.parametrize(("worth", "signature", "unknown"), [
    (6.0, 0.5, None), (10.0, 0.5, 0.7), (30.0, 0.5, 0.95), (10.0, 0.001, 0.95),
])  # fmt: skip
def test_what_only_a_nameless_correction_of_little_evidence_says_is_tentative(worth, signature, unknown):
    explanation = named((), 300.0, 300.0)
    explanation.p_value, explanation.p_is_bound = signature, signature == 0.001
    discrepancy = DiscrepancyEvidence("force", "time", worth, 1.0, 1.5)
    base = [1.5, 1.5]
    assert contradicted(explanation, base, discrepancy, [1.0, 1.0]) == (unknown is not None)
    if unknown:
        assert discrepancy_probability(explanation, base, discrepancy, [1.0, 1.0]) == unknown


@pytest.mark.parametrize(("misfit", "worth", "chance", "is_bound"), [
    (1.0, 5.0, 0.8, False), (1.0, 9.0, 3.0 * np.exp(-9.0), True), (40.0, 5.0, 0.0, False),
])  # fmt: skip
def test_a_mismatch_without_a_name_is_as_likely_by_chance_as_what_decides_it(misfit, worth, chance, is_bound):
    """Scores of effects that are not there may be quite likely. A Bayes factor of k has a chance of at most 1/k."""
    explanation = named((), 300.0, 300.0)
    explanation.p_value, explanation.p_is_bound = 0.4, False
    found = chance_without_a_name(explanation, misfit, DiscrepancyEvidence("force", "time", worth, 1.0, 1.5))
    assert found == (pytest.approx(chance), is_bound)
    assert chance_without_a_name(explanation, 1.0, None) == (0.8, False)


@pytest.mark.parametrize(("is_bound", "fitted", "stated", "said"), [
    (True, 2.4, True, True), (False, 2.4, True, False), (True, 1.3, True, False), (True, 2.4, False, False),
])  # fmt: skip
def test_fitted_recordings_alone_decide_where_no_simulated_null_comes_near(is_bound, fitted, stated, said):
    """Validation recordings agree with the base model: they do not go where something is missing."""
    explanation = named((), 300.0, 300.0, stated=stated)
    explanation.p_value, explanation.p_is_bound = 0.001, is_bound
    assert contradicted(explanation, [fitted, 0.99], None, [1.0, 1.0]) == said


@pytest.mark.parametrize(("shape", "stated", "p_value", "said"), [
    ("fast", True, 0.001, True), ("slow", True, 0.001, False), ("fast", False, 0.001, False), ("fast", True, 0.2, False), ("none", True, 0.001, False),
])  # fmt: skip
def test_validation_recordings_alone_decide_where_open_numbers_and_drift_do_not_explain_them(shape, stated, p_value, said):
    """Of the fitted recordings, drift explains all that stands out. A slow misfit of one noise may be a drift, too."""
    world = dataclasses.replace(tubes(roles=("fit", "fit", "validation", "validation")), stated=stated)
    y = world.truth(np.random.default_rng(2))
    y[2:] += {"fast": (-1.0) ** np.arange(y.shape[1]), "slow": 1.0, "none": 0.0}[shape]
    program = world.program(y)
    fit = Refitter(program).fit(())
    left = predictive_chi_square(program, fit, program.unseen)
    assert left < 1.3 if shape == "none" else left > 1.5
    explanation = Explanation(program, fit, Named(fit), [], p_value, True)
    drifting = DiscrepancyEvidence("length", "time", 1.0, 1.0, 1.0)
    assert contradicted(explanation, [1.3, left], drifting, [1.0, 1.0]) == said
    assert missed_beyond_drift(program, fit) == (shape == "fast")


def test_what_drift_explains_of_validation_recordings_takes_no_run_and_is_found_once(monkeypatch):
    world = tubes(roles=("fit", "fit", "validation", "validation"))
    y = world.truth(np.random.default_rng(2))
    y[2:] += (-1.0) ** np.arange(y.shape[1])
    program = world.program(y)
    fit = Refitter(program).fit(())
    found = []
    monkeypatch.setattr(Program, "evaluate", lambda *_, **__: pytest.fail("a run"))
    monkeypatch.setattr(instrument_drift, "drift_columns", lambda *given: found.append(drift_columns(*given)) or found[-1])
    first = drifted_chi_square(program, fit, program.unseen)
    assert first > 1.5 and drifted_chi_square(program, fit, program.unseen) == first and len(found) == 1


@pytest.mark.parametrize(("hidden", "together"), [(True, True), (False, False)])
def test_all_recordings_together_name_a_set_only_if_it_has_more_evidence_on_them(hidden, together):
    """Validation recordings keep most of their misfit by an effect that they alone show, or by something unknown."""
    rng = np.random.default_rng(3)
    world = tubes(recordings=5, roles=("fit",) * 3 + ("validation",) * 2, effects=(CONSTANT, DELAY, ANOTHER))
    world.effects[ANOTHER][:3] = 0.0
    y = world.truth(rng, (0.5, 0.2), **{CONSTANT: 2.0, ANOTHER: [2.0, 1.0] if hidden else [0.0, 0.0]})
    y[3:] += 0.0 if hidden else 4.0 * np.sin(0.6 * np.arange(y.shape[1]))
    found = explain(world.program(y), np.random.default_rng(0))
    assert found.together == together
    assert set(found.final.slugs) == ({CONSTANT, ANOTHER} if hidden else {CONSTANT})


@pytest.mark.parametrize("far", [False, True])
def test_all_recordings_are_not_searched_together_where_no_set_comes_near_the_noise_of_the_fitted_ones(far):
    """The search would cost as much again, and no name is to be trusted in any case."""
    rng = np.random.default_rng(3)
    world = tubes(recordings=5, roles=("fit",) * 3 + ("validation",) * 2, effects=(CONSTANT, DELAY, ANOTHER))
    world.effects[ANOTHER][:3] = 0.0
    y = world.truth(rng, (0.5, 0.2), **{CONSTANT: 4.0, ANOTHER: [5.0, 4.0]})
    y += 4.0 * np.sin(0.6 * np.arange(y.shape[1])) if far else 0.0
    said = []
    found = explain(world.program(y), np.random.default_rng(0), said.append)
    assert CONSTANT in found.final.slugs
    assert any("recordings for validation" in one for one in said) is not far
    assert found.together is not far


@pytest.mark.parametrize(
    ("kind", "driver", "value", "said"),
    [
        ("spring", "force", 1.24, "1.24 N"), ("spring", "elongation", 0.012, "12 mm"), ("spring", "xi0", 0.5, "0.5"),
        ("actuator", "pressure", 2.5e4, "25 kPa"), ("actuator", "pressure_rate", 1200.0, "1.2e+03 Pa/s"),
        ("elastomer", "max_strain", 0.4, "0.4"), ("wire", "time", 60.0, "60 s"), ("wire", "temperature", 31.0, "31 degC"),
    ],
)  # fmt: skip
def test_limits_of_a_place_have_their_unit(kind, driver, value, said):
    """A place was told as `force > 1.24`."""
    assert sized(kind, driver, value) == said


def test_a_place_is_told_with_its_unit():
    x = np.linspace(0.0, 2.0, 200)
    assert _region("spring", "force", x, np.where(x > 1.24, 5.0, 0.1)).startswith("force > 1.3 N (")


@pytest.mark.parametrize("letter", ["S", "W", "E"])
def test_no_pressure_is_asked_of_a_specimen_without_any(letter):
    """A spring was told to make ten cycles of pressure."""
    slugs = [slug for slug, effect in CATALOGUE.items() if letter in effect.kinds]
    asked = " ".join(separating([slug], letter) for slug in slugs)
    assert not any(word in asked for word in ("pressure", "actuator", "tube"))
    assert "pressure" in separating(["cyclic_shakedown"], "A")
    assert set(SEPARATE_OF[letter]) <= set(slugs)
