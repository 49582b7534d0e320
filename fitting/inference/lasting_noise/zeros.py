"""A zero of an instrument along a recording: its covariance, its modes, and what residuals tell beside it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

BINS = 32
"""Maximum number of blocks of rows that a recording is averaged to; drifts are slow."""


class Size(NamedTuple):
    """Size of a zero: standard deviations in units of the noise as it was stated.

    Attributes:
        drift: that of its drift at the end of a recording.
        offset: that of its offset.
        scale: that of the white noise.
    """

    drift: float
    offset: float
    scale: float


WHITE = Size(0.0, 0.0, 1.0)
"""A zero that neither is off nor drifts, beside the noise as it was stated."""


@dataclass(frozen=True)
class Series:
    """Residuals of a fit for one output of one recording, rows in the order of time.

    Attributes:
        time: time of each row that counts, ascending, shape (rows,).
        misfit: residual over the noise, shape (rows,).
        slopes: derivatives of the residual by every free parameter, shape (rows, parameters).
        output: name of the output; outputs of one name share an instrument.
        count: number of readings averaged in a row.
        share: part of the noise's standard deviation that the instrument itself makes, 0 to 1, shape (rows,);
            inputs make the rest.
    """

    time: np.ndarray
    misfit: np.ndarray
    slopes: np.ndarray
    output: str
    count: np.ndarray | float = 1.0
    share: np.ndarray | float = 1.0


def squares(one: Series, drift: float, offset: float, scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squares of slopes and residuals, the last column, in units of correlated noise; its log-determinant.

    Within a block a zero is constant. So the rows of a block, less their mean, have white noise only.

    Args:
        one: residuals of one output of one recording.
        drift, offset: size of its zero.
        scales: standard deviations of the white noise, shape (scales,).

    Returns:
        Shapes (scales, parameters + 1, parameters + 1) and (scales,).
    """
    blocks, variance = _binned(one), scales**2
    rows, block = np.column_stack([one.slopes, one.misfit]), np.column_stack([blocks.slopes, blocks.misfit])
    width, axes = np.linalg.eigh(_slow(blocks, drift, offset))
    turned, noise = axes.T @ block, variance[:, None] + np.maximum(width, 0.0)
    between = np.einsum("bi,sb,bj->sij", turned, 1.0 / noise, turned)
    within = (rows.T @ rows - block.T @ block) / variance[:, None, None]
    spare = len(one.misfit) - len(width)
    return within + between, np.log(noise).sum(axis=1) + spare * np.log(variance)


def square(one: Series, size: Size) -> np.ndarray:
    """The squares beside a zero of one size."""
    return squares(one, *size[:2], np.array([size[2]]))[0][0]


def modes_of(
    time: np.ndarray, share: np.ndarray, drift: float, offset: float
) -> tuple[np.ndarray, np.ndarray]:
    """Modes of a zero along a recording, and their variances in units of the noise.

    Args:
        time: time of each row that counts, ascending, shape (rows,).
        share: as of `Series`.
        drift, offset: size of the zero.

    Returns:
        Orthonormal modes, constant within a block, shape (rows, `BINS`), zero beyond the number of rows; and
        variances, shape (`BINS`,).
    """
    modes, variance = np.zeros((len(time), BINS)), np.zeros(BINS)
    if not len(time):
        return modes, variance
    blocks = _blocks(time, share)
    width, axes = np.linalg.eigh(_slow(blocks, drift, offset))
    number = np.repeat(np.arange(len(width)), blocks.count)
    modes[:, : len(width)] = axes[number] / np.sqrt(blocks.count)[number, None]
    variance[: len(width)] = np.maximum(width, 0.0)
    return modes, variance


def courses_of(time: np.ndarray) -> np.ndarray:
    """Courses of a zero that is off within one block only, orthonormal, shape (rows, `BINS`).

    Args:
        time: time of each row that counts, ascending, shape (rows,).
    """
    found = np.zeros((len(time), BINS))
    if len(time):
        count = _blocks(time).count
        number = np.repeat(np.arange(len(count)), count)
        found[np.arange(len(time)), number] = 1.0 / np.sqrt(count)[number]
    return found


def root_of(time: np.ndarray, drift: float, offset: float) -> np.ndarray:
    """Root R of the covariance R R^T of a zero along `courses_of`, shape (`BINS`, `BINS`); see `modes_of`."""
    found = np.zeros((BINS, BINS))
    if len(time):
        width, axes = np.linalg.eigh(_slow(_blocks(time), drift, offset))
        found[: len(width), : len(width)] = axes * np.sqrt(np.maximum(width, 0.0))
    return found


def _blocks(time: np.ndarray, share: np.ndarray | float = 1.0) -> Series:
    """Blocks of rows without residuals."""
    return _binned(Series(time, np.zeros(len(time)), np.zeros((len(time), 0)), "", share=share))


def _binned(one: Series) -> Series:
    """The series in at most `BINS` blocks, each with the noise of a single row."""
    edges = np.linspace(0, len(one.misfit), min(BINS, len(one.misfit)) + 1).astype(int)
    size = np.diff(edges)
    total = lambda x: np.add.reduceat(x, edges[:-1], axis=0)  # noqa: E731
    root = np.sqrt(size)
    slopes = total(one.slopes) / root[:, None]
    share = total(np.broadcast_to(one.share, one.misfit.shape)) / size
    return Series(total(one.time) / size, total(one.misfit) / root, slopes, one.output, size, share)


def _slow(one: Series, drift: float, offset: float) -> np.ndarray:
    """Covariance of zeros with offset and drift, between blocks, shape (blocks, blocks).

    The zeros of the instrument and of the inputs are independent, of one size in units of their noise.
    """
    course = (one.time - one.time[0]) / max(float(np.ptp(one.time)), 1e-12)
    walk = drift**2 * np.minimum.outer(course, course) + offset**2
    inputs = np.sqrt(1.0 - np.minimum(one.share, 1.0) ** 2)
    alike = np.multiply.outer(one.share, one.share) + np.multiply.outer(inputs, inputs)
    return walk * alike * np.sqrt(np.multiply.outer(one.count, one.count))
