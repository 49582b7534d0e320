"""One recording as arrays of a common shape, so that campaigns stack, map and share one compiled program."""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError, nearest

MOST_ROWS = 1024
"""Longer recordings are reduced, see `reduction`: what a law follows is slow against a thousand samples."""
STEP = 1.2
"""Ratio of neighbouring row counts that programs are compiled for; a fifth of the rows at most is padding."""
COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Numbers of recordings that programs are compiled for."""
FEW_ROWS = (32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024)
FEW_COUNTS = (2, 4, 6, 8, 16, 32, 64, 128)
"""The same for programs that take a minute to compile: fewer shapes, more padding."""
MARK = "__"
"""Between a parameter's name and the number of the specimen that it belongs to: `wire_diameter__2`."""


class Rows(eqx.Module):
    """A recording, padded at its end to a common number of rows. SI units, temperatures in degC.

    Several stack along a leading axis (`stack`) and are mapped over.

    Attributes:
        mask: rows that are there, shape (rows,).
        time: [s]; without a clock, the number of the row; it stands still over the padding.
        inputs: what drives the model, by quantity, each of shape (rows,).
        measured: outputs of the model as they were measured, by quantity; zero where missing.
        weight: one over the 1-sigma of each output; zero where missing or padded.
        base: every number of the model that may be free, by name, as the recording states it.
        extra: what only one kind needs, by name.
        specimen: number of the specimen in its campaign, from 1.
    """

    mask: Bool[Array, " rows"]
    time: Float[Array, " rows"]
    inputs: dict[str, Float[Array, " rows"]]
    measured: dict[str, Float[Array, " rows"]]
    weight: dict[str, Float[Array, " rows"]]
    base: dict[str, Float[Array, ""]]
    extra: dict[str, Array]
    specimen: Int[Array, ""]

    @property
    def observations(self) -> int:
        """Number of measured values that count."""
        return int(sum(np.sum(np.asarray(weight) > 0.0) for weight in self.weight.values()))


def numbers(values: Mapping[str, Array], rows: Rows) -> dict[str, Array]:
    """All numbers of a recording's model: the base ones, replaced by the free ones.

    Args:
        values: free parameters by name; those of single specimens carry `__` and the specimen's number.
        rows: one recording, not a stack.

    Raises:
        InputError: if a value belongs to no number of the model; names the nearest.
    """
    merged = dict(rows.base)
    own: dict[str, list[tuple[int, Array]]] = {}
    for name, value in values.items():
        stem, mark, number = name.partition(MARK)
        if stem not in merged:
            raise InputError(f"the model has no number {stem!r}, {nearest(stem, rows.base)}")
        if mark:
            own.setdefault(stem, []).append((int(number), value))
        else:
            merged[stem] = value
    for stem, members in own.items():
        for number, value in members:
            merged[stem] = jnp.where(rows.specimen == number, value, merged[stem])
    return merged


def with_numbers(rows: Rows, known: Mapping[str, Quantity]) -> Rows:
    """A recording whose model has these numbers where it has them at all."""
    base = {
        name: np.asarray(float(known[name].value)) if name in known else x for name, x in rows.base.items()
    }
    return eqx.tree_at(lambda r: r.base, rows, base)


def bucket(count: int) -> int:
    """Smallest compiled number of rows that holds `count`."""
    size = 32.0
    while 32 * round(size / 32.0) < count:
        size *= STEP
    return 32 * round(size / 32.0)


def padded(values: np.ndarray, size: int, fill: float | None = None) -> np.ndarray:
    """A column of `size` rows; the padding repeats the last value, or is `fill`."""
    end = values[-1] if fill is None else fill
    return np.concatenate([values, np.full(size - len(values), end, values.dtype)])


def stack(recordings: Sequence[Rows], like: Rows | None = None, coarse: bool = False) -> Rows:
    """Recordings of one kind along a leading axis, padded to a compiled number of rows and recordings.

    A padding recording repeats the first one without a row that counts.

    Args:
        recordings: at least one.
        like: a stack whose shape the new one is to have, if it holds the recordings.
        coarse: few shapes, for programs that are slow to compile.
    """
    longest = max(len(r.mask) for r in recordings)
    rows = next((n for n in FEW_ROWS if coarse and n >= longest), bucket(longest))
    counts = FEW_COUNTS if coarse else COUNTS
    wanted = next((n for n in counts if n >= len(recordings)), len(recordings))
    if like is not None:
        wanted, rows = max(wanted, like.mask.shape[0]), max(rows, like.mask.shape[1])
    grown = [_grown(r, rows) for r in recordings]
    grown += [silenced(grown[0])] * (wanted - len(grown))
    return jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf) for leaf in leaves]), *grown)


def silenced(rows: Rows) -> Rows:
    """The same recording or stack, of which nothing counts."""
    zero = jax.tree.map(lambda leaf: 0.0 * leaf, rows.weight)
    return eqx.tree_at(lambda r: (r.mask, r.weight), rows, (jnp.zeros_like(jnp.asarray(rows.mask)), zero))


def _grown(rows: Rows, size: int) -> Rows:
    count = len(rows.mask)

    def grow(leaf: np.ndarray, fill: float | None = None) -> np.ndarray:
        leaf = np.asarray(leaf)
        return padded(leaf, size, fill) if leaf.ndim and len(leaf) == count else leaf

    return Rows(
        mask=grow(rows.mask, False),
        time=grow(rows.time),
        inputs=jax.tree.map(grow, rows.inputs),
        measured=jax.tree.map(grow, rows.measured),
        weight=jax.tree.map(lambda leaf: grow(leaf, 0.0), rows.weight),
        base=rows.base,
        extra=jax.tree.map(grow, rows.extra),
        specimen=rows.specimen,
    )
