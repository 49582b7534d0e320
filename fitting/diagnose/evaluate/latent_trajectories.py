"""Latent trajectories: martensite fractions that explain a resistance and all other outputs together.

A fraction is a random walk. Its resistance determines the process-noise variance (`process_noise`). Under
every model the best trajectory is found anew and projected out of the misfit (`variable_projection`).

A spring remembers its hottest row, so an error there bends all rows that follow. Every row is coupled to the
row that it remembers.
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
        number: number of the trajectory.
        fraction: fraction at which the model was evaluated, (rows,).
        source: the row that each row remembers, (rows,).
        own: derivative of every channel by the fraction of the same row, (channels, rows).
        remembered: the same by that of the row it remembers.
        precision: precision of every increment from the row before, (rows,); zero for the first.
        count: number of rows of the recording; those after them are padding, and move as the last one does.
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
        process_noise: float,
        time: np.ndarray,
        count: int | None = None,
    ) -> "LatentTrajectory":
        """A trajectory from two derivatives of the channels, (channels, rows).

        Args:
            number: number of the trajectory.
            fraction: (rows,).
            moved: derivative when all rows move alike.
            memory: derivative when only `remembered_rows` move.
            process_noise: variance of the random walk per second.
            time: [s], (rows,).
            count: number of rows before the padding; all if None.
        """
        keeps, count = remembered_rows(fraction), len(fraction) if count is None else count
        latest = np.maximum.accumulate(np.where(keeps, np.arange(len(fraction)), 0))
        precision = 1.0 / (process_noise * intervals(time))
        precision[0], precision[count:] = 0.0, 0.0
        remembered = np.where(keeps, 0.0, memory)
        return cls(number, fraction, latest, moved - remembered, remembered, precision, count)

    @property
    def there(self) -> np.ndarray:
        """Mask of the rows of the recording, (rows,)."""
        return np.arange(len(self.fraction)) < self.count

    def change(self, step: np.ndarray) -> np.ndarray:
        """Change of the channels (channels, rows) with that of the trajectory (rows,)."""
        return self.own * step + self.remembered * step[self.source]

    def roughness(self, step: np.ndarray | float = 0.0) -> float:
        """Square of the increments once the trajectory has moved by a step, (rows,)."""
        moved = self.fraction + step
        return float(np.sum(self.precision * np.diff(moved, prepend=moved[:1]) ** 2))

    def pull(self) -> np.ndarray:
        """Derivative of half the increments' square, (rows,)."""
        rise = self.precision * np.diff(self.fraction, prepend=self.fraction[:1])
        return rise - np.append(rise[1:], 0.0)


def intervals(time: np.ndarray) -> np.ndarray:
    """Time from the row before [s], (rows,); the usual one where time stands still, as over the padding."""
    steps = np.diff(time, prepend=time[:1])
    usual = np.median(steps[steps > 0.0]) if np.any(steps > 0.0) else 1.0
    return np.where(steps > 0.0, steps, usual)


def remembered_rows(fraction: np.ndarray | jax.Array) -> np.ndarray | jax.Array:
    """Rows hotter than all before them, which later rows remember, along the last axis; may be traced."""
    xp = namespace_of(fraction)
    lowest = jax.lax.cummin(fraction, fraction.ndim - 1) if xp is jnp else np.minimum.accumulate(fraction, -1)
    first = xp.ones((*fraction.shape[:-1], 1), bool)
    return xp.concatenate([first, fraction[..., 1:] < lowest[..., :-1]], axis=-1)


def averaging(slope: np.ndarray, fraction: np.ndarray, block: int) -> np.ndarray:
    """Difference of a channel's mean over a block from its value at the mean fraction, (..., rows).

    Half the law's second derivative times the fraction's variance within the block, which it crosses evenly.

    Args:
        slope: derivative of the channel by the fraction, (..., rows).
        fraction: (rows,).
        block: samples in each row.
    """
    bend = np.gradient(slope, axis=-1) * np.gradient(fraction)
    return bend / 24.0 * (1.0 - 1.0 / block**2)
