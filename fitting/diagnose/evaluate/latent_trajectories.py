"""Latent trajectories: martensite fractions that explain a resistance and all other outputs together.

A fraction is a random walk. Its resistance determines the process-noise variance (`process_noise`). Under
every model the best trajectory is found anew and projected out of the misfit (`variable_projection`).

A spring remembers its hottest row so far, the one with the lowest fraction. So an error there bends all rows
that follow. Every row is coupled to the row that it remembers.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from pneusma_jax.numerics.safe import namespace_of


@dataclass(frozen=True)
class LatentTrajectory:
    """One free trajectory of one recording, and derivatives of the channels by it.

    Attributes:
        number: which of the recording's trajectories it is, from 0; those that are held count, too.
        fraction: fraction at which the model was evaluated, (rows,).
        source: index of the row that each row remembers, (rows,).
        own: derivative of every channel by the fraction of the same row, (channels, rows).
        remembered: derivative of every channel by the fraction of the remembered row, (channels, rows).
        precision: inverse variance of every increment from the row before, (rows,); zero for the first.
        count: number of rows of the recording. Rows after them are padding; their fraction changes with that
            of the last row.
    """

    number: int
    fraction: np.ndarray
    source: np.ndarray
    own: np.ndarray
    remembered: np.ndarray
    precision: np.ndarray
    count: int

    @classmethod
    def of(
        cls,
        number: int,
        fraction: np.ndarray,
        moved: np.ndarray,
        memory: np.ndarray,
        process_noise: float | np.ndarray,
        time: np.ndarray,
        count: int | None = None,
        source: np.ndarray | None = None,
    ) -> "LatentTrajectory":
        """A trajectory from two derivatives of the channels, (channels, rows).

        Args:
            number: which of the recording's trajectories it is.
            fraction: (rows,).
            moved: derivative of the channels when the fraction changes by the same in all rows.
            memory: derivative of the channels when it changes only in rows that are remembered.
            process_noise: variance of the random walk per second; one, or one by row.
            time: [s], (rows,).
            count: number of rows before the padding; all if None.
            source: index of the row that each row remembers, (rows,); the hottest so far if None.
        """
        rows, count = np.arange(len(fraction)), len(fraction) if count is None else count
        keeps = remembered_rows(fraction) if source is None else source == rows
        latest = np.maximum.accumulate(np.where(keeps, rows, 0))
        precision = 1.0 / (process_noise * intervals(time))
        precision[0], precision[count:] = 0.0, 0.0
        remembered = np.where(keeps, 0.0, memory)
        return cls(number, fraction, latest, moved - remembered, remembered, precision, count)

    @property
    def there(self) -> np.ndarray:
        """Mask of the rows of the recording, (rows,)."""
        return np.arange(len(self.fraction)) < self.count

    def change(self, step: np.ndarray) -> np.ndarray:
        """Change of the channels, (channels, rows), if the fraction changes by a step, (rows,)."""
        return self.own * step + self.remembered * step[self.source]

    def roughness(self, step: np.ndarray | float = 0.0) -> float:
        """Sum of squared increments times their precision, if the fraction changes by a step, (rows,)."""
        stepped = self.fraction + step
        return float(np.sum(self.precision * np.diff(stepped, prepend=stepped[:1]) ** 2))

    def pull(self) -> np.ndarray:
        """Derivative of half the roughness by the fraction of every row, (rows,)."""
        weighted = self.precision * np.diff(self.fraction, prepend=self.fraction[:1])
        return weighted - np.append(weighted[1:], 0.0)


def intervals(time: np.ndarray) -> np.ndarray:
    """Time from the row before [s], (rows,).

    Where time does not go on, as in the first row and over the padding, it is the median of all others.
    """
    steps = np.diff(time, prepend=time[:1])
    median = np.median(steps[steps > 0.0]) if np.any(steps > 0.0) else 1.0
    return np.where(steps > 0.0, steps, median)


def remembered_rows(fraction: np.ndarray | jax.Array) -> np.ndarray | jax.Array:
    """Mask of the rows that later rows remember: those with a lower fraction than all before them.

    Args:
        fraction: NumPy or JAX array, (..., rows); it may be traced.
    """
    xp = namespace_of(fraction)
    lowest = jax.lax.cummin(fraction, fraction.ndim - 1) if xp is jnp else np.minimum.accumulate(fraction, -1)
    first = xp.ones((*fraction.shape[:-1], 1), bool)
    return xp.concatenate([first, fraction[..., 1:] < lowest[..., :-1]], axis=-1)


def averaging(slope: np.ndarray, fraction: np.ndarray, block: int) -> np.ndarray:
    """Difference of a channel's mean over a block from its value at the mean fraction, (..., rows).

    The fraction is taken to change evenly within a block. The difference is half the law's second derivative
    times the variance of the fraction. For many samples this is a twelfth of its squared change over a row.

    Args:
        slope: derivative of the channel by the fraction, (..., rows).
        fraction: (rows,).
        block: samples in each row.
    """
    bend = np.gradient(slope, axis=-1) * np.gradient(fraction)
    return bend / 24.0 * (1.0 - 1.0 / block**2)
