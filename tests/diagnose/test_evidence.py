"""Log evidence: what a strength costs, and what beside latent trajectories is no evidence."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit import candidates, evidence
from fitting.diagnose.fit.evidence import _spared


def fitted(objective, follows, at=0.0):
    """A fit whose latent trajectories follow so many measured values, its base constant at a place; an effect is there."""
    return SimpleNamespace(objective=objective, evaluation=follows, slugs=(), u=np.array([at, 1.0]), at_bound=())


def beside_courses(monkeypatch, again=None):
    """A campaign of one recording with latent trajectories; what a refit near a candidate's courses ends at."""
    monkeypatch.setattr(candidates, "inflation_of", lambda program, fit: 1.0)
    monkeypatch.setattr(evidence, "_occam", lambda *anything: 0.0)
    refitter = SimpleNamespace(fit=lambda slugs, u, rounds, near=None, complete=True: again, completed=lambda fit: fit,
        promised=lambda fit: fit.objective, variance=lambda objective: 1.0)
    monkeypatch.setattr(candidates, "Refitter", lambda program: refitter)
    unknowns = SimpleNamespace(slugs=("a",), base=np.array([0]), neutral=np.zeros(2), amplitudes=lambda slug: np.array([1]))
    return SimpleNamespace(
        followed=lambda follows: [SimpleNamespace()], freedom_of_trajectories=lambda follows: np.array([follows]),
        fitted=np.array([True]), unknowns=unknowns, hidden=True, observations=lambda mask: 200,
    )  # fmt: skip


def test_what_hidden_courses_follow_more_is_no_evidence(monkeypatch):
    program = beside_courses(monkeypatch)
    candidate = candidates.CandidateFit("a", fitted(80.0, 40.0), 0.0, 0.0)
    candidates.weigh(program, fitted(100.0, 10.0), [candidate])
    assert candidate.bayes == pytest.approx(20.0 - 0.5 * 30.0)
    candidates.weigh(program, fitted(100.0, 60.0), [candidate])
    assert candidate.bayes == pytest.approx(20.0)


def test_no_trial_is_credited_with_a_kink_that_the_model_so_far_was_shut_in_by(monkeypatch):
    freed = fitted(83.0, 10.0)
    program = beside_courses(monkeypatch, freed)
    candidate = candidates.CandidateFit("a", fitted(80.0, 10.0), 20.0, 0.0)
    assert candidates.refitted_baseline(program, fitted(100.0, 10.0), [candidate]) is freed
    assert candidate.bayes == pytest.approx(3.0)
    program = beside_courses(monkeypatch, fitted(104.0, 10.0))
    shut = fitted(100.0, 10.0)
    assert candidates.refitted_baseline(program, shut, [candidate]) is shut
    assert candidate.bayes == pytest.approx(20.0)


def test_no_trial_is_credited_with_a_better_place_of_the_bases_own_constants(monkeypatch):
    """Without latent trajectories, too: the base is fitted from where a candidate ended, and takes over what is better."""
    better = fitted(82.0, 0.0)
    program = beside_courses(monkeypatch)
    program.hidden, program.followed, begun = False, lambda evaluation: [None], []
    refitter = SimpleNamespace(
        fit=lambda slugs, start, rounds, near=None, complete=True: begun.append(start) or better, completed=lambda fit: fit,
        promised=lambda fit: fit.objective - 3.0, variance=lambda objective: 1.0
    )
    monkeypatch.setattr(candidates, "Refitter", lambda program: refitter)
    near, far = (candidates.CandidateFit("a", fitted(80.0, 0.0, at), 20.0, 0.0) for at in (0.1, 2.0))
    assert candidates.refitted_baseline(program, fitted(100.0, 0.0), [near]).objective == 100.0 and not begun
    assert candidates.refitted_baseline(program, fitted(100.0, 0.0), [far]) is better and begun == [far.fit, better]
    assert far.bayes == pytest.approx(2.0)


def test_strengths_that_are_not_needed_cost_next_to_nothing():
    """Two strengths with the same prior: what leaving one out saves, against both evidences in closed form."""
    H = np.array([[50.0, 10.0, 4.0], [10.0, 80.0, 6.0], [4.0, 6.0, 30.0]])  # a base constant, two strengths
    best, width = np.array([0.3, 2.0, 0.05]), 5.0
    cost = np.log(width) - 0.5 * np.log(2.0 * np.pi)

    def evidence(kept):
        """Of a Gaussian misfit about `best` where the others are zero, less constants."""
        gone = [n for n in range(3) if n not in kept]
        inner = H[np.ix_(kept, kept)]
        pull = H[np.ix_(kept, gone)] @ -best[gone]
        least = 0.5 * best[gone] @ H[np.ix_(gone, gone)] @ best[gone]
        least -= 0.5 * pull @ np.linalg.solve(inner, pull)
        return -least - 0.5 * np.linalg.slogdet(inner)[1] - cost * (len(kept) - 1)

    saved = _spared(np.linalg.inv(H), best, {1: cost, 2: cost})
    assert saved == pytest.approx(evidence([0, 1]) - evidence([0, 1, 2]))
    assert saved > 1.0
    assert _spared(np.linalg.inv(H), np.array([0.3, 2.0, 2.0]), {1: cost, 2: cost}) == 0.0
