"""Model discrepancy as a smooth function of one driver: a description of what no named effect explains.

It is added to the last model that was fitted, and enters the augmented model as `unmodelled`. Outside the
range of its driver it is unknown: it is held there, and the report says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..fit.cross_validation import Masks, deciding
from ..fit.refit import Fit
from ..fit.standard_errors import widening
from ..settings import DEFAULT
from .discrepancy_places import Response, acts, hats, responses
from .locate import Place, distinct_drivers, drivers_of, knots_of
from .repeats import Repeats

DISCREPANCY = DEFAULT.discrepancy
SHARE = DEFAULT.share


@dataclass(frozen=True)
class Discrepancy:
    """A piecewise linear correction of one output, or of the silicone's stiffness.

    Attributes:
        program: program of the model that it is added to.
        quantity: output that it adds to, or the stiffness whose relative change it is; see `places`.
        response: response of the place.
        driver: quantity that it is a function of.
        along: values of the driver, shape (recordings, rows).
        knots: knots of the driver, ascending, from its smallest to its largest fitted value.
        values, sd: added at each knot, and standard errors, which count what is left, see `widening`; SI.
    """

    program: Program
    quantity: str
    response: Response
    driver: str
    along: np.ndarray
    knots: np.ndarray
    values: np.ndarray
    sd: np.ndarray

    def corrected(self, evaluation: Evaluation, weight: Masks) -> Evaluation:
        """An evaluation of the model with the correction fitted to its weighed misfit."""
        return self._added(evaluation, self.solved(evaluation, weight)[0])

    def shown(self, evaluation: Evaluation) -> Evaluation:
        """An evaluation of the model with the correction itself."""
        return self._added(evaluation, self.values)

    def solved(self, evaluation: Evaluation, weight: Masks) -> tuple[np.ndarray, np.ndarray]:
        """Values at the knots, and standard errors; a weak ridge holds open values at zero."""
        blocks, misfit = [], []
        for k, j, part in self._parts():
            w = np.broadcast_to(weight[k], evaluation.misfit[k].shape)[part]
            blocks.append(w[:, None] * self._hats(k, j).T)
            misfit.append(w * evaluation.misfit[k][part])
        A, r = np.concatenate(blocks), np.concatenate(misfit)
        H = A.T @ A
        H += max(DISCREPANCY.ridge * np.trace(H) / len(self.knots), 1e-12) * np.eye(len(self.knots))
        return -np.linalg.solve(H, A.T @ r), np.sqrt(np.diag(np.linalg.inv(H)))

    def _hats(self, k: int, j: int) -> np.ndarray:
        return hats(self.program, k, j, self.response, self.along, self.knots)

    def _parts(self) -> list[tuple[int, int, slice]]:
        """Recording, channel and place in the recording's misfit of every along that it changes."""
        found = []
        for k, channels in enumerate(self.program.channels):
            first = 0
            for j, channel in enumerate(channels):
                size = len(channel.measured)
                if channel.quantity in self.response:
                    found.append((k, j, slice(first, first + size)))
                first += size
        return found

    def _added(self, evaluation: Evaluation, values: np.ndarray) -> Evaluation:
        misfit = [m.copy() for m in evaluation.misfit]
        predicted = [list(channels) for channels in evaluation.predicted]
        for k, j, part in self._parts():
            misfit[k][part] += values @ self._hats(k, j)
            change = np.interp(np.nan_to_num(self.along[k]), self.knots, values)
            response = self.response[self.program.channels[k][j].quantity][k]
            predicted[k][j] = predicted[k][j] + response * change
        return replace(evaluation, misfit=misfit, predicted=predicted)


