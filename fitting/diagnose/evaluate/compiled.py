"""The compiled function of a campaign: the outputs of all recordings and their derivatives along a few
directions, with every candidate effect, neutral where it is absent."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.inference.program_cache import cached_program
from fitting.specimens.rows import Rows
from fitting.specimens.specimen import Specimen
from pneusma_jax.pipeline import Effect, Switched

from .evaluation import COURSE, Raw
from .latent_trajectories import remembered_rows
from .unknowns import Unknowns

WIDTH = 16
"""Directions of one run, those of latent trajectories included."""


class Compiled:
    """One program for every campaign of the same shapes: what a campaign states are arguments.

    Args:
        specimen: how rows are predicted.
        unknowns: numbers that may be free.
        always: effects that the base model has.
        courses: latent trajectories of a recording.
    """

    def __init__(self, specimen: Specimen, unknowns: Unknowns, always: tuple[Effect, ...], courses: int):
        self._unknowns, self._always, self._courses = unknowns, always, courses
        count = len(unknowns.base)

        def outputs(
            base: dict, own: jax.Array, shifts: tuple, on: jax.Array, always: tuple, stacked: Rows
        ) -> tuple:
            rows = eqx.tree_at(lambda r: r.base, stacked, base)
            if shifts:
                moved = tuple(x + s for x, s in zip(rows.extra[COURSE], shifts, strict=True))
                rows = eqx.tree_at(lambda r: r.extra[COURSE], rows, moved)
            tried = unknowns.effects(jnp.concatenate([jnp.zeros(count), own]))
            effects = (*always, *(Switched(effect, on[k]) for k, effect in enumerate(tried)))
            return jax.vmap(lambda row: specimen.answer({}, row, effects))(rows)

        def evaluate(
            base: dict,
            own: jax.Array,
            along_base: dict,
            along_own: jax.Array,
            along_courses: tuple,
            on: jax.Array,
            always: tuple,
            stacked: Rows,
        ) -> tuple:
            still = tuple(0.0 * s[0] for s in along_courses)

            def along(*steps: Any) -> tuple:
                lead = lambda base, own, shifts: outputs(base, own, shifts, on, always, stacked)  # noqa: E731
                return jax.jvp(lead, (base, own, still), steps, has_aux=True)

            return jax.vmap(along, out_axes=(None, 0, None))(along_base, along_own, along_courses)

        name = f"diagnosis of {specimen.kind}: {' '.join(unknowns.slugs)}"
        self._evaluate = cached_program(evaluate, name, specimen.compiler_options)

    @property
    def width(self) -> int:
        """Unknowns that one run brings derivatives by, at most."""
        return WIDTH - 2 * self._courses

    def run(self, u: np.ndarray, columns: np.ndarray, stacked: Rows) -> Raw:
        """One run, along a few of the unknowns and every latent trajectory.

        Args:
            u: scaled numbers, (unknowns,).
            columns: at most `width` indices of unknowns.
            stacked: recordings, with their latent trajectories.
        """
        unknowns, count = self._unknowns, self._courses
        base = unknowns.stated(u, stacked)
        along_own = np.zeros((WIDTH, len(unknowns) - len(unknowns.base)))
        along_base = {name: np.zeros((WIDTH, *value.shape)) for name, value in base.items()}
        for row, k in enumerate(columns):
            if k < len(unknowns.base):
                stem, share = unknowns.slope(u, k, stacked)
                along_base[stem][row] = share
            else:
                along_own[row, k - len(unknowns.base)] = 1.0
        along_courses = tuple(np.zeros((WIDTH, *stacked.mask.shape)) for _ in range(count))
        for j, direction in enumerate(along_courses):
            direction[WIDTH - 2 * count + j] = 1.0
            direction[WIDTH - count + j] = remembered_rows(np.asarray(stacked.extra[COURSE][j]))
        own, on = u[len(unknowns.base) :], unknowns.present(u, columns)
        found, slopes, drivers = jax.device_get(
            self._evaluate(base, own, along_base, along_own, along_courses, on, self._always, stacked)
        )
        return Raw(
            stacked,
            found,
            {name: value[: len(columns)] for name, value in slopes.items()},
            {name: value[WIDTH - 2 * count :] for name, value in slopes.items()},
            drivers,
        )
