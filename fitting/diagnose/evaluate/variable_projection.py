"""Variable projection: latent trajectories are linear unknowns, solved for under every model.

Under every model the best trajectories of a recording are found anew. What they explain is projected out of
misfit and derivatives. So a fit sees only what no trajectory explains. All of it is linear algebra on
derivatives by the fractions.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field

import jax
import numpy as np

from fitting.inference.channels import Channel
from pneusma_jax.late import Late

from ..settings import DEFAULT
from .latent_trajectories import LatentTrajectory
from .trajectory_elimination import best_steps, projected_columns

sparse, sparse_linalg = Late("scipy.sparse"), Late("scipy.sparse.linalg")

TRAJECTORIES = DEFAULT.trajectories


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


@dataclass(frozen=True)
class Projection:
    """All free trajectories of one recording as one sparse linear least-squares problem.

    Its unknowns go backwards in time, the trajectories of a row side by side. A row depends on the one before
    it and on the one that it remembers, which is earlier, too. In this order the factor of the system has
    hardly more entries than half of the system.

    Attributes:
        trajectories: the trajectories, at least one.
        channels: channels of the recording.
    """

    trajectories: Sequence[LatentTrajectory]
    channels: Sequence[Channel]
    _answers: dict[bytes, dict] = field(default_factory=dict, init=False, repr=False, compare=False)

    @functools.cached_property
    def design(self) -> "sparse.csr_array":
        """Derivative of the misfit by the unknowns, (values, unknowns).

        A whitened value depends on its own row and the one before, and on the rows that these remember.
        """
        here, before = (np.stack(c) for c in zip(*(c.coefficients for c in self.channels), strict=True))
        values, columns = [], []
        for trajectory, places in zip(self.trajectories, self._places, strict=True):
            remembered = places[trajectory.source]
            own, other = trajectory.own, trajectory.remembered
            values += [here * own, here * other, -before * _earlier(own), -before * _earlier(other)]
            columns += [places, remembered, _earlier(places), _earlier(remembered)]
        return _sparse(np.stack(values, axis=-1), np.stack(columns, axis=-1), self.fraction.size)

    @functools.cached_property
    def _walk(self) -> "sparse.csr_array":
        """Derivative of the weighted increments and of a hold on every row, (equations, unknowns)."""
        information = max(float(self.design.power(2).sum(axis=0).max()), TRAJECTORIES.hold_weight)
        maximum = TRAJECTORIES.maximum_stiffness * information  # more is lost to rounding
        weights = np.sqrt([np.minimum(trajectory.precision, maximum) for trajectory in self.trajectories])
        values = np.stack([weights, -weights], axis=-1)
        places, count = self._places, self.fraction.size
        columns = np.stack([places, _earlier(places)], axis=-1)
        held = np.full((count, 1), np.sqrt(TRAJECTORIES.hold_weight))
        hold = _sparse(held, np.arange(count)[:, None], count)
        return sparse.vstack([_sparse(values, columns, count), hold], format="csr")

    @functools.cached_property
    def system(self) -> "sparse.csc_array":
        """Second derivative of half the square of misfit and increments, (unknowns, unknowns)."""
        whole = sparse.vstack([self.design, self._walk], format="csr")
        found = whole.T @ whole
        found.sort_indices()
        return found

    @property
    def _places(self) -> np.ndarray:
        """Number of the unknown of every row, (trajectories, rows)."""
        rows, count = len(self.trajectories[0].fraction), len(self.trajectories)
        return np.arange(rows)[::-1] * count + np.arange(count)[:, None]

    @staticmethod
    def _ordered(by_row: np.ndarray) -> np.ndarray:
        """Unknowns (..., unknowns) from an array (..., trajectories, rows)."""
        turned = np.swapaxes(by_row[..., ::-1], -1, -2)
        return turned.reshape(*turned.shape[:-2], -1)

    def _by_row(self, unknowns: np.ndarray) -> np.ndarray:
        """An array (..., trajectories, rows) from unknowns (..., unknowns). Padding moves as the last row."""
        count = len(self.trajectories)
        turned = unknowns.reshape(*unknowns.shape[:-1], unknowns.shape[-1] // count, count)
        return self._with_padding(np.swapaxes(turned, -1, -2)[..., ::-1])

    @functools.cached_property
    def fraction(self) -> np.ndarray:
        """All trajectories, (unknowns,)."""
        return self._ordered(np.stack([trajectory.fraction for trajectory in self.trajectories]))

    @functools.cached_property
    def there(self) -> np.ndarray:
        """Mask of the rows of the recording, (unknowns,)."""
        return self._ordered(np.stack([trajectory.there for trajectory in self.trajectories]))

    def change(self, steps: np.ndarray) -> np.ndarray:
        """Change of the misfit (values,) with steps of the trajectories, (trajectories, rows)."""
        return self._changed(self._ordered(steps))

    def _changed(self, unknowns: np.ndarray) -> np.ndarray:
        """Change of the misfit (values,) with the unknowns (unknowns,), or of several, one in a row each."""
        return (self.design @ unknowns.T).T

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
        return self._project(jacobian, free, self._factor(free))

    @property
    def _inside(self) -> np.ndarray:
        """Mask of the rows that are neither padding nor at an end, (unknowns,)."""
        return self.there & (self.fraction > 0.0) & (self.fraction < 1.0)

    @functools.cached_property
    def _entries(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Row and column of every entry of the system, and where its diagonal is."""
        column = np.repeat(np.arange(self.system.shape[1]), np.diff(self.system.indptr))
        return self.system.indices, column, np.flatnonzero(self.system.indices == column)

    def _factor(self, free: np.ndarray) -> "sparse_linalg.SuperLU":
        """Factor of the system in which all but the free unknowns are held."""
        row, column, diagonal = self._entries
        entries = self.system.data * (free[row] & free[column])
        entries[diagonal] += ~free
        held = sparse.csc_array((entries, row, self.system.indptr), shape=self.system.shape)
        how = {"SymmetricMode": True}
        return sparse_linalg.splu(held, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=how)

    def _project(
        self, jacobian: np.ndarray, free: np.ndarray, factor: "sparse_linalg.SuperLU"
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `projected`, for a given mask of free unknowns and the factor of their system."""
        slopes = np.zeros((len(jacobian), len(free)))
        if len(jacobian):
            slopes = -factor.solve(np.where(free[:, None], self.design.T @ jacobian.T, 0.0)).T
        return jacobian + self._changed(slopes), self._by_row(slopes)

    def answer(self, misfit: np.ndarray, jacobian: np.ndarray) -> "Answer":
        """Best trajectories near those at which the model was evaluated, and the remaining misfit.

        Args:
            misfit: misfit of the model there, whitened, (values,).
            jacobian: its derivatives, (columns, values).
        """
        key = misfit.tobytes()  # a search needs the best trajectories first and their derivatives later
        if key not in self._answers:
            shaped = misfit.reshape(len(self.channels), -1)
            fraction = np.stack([trajectory.fraction for trajectory in self.trajectories])
            pull = np.stack([trajectory.pull() for trajectory in self.trajectories])
            self._answers[key] = jax.device_get(best_steps()(self._arrays, fraction, pull, shaped))
        best, slopes, projected = self._answers[key], [], []
        width = DEFAULT.optimiser.directions
        for first in range(0, len(jacobian), width):
            chunk = np.zeros((width, *best["misfit"].shape))
            part = jacobian[first : first + width]
            chunk[: len(part)] = part.reshape(len(part), *best["misfit"].shape)
            found = jax.device_get(projected_columns()(self._arrays, best["free"], chunk))
            slopes.append(found["slopes"][: len(part)])
            projected.append(found["jacobian"][: len(part)].reshape(len(part), -1))
        steps, none = best["step"], np.zeros((0, *best["step"].shape))
        return Answer(
            self._with_padding(steps),
            self._with_padding(np.concatenate([none, *slopes])),
            best["misfit"].flatten(),  # kept answers stay as they are
            np.concatenate([np.zeros((0, len(misfit))), *projected]),
        )

    @functools.cached_property
    def _arrays(self) -> tuple[np.ndarray, ...]:
        """The problem as `trajectory_elimination` takes it."""
        names = "own", "remembered", "source", "precision", "there"
        own = (np.stack([getattr(one, name) for one in self.trajectories]) for name in names)
        return *own, *(np.stack(c) for c in zip(*(c.coefficients for c in self.channels), strict=True))

    def _with_padding(self, found: np.ndarray) -> np.ndarray:
        """An array (..., trajectories, rows) whose padding moves as the last row."""
        found = found.copy()  # kept answers stay as they are
        for j, trajectory in enumerate(self.trajectories):
            found[..., j, trajectory.count :] = found[..., j, trajectory.count - 1 : trajectory.count]
        return found

    def degrees_of_freedom(self) -> float:
        """Degrees of freedom that the trajectories take: trace of their smoother, sum of `leverage`."""
        free = self._inside
        if not free.any():
            return 0.0
        (own,) = np.nonzero(free)
        information = np.where(free[:, None], (self.design.T @ self.design)[:, own].toarray(), 0.0)
        return float(np.sum(self._factor(free).solve(information)[own, np.arange(len(own))]))

    def leverage(self) -> np.ndarray:
        """Leverage of every measured value: the share of its error that trajectories follow, (values,)."""
        free = self._inside
        design = np.where(free[:, None], self.design.T.toarray(), 0.0)
        return np.sum(design * self._factor(free).solve(design), axis=0)


def degrees_of_freedom_of(each: Sequence[Projection | None]) -> np.ndarray:
    """Degrees of freedom that the trajectories of every recording take, (recordings,); 0 without any."""
    return np.array([0.0 if one is None else one.degrees_of_freedom() for one in each])


def _earlier(each: np.ndarray) -> np.ndarray:
    """Every row's entry of the row before, along the last axis; the first has its own."""
    return np.concatenate([each[..., :1], each[..., :-1]], axis=-1)


def _sparse(values: np.ndarray, columns: np.ndarray, count: int) -> "sparse.csr_array":
    """A sparse matrix with the same number of entries in every row.

    Args:
        values: shape (..., entries).
        columns: columns of the entries, broadcast against `values`. Those of a row that share one are added.
        count: number of columns.
    """
    rows = values.size // values.shape[-1]
    starts = np.arange(rows + 1, dtype=np.int32) * values.shape[-1]
    at = np.broadcast_to(columns, values.shape).astype(np.int32)
    return sparse.csr_array((values.ravel(), at.ravel(), starts), shape=(rows, count))
