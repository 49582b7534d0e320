"""The compiled function of a campaign: outputs of all recordings, and derivatives along a few directions.

Every candidate effect is in it, neutral where it is absent. Constants that no fit frees have no derivatives
there. Kinds whose rows take long run their recordings one by one, side by side on all cores. Their program is
then the same for any number of recordings.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.inference.parallel import run_short_jobs
from fitting.specimens.rows import MARK, Rows
from fitting.specimens.specimen import Specimen
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.pipeline import Effect, Switched
from pneusma_jax.program_cache import cached_program, of_package

from ..settings import DEFAULT
from .building import DIAGNOSIS
from .evaluation import TRAJECTORY, Raw, trajectories_of
from .latent_trajectories import remembered_rows
from .packed import Grouped, Named, Packed
from .unknowns import Unknowns

OPTIMISER = DEFAULT.optimiser

Outputs = tuple[dict[str, np.ndarray], dict[str, np.ndarray], dict[str, np.ndarray]]
"""Outputs, (recordings, rows), their derivatives, (directions, recordings, rows), and drivers, by name."""


class Compiled:
    """One program for every campaign of the same shapes: what a campaign states are arguments.

    Args:
        specimen: specimen that predicts the rows.
        unknowns: numbers that may be free.
        always: effects that the base model has.
        trajectories: latent trajectories of a recording.

    Attributes:
        one_by_one: true if recordings are run by themselves.
    """

    def __init__(self, specimen: Specimen, unknowns: Unknowns, always: tuple[Effect, ...], trajectories: int):
        self._unknowns, self._always, self._trajectories = unknowns, always, trajectories
        self.one_by_one, self._differenced = specimen.each_alone, specimen.differenced
        self._parts: dict[tuple, tuple[list, dict[tuple, Packed]]] = {}
        count = len(unknowns.base)

        def outputs(
            base: Named, own: jax.Array, moved: jax.Array, on: jax.Array, always: tuple, rows: Rows
        ) -> tuple:
            rows = eqx.tree_at(lambda r: r.base, rows, rows.base | base.columns)
            if trajectories:
                rows = replace(rows, extra=rows.extra | {TRAJECTORY: tuple(moved)})
            tried = unknowns.effects(jnp.concatenate([jnp.zeros(count), own]))
            effects = (*always, *(Switched(effect, on[k]) for k, effect in enumerate(tried)))
            each = lambda row: specimen.answer({}, row, effects)  # noqa: E731
            return _of_one(each, rows) if self.one_by_one else jax.vmap(each)(rows)

        def evaluate(
            base: Named,
            still: Named,
            own: jax.Array,
            moved: jax.Array,
            along_base: Named,
            along_own: jax.Array,
            on: jax.Array,
            always: tuple,
            recordings: Packed,
        ) -> tuple:
            rows = eqx.tree_at(lambda r: r.base, recordings.tree, still.columns)
            along_trajectories = _each_trajectory(moved, self.width)

            def along(*steps: Any) -> tuple:
                lead = lambda base, own, moved: outputs(base, own, moved, on, always, rows)  # noqa: E731
                return jax.jvp(lead, (base, own, moved), steps, has_aux=True)

            found, slopes, drivers = jax.vmap(along, out_axes=(None, 0, None))(
                along_base, along_own, along_trajectories
            )
            return Grouped.of(found), Grouped.of(slopes), Grouped.of(drivers)

        name = f"{DIAGNOSIS} {specimen!r}: {' '.join(unknowns.slugs)}"
        keep = all(of_package(CATALOGUE[slug]) for slug in unknowns.slugs)  # one's own may change
        self._evaluate = cached_program(evaluate, name, specimen.compiler_options, keep)

    @property
    def width(self) -> int:
        """Unknowns that one run brings derivatives by, at most."""
        return OPTIMISER.directions

    def at(self, unknowns: Unknowns) -> "Compiled":
        """The same compiled function for base constants with other nominal values, as read off recordings.

        Args:
            unknowns: the same numbers in the same order.
        """
        other = copy(self)
        other._unknowns = unknowns
        return other

    def run(
        self, u: np.ndarray, columns: np.ndarray, stacked: Rows, chosen: np.ndarray | None = None
    ) -> Raw:
        """One run, along a few of the unknowns and every latent trajectory.

        Args:
            u: scaled numbers, (unknowns,).
            columns: indices of unknowns, at most `width`.
            stacked: recordings, with their latent trajectories.
            chosen: mask of the recordings that are asked for, (recordings of the stack,); all if None. What a
                run returns for others is not defined.
        """
        unknowns, count = self._unknowns, self._trajectories
        stated, most = unknowns.stated(u, stacked), self.width + 2 * count
        free = {unknowns.items[k].name.partition(MARK)[0] for k in unknowns.base}
        free = set(stated) if self._differenced else free  # so that one program serves any free constants
        names, others = (tuple(n for n in stated if (n in free) == wanted) for wanted in (True, False))
        base, still = (
            np.stack([stated[n] for n in some], axis=-1) if some else np.zeros((len(stacked.mask), 0))
            for some in (names, others)
        )
        along_base = np.zeros((most, *base.shape))
        along_own = np.zeros((most, len(unknowns) - len(unknowns.base)))
        for row, k in enumerate(columns):
            if k < len(unknowns.base):
                stem, share = unknowns.slope(u, k, stacked)
                along_base[row, :, names.index(stem)] = share
            else:
                along_own[row, k - len(unknowns.base)] = 1.0
        own, on = u[len(unknowns.base) :], unknowns.present(u, columns)
        moved = np.moveaxis(trajectories_of(stacked), 1, 0) if count else np.zeros((0, *stacked.mask.shape))
        parts = self._packed(stacked)

        def evaluate(part: slice = slice(None)) -> Outputs:
            found = self._evaluate(
                Named(base[part], names),
                Named(still[part], others),
                own,
                moved[:, part],
                Named(along_base[:, part], names),
                along_own,
                on,
                self._always,
                parts(part),
            )
            return tuple(Grouped.apart(one) for one in jax.device_get(found))

        there = np.asarray(stacked.mask).any(axis=1) & (True if chosen is None else chosen)
        found, slopes, drivers = _one_by_one(evaluate, there) if self.one_by_one else evaluate()
        return Raw(
            stacked,
            found,
            {name: value[: len(columns)] for name, value in slopes.items()},
            {name: value[self.width :] for name, value in slopes.items()},
            drivers,
        )

    def _packed(self, stacked: Rows) -> Callable[[slice], Packed]:
        """Function that packs a part of a stack, without what runs vary. Parts are packed once."""
        still = eqx.tree_at(lambda r: r.base, stacked, {})
        if self._trajectories:
            still = replace(still, extra={name: x for name, x in still.extra.items() if name != TRAJECTORY})
        leaves, structure = jax.tree.flatten(still)
        key = structure, *map(id, leaves)
        known = self._parts.get(key)
        if known is None:
            if len(self._parts) >= OPTIMISER.kept_stacks:
                self._parts.pop(next(iter(self._parts)), None)
            known = self._parts[key] = leaves, {}  # which keeps the arrays, and so their ids
        packed = known[1]

        def of_part(part: slice) -> Packed:
            place = part.start, part.stop
            if place not in packed:
                packed[place] = Packed.of(structure.unflatten([np.asarray(leaf)[part] for leaf in leaves]))
            return packed[place]

        return of_part


def _each_trajectory(moved: jax.Array, first: int) -> jax.Array:
    """Directions of a run along trajectories: each as a whole, then its remembered rows alone.

    Args:
        moved: trajectories, (trajectories, recordings, rows).
        first: number of directions before these, which are along none.
    """
    count = len(moved)
    still = jnp.zeros((first, *moved.shape))
    unit = jnp.eye(count)[:, :, None, None]
    whole = unit * jnp.ones_like(moved)
    return jnp.concatenate([still, whole, unit * remembered_rows(moved)]) if count else still


def _of_one(each: Callable[[Rows], tuple], stack: Rows) -> tuple:
    """A function of the only recording of a stack, without the selections that a mapped loop needs."""
    found = each(jax.tree.map(lambda leaf: leaf[0], stack))
    return jax.tree.map(lambda leaf: leaf[None], found)


def _one_by_one(evaluate: Callable[[slice], Outputs], there: np.ndarray) -> Outputs:
    """Outputs of a stack, from runs of its recordings by themselves.

    Args:
        evaluate: outputs of a part of the stack.
        there: mask of the recordings to run, (recordings of the stack,). Others repeat one that is run.
    """
    runs = np.flatnonzero(there)
    parts = run_short_jobs(lambda k: evaluate(slice(k, k + 1)), runs.tolist())
    place = np.zeros(len(there), int)
    place[runs] = np.arange(len(runs))

    def joined(parts: Sequence[dict[str, np.ndarray]], axis: int) -> dict[str, np.ndarray]:
        whole = {name: np.concatenate([part[name] for part in parts], axis=axis) for name in parts[0]}
        return {name: np.take(values, place, axis=axis) for name, values in whole.items()}

    found, slopes, drivers = zip(*parts, strict=True)
    return joined(found, 0), joined(slopes, 1), joined(drivers, 0)
