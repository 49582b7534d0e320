"""Held-out scores: models on recordings, or parts of them, that they were not fitted to."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.data.recordings import schema
from fitting.inference.parallel import run_parallel
from pneusma_jax.units import from_si

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..fit.cross_validation import Masks, folds
from ..fit.prediction import Loss, negative_log_predictive_density, predictive_chi_square
from ..fit.refit import Fit, Refitter
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy import Discrepancy

CROSS_VALIDATION = DEFAULT.cross_validation

Correction = Callable[[Evaluation, Masks], Evaluation]
"""Correction of a prediction, from the part of its misfit that is weighed."""


@dataclass(frozen=True)
class HeldOut:
    """Scores of values that were not fitted.

    Attributes:
        on: names of the recordings.
        how: `validation`, `left out in turn` or `within-recording`.
        rmse: root mean square error by channel (canonical quantity), SI.
        reduced_chi2: chi-square per value.
        values: number of values; those that latent trajectories follow count in part.
        predictive: chi-square per value in units of the errors of prediction, see `fit.prediction`; None
            where recordings are left out in turn.
    """

    on: list[str]
    how: str
    rmse: dict[str, float]
    reduced_chi2: float
    values: float
    predictive: float | None = None

    def within_errors(self, program: Program, fit: Fit, rest: Discrepancy | None = None) -> "HeldOut":
        """The score with its predictive chi-square, where it is of recordings for validation.

        Args:
            program: program of the campaign.
            fit: model that the score is of.
            rest: saved discrepancy beside it.
        """
        if program.fitted.all():
            return self
        shown = None if rest is None else rest.shown
        return replace(self, predictive=predictive_chi_square(program, fit, program.unseen, shown))

    def by_column(self, kind: str) -> dict[str, float]:
        """Root mean square errors by canonical column of recordings of a kind, in that column's unit."""
        columns = {schema.quantity_and_unit(name)[0]: name for name in schema.KINDS[kind].columns.outputs}
        known = {columns[q]: error for q, error in self.rmse.items() if q in columns}
        return {c: float(from_si(error, schema.quantity_and_unit(c)[1])) for c, error in known.items()}


Model = tuple[Program, Fit, float] | tuple[Program, Fit, float, Correction | None]


