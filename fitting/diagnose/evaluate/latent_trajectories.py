"""Latent trajectories: martensite fractions that have to explain a resistance and everything else together.

A fraction is no input and no parameter: it walks, as fast as its resistance shows and as the noise of all
channels leaves open. Under every model the best course is found anew, and what it takes up leaves the
misfit and its derivatives (variable projection): a fit sees only what no course explains. All of it
is linear algebra on the derivatives by the fractions, which a program returns beside those by its unknowns.

A spring remembers its hottest row: a fraction that noise pushed down there would bend all rows that follow.
So rows are coupled to the one that they remember, and a course is found that both explain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve

from fitting.inference.channels import Channel

from ..settings import DEFAULT

TRAJECTORIES = DEFAULT.trajectories


@dataclass(frozen=True)
class LatentTrajectory:
    """One free course of one recording, and how the channels change with it.

    Attributes:
        number: of the course.
        fraction: where it was when the model was evaluated, (rows,).
        source: the row that each row remembers, (rows,).
        own: derivative of every channel by the fraction of the same row, (channels, rows).
        remembered: the same by that of the row it remembers.
        precision: of every increment from the row before, (rows,); zero for the first.
    """

    number: int
    fraction: np.ndarray
    source: np.ndarray
    own: np.ndarray
    remembered: np.ndarray
    precision: np.ndarray

    @classmethod
    def of(
        cls,
        number: int,
        fraction: np.ndarray,
        moved: np.ndarray,
        memory: np.ndarray,
        pace: float,
        time: np.ndarray,
    ) -> "LatentTrajectory":
        """A course from two derivatives of the channels, (channels, rows).

        Args:
            number: of the course.
            fraction: (rows,).
            moved: derivative when all rows move alike.
            memory: derivative when only `remembered_rows` move.
            pace: variance of the walk per second.
            time: [s], (rows,).
        """
        keeps = remembered_rows(fraction)
        latest = np.maximum.accumulate(np.where(keeps, np.arange(len(fraction)), 0))
        precision = 1.0 / (pace * intervals(time))
        precision[0] = 0.0
        remembered = np.where(keeps, 0.0, memory)
        return cls(number, fraction, latest, moved - remembered, remembered, precision)

    def design(self, channels: Sequence[Channel]) -> np.ndarray:
        """Derivative of the misfit by every row of the course, (rows, values)."""
        count = len(self.fraction)
        each = np.arange(count)
        parts = []
        for channel, own, remembered in zip(channels, self.own, self.remembered, strict=True):
            plain = np.diag(own)
            np.add.at(plain, (self.source, each), remembered)
            parts.append(channel.whitened(plain))
        return np.concatenate(parts, axis=1)

    def change(self, step: np.ndarray) -> np.ndarray:
        """Change of the channels (channels, rows) with that of the course (rows,)."""
        return self.own * step + self.remembered * step[self.source]

    def stiffness(self) -> np.ndarray:
        """Second derivative of half the increments' square, with a hold on every row, (rows, rows)."""
        after = np.append(self.precision[1:], 0.0)
        found = np.diag(self.precision + after + TRAJECTORIES.hold_weight)
        each = np.arange(len(after) - 1)
        found[each, each + 1] = found[each + 1, each] = -self.precision[1:]
        return found

    def roughness(self, step: np.ndarray | float = 0.0) -> float:
        """Square of the increments once the course has moved by a step, (rows,)."""
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
    """All free courses of one recording as one linear problem.

    Attributes:
        courses: at least one.
        design: derivative of the misfit by their rows, one course after the other, (rows of all, values).
        stiffness: of their walks, (rows of all, rows of all).
        information: second derivative of half the misfit's square by their rows.
    """

    courses: Sequence[LatentTrajectory]
    design: np.ndarray
    stiffness: np.ndarray
    information: np.ndarray

    @classmethod
    def of(cls, courses: Sequence[LatentTrajectory], channels: Sequence[Channel]) -> "Hidden":
        """Courses of a recording with these channels."""
        design = np.concatenate([course.design(channels) for course in courses])
        return cls(courses, design, block_diag(*(c.stiffness() for c in courses)), design @ design.T)

    @property
    def fraction(self) -> np.ndarray:
        """All courses, one after the other."""
        return np.concatenate([course.fraction for course in self.courses])

    def roughness(self, steps: np.ndarray | None = None) -> float:
        """Square of all increments once the courses have moved by steps, (courses, rows)."""
        moves = np.zeros(len(self.courses)) if steps is None else steps
        return sum(course.roughness(step) for course, step in zip(self.courses, moves, strict=True))

    def projected(self, jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions of the misfit, (columns, values), less what the courses explain of them, and how the
        courses follow, (columns, free courses, rows). Rows at a limit are held there."""
        now = self.fraction
        free = (now > 0.0) & (now < 1.0)
        return self._less(jacobian, free)

    def _less(self, jacobian: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        slopes = np.zeros((len(jacobian), len(free)))
        if len(jacobian) and free.any():
            system = (self.information + self.stiffness)[np.ix_(free, free)]
            factor = cho_factor(system, check_finite=False)
            slopes[:, free] = -cho_solve(factor, self.design[free] @ jacobian.T, check_finite=False).T
        shape = (len(jacobian), len(self.courses), len(free) // len(self.courses))
        return jacobian + slopes @ self.design, slopes.reshape(shape)

    def answer(self, misfit: np.ndarray, jacobian: np.ndarray) -> "Answer":
        """Best courses near those at which the model was evaluated, and the misfit that they leave.

        Args:
            misfit: of the model there, whitened, (values,).
            jacobian: its derivatives, (columns, values).
        """
        system, now = self.information + self.stiffness, self.fraction
        pull = self.design @ misfit + np.concatenate([course.pull() for course in self.courses])
        free, step = np.ones(len(now), bool), np.zeros(len(now))
        for _ in range(TRAJECTORIES.limit_passes):
            if not free.any():
                break
            rest = pull[free] + system[np.ix_(free, ~free)] @ step[~free]
            factor = cho_factor(system[np.ix_(free, free)], check_finite=False)
            step[free] = -cho_solve(factor, rest, check_finite=False)
            beyond = free & ((now + step < 0.0) | (now + step > 1.0))
            if not beyond.any():
                break
            step[beyond] = np.clip(now + step, 0.0, 1.0)[beyond] - now[beyond]
            free &= ~beyond
        step = np.clip(
            np.clip(now + step, 0.0, 1.0) - now, -TRAJECTORIES.maximum_step, TRAJECTORIES.maximum_step
        )
        left, slopes = self._less(jacobian, free)
        return Answer(step.reshape(len(self.courses), -1), slopes, misfit + step @ self.design, left)

    def taken(self) -> np.ndarray:
        """Share of every measured value that courses take up: how far they follow its error, (values,)."""
        free = (self.fraction > 0.0) & (self.fraction < 1.0)
        design = self.design[free]
        if not free.any():
            return np.zeros(design.shape[1])
        factor = cho_factor((self.information + self.stiffness)[np.ix_(free, free)], check_finite=False)
        return np.sum(design * cho_solve(factor, design, check_finite=False), axis=0)


@dataclass(frozen=True)
class Answer:
    """What the courses of one recording do to its misfit.

    Attributes:
        steps: change of the free courses, (free courses, rows).
        slopes: derivatives of the free courses, (columns, free courses, rows).
        misfit: that is left, (values,). The increments of the walk are not in it: where a course is loose or
            stiff they hardly count; between, a fit sees a little less than a profiled likelihood shows.
        jacobian: its derivatives, (columns, values).
    """

    steps: np.ndarray
    slopes: np.ndarray
    misfit: np.ndarray
    jacobian: np.ndarray


def averaging(slope: np.ndarray, fraction: np.ndarray, block: int) -> np.ndarray:
    """What a channel's mean over a block differs from its value at the mean fraction, (..., rows).

    Half the law's second derivative times the fraction's variance within the block, which it crosses evenly.

    Args:
        slope: derivative of the channel by the fraction, (..., rows).
        fraction: (rows,).
        block: samples in each row.
    """
    bend = np.gradient(slope, axis=-1) * np.gradient(fraction)
    return bend / 24.0 * (1.0 - 1.0 / block**2)


def process_noise_of(
    reading: Channel, slope: np.ndarray, misfit: np.ndarray, course: np.ndarray, time: np.ndarray
) -> float:
    """Variance per second with which a fraction walks, as its resistance says: that of largest evidence,
    NaN where none is much better.

    Args:
        reading: the resistance.
        slope: its derivative by the fraction, (rows,).
        misfit: model minus data, SI, (rows,).
        course: fraction at which the model was evaluated, (rows,).
        time: [s], (rows,).
    """
    there = np.isfinite(reading.sigma) & np.isfinite(misfit) & (slope != 0.0)
    if there.sum() < 3:
        return np.nan
    slow = np.sqrt((1.0 + reading.correlation) / (1.0 - reading.correlation))
    told, noise = slope[there], (slow * reading.sigma)[there]
    seen = told * course[there] - misfit[there]
    steps = intervals(time[there])
    paces = np.asarray(TRAJECTORIES.process_noise_variances)
    mean, variance = np.full(len(paces), course[there][0]), np.ones(len(paces))
    evidence = np.zeros(len(paces))
    for s, sigma, y, dt in zip(told, noise, seen, steps, strict=True):
        variance = variance + paces * dt
        spread = s**2 * variance + sigma**2
        surprise = y - s * mean
        evidence -= 0.5 * (np.log(spread) + surprise**2 / spread)
        gain = variance * s / spread
        mean, variance = mean + gain * surprise, variance * sigma**2 / spread
    return (
        float(paces[np.argmax(evidence)])
        if np.ptp(evidence) > TRAJECTORIES.minimum_evidence_spread
        else np.nan
    )


def estimated_process_noise(found: np.ndarray) -> np.ndarray:
    """Paces of all courses, zero where there is none; where one is not told (NaN), the others' median."""
    told = found[np.isfinite(found) & (found > 0.0)]
    usual = 10.0 ** np.median(np.log10(told)) if told.size else TRAJECTORIES.usual_process_noise_variance
    return np.where(np.isfinite(found), found, usual)
