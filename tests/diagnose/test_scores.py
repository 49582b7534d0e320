"""Scores of values that were not fitted: a mean of models, and every model fitted once without each group."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.evaluate.evaluation import Evaluation
from fitting.diagnose.verdict import held_out
from fitting.diagnose.verdict.held_out import Scores

ROWS, RECORDINGS = 4, 3


def evaluation(misfit):
    parts = [np.full(ROWS, float(misfit)) for _ in range(RECORDINGS)]
    return Evaluation(parts, [np.zeros((0, ROWS))] * RECORDINGS, [[p] for p in parts], {}, np.zeros(1), np.zeros(0, int), None, None, [None] * RECORDINGS)


def fit(misfit):
    return SimpleNamespace(slugs=(), evaluation=evaluation(misfit))


def program(fitted):
    channel = SimpleNamespace(measured=np.zeros(ROWS), sigma=np.ones(ROWS), quantity="force")
    return SimpleNamespace(
        fitted=np.array(fitted), channels=[[channel]] * RECORDINGS, free_share=lambda k: 1.0,
        recordings=[SimpleNamespace(name=f"r{k}") for k in range(RECORDINGS)],
    )  # fmt: skip


@pytest.fixture
def asked(monkeypatch):
    """Fits without a group that were asked for; each leaves one more than the fit of everything."""
    found = []

    class Refitter:
        def __init__(self, program, weight):
            self.without = [k for k, w in enumerate(weight) if not w.any()]

        def fit(self, slugs, start, rounds):
            found.append((id(start), *self.without))
            return SimpleNamespace(evaluation=evaluation(start.evaluation.misfit[0][0] + 1.0))

    monkeypatch.setattr(held_out, "Refitter", Refitter)
    return found


def test_every_model_is_fitted_once_without_each_recording(asked):
    one, other, all_fitted, scores = fit(1.0), fit(3.0), program([True] * 3), Scores()
    assert scores.averaged([(all_fitted, one, 1.0)]).reduced_chi2 == pytest.approx(4.0)
    assert scores.averaged([(all_fitted, one, 0.5), (all_fitted, other, 0.5)]).reduced_chi2 == pytest.approx(9.0)
    halved = scores.averaged([(all_fitted, other, 1.0, lambda e, out: evaluation(0.5 * e.misfit[0][0]))])
    assert halved.reduced_chi2 == pytest.approx(4.0) and halved.how == "left out in turn"
    assert sorted(asked) == sorted((id(f), k) for f in (one, other) for k in range(RECORDINGS))


def test_recordings_for_validation_are_scored_as_they_are(asked):
    found = Scores().averaged([(program([True, True, False]), fit(2.0), 1.0)])
    assert found.reduced_chi2 == pytest.approx(4.0) and found.on == ["r2"] and found.how == "validation"
    assert asked == []
