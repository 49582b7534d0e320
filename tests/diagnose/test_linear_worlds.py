"""What fits, scores, evidence and predictions of a linear-Gaussian world must be, by their closed forms."""

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, SWELLING, log_density, ridge, tubes
from scipy.stats import chi2

from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.candidates import candidate_fits, refitted_baseline
from fitting.diagnose.fit.cross_validation import cross_validate, deciding
from fitting.diagnose.fit.evidence import evidence
from fitting.diagnose.fit.instrument_drift import drift_columns, drift_gain
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.fit.prediction import negative_log_predictive_density, predictive_chi_square
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.fit.score_test import score_effects
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.held_out import Scores

BASE = (0.6, -0.4)


@pytest.fixture
def rng():
    return np.random.default_rng(7)


NEARLY = 2.0 * DEFAULT.optimiser.minimum_decrease
"""Chi-square to which a fit ends: it takes no step that promises less."""


def fitted(world, measured, slugs=(), start=None):
    program = world.program(measured)
    return program, Refitter(program).fit(slugs, start)


def test_a_fit_is_the_posterior_of_its_numbers(rng):
    world = tubes()
    y = world.truth(rng, BASE)
    program, fit = fitted(world, y)
    mean, covariance = ridge(world.design(), y.ravel())
    step = fit.u[:2] - mean
    assert step @ np.linalg.solve(covariance, step) < NEARLY
    assert fit.covariance == pytest.approx(covariance, rel=1e-6)
    left = y.ravel() - world.design() @ mean
    assert 2.0 * fit.objective == pytest.approx(left @ left + mean @ mean, abs=NEARLY)
    assert reduced(program, fit, program.fitted) == pytest.approx(left @ left / y.size, abs=0.01)


def test_a_score_is_the_gain_of_the_best_strength_and_its_p_value(rng):
    world = tubes(effects=(CONSTANT,))
    y = world.truth(rng, BASE, **{CONSTANT: 0.3})
    program, base = fitted(world, y)
    found = score_effects(Refitter(program), base, [CONSTANT], np.random.default_rng(1))
    covariance = np.eye(y.size) + world.design() @ world.design().T
    v, precision = world.effects[CONSTANT].ravel(), np.linalg.inv(covariance)
    gain = (v @ precision @ y.ravel()) ** 2 / (v @ precision @ v)
    (score,) = found.scores
    assert score.gain * found.scale**2 == pytest.approx(gain, rel=1e-6)
    assert score.p_value == pytest.approx(chi2.sf(score.gain, 1), rel=1e-6)
    assert score.strength == pytest.approx(np.sqrt(v @ precision @ v), rel=1e-6)


@pytest.mark.parametrize("strength", [0.0, 0.3, 2.0])
def test_evidence_is_the_ratio_of_marginal_likelihoods(rng, strength):
    """A strength of flat prior within its bounds, and a factor of one half for each of several."""
    world = tubes()
    y = world.truth(rng, BASE, **{CONSTANT: strength})
    program, base = fitted(world, y)
    start = base.u.copy()
    own = program.unknowns.of([CONSTANT])
    start[own] = strength
    fit = Refitter(program).fit((CONSTANT,), start)
    without = np.eye(y.size) + world.design() @ world.design().T
    v = world.effects[CONSTANT].ravel()
    low, high = program.unknowns.low[own[0]], program.unknowns.high[own[0]]
    values = np.linspace(low, high, 4001)
    pull, size = v @ np.linalg.solve(without, y.ravel()), v @ np.linalg.solve(without, v)
    gains = values * pull - 0.5 * values**2 * size  # of log density, by every strength
    marginal = gains.max() + np.log(np.trapezoid(np.exp(gains - gains.max()), values) / (high - low))
    expected = marginal - np.log(len(world.effects))
    assert evidence(program, base, fit, 1.0) == pytest.approx(expected, abs=NEARLY)


@pytest.mark.parametrize("inflation", [1.0, 30.0, 900.0])
def test_evidence_where_much_is_left_is_that_of_as_wide_a_noise(rng, inflation):
    """A strength of flat prior alone, against its evidence by quadrature."""
    world = tubes(effects=(DELAY,), constants=0)
    y = np.sqrt(inflation) * world.truth(rng) + world.truth(None, **{DELAY: 5.0})
    program, base = fitted(world, y)
    fit = Refitter(program).fit((DELAY,), base.u)
    values, v = np.linspace(0.0, program.unknowns.high[0], 20001), world.effects[DELAY].ravel()
    gains = (values * (v @ y.ravel()) - 0.5 * values**2 * (v @ v)) / inflation
    expected = gains.max() + np.log(np.trapezoid(np.exp(gains - gains.max()), values) / values[-1])
    assert evidence(program, base, fit, inflation) == pytest.approx(expected, abs=0.2)


def test_an_effect_that_ends_at_its_absence_has_no_evidence(rng):
    world = tubes(effects=(DELAY,))
    y = world.truth(rng, BASE, **{DELAY: -3.0})  # a delay cannot be negative
    program, base = fitted(world, y)
    fit = Refitter(program).fit((DELAY,), base.u)
    assert fit.u[2] == 0.0 and evidence(program, base, fit, 1.0) <= 0.0
    assert [score.slug for score in score_effects(Refitter(program), base, [DELAY], rng).scores] == []


