"""Places of a model discrepancy: an output, or the silicone's stiffness within the model.

A change of an output by itself looks like an instrument. A change of stiffness along a clock, a temperature,
a current or the bending changes all outputs together. To first order both are a function of rows times a
response.
"""

import numpy as np

from fitting.specimens import specimen_of
from fitting.specimens.rows import MARK
from pneusma_jax.model_discrepancy import WALL

from ..evaluate.program import Program
from ..fit.instrument_drift import outputs_of
from ..fit.refit import Fit
from .locate import hats_at

Response = dict[str, np.ndarray]
"""Change of every output by that of a place in the same row, SI, by quantity, (recordings, rows)."""


def responses(program: Program, fit: Fit) -> dict[str, Response]:
    """Places of a fitted model with their effect on its outputs.

    An output acts by itself, under its name. The relative change of the silicone's stiffness, `WALL`, is a
    place where a base constant gives its effect.
    """
    ones = np.ones(program.stacked.mask.shape)
    found = {name: {name: ones} for name in outputs_of(program)}
    wall = _wall(program, fit)
    return found if wall is None else found | {WALL: wall}


def acts(place: str, driver: str, kind: str) -> bool:
    """True if a place may follow a driver: an output any, the silicone only those that no law follows."""
    return place != WALL or driver in specimen_of(kind).wall_drivers


def _wall(program: Program, fit: Fit) -> Response | None:
    """Derivatives by the logarithm of the silicone's stiffness; None where no constant is that."""
    unknowns = program.unknowns
    own = [k for k in unknowns.base if unknowns.items[k].name.partition(MARK)[0] == WALL]
    if not own:
        return None
    total: Response = {}
    slopes = program.slopes(fit.evaluation, np.array(own, int))
    for row, k in enumerate(own):
        share = unknowns.slope(fit.u, k, program.stacked)[1]  # of the stiffness itself
        value = float(unknowns.items[k].value(fit.u[k]))
        relative = np.divide(value, share, out=np.zeros_like(share), where=share != 0.0)
        for quantity, slope in slopes.items():
            change = relative[:, None] * np.nan_to_num(slope[row])
            total[quantity] = total.get(quantity, 0.0) + change
    return total


def hats(
    program: Program, k: int, j: int, response: Response, driver: np.ndarray, knots: np.ndarray
) -> np.ndarray:
    """Whitened hat functions of a driver, times a place's response, in channel j of recording k.

    Args:
        program: program of the campaign.
        k, j: numbers of the recording and of the channel.
        response: response of the place.
        driver: values of the driver by recording, (recordings, rows).
        knots: knots of the driver, ascending.

    Returns:
        Shape (knots, values); zero where the place does nothing to the channel.
    """
    channel = program.channels[k][j]
    if channel.quantity not in response:
        return np.zeros((len(knots), len(channel.measured)))
    x = np.clip(np.nan_to_num(driver[k]), knots[0], knots[-1])
    columns = hats_at(x, knots)
    there = np.isfinite(channel.sigma)
    return channel.whitened(np.where(there, columns * response[channel.quantity][k], 0.0))
