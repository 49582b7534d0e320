"""Noise of measured inputs that an effect averages away: what fits better by that alone is no physics.

A channel that runs half a row late is predicted from the mean of two rows of a noisy temperature, and a lag
from that of many. The same noise is put on the inputs under both models; what the further one passes on less
is what it gains by luck.
"""

import jax.numpy as jnp
import numpy as np

from .evaluation import with_courses
from .inputs import input_noise, readings_kept, shifted
from .program import Program
from .refit import Fit

SEED = 20
"""Of the noise that both models get."""
LOST = 10.0
"""Change in standard deviations of a value that noise does not make: a row lost its answer."""


def averaged_away(program: Program, current: Fit, further: Fit) -> float:
    """Log-likelihood that a further model gains because it passes on less noise of inputs, not deflated."""
    if not input_noise(program.recordings, program.stacked):
        return 0.0
    return 0.5 * max(_passed_on(program, current) - _passed_on(program, further), 0.0)


def _passed_on(program: Program, fit: Fit) -> float:
    """Chi-square of fitted recordings that the noise of inputs alone makes under a model."""
    quiet = with_courses(program.stacked, fit.evaluation.courses)
    rng, noisy = np.random.default_rng(SEED), quiet
    for name, sigma in input_noise(program.recordings, quiet).items():
        left = sigma * readings_kept(program.recordings, quiet, name)
        noise = rng.standard_normal(np.shape(quiet.inputs[name]))
        noisy = shifted(noisy, name, jnp.asarray(left[:, None] * noise))
    nothing, total = program.unknowns.base[:0], 0.0
    there, moved = (program.evaluate(fit.u, nothing, rows).misfit for rows in (quiet, noisy))
    for k in np.flatnonzero(program.fitted):
        change = moved[k] - there[k]
        total += float(np.sum(change[np.abs(change) < LOST] ** 2))
    return total
