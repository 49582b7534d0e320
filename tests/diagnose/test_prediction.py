"""Predictive chi-square of recordings that were not fitted, against the growth of the least objective."""

import dataclasses

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, SIGMA, World, tubes
from scipy.optimize import minimize_scalar

from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.fit.prediction import negative_log_predictive_density, predictive_chi_square
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.verdict.held_out import Scores
from fitting.inference.parallel import RUNS

ROWS = 200
BOUND = 4.0
"""Of a base constant, in standard deviations of its prior."""


def judged(shift, known, noise=0.0):
    """Scores of an unseen recording that is off as a constant would shift it, which a fitted one shows by `known`."""
    rng = np.random.default_rng(1)
    world = World(np.stack([np.full((ROWS, 1), known), np.ones((ROWS, 1))]), roles=("fit", "validation"))
    program = world.program(np.stack([np.zeros(ROWS), shift + noise * rng.standard_normal(ROWS)]))
    fit = Refitter(program).fit(())
    return [f(program, fit, program.unseen) for f in (predictive_chi_square, reduced, negative_log_predictive_density)]


def test_an_open_constant_is_no_misfit_of_recordings_that_need_it():
    allowed, plain, _ = judged(2.0, 0.0, 1.0)
    assert plain > 4.0
    assert allowed == pytest.approx(1.0, abs=0.2)


def test_a_constant_that_the_fit_knows_is_none_that_others_may_move():
    allowed, plain, _ = judged(2.0, 100.0 / np.sqrt(ROWS))
    assert allowed == pytest.approx(plain, rel=0.05)


def test_no_constant_leaves_its_bounds_to_excuse_a_recording():
    allowed, plain, _ = judged(20.0, 0.0)
    assert 16.0**2 < allowed < plain


@pytest.mark.parametrize("roles", [("fit", "validation"), ("fit", "fit")])
def test_a_score_of_validation_recordings_is_told_within_the_errors_of_prediction_too(roles):
    rng = np.random.default_rng(1)
    world = World(np.stack([np.zeros((ROWS, 1)), np.ones((ROWS, 1))]), roles=roles)
    program = world.program(np.stack([np.zeros(ROWS), 2.0 + rng.standard_normal(ROWS)]))
    fit = Refitter(program).fit(())
    score = Scores().averaged([(program, fit, 1.0)])
    told = score.within_errors(program, fit)
    assert dataclasses.replace(told, predictive=None) == score
    if "validation" in roles:
        assert score.reduced_chi2 > 4.0 and told.predictive == pytest.approx(1.0, abs=0.2)
    else:  # what is left out in turn has no such score
        assert told.predictive is None


def test_constants_that_a_fit_leaves_open_but_for_a_sum_are_judged_as_well():
    """Two strengths of which the fitted recording shows the sum: their covariance is singular to rounding."""
    sums = np.stack([np.full((ROWS, 2), 1e6), np.ones((ROWS, 2))])
    world = World(np.zeros((2, ROWS, 1)), {ANOTHER: sums}, ("fit", "validation"))
    program = world.program(np.stack([np.zeros(ROWS), np.full(ROWS, 2.0)]))
    fit = Refitter(program).fit((ANOTHER,))
    variances = np.linalg.eigvalsh(fit.covariance)
    assert variances[0] < 1e-16 * variances[-1]
    assert predictive_chi_square(program, fit, program.unseen) == pytest.approx(4.0, rel=0.01)


class Curved(World):
    """A world of one base constant, whose recordings are any functions of it, in standard deviations."""

    laws = ()

    def run(self, u, columns, stacked, chosen=None):
        raw = super().run(u, columns, stacked, chosen)
        outputs, slopes = (np.array(one["length"]) for one in (raw.found, raw.slopes))
        step = 1e-5
        for k, law in enumerate(self.laws):
            outputs[k] = SIGMA * law(u[0])
            slopes[np.asarray(columns) == 0, k] = SIGMA * (law(u[0] + step) - law(u[0] - step)) / (2.0 * step)
        return dataclasses.replace(raw, found={"length": outputs}, slopes={"length": slopes})


def curved(laws, measured, start=None):
    """Program of a fitted recording and one for validation, the fit of the former, and the least growth.

    Args:
        laws: of both recordings, functions of the constant with values (rows,) or a number.
        measured: of both, in standard deviations, (rows,) or a number.
        start: of the fit.
    """
    world = Curved(np.zeros((2, ROWS, 1)), roles=("fit", "validation"))
    object.__setattr__(world, "laws", laws)
    measured = np.stack([np.broadcast_to(one, ROWS) for one in measured])
    program = world.program(measured)
    fit = Refitter(program).fit((), None if start is None else np.array([start]))

    def least(*recordings):
        squares = lambda u: u**2 + sum(np.sum((laws[k](u) - measured[k]) ** 2) for k in recordings)  # noqa: E731
        parts = np.linspace(-BOUND, BOUND, 17)
        found = (minimize_scalar(squares, bounds=pair, method="bounded") for pair in zip(parts, parts[1:], strict=False))
        return min(*(one.fun for one in found), squares(BOUND), squares(-BOUND))

    return program, fit, (least(0, 1) - least(0)) / ROWS


