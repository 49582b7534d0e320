"""The compiled function of a campaign: outputs of all recordings, and derivatives along a few directions.

Every candidate effect is in it, neutral where it is absent.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.specimens.rows import Rows
from fitting.specimens.specimen import Specimen
from pneusma_jax.pipeline import Effect, Switched
from pneusma_jax.program_cache import cached_program

from ..settings import DEFAULT
from .evaluation import TRAJECTORY, Raw
from .latent_trajectories import remembered_rows
from .unknowns import Unknowns

OPTIMISER = DEFAULT.optimiser


class Compiled:
    """One program for every campaign of the same shapes: what a campaign states are arguments.

    Args:
        specimen: specimen that predicts the rows.
        unknowns: numbers that may be free.
        always: effects that the base model has.
        trajectories: latent trajectories of a recording.
    """

    def __init__(self, specimen: Specimen, unknowns: Unknowns, always: tuple[Effect, ...], trajectories: int):
        self._unknowns, self._always, self._trajectories = unknowns, always, trajectories
        count = len(unknowns.base)

        def outputs(
            base: dict, own: jax.Array, shifts: tuple, on: jax.Array, always: tuple, stacked: Rows
        ) -> tuple:
            rows = eqx.tree_at(lambda r: r.base, stacked, base)
            if shifts:
                moved = tuple(x + s for x, s in zip(rows.extra[TRAJECTORY], shifts, strict=True))
                rows = eqx.tree_at(lambda r: r.extra[TRAJECTORY], rows, moved)
            tried = unknowns.effects(jnp.concatenate([jnp.zeros(count), own]))
            effects = (*always, *(Switched(effect, on[k]) for k, effect in enumerate(tried)))
            return jax.vmap(lambda row: specimen.answer({}, row, effects))(rows)

        def evaluate(
            base: dict,
            own: jax.Array,
            along_base: dict,
            along_own: jax.Array,
            along_trajectories: tuple,
            on: jax.Array,
            always: tuple,
            stacked: Rows,
        ) -> tuple:
            still = tuple(0.0 * s[0] for s in along_trajectories)

            def along(*steps: Any) -> tuple:
                lead = lambda base, own, shifts: outputs(base, own, shifts, on, always, stacked)  # noqa: E731
                return jax.jvp(lead, (base, own, still), steps, has_aux=True)

            return jax.vmap(along, out_axes=(None, 0, None))(along_base, along_own, along_trajectories)

        name = f"diagnosis of {specimen!r}: {' '.join(unknowns.slugs)}"
        self._evaluate = cached_program(evaluate, name, specimen.compiler_options)

    @property
    def width(self) -> int:
        """Unknowns that one run brings derivatives by, at most."""
        return OPTIMISER.directions - 2 * self._trajectories

    def run(self, u: np.ndarray, columns: np.ndarray, stacked: Rows) -> Raw:
        """One run, along a few of the unknowns and every latent trajectory.

        Args:
            u: scaled numbers, (unknowns,).
            columns: indices of unknowns, at most `width`.
            stacked: recordings, with their latent trajectories.
        """
        unknowns, count = self._unknowns, self._trajectories
        base = unknowns.stated(u, stacked)
        along_own = np.zeros((OPTIMISER.directions, len(unknowns) - len(unknowns.base)))
        along_base = {name: np.zeros((OPTIMISER.directions, *value.shape)) for name, value in base.items()}
        for row, k in enumerate(columns):
            if k < len(unknowns.base):
                stem, share = unknowns.slope(u, k, stacked)
                along_base[stem][row] = share
            else:
                along_own[row, k - len(unknowns.base)] = 1.0
        along_trajectories = tuple(
            np.zeros((OPTIMISER.directions, *stacked.mask.shape)) for _ in range(count)
        )
        for j, direction in enumerate(along_trajectories):
            direction[OPTIMISER.directions - 2 * count + j] = 1.0
            direction[OPTIMISER.directions - count + j] = remembered_rows(
                np.asarray(stacked.extra[TRAJECTORY][j])
            )
        own, on = u[len(unknowns.base) :], unknowns.present(u, columns)
        found, slopes, drivers = jax.device_get(
            self._evaluate(base, own, along_base, along_own, along_trajectories, on, self._always, stacked)
        )
        return Raw(
            stacked,
            found,
            {name: value[: len(columns)] for name, value in slopes.items()},
            {name: value[OPTIMISER.directions - 2 * count :] for name, value in slopes.items()},
            drivers,
        )
