"""Stepwise search: effects enter one by one while the Bayesian information criterion falls, as a careful user
of a catalogue would do."""

from dataclasses import dataclass

import numpy as np

from fitting.diagnose.fit.refit import Refitter
from fitting.inference.parallel import RUNS

MOST_EFFECTS = 3
TRIED = 5
"""Number of candidates that are fitted at each step, of those that a linear estimate ranks first."""
ROUNDS = 8
MOST_EVALUATIONS = 400
"""Maximum number of model runs after which a further effect is tried."""


@dataclass
class Found:
    """Effects in the order of entry, in the form of a report, with the final fit."""

    slugs: tuple
    effects: list
    fit: object
    evaluations: int


def search(program, base):
    """Forward selection by BIC.

    Args:
        program: program whose channels treat the errors as independent.
        base: fit of the base model from which to start.
    """
    before = program.tally[RUNS]
    count = np.log(program.observations(program.fitted))
    refitter = Refitter(program)
    current = refitter.fit((), base.u)
    score, slugs, effects = _deviance(program, current), (), []
    while len(slugs) < MOST_EFFECTS and program.tally[RUNS] - before < MOST_EVALUATIONS:
        trials = {}
        for slug in _ranked(program, current, slugs)[:TRIED]:
            fit = refitter.fit((*slugs, slug), _start(program, current, slug), ROUNDS)
            trials[slug] = _deviance(program, fit) + count * len(program.unknowns.of((*slugs, slug))), fit
            if program.tally[RUNS] - before > MOST_EVALUATIONS:
                break
        if not trials:
            break
        best = min(trials, key=lambda s: trials[s][0])
        if trials[best][0] >= score:
            break
        scores = np.array([score, *(value for value, _ in trials.values())])
        weights = np.exp(-0.5 * (scores - scores.min()))
        probability = float(1.0 / weights.sum())
        score, current = trials[best]
        slugs = (*slugs, best)
        effects.append({"name": best, "probability": probability, "confusable_with": []})
    return Found(slugs, effects, current, program.tally[RUNS] - before)


def _deviance(program, fit):
    return fit.evaluation.chi2(program.fitted.astype(float))


def _start(program, current, slug):
    unknowns, start = program.unknowns, current.u.copy()
    for k in unknowns.amplitudes(slug):
        start[k] = 0.2 * unknowns.items[k].start
    return start


def _ranked(program, current, present):
    """Absent effects, ranked by the misfit that their derivative, or a typical amplitude, could remove."""
    unknowns = program.unknowns
    absent = [s for s in unknowns.slugs if s not in present]
    columns = {s: unknowns.amplitudes(s) for s in absent}
    weight = program.fitted.astype(float)
    entered = np.concatenate([unknowns.base, unknowns.of(present)]).astype(int)
    r, J = program.evaluate(current.u, np.concatenate([entered, *columns.values()])).joined(weight)
    entered_columns, own, first = J[:, : len(entered)], {}, len(entered)
    for slug, indices in columns.items():
        own[slug] = J[:, first : first + len(indices)]
        first += len(indices)
        if np.max(np.abs(own[slug]), initial=0.0) < 1e-6:
            typical = current.u.copy()
            typical[unknowns.of([slug])] = [unknowns.items[k].start for k in unknowns.of([slug])]
            own[slug] = (program.evaluate(typical, indices[:0]).joined(weight)[0] - r)[:, None]
    Q, _ = np.linalg.qr(entered_columns)
    free = lambda A: A - Q @ (Q.T @ A)  # noqa: E731
    residual = free(r)
    gains = {}
    for slug, A in own.items():
        P = free(A)
        step = np.linalg.lstsq(P, residual, rcond=1e-8)[0] if A.size else np.zeros(0)
        gains[slug] = float(residual @ residual - np.sum((residual - P @ step) ** 2)) - np.log(len(r)) * A.shape[1]
    return sorted(gains, key=lambda s: -gains[s])