NOTHING = lambda u: 0.0 * u  # noqa: E731
HALF = np.arange(ROWS) < ROWS // 2
CASES = {
    "far to go": ((NOTHING, lambda u: 10.0 * np.expm1(u)), (0.0, 10.0 * np.expm1(2.0)), None),
    "promised too much": ((NOTHING, lambda u: 5.0 * np.tanh(u)), (0.0, 11.0), None),
    "at a bound": ((lambda u: u, lambda u: u), (6.0, 0.0), None),
    "a better minimum": (
        (lambda u: np.where(HALF, 3.0 * (u**2 - 4.0), u - 2.0), lambda u: 5.0 * u), (0.0, 12.0), -2.0
    ),
}  # fmt: skip


@pytest.mark.parametrize(("laws", "measured", "start"), CASES.values(), ids=CASES)
def test_the_least_objective_grows_by_it(laws, measured, start):
    program, fit, growth = curved(laws, measured, start)
    assert reduced(program, fit, program.unseen) > 1.1 * growth
    assert predictive_chi_square(program, fit, program.unseen) == pytest.approx(growth, rel=2e-3, abs=2e-3)


def test_a_discrepancy_stays_as_it_is_while_numbers_move():
    (nothing, law), measured = CASES["promised too much"][0], 5.0 * np.tanh(1.5)
    program, fit, growth = curved((nothing, law), (0.0, measured + 7.0))

    def shown(evaluation):
        return dataclasses.replace(evaluation, misfit=[evaluation.misfit[0], evaluation.misfit[1] + 7.0])

    beside = predictive_chi_square(program, fit, program.unseen, shown)
    assert beside == pytest.approx(curved((nothing, law), (0.0, measured))[2], abs=2e-3)
    assert predictive_chi_square(program, fit, program.unseen) == pytest.approx(growth, rel=2e-3)
    assert growth > 40.0 > 0.1 > beside


SATURATING = lambda u: 3.0 * np.tanh(u), lambda u: 0.2 * u  # noqa: E731


def test_a_discrepancy_that_moves_numbers_far_is_no_misfit_of_other_recordings():
    """The first order promises a fit with it a hundred times less than the model can do."""
    program, fit, _ = curved(SATURATING, (0.0, 0.0))

    def shown(evaluation):
        return dataclasses.replace(evaluation, misfit=[evaluation.misfit[0] + 5.0, evaluation.misfit[1]])

    growth = curved(SATURATING, (-5.0, 0.0))[2]
    assert predictive_chi_square(program, fit, program.unseen, shown) == pytest.approx(growth, abs=0.01)


def test_a_fit_that_was_not_led_to_its_end_is_judged_from_there():
    program, fit, growth = curved(SATURATING, (5.0, 0.0))
    short = Refitter(program).fit((), np.zeros(1), rounds=1)
    assert short.objective > 1.1 * fit.objective
    assert predictive_chi_square(program, short, program.unseen) == pytest.approx(growth, abs=0.01)


@pytest.mark.parametrize("start", [None, 1.7, 2.7])
def test_a_step_that_fails_at_a_kink_is_not_promised(start):
    program, fit, growth = curved((lambda u: 5.0 + 2.0 * np.abs(u - 1.0), lambda u: 0.2 * u), (0.0, 1.0), start)
    assert Refitter(program).promised(fit) < 0.1 * fit.objective
    assert predictive_chi_square(program, fit, program.unseen) == pytest.approx(growth, rel=0.01)


def test_the_order_in_which_effects_are_told_is_no_information():
    world = tubes(recordings=2, rows=60, effects=(CONSTANT, ANOTHER), roles=("fit", "validation"))
    for slug, known, asked in ((CONSTANT, 30.0, 0.1), (ANOTHER, 0.1, 30.0)):
        world.effects[slug][:] *= np.array([known, asked])[:, None, None]
    program = world.program(world.truth(np.random.default_rng(1), **{CONSTANT: 0.5, ANOTHER: [0.3, 0.2]}))
    fit = Refitter(program).fit((CONSTANT, ANOTHER))
    other = dataclasses.replace(fit, slugs=(ANOTHER, CONSTANT), predictions={})
    densities = [negative_log_predictive_density(program, one, program.unseen) for one in (fit, other)]
    assert densities[1] == pytest.approx(densities[0])


def test_predictions_are_not_those_of_another_evaluation():
    program, fit, _ = curved((NOTHING, NOTHING), (0.0, 3.0))
    assert predictive_chi_square(program, fit, program.unseen) == pytest.approx(9.0)
    misfit = [fit.evaluation.misfit[0], 0.0 * fit.evaluation.misfit[1]]
    other = dataclasses.replace(fit, evaluation=dataclasses.replace(fit.evaluation, misfit=misfit))
    assert predictive_chi_square(program, other, program.unseen) == pytest.approx(0.0, abs=1e-9)


def test_recordings_left_out_in_turn_are_predicted_once():
    world = tubes(recordings=3)
    program = world.program(world.truth(np.random.default_rng(0), (0.5,)))
    base, fit, scores = Refitter(program).fit(()), Refitter(program).fit((CONSTANT,)), Scores()
    lost = scores.lost(program, fit, [base])
    runs = program.tally[RUNS]
    assert scores.lost(program, fit, [base]) == lost
    assert program.tally[RUNS] == runs


def test_a_model_without_free_numbers_predicts_what_it_is():
    world = World(np.zeros((2, ROWS, 0)), roles=("fit", "validation"))
    program = world.program(np.stack([np.zeros(ROWS), np.full(ROWS, 3.0)]))
    fit = Refitter(program).fit(())
    assert predictive_chi_square(program, fit, program.unseen) == pytest.approx(9.0)
    assert negative_log_predictive_density(program, fit, program.unseen) == pytest.approx(4.5 * ROWS)
