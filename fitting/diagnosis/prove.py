"""What a model is worth on recordings that it was not fitted to."""

from dataclasses import dataclass

import numpy as np

from .explain import Explanation
from .folds import ROUNDS, folds
from .program import Evaluation, Program
from .refit import Refitter

MOST_FOLDS = 8
"""Groups of recordings that are left out in turn, where there are more."""


@dataclass(frozen=True)
class HeldOut:
    """Scores of values that were not fitted.

    Attributes:
        on: names of the recordings.
        how: `validation`, `left out in turn` or `within-recording`.
        rmse: by channel (canonical quantity), SI.
        reduced_chi2: per value.
    """

    on: list[str]
    how: str
    rmse: dict[str, float]
    reduced_chi2: float


def held_out(explanation: Explanation) -> tuple[HeldOut, HeldOut]:
    """Scores of the refitted base model and of the final one, on the same values."""
    before = explanation.base_program, explanation.base
    after = explanation.program, explanation.final
    program = explanation.program
    if not program.fitted.all():
        chosen = [
            np.full(len(m), float(not f))
            for m, f in zip(after[1].evaluation.misfit, program.fitted, strict=True)
        ]
        names = [r.name for r, f in zip(program.recordings, program.fitted, strict=True) if not f]
        found = [_score(p, [(f.evaluation, chosen)], names, "validation") for p, f in (before, after)]
        return found[0], found[1]
    sizes = [len(m) for m in after[1].evaluation.misfit]
    how = "left out in turn" if len(sizes) > 1 else "within-recording"
    names = [r.name for r in program.recordings]
    found = []
    for p, fit in (before, after):
        parts = []
        for out in folds(sizes, np.arange(len(sizes)), MOST_FOLDS):
            weight = [1.0 - w for w in out]
            parts.append((Refitter(p, weight).fit(fit.slugs, fit.u, ROUNDS).evaluation, out))
        found.append(_score(p, parts, names, how))
    return found[0], found[1]


def _score(
    program: Program, parts: list[tuple[Evaluation, list[np.ndarray]]], names: list[str], how: str
) -> HeldOut:
    squares: dict[str, list[float]] = {}
    total, count = 0.0, 0
    for evaluation, out in parts:
        for k, channels in enumerate(program.channels):
            first = 0
            for j, channel in enumerate(channels):
                size = len(channel.measured)
                chosen = (out[k][first : first + size] > 0.0) & np.isfinite(channel.sigma)
                misfit = evaluation.misfit[k][first : first + size][chosen]
                total, count = total + float(misfit @ misfit), count + int(chosen.sum())
                error = (evaluation.predicted[k][j] - channel.measured)[chosen]
                squares.setdefault(channel.quantity, []).extend((error[np.isfinite(error)] ** 2).tolist())
                first += size
    rmse = {name: float(np.sqrt(np.mean(values))) for name, values in squares.items() if values}
    return HeldOut(names, how, rmse, total / max(count, 1))
