"""Random effects of instruments: an offset and a drift of a zero, estimated from a fit's residuals, and their
effect on the intervals of its constants.

Besides white noise each recording may have a constant offset of its zero and a random walk from its start.
Its inputs have such zeros, too, of the same size in units of their own noise.
Their sizes follow from the marginal likelihood of the linearised fit (restricted maximum likelihood, D. A.
Harville, J. Am. Stat. Assoc. 72 (1977) 320). It accounts for the part that the fit has absorbed.

A fit that treats the noise as white ignores this. Zeros of known sizes make the noise correlated. The
constants then have the centre and the covariance of generalised least squares. The sizes are uncertain, so a
constant's distribution is a mixture of such Gaussians over a grid of sizes, weighted by their probability
given the data. Intervals leave out as much of that mixture below as above.

Outputs may share a hidden trajectory, as a spring's force and resistance share its martensite fraction. Then
they are one group: the trajectory takes up a part of each zero and of the noise (`shared`).

Two simpler ways make intervals of clean recordings too wide. One is the covariance that a white fit has
beside a drift, the sandwich A^-1 (J' V J + P) A^-1. It is the mean over all courses of that drift, also those
that the residuals at hand exclude. The other is a variance averaged over the grid. A drift may be as
probable as 3 % but six times as wide as the noise. It doubles that variance, and widens a 90 % interval by
7 %.
"""

from .intervals import (
    SURE_OF_WHITE,
    Lasting,
    covariance_beside_zeros,
    lasting,
    lasting_beside_trajectories,
    side_variances_by_name,
    variances_by_name,
)
from .shared import Shared
from .zeros import Series, Size, courses_of, modes_of

__all__ = [
    "SURE_OF_WHITE",
    "Lasting",
    "Series",
    "Shared",
    "Size",
    "courses_of",
    "covariance_beside_zeros",
    "lasting",
    "lasting_beside_trajectories",
    "modes_of",
    "side_variances_by_name",
    "variances_by_name",
]
