"""Results of a program: one run of the compiled function, and the evaluation that is made of runs.

Latent trajectories are solved for between the two. A run holds them where they were. The misfit of an
evaluation is that of the best ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.inference.channels import Channel
from fitting.specimens.rows import Rows

from ..settings import DEFAULT
from .latent_trajectories import LatentTrajectory, averaging
from .process_noise import estimated_process_noise, process_noise_of
from .variable_projection import Projection

TRAJECTORIES = DEFAULT.trajectories

TRAJECTORY = "xi0"
"""Column of rows that keeps latent trajectories: a tuple of columns."""


def trajectories_of(stacked: Rows) -> np.ndarray:
    """Latent trajectories of a stack, (recordings, trajectories, rows); none where it keeps none."""
    columns = stacked.extra.get(TRAJECTORY, ())
    columns = columns if isinstance(columns, tuple) else ()  # a column of its own is no latent trajectory
    shape = (len(stacked.mask), 0, stacked.mask.shape[1])
    return np.stack([np.asarray(x) for x in columns], axis=1) if len(columns) else np.zeros(shape)


def row_count(stacked: Rows, k: int) -> int:
    """Number of rows of recording k of a stack, without the padding at its end."""
    there = np.flatnonzero(np.asarray(stacked.mask)[k])
    return int(there[-1]) + 1 if there.size else 0


def with_trajectories(stacked: Rows, found: np.ndarray) -> Rows:
    """A stack with other latent trajectories, (recordings, trajectories, rows)."""
    if not found.shape[1]:
        return stacked
    return replace(stacked, extra=stacked.extra | {TRAJECTORY: tuple(np.moveaxis(found, 1, 0).copy())})


@dataclass(frozen=True)
class Raw:
    """One run of the compiled program.

    Attributes:
        stacked: the recordings.
        found: outputs by quantity, (recordings, rows).
        slopes: their derivatives by unknowns, (columns, recordings, rows).
        along: the same by latent trajectories: each moved as a whole, then in its remembered rows alone.
        drivers: drivers of the outputs, by name, (recordings, rows).
    """

    stacked: Rows
    found: dict[str, np.ndarray]
    slopes: dict[str, np.ndarray]
    along: dict[str, np.ndarray]
    drivers: dict[str, np.ndarray]

    def projection(
        self, k: int, channels: Sequence[Channel], process_noise: np.ndarray
    ) -> Projection | None:
        """Free trajectories of recording k as a linear problem; None if there are none.

        Args:
            k: number of the recording.
            channels: channels that count.
            process_noise: variance of every trajectory per second, zero where it is held, (trajectories,).
        """
        slopes = np.stack([self.along[channel.quantity][:, k] for channel in channels], axis=1)
        good = np.stack([self.good(k, channel) for channel in channels])
        slopes = np.where(good, np.nan_to_num(slopes), 0.0)
        at, time = trajectories_of(self.stacked)[k], np.asarray(self.stacked.time)[k]
        count = row_count(self.stacked, k)
        free = [
            LatentTrajectory.of(
                j, at[j], slopes[j], slopes[len(process_noise) + j], process_noise[j], time, count
            )
            for j in np.flatnonzero(process_noise)
        ]
        return Projection(free, channels) if free else None

    def taking(self, other: "Raw", chosen: np.ndarray) -> "Raw":
        """The run with chosen recordings taken from another.

        Args:
            other: run of the same program and columns.
            chosen: mask, (recordings of the stack,).
        """
        if not chosen.any():
            return self
        if chosen.all():
            return other
        row, trajectory = chosen[:, None], chosen[:, None, None]
        pick = lambda mine, theirs: {n: np.where(row, theirs[n], x) for n, x in mine.items()}  # noqa: E731
        moved = np.where(trajectory, trajectories_of(other.stacked), trajectories_of(self.stacked))
        return Raw(
            with_trajectories(self.stacked, moved),
            pick(self.found, other.found),
            pick(self.slopes, other.slopes),
            pick(self.along, other.along),
            pick(self.drivers, other.drivers),
        )

    def good(self, k: int, channel: Channel) -> np.ndarray:
        """Rows of recording k for which the model has an answer with derivatives, (rows,)."""
        slope = self.slopes[channel.quantity][:, k]
        return np.isfinite(self.found[channel.quantity][k]) & np.all(np.isfinite(slope), axis=0)

    def process_noise_of_trajectories(
        self, channels: Sequence[Sequence[Channel]], numbers: Sequence[int]
    ) -> np.ndarray:
        """Process-noise variance of every latent trajectory, by its own resistance; 0 where there is none.

        Returns:
            Shape (recordings, trajectories).

        Args:
            channels: channels by recording.
            numbers: numbers of the springs, in the order of the trajectories.
        """
        names = [f"resistance_{n}" for n in numbers]
        found, at = np.zeros((len(channels), len(names))), trajectories_of(self.stacked)
        for k, members in enumerate(channels):
            for channel in members:
                if channel.quantity in names:
                    j = names.index(channel.quantity)
                    slope = np.nan_to_num(self.along[channel.quantity][j, k])
                    misfit = self.found[channel.quantity][k] - channel.measured
                    time = np.asarray(self.stacked.time)[k]
                    found[k, j] = process_noise_of(channel, slope, misfit, at[k, j], time)
        return estimated_process_noise(found)

    def averaging(
        self, k: int, channels: Sequence[Channel], process_noise: np.ndarray, block: int
    ) -> list[np.ndarray]:
        """Uncertainty of recording k that averaging over fast changes of a phase leaves, by channel, (rows,).

        Args:
            k: number of the recording.
            channels: channels that count.
            process_noise: same as in `projection`.
            block: readings that a row is the mean of.
        """
        projection, count = self.projection(k, channels, process_noise), row_count(self.stacked, k)
        found = [np.zeros(self.stacked.mask.shape[1]) for _ in channels]
        for trajectory in projection.trajectories if projection else ():
            slopes = trajectory.own + trajectory.remembered
            parts = averaging(slopes[:, :count], trajectory.fraction[:count], block)
            for total, part in zip(found, parts, strict=True):
                total[:count] += np.abs(part)
        return found

    def whitened(
        self, k: int, channels: Sequence[Channel], failed: float
    ) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
        """Misfit of recording k, its derivatives, and predictions by channel.

        Args:
            k: number of the recording.
            channels: channels that count.
            failed: standard deviations that a row without an answer counts for.
        """
        good = [self.good(k, channel) for channel in channels]
        derivatives, plain = [], []
        for channel, there in zip(channels, good, strict=True):
            predicted, slope = self.found[channel.quantity][k], self.slopes[channel.quantity][:, k]
            plain.append(np.where(there, predicted, np.nan))
            derivatives.append(channel.whitened(np.where(there, slope, 0.0)))
        return self._missed(k, channels, failed, good), np.concatenate(derivatives, axis=1), plain

    def misfit(self, k: int, channels: Sequence[Channel], failed: float) -> np.ndarray:
        """Whitened misfit of recording k, all its channels in a row, (values,); as `whitened` takes them."""
        return self._missed(k, channels, failed, [self.good(k, channel) for channel in channels])

    def _missed(
        self, k: int, channels: Sequence[Channel], failed: float, good: Sequence[np.ndarray]
    ) -> np.ndarray:
        """`misfit`, where the rows with an answer are known by channel."""
        pieces = []
        for channel, there in zip(channels, good, strict=True):
            missed = self.found[channel.quantity][k] - channel.measured
            missed = np.where(there, missed, failed * channel.sigma)
            pieces.append(channel.whitened(np.where(np.isfinite(channel.sigma), missed, 0.0)))
        return np.concatenate(pieces)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Results of one evaluation; each is equal to itself alone.

    Attributes:
        misfit: whitened model minus data of each recording, all its channels in a row, (values,).
        jacobian: its derivative by each scaled unknown that was asked for, (columns, values).
        predicted: predictions of each recording and channel, SI, (rows,), NaN where the model has no answer.
        drivers: drivers of the outputs, by name, (recordings, rows).
        u: scaled numbers, (unknowns,).
        columns: unknowns that derivatives are by.
        trajectories: latent trajectories, (recordings of the stack, trajectories, rows).
        trajectory_slopes: their derivatives, (columns, recordings of the stack, trajectories, rows).
        projections: linear problem of every recording's trajectories. None if it has none, none were moved,
            or the program itself finds them.
        asked: mask of the recordings that were asked for, (recordings,).
        problem: what the program held, see `Program.holds`; nothing where other recordings were evaluated.
    """

    misfit: list[np.ndarray]
    jacobian: list[np.ndarray]
    predicted: list[list[np.ndarray]]
    drivers: dict[str, np.ndarray]
    u: np.ndarray
    columns: np.ndarray
    trajectories: np.ndarray
    trajectory_slopes: np.ndarray
    projections: list[Projection | None]
    asked: np.ndarray
    problem: tuple = ()

    def trajectories_at(self, u: np.ndarray) -> np.ndarray:
        """Latent trajectories at other numbers, to first order."""
        change = np.tensordot(u[self.columns] - self.u[self.columns], self.trajectory_slopes, axes=1)
        return np.clip(
            self.trajectories + np.clip(change, -TRAJECTORIES.maximum_step, TRAJECTORIES.maximum_step),
            0.0,
            1.0,
        )

    def bettered(self, other: "Evaluation", by: float = 0.0) -> "Evaluation":
        """The evaluation with those recordings of another one, at the same numbers, that fit better there.

        Args:
            other: evaluation with derivatives by the same unknowns.
            by: by how much their sum of squares must be smaller.
        """
        squares = [[float(m @ m) for m in one.misfit] for one in (self, other)]
        better = np.array([b < a - by for a, b in zip(*squares, strict=True)])
        return self.taking(other, better) if better.any() else self

    def taking(self, other: "Evaluation", chosen: np.ndarray) -> "Evaluation":
        """The evaluation with chosen recordings taken from another one at the same numbers.

        Args:
            other: evaluation with derivatives by the same unknowns.
            chosen: mask, (recordings,).

        Raises:
            ValueError: if the derivatives are by others.
        """
        if not np.array_equal(self.columns, other.columns):
            raise ValueError(f"derivatives by {self.columns} and by {other.columns} cannot be joined")
        row = np.zeros(len(next(iter(self.drivers.values()))), bool)
        row[: len(chosen)] = chosen

        def pick(mine: list, theirs: list) -> list:
            return [b if taken else a for a, b, taken in zip(mine, theirs, chosen, strict=True)]

        along = row[:, None, None]
        return replace(
            self,
            misfit=pick(self.misfit, other.misfit),
            jacobian=pick(self.jacobian, other.jacobian),
            predicted=pick(self.predicted, other.predicted),
            drivers={n: np.where(row[:, None], other.drivers[n], x) for n, x in self.drivers.items()},
            trajectories=np.where(along, other.trajectories, self.trajectories),
            trajectory_slopes=np.where(along, other.trajectory_slopes, self.trajectory_slopes),
            projections=pick(self.projections, other.projections),
            asked=np.where(chosen, other.asked, self.asked),
        )

    def joined(self, weight: np.ndarray | list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Misfit and Jacobian (values, columns) of recordings, each weighed by a number or a mask.

        Raises:
            ValueError: if a recording counts that was not asked for.
        """
        self._check(weight)
        r = np.concatenate([w * m for w, m in zip(weight, self.misfit, strict=True)])
        J = np.concatenate([w * j for w, j in zip(weight, self.jacobian, strict=True)], axis=1)
        return r, J.T

    def chi2(self, weight: np.ndarray) -> float:
        """Sum of squares of the weighed misfit.

        Raises:
            ValueError: if a recording counts that was not asked for.
        """
        self._check(weight)
        return float(sum(np.sum((w * m) ** 2) for w, m in zip(weight, self.misfit, strict=True)))

    def _check(self, weight: np.ndarray | list[np.ndarray]) -> None:
        """Refuse recordings whose misfit is zero because nobody asked for them."""
        missing = [k for k, w in enumerate(weight) if np.any(w) and not self.asked[k]]
        if missing:
            raise ValueError(f"recordings {missing} were not evaluated")
