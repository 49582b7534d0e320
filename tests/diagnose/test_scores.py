"""Scores of values that were not fitted: a mean of models, and every model fitted once without each group."""

import numpy as np
import pytest
from linear_world import CONSTANT, DELAY, ridge, tubes

from fitting.diagnose.fit.cross_validation import HeldOutScores
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.verdict.held_out import Scores
from fitting.inference.parallel import RUNS


def campaign(**more):
    world = tubes(recordings=3, **more)
    y = world.truth(np.random.default_rng(2), (0.5, -0.3), **{CONSTANT: 1.0})
    program = world.program(y)
    return world, y, program, [Refitter(program).fit(slugs) for slugs in ((), (CONSTANT,), (DELAY,))]


def test_a_mean_of_models_is_scored_by_its_predictions():
    """Each of fits without one recording, in closed form."""
    world, y, program, (base, one, _) = campaign()
    left = []
    for k in range(3):
        others = [n for n in range(3) if n != k]
        predictions = []
        for slugs in ((), (CONSTANT,)):
            A, b = world.design(slugs, others), y[others].ravel()
            prior = np.diag([1.0, 1.0] + [0.0] * len(slugs))
            predictions.append(world.design(slugs, [k]) @ np.linalg.solve(A.T @ A + prior, A.T @ b))
        left.append(y[k] - np.mean(predictions, axis=0))
    found = Scores().averaged([(program, base, 0.5), (program, one, 0.5)])
    assert found.how == "left out in turn" and found.on == ["r0", "r1", "r2"]
    assert found.reduced_chi2 == pytest.approx(np.mean(np.square(left)), rel=0.02)
    assert found.rmse["length"] == pytest.approx(1e-6 * np.sqrt(np.mean(np.square(left))), rel=0.02)


def test_a_correction_is_fitted_to_what_was_not_left_out():
    _, _, program, (base, *_) = campaign()
    seen = []

    def correction(evaluation, weight):
        seen.append([float(w.mean()) for w in weight])
        return evaluation

    alone = Scores().averaged([(program, base, 1.0)])
    assert Scores().averaged([(program, base, 1.0, correction)]) == alone
    assert sorted(seen) == [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]]


def test_every_model_is_fitted_once_without_each_group():
    _, _, program, (base, one, other) = campaign()
    scores = Scores()
    scores.averaged([(program, base, 0.5), (program, one, 0.5)])
    before = program.tally[RUNS]
    scores.averaged([(program, one, 1.0)])
    scores.averaged([(program, one, 0.3), (program, base, 0.7)])
    assert program.tally[RUNS] == before
    scores.averaged([(program, other, 1.0)])
    assert program.tally[RUNS] > before


def test_what_a_model_leaves_of_values_left_out_in_turn_is_asked_for_once():
    _, _, program, (base, one, _) = campaign()
    scores = HeldOutScores(program)
    known, before = scores(base), program.tally[RUNS]
    assert scores(base) is known and program.tally[RUNS] == before
    assert scores.gained(base, one) < known.sum()
    assert scores(Refitter(program).fit(())) is not known  # another fit, however alike


def test_recordings_for_validation_are_scored_as_they_are():
    world, y, program, (base, *_) = campaign(roles=("fit", "fit", "validation"))
    before = program.tally[RUNS]
    found = Scores().averaged([(program, base, 1.0)])
    mean, _ = ridge(world.design(chosen=[0, 1]), y[:2].ravel())
    left = y[2] - world.design(chosen=[2]) @ mean
    assert (found.on, found.how, program.tally[RUNS]) == (["r2"], "validation", before)
    assert found.reduced_chi2 == pytest.approx(left @ left / len(left), rel=0.01)
