"""Evidence that noise of inputs explains: an effect that averages it away fits better by that alone.

A channel half a row late is predicted from the mean of two rows of a noisy temperature, and a lag from many.
The same white noise is put on the inputs under both models. The difference of what both pass on is no
evidence.
"""

import numpy as np

from ..evaluate.inputs import shifted, white_noise
from ..evaluate.program import Program
from ..settings import DEFAULT
from .refit import Fit

CHANCE = DEFAULT.chance
CROSS_VALIDATION = DEFAULT.cross_validation


def explained_by_input_noise(program: Program, current: Fit, further: Fit) -> float:
    """Log-likelihood that a further model gains because it passes on less noise of inputs, not deflated."""
    noise = white_noise(program.recordings, program.stacked)
    if not any(sigma.any() for sigma in noise.values()):
        return 0.0
    return 0.5 * max(_passed_on(program, current, noise) - _passed_on(program, further, noise), 0.0)


def _passed_on(program: Program, fit: Fit, noise: dict[str, np.ndarray]) -> float:
    """Chi-square of fitted recordings that noise of inputs alone makes under a model, less what hidden
    trajectories follow of it.

    Args:
        program: program of the campaign.
        fit: model.
        noise: 1-sigmas of inputs, SI, by quantity, (recordings of the stack,).
    """
    still = program.begun(program.stacked, fit.evaluation, fit.u)
    rng, noisy = np.random.default_rng(CROSS_VALIDATION.input_seed), still
    for name, sigma in noise.items():
        kicks = rng.standard_normal(np.shape(still.inputs[name]))
        noisy = shifted(noisy, name, sigma[:, None] * kicks)
    nothing, total = program.unknowns.base[:0], 0.0
    there, moved = (program.evaluate(fit.u, nothing, rows).misfit for rows in (still, noisy))
    followed = program.followed(fit.evaluation)
    for k in np.flatnonzero(program.fitted):
        change = np.where(np.abs(moved[k] - there[k]) < CHANCE.outlier, moved[k] - there[k], 0.0)
        change = followed[k].projected(change[None])[0][0] if followed[k] else change
        total += float(change @ change)
    return total
