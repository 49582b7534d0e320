"""One recording as arrays of standard sizes, so that campaigns stack and share one compiled program."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.numerics.safe import as_array

MOST_ROWS = 1024
"""Maximum number of rows; longer recordings are reduced, see `reduction`. The laws change slowly over a
thousand samples."""
STEP = 1.2
"""Ratio of neighbouring row counts that programs are compiled for. At most a fifth of the rows is padding."""
COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)
"""Numbers of recordings that programs are compiled for."""
FEW_ROWS = (32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024)
FEW_COUNTS = (2, 4, 6, 8, 16, 32, 64, 128)
"""The same for programs that take a minute to compile: fewer shapes, more padding."""
STANDING = 0.01
"""Maximum range of the inner half of a drive's values that stands still, over the range of all [1]."""
CLEAN = "clean"
"""Name in `Rows.extra` of weights by the outputs' own noise, where inputs add some."""
MARK = "__"
"""Separator between a parameter's name and the number of its specimen: `wire_diameter__2`."""


def of_specimen(name: str, specimens: Iterable[str]) -> str:
    """A parameter's name for a reader: `wire_diameter of B` for `wire_diameter__2`.

    Args:
        name: name of the parameter.
        specimens: names of the specimens of all recordings, in their order; the same name may come again.
    """
    stem, mark, number = name.partition(MARK)
    return f"{stem} of {list(dict.fromkeys(specimens))[int(number) - 1]}" if mark else stem


class Rows(eqx.Module):
    """A recording, padded at its end to a standard number of rows. SI units, temperatures in degC.

    Several recordings stack along a leading axis (`stack`) and are mapped over.

    Attributes:
        mask: true in rows of the recording, false in the padding, shape (rows,).
        time: time [s], shape (rows,); the row number without a clock; constant over the padding.
        inputs: drivers of the model by quantity, each of shape (rows,).
        measured: measured outputs by quantity, shape (rows,); zero where missing.
        weight: inverse standard deviation of each output, shape (rows,); zero where missing or padded.
        base: values of all parameters that may be free, by name, as the recording states them.
        extra: additional arrays of single kinds, by name.
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

    def own_share(self, output: str) -> Float[np.ndarray, " rows"]:
        """Part of the standard deviation of an output that its own instrument makes, 0 to 1."""
        weight = np.asarray(self.weight[output])
        clean = np.asarray(self.extra.get(CLEAN, self.weight)[output])
        return np.minimum(weight / np.where(clean > 0.0, clean, np.inf), 1.0)

    @property
    def observations(self) -> int:
        """Number of measured values that count."""
        return int(sum(np.sum(np.asarray(weight) > 0.0) for weight in self.weight.values()))


def numbers(values: Mapping[str, Array], rows: Rows) -> dict[str, Array]:
    """All parameters of a recording's model: the base values, replaced by the free ones.

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
    """A recording with these values for the parameters that its model has."""
    base = {
        name: np.asarray(float(known[name].value)) if name in known else x for name, x in rows.base.items()
    }
    return eqx.tree_at(lambda r: r.base, rows, base)


def with_extra(rows: Rows, **entries: Any) -> Rows:
    """A recording, or a stack of them, with other entries of its `extra`."""
    return eqx.tree_at(lambda r: r.extra, rows, {**rows.extra, **entries})


def held(rows: Rows, drive: str) -> bool:
    """True if a drive stands still in most rows while the clock runs: over it, they would lie on one line.

    Args:
        rows: one recording.
        drive: name of an input.
    """
    there = np.asarray(rows.mask)
    values, time = np.asarray(rows.inputs[drive])[there], np.asarray(rows.time)[there]
    inner = np.subtract(*np.quantile(values, (0.75, 0.25)))
    return bool(np.ptp(time) > 0.0 and inner <= STANDING * np.ptp(values))


def bucket(count: int) -> int:
    """Smallest compiled number of rows that holds `count`."""
    size = 32.0
    while 32 * round(size / 32.0) < count:
        size *= STEP
    return 32 * round(size / 32.0)


def padded(values: np.ndarray, size: int, fill: float | None = None) -> np.ndarray:
    """A column of `size` rows, or several side by side. The padding repeats the last row, or is `fill`."""
    end = values[-1] if fill is None else fill
    return np.concatenate([values, np.full((size - len(values), *values.shape[1:]), end, values.dtype)])


def stack(recordings: Sequence[Rows], like: Rows | None = None, coarse: bool = False) -> Rows:
    """Recordings of one kind along a leading axis, padded to a compiled number of rows and recordings.

    A padding recording repeats the first one with no row that counts.

    Args:
        recordings: one or more recordings.
        like: stack whose shape is reused if it holds the recordings.
        coarse: true for few shapes, for programs that are slow to compile.
    """
    longest = max(len(r.mask) for r in recordings)
    rows = next((n for n in FEW_ROWS if coarse and n >= longest), bucket(longest))
    counts = FEW_COUNTS if coarse else COUNTS
    wanted = next((n for n in counts if n >= len(recordings)), len(recordings))
    if like is not None:
        wanted, rows = max(wanted, like.mask.shape[0]), max(rows, like.mask.shape[1])
    grown = [_grown(r, rows) for r in recordings]
    grown += [silenced(grown[0])] * (wanted - len(grown))
    return jax.tree.map(lambda *leaves: as_array(np.stack([np.asarray(leaf) for leaf in leaves])), *grown)


def silenced(rows: Rows) -> Rows:
    """The same recording or stack with all weights zero."""
    zero = jax.tree.map(lambda leaf: 0.0 * leaf, rows.weight)
    none = as_array(np.zeros(rows.mask.shape, rows.mask.dtype))
    return eqx.tree_at(lambda r: (r.mask, r.weight), rows, (none, zero))


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
