"""Latent trajectories: martensite fractions that explain a resistance and all other outputs together.

A fraction is a random walk. Its resistance determines the process-noise variance. Under every model the best
trajectory is found anew and projected out of misfit and derivatives (variable projection). So a fit sees only
what no trajectory explains. All of it is linear algebra on derivatives by the fractions.

A spring remembers its hottest row, so an error there bends all rows that follow. Every row is coupled to the
row that it remembers.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve
from scipy.linalg.lapack import dpotri
from scipy.sparse import coo_array, csr_array, vstack

from fitting.inference.channels import Channel

from ..settings import DEFAULT

TRAJECTORIES = DEFAULT.trajectories


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

    def design(self, channels: Sequence[Channel]) -> csr_array:
        """Derivative of the misfit by every row of the trajectory, (rows, values), of which few are not zero.

        A whitened value depends on its own row and the one before, and on the rows that these remember.
        """
        size = len(self.fraction)
        each = np.arange(size)
        rows, columns, values = [], [], []
        for k, (channel, own, remembered) in enumerate(zip(channels, self.own, self.remembered, strict=True)):
            here, before = channel.coefficients
            rows += [each, self.source, each[:-1], self.source[:-1]]
            columns += [k * size + part for part in (each, each, each[1:], each[1:])]
            values += [here * own, here * remembered, -before[1:] * own[:-1], -before[1:] * remembered[:-1]]
        at = np.concatenate(rows), np.concatenate(columns)
        return coo_array((np.concatenate(values), at), shape=(size, size * len(channels))).tocsr()

    @property
    def there(self) -> np.ndarray:
        """Mask of the rows of the recording, (rows,)."""
        return np.arange(len(self.fraction)) < self.count

    def change(self, step: np.ndarray) -> np.ndarray:
        """Change of the channels (channels, rows) with that of the trajectory (rows,)."""
        return self.own * step + self.remembered * step[self.source]

    def stiffness(self) -> np.ndarray:
        """Second derivative of half the increments' square, with a hold on every row, (rows, rows)."""
        after = np.append(self.precision[1:], 0.0)
        found = np.diag(self.precision + after + TRAJECTORIES.hold_weight)
        each = np.arange(len(after) - 1)
        found[each, each + 1] = found[each + 1, each] = -self.precision[1:]
        return found

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


def remembered_rows(fraction: np.ndarray) -> np.ndarray:
    """Rows hotter than all before them, which later rows remember, along the last axis."""
    lowest = np.minimum.accumulate(fraction, axis=-1)
    found = np.ones(fraction.shape, bool)
    found[..., 1:] = fraction[..., 1:] < lowest[..., :-1]
    return found


