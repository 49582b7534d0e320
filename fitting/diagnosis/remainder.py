"""What no named effect explains, as a smooth function of what it goes with: described, not explained.

It holds within the range of the drivers that were recorded, and is never extrapolated: beyond, it is unknown.
"""

from dataclasses import dataclass

import numpy as np

from .explain import Explanation
from .generic import RIDGE, hats, knots_of
from .locate import Place, drivers_of
from .trials import reduced


@dataclass(frozen=True)
class Remainder:
    """A piecewise linear correction of the first channel.

    Attributes:
        quantity: channel that it adds to.
        driver: what it is a function of.
        knots: of the driver, ascending; the correction is unknown outside.
        values: correction at each knot, SI.
        before, after: reduced chi-square on recordings that decide, without and with it.
    """

    quantity: str
    driver: str
    knots: np.ndarray
    values: np.ndarray
    before: float
    after: float


def remainder(explanation: Explanation, place: Place) -> Remainder | None:
    """Describe what the final model leaves by the driver that describes it best on the fitted recordings."""
    program, fit = explanation.program, explanation.final
    judge = program.unseen
    drivers = drivers_of(program, fit)
    best = None
    for name in place.drivers:
        knots = knots_of(drivers[name])
        if knots is None:
            continue
        A, r = _columns(explanation, drivers[name], knots, program.fitted)
        values = -np.linalg.solve(
            A.T @ A + RIDGE * np.trace(A.T @ A) / len(knots) * np.eye(len(knots)), A.T @ r
        )
        misfit = float(np.sum((r + A @ values) ** 2))
        if best is None or misfit < best[0]:
            best = (misfit, name, knots, values)
    if best is None:
        return None
    _, name, knots, values = best
    B, s = _columns(explanation, drivers[name], knots, judge)
    others = fit.evaluation.chi2(judge.astype(float)) - float(s @ s)
    after = (others + float(np.sum((s + B @ values) ** 2))) / max(program.observations(judge), 1)
    quantity = program.channels[0][0].quantity
    return Remainder(quantity, name, knots, values, reduced(program, fit, judge), after)


def _columns(
    explanation: Explanation, driver: np.ndarray, knots: np.ndarray, chosen: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whitened hat functions of a driver, and whitened misfit of the first channel, of some recordings."""
    program, fit = explanation.program, explanation.final
    blocks, misfit = [], []
    for k in np.flatnonzero(chosen):
        channel = program.channels[k][0]
        blocks.append(hats(program, k, 0, driver, knots).T)
        misfit.append(fit.evaluation.misfit[k][: len(channel.measured)])
    return np.concatenate(blocks), np.concatenate(misfit)
