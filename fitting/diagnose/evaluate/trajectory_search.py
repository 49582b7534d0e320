"""The search for latent trajectories under a model: each recording by itself, in shared runs of the program.

A Gauss-Newton step that makes a recording worse is halved. Where rows switch between laws (friction, contact,
reversal), full steps would cycle, and a fit would see noise.

The damping is that of `gauss_newton.settle`, which searches one trajectory inside a compiled program. Here a
run of the program serves all recordings that are still open. A step eliminates rows: 0.6 ms for 200 rows of
two springs. The bounded trust-region step of `inference.least_squares` takes 130 ms for as many fractions.
"""

from collections.abc import Sequence

import numpy as np

from fitting.inference.channels import Channel

from ..settings import DEFAULT
from .evaluation import Raw, trajectories_of
from .variable_projection import Projection

TRAJECTORIES = DEFAULT.trajectories


class Search:
    """State of the search after the runs so far.

    Args:
        channels: channels by recording.
        process_noise: variance of every trajectory per second, zero where it is held, (recordings,
            trajectories).
        failed: standard deviations that a row without an answer counts for.
        chosen: mask of the recordings that are asked for, (recordings,); all if None.

    Attributes:
        best: every recording from the run that fitted it best.
        projections: linear problem of its trajectories there; None where it has none.
        overshot: recordings whose linear answer was tried and was worse, (recordings,).
    """

    def __init__(
        self,
        channels: Sequence[Sequence[Channel]],
        process_noise: np.ndarray,
        failed: float,
        chosen: np.ndarray | None = None,
    ):
        self._channels, self._process_noise, self._failed = channels, process_noise, failed
        count = len(channels)
        self.best: Raw | None = None
        self.projections: list[Projection | None] = [None] * count
        self.overshot = np.zeros(count, bool)
        self._least, self._share = np.full(count, np.inf), np.full(count, 0.5)
        self._open = np.ones(count, bool) if chosen is None else chosen.copy()
        self._steps = np.zeros(0)

    @property
    def finished(self) -> bool:
        """True if no recording asks for another run."""
        return not self._open.any()

    @property
    def open(self) -> np.ndarray:
        """Mask of the recordings that ask for another run, (recordings of the stack,)."""
        found = np.zeros(len(self.best.stacked.mask), bool)
        found[: len(self._open)] = self._open
        return found

    @property
    def proposal(self) -> np.ndarray:
        """Trajectories to try next, (recordings of the stack, trajectories, rows)."""
        share = np.where(self._open, self._share, 0.0)
        found = trajectories_of(self.best.stacked)
        found[: len(share)] += share[:, None, None] * self._steps[: len(share)]
        return found

    def add(self, run: Raw) -> None:
        """Take in a run at `proposal`, or at where the search begins."""
        if self.best is None:
            self._steps = np.zeros_like(trajectories_of(run.stacked))
        better = np.zeros(len(run.stacked.mask), bool)
        for k in np.flatnonzero(self._open):
            projection = run.projection(k, self._channels[k], self._process_noise[k])
            misfit = run.misfit(k, self._channels[k], self._failed)
            square = float(misfit @ misfit) + (projection.roughness() if projection else 0.0)
            better[k] = square < self._least[k]
            if better[k]:
                self._least[k], self.projections[k] = square, projection
                self._begin(k, misfit)
            else:
                self._share[k] *= 0.5
                self.overshot[k] = True
                self._open[k] = self._share[k] >= TRAJECTORIES.minimum_step_share
        self.best = run if self.best is None else self.best.taking(run, better)

    def _begin(self, k: int, misfit: np.ndarray) -> None:
        """A step of recording k from where it is best now."""
        projection, self.overshot[k] = self.projections[k], False
        if projection is None:
            self._open[k] = False
            return
        answer = projection.answer(misfit, np.zeros((0, len(misfit))))
        gained = self._least[k] - float(answer.misfit @ answer.misfit) - projection.roughness(answer.steps)
        self._steps[k] = 0.0
        for trajectory, step in zip(projection.trajectories, answer.steps, strict=True):
            self._steps[k, trajectory.number] = step
        self._share[k] = min(2.0 * self._share[k], 1.0)
        far = np.max(np.abs(answer.steps), initial=0.0) >= TRAJECTORIES.sufficient_step
        self._open[k] = far and gained > max(
            TRAJECTORIES.minimum_gain, TRAJECTORIES.minimum_gain_share * self._least[k]
        )