@dataclass(frozen=True)
class Hidden:
    """All free trajectories of one recording as one linear least-squares problem.

    Attributes:
        trajectories: the trajectories, at least one.
        design: derivative of the misfit by their rows, one trajectory after the other, (rows of all, values);
            sparse.
        stiffness: stiffness of their random walks, (rows of all, rows of all).
        information: second derivative of half the misfit's square by their rows.
    """

    trajectories: Sequence[LatentTrajectory]
    design: csr_array
    stiffness: np.ndarray
    information: np.ndarray
    _answers: dict[bytes, tuple] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, trajectories: Sequence[LatentTrajectory], channels: Sequence[Channel]) -> "Hidden":
        """Trajectories of a recording with these channels."""
        design = vstack([trajectory.design(channels) for trajectory in trajectories], format="csr")
        walks = block_diag(*(trajectory.stiffness() for trajectory in trajectories))
        return cls(trajectories, design, walks, (design @ design.T).toarray())

    @property
    def fraction(self) -> np.ndarray:
        """All trajectories, one after the other."""
        return np.concatenate([trajectory.fraction for trajectory in self.trajectories])

    def roughness(self, steps: np.ndarray | None = None) -> float:
        """Square of all increments once the trajectories have moved by steps, (trajectories, rows)."""
        moves = np.zeros(len(self.trajectories)) if steps is None else steps
        return sum(
            trajectory.roughness(step) for trajectory, step in zip(self.trajectories, moves, strict=True)
        )

    def projected(self, jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions of the misfit projected off the trajectories. Rows at 0 or 1 are held there.

        Args:
            jacobian: the directions, (columns, values).

        Returns:
            The projected directions, and the derivatives of the trajectories, (columns, free trajectories,
            rows).
        """
        free = self._inside
        return self._less(jacobian, free, self._factor(free))

    @property
    def _inside(self) -> np.ndarray:
        """Mask of the rows that are neither padding nor at an end, (rows of all,)."""
        return self.there & (self.fraction > 0.0) & (self.fraction < 1.0)

    @functools.cached_property
    def there(self) -> np.ndarray:
        """Mask of the rows of the recording, (rows of all,)."""
        return np.concatenate([trajectory.there for trajectory in self.trajectories])

    @functools.cached_property
    def system(self) -> np.ndarray:
        """Second derivative of half the square of misfit and increments, (rows of all, rows of all)."""
        return self.information + self.stiffness

    def _factor(self, free: np.ndarray) -> tuple | None:
        """Cholesky factor of the free rows' system; None where no row is free."""
        return cho_factor(self.system[np.ix_(free, free)], check_finite=False) if free.any() else None

    def _less(
        self, jacobian: np.ndarray, free: np.ndarray, factor: tuple | None
    ) -> tuple[np.ndarray, np.ndarray]:
        slopes = np.zeros((len(jacobian), len(free)))
        if len(jacobian) and factor is not None:
            slopes[:, free] = -cho_solve(factor, (self.design @ jacobian.T)[free], check_finite=False).T
        return jacobian + slopes @ self.design, self._padded(slopes)

    def _padded(self, moves: np.ndarray) -> np.ndarray:
        """Moves of all rows (..., rows of all) by trajectory (..., trajectories, rows). The padding moves as
        the last row does."""
        count = len(self.trajectories)
        found = moves.reshape(*moves.shape[:-1], count, moves.shape[-1] // count).copy()  # kept answers stay
        for j, trajectory in enumerate(self.trajectories):
            found[..., j, trajectory.count :] = found[..., j, trajectory.count - 1 : trajectory.count]
        return found

    def answer(self, misfit: np.ndarray, jacobian: np.ndarray) -> "Answer":
        """Best trajectories near those at which the model was evaluated, and the remaining misfit.

        Args:
            misfit: misfit of the model there, whitened, (values,).
            jacobian: its derivatives, (columns, values).
        """
        key = misfit.tobytes()  # a search asks for the best of a run first, and for its derivatives later
        if key not in self._answers:
            self._answers[key] = self._best(misfit)
        step, free, factor = self._answers[key]
        left, slopes = self._less(jacobian, free, factor)
        return Answer(self._padded(step), slopes, misfit + step @ self.design, left)

    def release(self) -> None:
        """Drop what answers were made of, half of the memory. Another answer makes it again.

        Fits keep their evaluations, and these ask for no more answers.
        """
        self._answers.clear()
        self.__dict__.pop("system", None)

    def _best(self, misfit: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple | None]:
        """Step of all rows, the mask of those that are at no end after it, and the factor of their system."""
        now = self.fraction
        pull = self.design @ misfit + np.concatenate([trajectory.pull() for trajectory in self.trajectories])
        free, step, factor = self.there.copy(), np.zeros(len(now)), None
        for _ in range(TRAJECTORIES.limit_passes):
            factor = self._factor(free)
            if factor is None:
                break
            held = np.flatnonzero(self.there & ~free)
            rest = pull[free] + self.system[np.ix_(free, held)] @ step[held]
            step[free] = -cho_solve(factor, rest, check_finite=False)
            beyond = free & ((now + step < 0.0) | (now + step > 1.0))
            if not beyond.any():
                break
            step[beyond] = np.clip(now + step, 0.0, 1.0)[beyond] - now[beyond]
            free, factor = free & ~beyond, None
        step = np.clip(
            np.clip(now + step, 0.0, 1.0) - now, -TRAJECTORIES.maximum_step, TRAJECTORIES.maximum_step
        )
        return step, free, self._factor(free) if factor is None else factor

    def degrees_of_freedom(self) -> float:
        """Degrees of freedom that the trajectories take: trace of their smoother, sum of `leverage`."""
        free = self._inside
        if not free.any():
            return 0.0
        told, walk = (x[np.ix_(free, free)] for x in (self.information, self.stiffness))
        factor, lower = cho_factor(told + walk, lower=True, check_finite=False)
        inverse, _ = dpotri(factor, lower=lower)  # half the work of solving for every column
        half = np.tril(inverse)
        return float(2.0 * np.sum(half * told) - np.sum(np.diag(half) * np.diag(told)))

    def leverage(self) -> np.ndarray:
        """Leverage of every measured value: the share of its error that trajectories follow, (values,)."""
        free = self._inside
        factor = self._factor(free)
        if factor is None:
            return np.zeros(self.design.shape[1])
        design = self.design.toarray()[free]
        return np.sum(design * cho_solve(factor, design, check_finite=False), axis=0)


def taken_by(each: Sequence[Hidden | None]) -> np.ndarray:
    """Degrees of freedom that the trajectories of every recording take, (recordings,); 0 without any."""
    return np.array([0.0 if one is None else one.degrees_of_freedom() for one in each])


@dataclass(frozen=True)
class Answer:
    """The best trajectories of one recording, and its misfit with them.

    Attributes:
        steps: change of the free trajectories, (free trajectories, rows).
        slopes: derivatives of the free trajectories, (columns, free trajectories, rows).
        misfit: remaining misfit, (values,). It leaves out the increments of the walk, which hardly count
            where a trajectory is loose or stiff. Between these cases, a fit sees a little less than the
            profile likelihood.
        jacobian: its derivatives, (columns, values).
    """

    steps: np.ndarray
    slopes: np.ndarray
    misfit: np.ndarray
    jacobian: np.ndarray


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


def process_noise_of(
    reading: Channel, slope: np.ndarray, misfit: np.ndarray, trajectory: np.ndarray, time: np.ndarray
) -> float:
    """Process-noise variance per second of a fraction, of largest evidence by its resistance.

    NaN where no variance is much better than the others.

    Args:
        reading: the resistance.
        slope: its derivative by the fraction, (rows,).
        misfit: model minus data, SI, (rows,).
        trajectory: fraction at which the model was evaluated, (rows,).
        time: [s], (rows,).
    """
    there = np.isfinite(reading.sigma) & np.isfinite(misfit) & (slope != 0.0)
    if there.sum() < 3:
        return np.nan
    slow = np.sqrt((1.0 + reading.correlation) / (1.0 - reading.correlation))
    gradient, noise = slope[there], (slow * reading.sigma)[there]
    read = gradient * trajectory[there] - misfit[there]
    steps = intervals(time[there])
    process_noise_of_trajectories = np.asarray(TRAJECTORIES.process_noise_variances)
    mean, variance = (
        np.full(len(process_noise_of_trajectories), trajectory[there][0]),
        np.ones(len(process_noise_of_trajectories)),
    )
    evidence = np.zeros(len(process_noise_of_trajectories))
    for s, sigma, y, dt in zip(gradient, noise, read, steps, strict=True):
        variance = variance + process_noise_of_trajectories * dt
        spread = s**2 * variance + sigma**2
        innovation = y - s * mean
        evidence -= 0.5 * (np.log(spread) + innovation**2 / spread)
        gain = variance * s / spread
        mean, variance = mean + gain * innovation, variance * sigma**2 / spread
    return (
        float(process_noise_of_trajectories[np.argmax(evidence)])
        if np.ptp(evidence) > TRAJECTORIES.minimum_evidence_spread
        else np.nan
    )


def estimated_process_noise(found: np.ndarray) -> np.ndarray:
    """Process-noise variances of all trajectories; the median of the others where one is NaN."""
    known = found[np.isfinite(found) & (found > 0.0)]
    usual = 10.0 ** np.median(np.log10(known)) if known.size else TRAJECTORIES.usual_process_noise_variance
    return np.where(np.isfinite(found), found, usual)