def fitted_discrepancy(
    program: Program, fit: Fit, place: Place, seen: str | None = None, repeats: Repeats | None = None
) -> Discrepancy | None:
    """The discrepancy of a model, by the driver that predicts left-out parts best.

    None where no driver predicts them better than nothing. Along a driver by which the misfit repeats, knots
    are also tried that are close enough for its period. In time a period begins anew in every recording, so
    that no function of time predicts it.

    Args:
        program: program of the campaign.
        fit: model whose misfit it is.
        place: place of the misfit, with the drivers that are tried.
        seen: output, or silicone stiffness, on which the discrepancy of largest evidence acts.
        repeats: period of the misfit, if it has one.
    """
    first = _first(program)
    quantities = dict.fromkeys((first, seen or first))
    if repeats is None or repeats.driver == "time":
        return _described(program, fit, [*quantities], place.drivers, 1.0)
    quantities |= {repeats.quantity: None}
    drivers = dict.fromkeys([*place.drivers, repeats.driver])
    return _described(program, fit, [*quantities], [*drivers], 1.0, repeats)


def beside(program: Program, fit: Fit) -> Discrepancy | None:
    """The discrepancy beside named effects, by any driver.

    None where it removes too little of what the effects leave of left-out parts.
    """
    return _described(
        program, fit, (_first(program),), tuple(distinct_drivers(program, fit)), 1.0 - SHARE.minor
    )


def _first(program: Program) -> str:
    """The first output that was measured."""
    return program.channels[int(np.flatnonzero(program.fitted)[0])][0].quantity


def _described(
    program: Program,
    fit: Fit,
    quantities: Sequence[str],
    drivers: Sequence[str],
    worth: float,
    repeats: Repeats | None = None,
) -> Discrepancy | None:
    """The discrepancy by the place and driver that predict left-out parts best.

    None where it leaves more than a share `worth` of their excess over noise.
    """
    evaluation = fit.evaluation
    drivers_of_rows, places = drivers_of(program, fit), responses(program, fit)
    sizes = [len(m) for m in evaluation.misfit]
    outs = deciding(program, sizes)
    trains = [[f * (1.0 - w) for f, w in zip(program.fitted, out, strict=True)] for out in outs]
    excess = sum(evaluation.chi2(out) for out in outs)
    noise = program.observations(program.fitted)
    best, least = None, excess if worth >= 1.0 else noise + worth * (excess - noise)
    counts = list(product(drivers, DISCREPANCY.saved_knots))
    if repeats is not None:
        periods = np.ptp(np.nan_to_num(drivers_of_rows[repeats.driver])) / repeats.period
        most = DISCREPANCY.maximum_knots * noise
        counts.append((repeats.driver, round(min(DISCREPANCY.period_knots * periods, most))))
    for quantity, (name, count) in product(quantities, counts):
        knots = _knots(program, drivers_of_rows[name], count)
        if quantity not in places or not acts(quantity, name, program.kind) or knots is None:
            continue
        blank = np.zeros(len(knots))
        tried = Discrepancy(
            program, quantity, places[quantity], name, drivers_of_rows[name], knots, blank, blank
        )
        left = sum(
            tried.corrected(evaluation, train).chi2(out) for train, out in zip(trains, outs, strict=True)
        )
        if left < least:
            best, least = tried, left
    if best is None:
        return None
    everything = [np.full(size, float(f)) for size, f in zip(sizes, program.fitted, strict=True)]
    values, sd = best.solved(evaluation, everything)
    found = replace(best, values=values, sd=sd)
    return replace(found, sd=sd * widening(program, found.shown(evaluation)))


def _knots(program: Program, along: np.ndarray, count: int) -> np.ndarray | None:
    """Quantiles of the driver over the fitted values; None where it hardly varies."""
    quantity = _first(program)
    seen = [
        along[k][: len(channel.sigma)][np.isfinite(channel.sigma)]
        for k in np.flatnonzero(program.fitted)
        for channel in program.channels[k]
        if channel.quantity == quantity
    ]
    seen = np.concatenate(seen)
    seen = seen[np.isfinite(seen)]
    return knots_of(seen, count) if seen.size else None
