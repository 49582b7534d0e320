"""Zeros of outputs that share a hidden trajectory, which takes up a part of each zero.

A fit that adapts a hidden trajectory leaves of its readings only the part that no trajectory explains. Its
residuals are a projection, r = (I - P) y, of the outputs together with the trajectory's prior. White noise
has unit variance in the range of I - P. A zero leaves there only A = (I - P) Z, the part that the trajectory
does not follow. So the residuals have the covariance I + A S A^T.

The rows of one output are then no independent readings. The residuals of a spring's resistance are half as
large as its noise, since the martensite fraction follows most of it. Taken as rows of a noise half as large,
resistance would weigh four times as much beside the force as in the fit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from .evidence import log_evidence
from .sizes import DRIFTS, OFFSETS, SCALES, Sizes, before_of
from .zeros import BINS, Size, root_of

FAINT = 1e-12
"""Minimum weight over the largest of a size that is kept. Once zeros are decided to drift, the weight of a
size beside another one may grow by up to 3e8."""


@dataclass(frozen=True)
class Shared:
    """Residuals of a recording whose outputs share a hidden trajectory, adapted to them by the fit.

    Attributes:
        misfit: residuals of all outputs and of the trajectory's prior over the noise, shape (residuals,).
        slopes: their derivatives by every free parameter, the trajectory following, shape (residuals,
            parameters).
        moved: by output, change of the residuals if a zero is off by the noise along each of `courses_of`,
            shape (residuals, `BINS`). The trajectory follows.
        time: by output, time of each row that counts, ascending, shape (rows,).
        count: number of readings less that of degrees of freedom that the trajectory takes.
    """

    misfit: np.ndarray
    slopes: np.ndarray
    moved: Mapping[str, np.ndarray]
    time: Mapping[str, np.ndarray]
    count: float

    @property
    def square(self) -> np.ndarray:
        """Squares of slopes and residuals, the last column, beside white noise."""
        rows = np.column_stack([self.slopes, self.misfit])
        return rows.T @ rows


def shared_sizes_of(
    recordings: Sequence[Shared], outputs: Sequence[str], precision: np.ndarray, pull: np.ndarray
) -> Sizes:
    """Probable sizes of the zeros of all outputs together, and what the recordings tell beside each.

    The white noise has one scale for all outputs: the trajectory mixes them. Drifts and offsets of the grid
    are in units of that noise, those of the result in units of the noise as it was stated.

    Args:
        recordings: residuals of all recordings, with the same outputs.
        outputs: outputs with readings, one or more.
        precision, pull: as of `lasting`.
    """
    grid = list(product(DRIFTS, OFFSETS))
    found = [_squares(one, outputs, grid) for one in recordings]
    square, determinant = (sum(part) for part in zip(*found, strict=True))
    count, spare = len(precision), sum(one.count for one in recordings)
    places = list(product(grid, repeat=len(outputs)))
    prior = np.array([sum(before_of(*zero) for zero in place) for place in places])
    parts = []
    for scale in SCALES:
        scaled = square / scale**2
        information, slope = scaled[:, :count, :count], scaled[:, :count, count]
        loss = scaled[:, count, count] + determinant + spare * np.log(scale**2)
        evidence = log_evidence(information, slope, loss, precision, pull)
        size = np.array([[(d * scale, o * scale, scale) for d, o in place] for place in places])
        parts.append((size, prior, evidence, information, slope, loss))
    best = max(np.max(part[1] + part[2]) for part in parts)
    kept = [part[1] + part[2] > best + np.log(FAINT) for part in parts]
    return Sizes(*(
        np.concatenate([part[k][keep] for part, keep in zip(parts, kept, strict=True)]) for k in range(6)
    ))  # fmt: skip


def square_beside(one: Shared, zeros: Mapping[str, Size]) -> np.ndarray:
    """Squares of slopes and residuals, the last column, beside zeros of one size for each output.

    Args:
        one: residuals of a recording.
        zeros: sizes by output, whose scale is one but for rounding; none for white noise.
    """
    square = one.square
    if not zeros:
        return square
    scale = float(np.mean([size[2] for size in zeros.values()]))
    columns = [one.moved[n] @ root_of(one.time[n], d / scale, o / scale) for n, (d, o, _) in zeros.items()]
    moved, rows = np.column_stack(columns), np.column_stack([one.slopes, one.misfit])
    side = moved.T @ rows
    own = moved.T @ moved + np.eye(moved.shape[1])
    return (square - side.T @ np.linalg.solve(own, side)) / scale**2


def _squares(
    one: Shared, outputs: Sequence[str], grid: Sequence[tuple[float, float]]
) -> tuple[np.ndarray, np.ndarray]:
    """Squares of slopes and residuals beside every combination of zeros, and its log-determinant.

    The zeros of one output after the other are taken out of all later columns.

    Returns:
        Shapes (sizes, parameters + 1, parameters + 1) and (sizes,), the last output's sizes fastest.
    """
    rows = np.column_stack([*(one.moved[name] for name in outputs), one.slopes, one.misfit])
    square, determinant = (rows.T @ rows)[None], np.zeros(1)
    for name in outputs:
        root = np.stack([root_of(one.time[name], *zero) for zero in grid])
        turned = np.swapaxes(root, 1, 2)
        own = turned @ square[:, None, :BINS, :BINS] @ root + np.eye(BINS)
        side = turned @ square[:, None, :BINS, BINS:]
        square = square[:, None, BINS:, BINS:] - np.swapaxes(side, 2, 3) @ np.linalg.solve(own, side)
        determinant = (determinant[:, None] + np.linalg.slogdet(own)[1]).ravel()
        square = square.reshape(-1, *square.shape[2:])
    return square, determinant