class Scores:
    """Held-out scores of models.

    Each model is fitted once without each group of recordings, however many mixtures it takes part in.
    """

    def __init__(self) -> None:
        self._without: dict[tuple[int, int], tuple[Fit, Fit]] = {}
        self._programs: dict[tuple[int, int], tuple[Program, Program]] = {}

    def held_out(self, explanation: Explanation) -> tuple[HeldOut, HeldOut]:
        """Scores of the refitted base model and of the final one, on the same values."""
        fits = explanation.base, explanation.final
        return tuple(self._alone(explanation.program, fit) for fit in fits)

    def averaged(self, models: Sequence[Model]) -> HeldOut:
        """Score of the weighted mean of several models' predictions of values that were not fitted.

        Args:
            models: models of one campaign: program, fit, weight, and a correction if there is one; weights
                sum to one.
        """
        models = [(*model, None)[:4] for model in models]
        program = models[0][0]
        sizes = [len(m) for m in models[0][1].evaluation.misfit]
        if program.fitted.all():
            how = "left out in turn" if len(sizes) > 1 else "within-recording"
            names = [r.name for r in program.recordings]
            outs = folds(sizes, np.arange(len(sizes)), CROSS_VALIDATION.maximum_folds)
            predicted = lambda p, fit, number, out: self._refitted(p, fit, number, out).evaluation  # noqa: E731
        else:
            how = "validation"
            names = [r.name for r, f in zip(program.recordings, program.fitted, strict=True) if not f]
            outs = [[np.full(size, float(not f)) for size, f in zip(sizes, program.fitted, strict=True)]]
            predicted = lambda p, fit, number, out: fit.evaluation  # noqa: E731

        def modelled(p: Program, fit: Fit, more: Correction | None, number: int, out: Masks) -> Evaluation:
            found = predicted(p, fit, number, out)
            return found if more is None else more(found, [1.0 - w for w in out])

        def averaged_over(job: tuple[int, Masks]) -> tuple[Evaluation, Masks]:
            return _mean([(modelled(p, fit, more, *job), w) for p, fit, w, more in models]), job[1]

        return _score(program, run_parallel(averaged_over, enumerate(outs)), names, how)

    def rise(self, explanation: Explanation) -> Loss:
        """Values that were not fitted, under the final model and the base model, each as its numbers predict.

        Numbers that a fit leaves open are not forgiven here, see `lost`. They excuse a miss, but a miss
        supports nothing.
        """
        before, after = self.held_out(explanation)
        nats = [0.5 * one.values * one.reduced_chi2 for one in (before, after)]
        return Loss(*nats, before.values)

    def lost(self, program: Program, fit: Fit, others: Sequence[Fit]) -> Loss:
        """Values that were not fitted, under a model and under the best of others.

        Numbers that a fit leaves open may decide in a recording that it has not seen. Its prediction is then
        as uncertain as they are. Parts of one recording are predicted closely: the misfit alone counts there.

        Args:
            program: program of the campaign.
            fit: model with effects.
            others: the base model, and models with fewer effects.
        """
        fits = [fit, *others]
        count = program.observations(program.unseen)
        if not program.fitted.all():
            values = [negative_log_predictive_density(program, f, program.unseen) for f in fits]
        elif len(program.recordings) == 1:
            values = [0.5 * one.values * one.reduced_chi2 for one in (self._alone(program, f) for f in fits)]
        else:
            values = [self._surprise(program, f) for f in fits]
        return Loss(min(values[1:]), values[0], count)

    def _alone(self, program: Program, fit: Fit) -> HeldOut:
        """Score of one model."""
        return self.averaged([(program, fit, 1.0)])

    def _surprise(self, program: Program, fit: Fit) -> float:
        """Negative log predictive density of recordings left out in turn, less constants."""
        sizes = [len(m) for m in fit.evaluation.misfit]
        outs = folds(sizes, np.arange(len(sizes)), CROSS_VALIDATION.maximum_folds)

        def of_group(group: tuple[int, Masks]) -> float:
            chosen = np.array([bool(np.any(mask > 0.0)) for mask in group[1]])
            without = self._program_without(program, group[0], chosen)
            return negative_log_predictive_density(without, self._refitted(program, fit, *group), chosen)

        return float(sum(run_parallel(of_group, enumerate(outs))))

    def _program_without(self, program: Program, number: int, chosen: np.ndarray) -> Program:
        """The program with one group of recordings not fitted, by its number. Fits keep predictions of it."""
        held = self._programs.get((id(program), number))
        if held is None:
            held = self._programs[id(program), number] = program, replace(program, fitted=~chosen)
        return held[1]

    def _refitted(self, program: Program, fit: Fit, number: int, out: Masks) -> Fit:
        """A model fitted without one group of recordings, by its number."""
        held = self._without.get((id(fit), number))
        if held is None:
            without = Refitter(program, [1.0 - w for w in out]).fit(fit.slugs, fit, CROSS_VALIDATION.steps)
            held = self._without[id(fit), number] = fit, without  # which keeps the fit, and so its id
        return held[1]


def _mean(members: Sequence[tuple[Evaluation, float]]) -> Evaluation:
    """Mean prediction; a whitened misfit is linear in it."""
    first = members[0][0]
    if len(members) == 1:
        return first
    misfit = [sum(w * e.misfit[k] for e, w in members) for k in range(len(first.misfit))]
    predicted = [
        [sum(w * e.predicted[k][j] for e, w in members) for j in range(len(first.predicted[k]))]
        for k in range(len(first.predicted))
    ]
    return replace(first, misfit=misfit, predicted=predicted)


def _score(
    program: Program, parts: list[tuple[Evaluation, list[np.ndarray]]], names: list[str], how: str
) -> HeldOut:
    squares: dict[str, list[float]] = {}
    total, count = 0.0, 0.0
    for evaluation, out in parts:
        for k, channels in enumerate(program.channels):
            first = 0
            for j, channel in enumerate(channels):
                size = len(channel.measured)
                chosen = (out[k][first : first + size] > 0.0) & np.isfinite(channel.sigma)
                misfit = evaluation.misfit[k][first : first + size][chosen]
                total += float(misfit @ misfit)
                count += float(chosen.sum()) * program.free_share(k)
                error = (evaluation.predicted[k][j] - channel.measured)[chosen]
                squares.setdefault(channel.quantity, []).extend((error[np.isfinite(error)] ** 2).tolist())
                first += size
    rmse = {name: float(np.sqrt(np.mean(values))) for name, values in squares.items() if values}
    return HeldOut(names, how, rmse, total / max(count, 1.0), count)
