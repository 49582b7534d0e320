"""Terms that a custom model misses: stepwise, by evidence and cross-validation, at most three."""

from collections.abc import Callable, Sequence

import numpy as np

from fitting.inference.serial_correlation import correlation_time

from ..settings import DEFAULT
from .data import OwnRecording
from .fits import OwnFit, Problem
from .model import OwnModel
from .result import Candidate, Explained, Stage

CANDIDATES = DEFAULT.candidates
EVIDENCE = DEFAULT.evidence
SEARCH = DEFAULT.search
SHARE = DEFAULT.share


def explain_own(
    model: OwnModel,
    recordings: Sequence[OwnRecording],
    most: int = SEARCH.maximum_effects,
    progress: Callable[[str], None] = lambda _: None,
) -> Explained:
    """Find what a base model misses.

    The base is refitted within its priors first, so that no term gets credit for a recalibration. Then a step
    is repeated up to `most` times. Every absent term is scored by its sensitivity. The best are fitted
    together with the base and the present terms. Their evidence is deflated by the misfit of the best one and
    by the serial correlation of its residuals. The best term that also predicts recordings left out in turn
    enters. At the end, redundant terms are removed.

    Args:
        model: base and candidate terms.
        recordings: recordings of role `fit` to learn from. Those of role `validation` are only predicted, at
            the end.
        most: terms that may enter.
        progress: told what happens, in words.

    Raises:
        InputError: if the recordings do not agree, or a term acts nowhere.
    """
    problem = Problem(model, recordings)
    progress("refitting the base")
    base = current = problem.fit()
    kept = problem.left_out(base)
    before, stages = kept, []
    while len(current.present) < most:
        gains = problem.gains(current)
        order = sorted(gains, key=lambda name: -gains[name])[: CANDIDATES.tried]
        progress(f"fitting {', '.join(order)} together with {', '.join(('the base', *current.present))}")
        fits = {name: problem.fit((*current.present, name), current.result.values) for name in order}
        inflation = _inflation(problem, min(fits.values(), key=lambda f: f.objective))
        candidates = [_weighed(problem, current, name, fits[name], gains[name], inflation) for name in order]
        candidates.sort(key=lambda c: -c.log_bayes_factor)
        stage = Stage(current.present, candidates, None, kept)
        stages.append(stage)
        for place, candidate in enumerate(candidates):
            if candidate.log_bayes_factor < EVIDENCE.minimum_difference or candidate.at_bound:
                continue
            score = problem.left_out(fits[candidate.name])
            candidates[place] = candidate.scored(score)
            if score < (1.0 - SHARE.small) * kept:
                stage.chosen, current, kept = candidate.name, fits[candidate.name], score
                break
        if stage.chosen is None:
            break
    current = _pruned(problem, current)
    left, width = problem.left_out(current), _inflation(problem, current)
    return Explained(problem, base, current, stages, before, left, width)


def _inflation(problem: Problem, best: OwnFit) -> float:
    """Variance of the misfit over that of independent errors of the stated size."""
    misfit = problem.misfit(best.result.values, problem.fitted)
    left = best.chi_square / problem.data.counted(problem.fitted)
    series = []
    for row in misfit:  # one series for every component of an output, along the rows
        first = 0
        for name in sorted(problem.data.weight):
            shape = problem.data.weight[name].shape[1:]
            size = int(np.prod(shape))
            series += list(row[first : first + size].reshape(shape[0], -1).T)
            first += size
    return max(1.0, left) * correlation_time([s for s in series if np.any(s != 0.0)])


def _weighed(
    problem: Problem, current: OwnFit, name: str, fit: OwnFit, gain: float, inflation: float
) -> Candidate:
    """Log Bayes factor by Laplace's approximation, with flat priors of terms within their bounds.

    The price of a term's unknowns is never a gain, however wide its error. The logarithm of the number of
    terms pays for the choice among them.
    """
    term, occam = problem.model.term(name), 0.0
    for key, spec in term.specs.items():
        error = fit.result.standard_errors[term.full(key)]
        if error is not None and error > 0.0:
            occam += 0.5 * np.log(2.0 * np.pi * inflation) + np.log(error / (spec.high - spec.low))
    value = (
        (current.objective - fit.objective) / inflation + min(occam, 0.0) - np.log(len(problem.model.terms))
    )
    bound = [n for n in fit.at_bound if n in [term.full(key) for key in term.specs]]
    return Candidate(name, float(value), gain, tuple(bound))


def _pruned(problem: Problem, fit: OwnFit) -> OwnFit:
    """The model without terms that later ones made redundant; the last one that entered stays."""
    for name in fit.present[:-1]:
        rest = tuple(n for n in fit.present if n != name)
        without = problem.fit(rest, fit.result.values)
        if (without.objective - fit.objective) / _inflation(problem, fit) < EVIDENCE.minimum_difference:
            fit = without
    return fit
