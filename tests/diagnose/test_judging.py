"""How what is left is judged: recordings that a fit has not seen, slow drift, and what is said of names."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit.misfit import negative_log_predictive_density, predictive_chi_square, reduced
from fitting.diagnose.search.steps import LeaveOneOutEvidence, Named
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.conclude import _left_over
from fitting.diagnose.verdict.discrepancy_evidence import DiscrepancyEvidence
from fitting.diagnose.verdict.probabilities import effects_found, probabilities
from fitting.diagnose.verdict.unexplained import (
    contradicted,
    discrepancy_probability,
    helps_nobody,
    leaves_more,
    outdone,
    refuted,
    steady,
    unexplained,
)

ROWS = 200


def judged(shift, sd, noise=0.0):
    """Reduced chi-square of an unseen recording that is off as a constant would shift it, that is known to `sd`."""
    A = np.ones((ROWS, 1))
    r = shift + noise * np.random.default_rng(1).standard_normal(ROWS)
    evaluation = SimpleNamespace(joined=lambda weight: (r * weight[1], A * weight[1]), chi2=lambda weight: float(r @ r))
    fit = SimpleNamespace(evaluation=evaluation, covariance=np.array([[sd**2]]), u=np.zeros(1), free=np.array([0]))
    program = SimpleNamespace(
        fitted=np.array([True, False]),
        unknowns=SimpleNamespace(low=np.array([-4.0]), high=np.array([4.0])),
        observations=lambda chosen: ROWS,
    )
    return [f(program, fit, np.array([False, True])) for f in (predictive_chi_square, reduced, negative_log_predictive_density)]


def test_an_open_constant_is_no_misfit_of_recordings_that_need_it():
    allowed, plain, _ = judged(2.0, 1.0, 1.0)
    assert plain > 4.0
    assert allowed == pytest.approx(1.0, abs=0.2)


def test_a_constant_that_the_fit_knows_is_none_that_others_may_move():
    allowed, plain, _ = judged(2.0, 0.01)
    assert allowed == pytest.approx(plain, rel=0.05)


def test_no_constant_leaves_its_bounds_to_excuse_a_recording():
    allowed, plain, _ = judged(20.0, 1.0)
    assert allowed > 16.0**2
    assert allowed < plain


def test_constants_that_a_fit_leaves_open_but_for_a_sum_are_judged_as_well():
    """Their covariance is singular to rounding, and its inverse of no sign."""
    apart, together = np.array([1.0, -1.0]) / np.sqrt(2.0), np.array([1.0, 1.0]) / np.sqrt(2.0)
    covariance = 1e6 * np.outer(apart, apart) + 1e-13 * np.outer(together, together)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(np.linalg.inv(covariance))
    A, r = np.ones((ROWS, 2)), np.full(ROWS, 2.0)
    program = SimpleNamespace(
        fitted=np.array([True, False]),
        unknowns=SimpleNamespace(low=np.full(2, -4.0), high=np.full(2, 4.0)),
        observations=lambda chosen: ROWS,
    )
    evaluation = SimpleNamespace(joined=lambda weight: (r * weight[1], A * weight[1]), chi2=lambda weight: float(r @ r))
    fit = SimpleNamespace(evaluation=evaluation, covariance=covariance, u=np.zeros(2), free=np.arange(2))
    assert predictive_chi_square(program, fit, np.array([False, True])) == pytest.approx(4.0, rel=0.01)


def test_a_prediction_is_judged_by_the_density_that_it_gave_what_came():
    """Errors that share a shift of known spread, against the joint density of a Gaussian."""
    shift, sd = 0.7, 0.4
    r = shift + np.random.default_rng(1).standard_normal(ROWS)
    covariance = np.eye(ROWS) + 1.0 / (sd**-2 + 12.0 / 8.0**2)
    density = 0.5 * (r @ np.linalg.solve(covariance, r) + np.linalg.slogdet(covariance)[1])
    assert judged(shift, sd, 1.0)[2] == pytest.approx(density, abs=0.05)


def test_drift_excuses_what_passes_for_noise_and_no_more():
    generic = DiscrepancyEvidence("stress", "time", 3.0, 1.0, 1.05)
    assert steady(1.5, generic) == pytest.approx(1.05)
    assert steady(3.9, generic) == pytest.approx(3.9 - DEFAULT.drift.maximum_explained)
    assert steady(3.9, None) == 3.9


@pytest.mark.parametrize(("left", "first"), [(1.3, "name"), (2.1, "name"), (3.2, "unmodelled"), (6.0, "unmodelled")])
def test_a_name_that_leaves_a_quarter_of_a_misfit_gives_way(left, first):
    unknown = unexplained([9.0, 9.0], [1.0, left], [1.0, 1.0], [1.2, 1.2])
    assert (unknown > 0.5) == (first == "unmodelled")


@pytest.mark.parametrize(("before", "after", "over"), [
    ([3.0, 9.0], [1.02, 1.5], True),  # what was not fitted is missed by an eighth of its misfit
    ([3.0, 5.0], [1.02, 1.25], False),  # it is not, to 0.3
    ([3.0, 5.0], [1.5, 1.0], True),  # what was fitted is missed
    ([3.0, 60.0], [1.02, 3.5], False),  # a right form may leave a twentieth
    ([3.0, 1.0], [1.02, 1.25], False),
])  # fmt: skip
def test_a_model_that_does_not_hold_leaves_something_unmodelled(before, after, over):
    assert leaves_more(before, after, [1.0, 1.0]) is over
    assert not leaves_more(before, after, [1.3, 3.4])  # neighbouring rows differ by as much


@pytest.mark.parametrize(("before", "after", "idle"), [(3.9, 4.1, True), (9.0, 4.0, False), (1.2, 1.2, False)])
def test_a_name_that_helps_no_recording_that_was_not_fitted_is_doubted(before, after, idle):
    unasked = (np.nan, np.nan)
    assert helps_nobody([9.0, before], [1.0, after], [1.0, 1.0], unasked) is idle
    assert not helps_nobody([9.0, before], [1.0, after], [1.0, 4.0], unasked)
    assert helps_nobody([9.0, 9.0], [1.0, 1.4], [1.0, 1.0], (before, after)) is idle  # left out in turn
    assert not helps_nobody([9.0, 9.0], [1.0, 1.0], [1.0, 1.0], (before, after))  # but all else is explained


@pytest.mark.parametrize(
    ("before", "after", "validated", "doubt"),
    [
        (1.28, 1.40, True, DEFAULT.verdict.refuted_unknown),  # missed by more than without the effects
        (1.28, 1.25, True, 0.0),
        (0.95, 1.01, True, 0.0),  # as well as noise lets them be
        (2.50, 2.40, True, 0.0),
        (1.28, 1.40, False, 0.0),  # every recording was fitted
    ],
)
def test_names_that_make_validation_recordings_worse_are_refuted(before, after, validated, doubt):
    """Although those that were left out in turn are predicted better."""
    evaluation = SimpleNamespace(chi2=lambda chosen: 1.0)
    program = SimpleNamespace(
        fitted=np.array([True, not validated]),
        unknowns=SimpleNamespace(base=np.array([0])),
        observations=lambda chosen: 1,
    )
    fit = SimpleNamespace(u=np.zeros(1), evaluation=evaluation)
    explanation = SimpleNamespace(program=program, final=fit, left_out=(2.0, 1.0))
    assert refuted(explanation, None, [1.2, 1.3], [2.0, before], [1.0, after]) == doubt


def test_what_a_named_effect_leaves_is_said_beside_it():
    program = SimpleNamespace(fitted=np.array([True, False]), unseen=np.array([False, True]), observations=lambda m: 100.0)
    explanation = SimpleNamespace(program=program)
    found = _left_over(explanation, 0.3, [1.1, 1.6], [SimpleNamespace(slug="gravity")], None, 0.0)
    assert (found.slug, found.probability, found.confusable) == ("unmodelled", 0.3, ["gravity"])
    assert found.bayes == pytest.approx(0.5 * 0.6 * 100.0)
    assert found.text.startswith("gravity leaves more than noise")


@pytest.mark.parametrize(("generic", "left", "gain"), [
    (1.0, 1.2, 20.0), (1.0, 1.06, 6.0), (1.0, 1.04, 0.0), (1.3, 1.0, 0.0), (1.0, np.nan, 0.0), (None, 1.2, 0.0),
])  # fmt: skip
def test_a_nameless_correction_that_predicts_better_speaks_against_a_name(monkeypatch, generic, left, gain):
    """Of 400 values, whose misfit counts by half."""
    monkeypatch.setattr("fitting.diagnose.verdict.unexplained.inflation_of", lambda program, fit: 2.0)
    program = SimpleNamespace(fitted=None, observations=lambda mask: 400.0)
    race = None if generic is None else SimpleNamespace(left_out=generic)
    assert outdone(SimpleNamespace(program=program, final=None, left_out=(3.0, left)), race) == pytest.approx(gain)


def test_what_is_said_where_a_nameless_correction_predicts_better():
    program = SimpleNamespace(fitted=np.array([True]), unseen=np.array([True]), observations=lambda mask: 400.0)
    named, race = [SimpleNamespace(slug="gravity")], SimpleNamespace(driver="pressure_rate")
    found = _left_over(SimpleNamespace(program=program), 0.25, [0.9, 0.9], named, race, 12.0)
    assert found.bayes == 12.0 and "function of pressure rate without a name predicts" in found.text


@pytest.mark.parametrize(("second", "least", "most"), [(200.0, 0.45, 0.55), (700.0, 0.6, 0.8), (2500.0, 0.95, 1.0)])
def test_a_further_effect_that_explains_little_may_be_what_the_form_of_the_first_leaves(second, least, most):
    """Of 5000 of misfit explained: evidence of 200 is beyond doubt for something, not for a second effect."""

    def trial(slug, bayes, objective):
        return SimpleNamespace(slug=slug, bayes=bayes, adrift=0.0, averaged=0.0, fit=SimpleNamespace(objective=objective, u=np.zeros(0)))

    slugs = ("self_heating_rate", "channel_lag")
    others = {"self_heating_rate": 6000.0 - second, "channel_lag": 1000.0 + second}
    standings = {
        slug: LeaveOneOutEvidence(slug, SimpleNamespace(objective=alone), [trial(slug, alone - 1000.0, 1000.0)])
        for slug, alone in others.items()
    }
    program = SimpleNamespace(unknowns=SimpleNamespace(of=lambda names: np.zeros(0, int)))
    final = SimpleNamespace(slugs=slugs, at_bound=(), objective=1000.0, u=np.zeros(0))
    explanation = SimpleNamespace(
        program=program, final=final, base=SimpleNamespace(objective=6000.0), named=Named(final, 1.0, standings), contending=[]
    )
    first, further = effects_found(explanation, 0.01)
    assert first.probability > (0.8 if second < 2000.0 else 0.95)
    assert least < further.probability < most


def test_what_a_refused_rival_has_more_makes_it_no_likelier(monkeypatch):
    """Drift, left-out recordings or those never fitted spoke against it."""
    model = SimpleNamespace(slugs=("gravity",), at_bound=(), objective=100.0, u=np.zeros(0))
    own, rival = (SimpleNamespace(slug=s, bayes=b, adrift=0.0, averaged=0.0, fit=model) for s, b in (("gravity", 50.0), ("thick_wall", 65.0)))
    standing = LeaveOneOutEvidence("gravity", SimpleNamespace(slugs=(), objective=300.0), [rival, own])
    explanation = SimpleNamespace(
        program=SimpleNamespace(unknowns=SimpleNamespace(of=lambda names: np.zeros(0, int), slugs=["gravity", "thick_wall"])),
        final=model, base=SimpleNamespace(objective=300.0), named=Named(model, 1.0, {"gravity": standing}),
        standings=[standing], leading=standing, contending=[],
    )  # fmt: skip
    monkeypatch.setattr("fitting.diagnose.verdict.probabilities._alike", lambda *_: False)
    (found,) = effects_found(explanation, 0.0)
    assert found.probability == pytest.approx(0.5) and found.confusable == ["thick_wall"]
    candidates, _ = probabilities(explanation, True, 0.0)
    assert candidates["gravity"] == (pytest.approx(0.5), 50.0) and candidates["thick_wall"] == (pytest.approx(0.5), 65.0)


def test_a_rival_without_luck_is_as_good_as_an_effect_is_without_its_own(monkeypatch):
    """A delay that averages noise of a temperature, and a hysteresis that does not."""
    model = SimpleNamespace(slugs=("channel_lag",), at_bound=(), objective=100.0, u=np.zeros(0))
    own = SimpleNamespace(slug="channel_lag", bayes=64.0, adrift=18.0, averaged=0.0, fit=model)
    rival = SimpleNamespace(slug="transformation_hysteresis", bayes=43.0, fit=model)
    standing = LeaveOneOutEvidence("channel_lag", SimpleNamespace(slugs=(), objective=300.0), [own, rival])
    explanation = SimpleNamespace(
        program=SimpleNamespace(unknowns=SimpleNamespace(of=lambda names: np.zeros(0, int))),
        final=model, base=SimpleNamespace(objective=300.0), named=Named(model, 1.0, {"channel_lag": standing}), contending=[],
    )  # fmt: skip
    monkeypatch.setattr("fitting.diagnose.verdict.probabilities._alike", lambda *_: False)
    (found,) = effects_found(explanation, 0.0)
    assert found.probability > 0.99 and found.confusable == []
    own.averaged = 18.0
    (found,) = effects_found(explanation, 0.0)
    assert found.probability < 0.85 and found.confusable == ["transformation_hysteresis"] and found.bayes == 64.0


def test_an_effect_is_not_certain_that_drift_or_a_contending_explanation_may_stand_for():
    model = SimpleNamespace(objective=100.0, u=np.zeros(0))
    entered = SimpleNamespace(slug="gravity", bayes=200.0, adrift=0.0, averaged=0.0, fit=model)
    first = LeaveOneOutEvidence("gravity", SimpleNamespace(objective=300.0), [entered])
    explanation = SimpleNamespace(
        program=SimpleNamespace(unknowns=SimpleNamespace(of=lambda names: np.zeros(0, int))),
        final=SimpleNamespace(slugs=("gravity",), at_bound=(), objective=100.0, u=np.zeros(0)),
        base=SimpleNamespace(objective=300.0),
        named=Named(model, 1.0, {"gravity": first}),
        contending=[],
    )
    assert effects_found(explanation, 0.01)[0].probability > 0.95
    entered.bayes, entered.adrift = 12.0, 6.0  # a further one, of which drift makes half
    assert effects_found(explanation, 0.01)[0].probability == 0.7
    entered.bayes, entered.adrift = 9.0, 0.0  # enough to enter first, and some null in a hundred gets as far
    assert effects_found(explanation, 0.01)[0].probability == 0.7
    entered.bayes = 200.0
    explanation.contending = [("gravity", "tip_contact")]  # it is part of both
    assert effects_found(explanation, 0.01)[0].probability > 0.95
    explanation.contending = [("thick_wall", "tip_contact"), ("thick_wall", "gravity")]
    found = effects_found(explanation, 0.01)[0]
    assert found.probability == 0.5 and found.confusable == ["thick_wall", "tip_contact"]


@pytest.mark.parametrize(("worth", "signature", "unknown"), [
    (6.0, 0.5, None), (10.0, 0.5, 0.7), (30.0, 0.5, 0.9), (10.0, 0.001, 0.9),
])  # fmt: skip
def test_what_only_a_nameless_correction_of_little_evidence_says_is_tentative(worth, signature, unknown):
    program = SimpleNamespace(noise_stated=True, fitted=np.ones(2, bool), observations=lambda chosen: 500)
    explanation = SimpleNamespace(program=program, p_value=signature, p_is_bound=signature == 0.001)
    generic = DiscrepancyEvidence("force", "time", worth, 1.0, 1.5)
    base = [1.5, 1.5]
    assert contradicted(explanation, base, generic, [1.0, 1.0]) == (unknown is not None)
    if unknown:
        assert discrepancy_probability(explanation, base, generic, [1.0, 1.0], 0.01) == unknown
        assert discrepancy_probability(explanation, base, generic, [1.0, 1.0], 0.97) == (0.97 if unknown == 0.9 else unknown)
