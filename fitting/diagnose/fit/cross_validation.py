"""Cross-validation: fitted recordings, or parts of them, are left out in turn to decide about effects."""

from collections.abc import Sequence

import numpy as np

from fitting.inference.parallel import run_parallel

from ..evaluate.program import Program
from ..settings import DEFAULT
from .refit import Fit, Refitter

CROSS_VALIDATION = DEFAULT.cross_validation
SHARE = DEFAULT.share


Masks = list[np.ndarray]
"""A mask of the values of every recording."""


def folds(sizes: Sequence[int], members: Sequence[int], most: int) -> list[Masks]:
    """Masks of what is left out, one list by recording for every fold.

    Args:
        sizes: values of every recording.
        members: numbers of the recordings that may be left out; blocks of it, if it is one.
        most: groups of recordings at most.
    """
    if len(members) > 1:
        groups = [list(members[k :: min(len(members), most)]) for k in range(min(len(members), most))]
        return [[np.full(size, float(k in group)) for k, size in enumerate(sizes)] for group in groups]
    (only,) = members
    edges = np.linspace(0, sizes[only], CROSS_VALIDATION.blocks + 1).astype(int)
    place = np.arange(sizes[only])
    blocks = [((place >= a) & (place < b)).astype(float) for a, b in zip(edges[:-1], edges[1:], strict=True)]
    return [[block if k == only else np.zeros(size) for k, size in enumerate(sizes)] for block in blocks]


def deciding(program: Program, sizes: Sequence[int]) -> list[Masks]:
    """Masks of the fitted values that are left out to decide about an effect.

    Args:
        program: program of the campaign.
        sizes: values of every recording.
    """
    members = np.flatnonzero(program.fitted)
    alone = len({program.recordings[k].specimen for k in members}) == 1
    if alone and 1 < len(members) <= CROSS_VALIDATION.maximum_folds:
        return _parts_of_all(sizes, members)
    return folds(sizes, members, CROSS_VALIDATION.groups)


def _parts_of_all(sizes: Sequence[int], members: Sequence[int]) -> list[Masks]:
    """Masks that leave out two stretches of every recording at once, all of it over the folds."""
    found = []
    for j in range(CROSS_VALIDATION.blocks):
        masks = [np.zeros(size) for size in sizes]
        for k in members:
            edges = np.linspace(0, sizes[k], 2 * CROSS_VALIDATION.blocks + 1).astype(int)
            for i in (j, j + CROSS_VALIDATION.blocks):
                masks[k][edges[i] : edges[i + 1]] = 1.0
        found.append(masks)
    return found


class HeldOutScores:
    """Cross-validated chi-square of models, each computed once.

    Args:
        program: program of the campaign.
    """

    def __init__(self, program: Program):
        self._program, self._known = program, {}

    def __call__(self, fit: Fit) -> np.ndarray:
        """See `cross_validate`."""
        if id(fit) not in self._known:  # a fit that is kept keeps its id
            self._known[id(fit)] = fit, cross_validate(self._program, fit)
        return self._known[id(fit)][1]

    def known(self, fit: Fit) -> bool:
        """True if a model was asked for."""
        return id(fit) in self._known

    def gained(self, base: Fit, fit: Fit) -> float:
        """Cross-validated reduced chi-square of a model, with its gain on a base model counted by `gain`."""
        before = self(base)
        return float(before.sum()) - gain(before, self(fit))[0]


def cross_validate(program: Program, fit: Fit) -> np.ndarray:
    """Chi-square of the fitted recordings, predicted by fits without them: a reduced one, in parts by fold.

    Args:
        program: program of the campaign.
        fit: model of all of them, from which every fold starts.
    """

    def without(out: Masks) -> float:
        weight = [f * (1.0 - w) for f, w in zip(program.fitted, out, strict=True)]
        return Refitter(program, weight).fit(fit.slugs, fit, CROSS_VALIDATION.steps).evaluation.chi2(out)

    found = run_parallel(without, deciding(program, [len(m) for m in fit.evaluation.misfit]))
    return np.array(found) / max(program.observations(program.fitted), 1)


def gain(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Gain of a model on values left out in turn: in reduced chi-square, and as a share of the misfit there.

    The worst fold is left out, with its misfit, where it loses. Without the rows in which an effect acts, a
    fit may end at another value of it that nothing contradicts. The share is computed without the fold of
    largest misfit if three things hold there. Both models extrapolate badly in it, every other fold gains,
    and the other folds hold a real part of the misfit.

    Args:
        before, after: scores of both models, by fold, as `cross_validate` gives them.
    """
    gains, misfit = before - after, before - 1.0 / len(before)
    kept = np.arange(len(gains)) != (np.argmin(gains) if gains.min() < 0.0 else -1)
    gained = float(gains[kept].sum())
    share = gained / max(float(misfit[kept].sum()), CROSS_VALIDATION.minimum_misfit)
    most = int(np.argmax(misfit))
    rest = np.delete(gains, most), np.delete(misfit, most)
    forgiven = (
        after[most] > SHARE.most * before[most]
        and rest[1].sum() > SHARE.small * misfit.sum()
    )
    if forgiven and rest[0].min(initial=np.inf) > 0.0 and len(rest[0]) > 1:
        share = max(share, float(rest[0].sum() / rest[1].sum()))
    return gained, share