@pytest.mark.parametrize(("strength", "at_bound"), [(4.0, False), (14.0, True)])
def test_an_effect_that_ends_at_a_bound_loses_evidence(strength, at_bound):
    world = tubes(effects=(CONSTANT,))
    y = world.truth(None, **{CONSTANT: strength})
    program, base = fitted(world, y)
    fit = Refitter(program).fit((CONSTANT,), base.u)
    assert bool(fit.at_bound) is at_bound
    if at_bound:
        free = evidence(program, base, type(fit)(**{**vars(fit), "at_bound": ()}), 1.0)
        assert free - evidence(program, base, fit, 1.0) == pytest.approx(DEFAULT.evidence.minimum_first)


def test_the_predictive_chi_square_is_that_of_the_predictive_density(rng):
    """Of recordings that were not fitted: noise, and what the fit leaves open."""
    world = tubes(recordings=3, rows=12, roles=("fit", "fit", "validation"))
    y = world.truth(rng, BASE)
    program, fit = fitted(world, y)
    seen, unseen = world.design(chosen=[0, 1]), world.design(chosen=[2])
    mean, covariance = ridge(seen, y[:2].ravel())
    left = y[2] - unseen @ mean
    predictive = np.eye(len(left)) + unseen @ covariance @ unseen.T
    square = left @ np.linalg.solve(predictive, left)
    assert predictive_chi_square(program, fit, program.unseen) * len(left) == pytest.approx(square, abs=NEARLY)
    density = -log_density(left, predictive) - 0.5 * len(left) * np.log(2.0 * np.pi)
    assert negative_log_predictive_density(program, fit, program.unseen) == pytest.approx(density, abs=0.2)


def test_cross_validation_is_the_misfit_of_fits_without_each_fold(rng):
    world = tubes(recordings=3)
    y = world.truth(rng, BASE)
    program, fit = fitted(world, y)
    found = cross_validate(program, fit)
    A, values = world.design(), y.ravel()
    for chi_square, out in zip(found, deciding(program, [y.shape[1]] * 3), strict=True):
        gone = np.concatenate(out) > 0.0
        mean, _ = ridge(A[~gone], values[~gone])
        left = values[gone] - A[gone] @ mean
        assert chi_square * y.size == pytest.approx(left @ left, abs=1.0)  # a fold's fit ends within NEARLY


def test_what_effects_cost_of_recordings_left_out_in_turn_is_a_difference_of_predictive_densities(rng):
    """Of whole recordings, each predicted by fits without it, with the uncertainty of their numbers."""
    world = tubes(recordings=3, rows=12)
    y = world.truth(rng, BASE)
    program, base = fitted(world, y)
    final = Refitter(program).fit((CONSTANT,))
    exact = []
    for slugs in ((), (CONSTANT,)):
        total = 0.0
        for k in range(3):
            seen, unseen = world.design(slugs, [j for j in range(3) if j != k]), world.design(slugs, [k])
            mean, covariance = ridge(seen, np.delete(y, k, axis=0).ravel())
            total -= log_density(y[k] - unseen @ mean, np.eye(y.shape[1]) + unseen @ covariance @ unseen.T)
        exact.append(total)
    assert Scores().lost(program, final, [base]).nats == pytest.approx(exact[1] - exact[0], abs=1.0)


def test_drift_is_worth_the_ratio_of_marginal_likelihoods(rng):
    world = tubes(recordings=2, rows=40)
    y = world.truth(rng, BASE)
    program, base = fitted(world, y)
    A, D = world.design(), drift_columns(program, base.evaluation)

    def density(size):
        return log_density(y.ravel(), np.eye(y.size) + A @ A.T + size**2 * D @ D.T)

    gains = [density(size) - density(0.0) for size in DEFAULT.drift.sizes]
    assert drift_gain(program, base)[0] == pytest.approx(np.log(np.mean(np.exp(gains))), abs=1e-3)


def test_candidates_end_at_their_joint_posterior_and_the_truth_leads(rng):
    world = tubes()
    y = world.truth(rng, BASE, **{ANOTHER: (0.8, -0.6)})
    program, base = base_fit(world.program(y))
    scores = score_effects(Refitter(program), base, program.unknowns.slugs, rng)
    found = candidate_fits(program, base, scores, lambda _: None, 1)
    assert found[0].slug == ANOTHER
    fit = found[0].fit
    A = world.design([ANOTHER])
    H = A.T @ A + np.diag([1.0, 1.0, 0.0, 0.0])
    scale = program.channels[0][0].sigma[0] / 1e-6  # the noise that the campaign shows
    H = A.T @ A / scale**2 + np.diag([1.0, 1.0, 0.0, 0.0])
    assert fit.u[fit.free] == pytest.approx(np.linalg.solve(H, A.T @ y.ravel() / scale**2), abs=1e-3)
    assert refitted_baseline(program, base, found) is base  # a linear base has one optimum


def test_an_effect_of_the_wrong_sign_is_not_tried(rng):
    world = tubes(effects=(SWELLING, CONSTANT))
    y = world.truth(rng, BASE, **{SWELLING: -1.0})
    program, base = fitted(world, y)
    found = score_effects(Refitter(program), base, program.unknowns.slugs, rng)
    assert SWELLING not in [score.slug for score in found.scores]
