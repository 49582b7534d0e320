"""What a model is worth on recordings that it was not fitted to."""

from dataclasses import dataclass

import numpy as np

from .explain import Explanation
from .program import Evaluation, Program
from .refit import Fit, Refitter

BLOCKS = 5
"""Parts of a single recording that are left out in turn."""
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
    folds, how = _folds(after[1])
    names = [r.name for r in program.recordings]
    found = []
    for p, fit in (before, after):
        parts = []
        for out in folds:
            weight = [1.0 - w for w in out]
            parts.append((Refitter(p, weight).fit(fit.slugs, fit.u, rounds=5).evaluation, out))
        found.append(_score(p, parts, names, how))
    return found[0], found[1]


def _folds(fit: Fit) -> tuple[list[list[np.ndarray]], str]:
    """Masks of the values that are left out, one list by recording for every fold."""
    sizes = [len(m) for m in fit.evaluation.misfit]
    if len(sizes) > 1:
        groups = np.array_split(np.arange(len(sizes)), min(len(sizes), MOST_FOLDS))
        folds = [[np.full(size, float(k in group)) for k, size in enumerate(sizes)] for group in groups]
        return folds, "left out in turn"
    edges = np.linspace(0, sizes[0], BLOCKS + 1).astype(int)
    place = np.arange(sizes[0])
    folds = [[((place >= a) & (place < b)).astype(float)] for a, b in zip(edges[:-1], edges[1:], strict=True)]
    return folds, "within-recording"


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
