"""Evaluations of the compiled model, spread over the devices of this machine.

A row is one sample of a study: one value for each uncertain input.
"""

from collections.abc import Callable

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding
from jax.sharding import PartitionSpec as P
from jaxtyping import Array, Float, UInt8

from pneusma_jax.numerics.rows import filled, first_rows
from pneusma_jax.program_cache import cached_program

CALL_ROWS = 8192
"""Number of rows of a whole call. It bounds memory, and a call of so many takes long against its start."""
SMALL_CALLS = (64, 1024)
"""Number of rows of smaller calls, ascending. The first one that holds all rows of a request is taken."""


class Evaluator:
    """A function of one row as a function of many.

    Rows are independent. So each device takes an equal part of a whole call and exchanges nothing with the
    others. Smaller calls use one device. A row has the same result wherever it is computed.

    Args:
        row: function of the values of one row, shape (values,). It returns the columns, shape (columns,), a
            status, and arrays of any shape beside them.
        batch_size: number of rows that one device computes together, at least 1. It is rounded down to a
            power of two, so that it divides the rows of a call.
        devices: devices to use; all local ones if None.
        identity: text that says everything that `row` depends on besides the source of the packages. With it
            programs for one device are kept on disk, and not traced again in every process.
    """

    def __init__(
        self,
        row: Callable[[Array], tuple[Array, ...]],
        batch_size: int,
        devices: list | None = None,
        identity: str | None = None,
    ):
        devices = jax.local_devices() if devices is None else devices
        self._row, self._identity = row, identity
        self._mesh = Mesh(np.asarray(devices), ("rows",))
        self._split = NamedSharding(self._mesh, P("rows"))
        self._batch_size = 1 << (batch_size.bit_length() - 1)
        self._programs: dict[tuple[Callable, bool], Callable] = {}
        self._gradients: dict[Callable, Callable] = {}

    @property
    def devices(self) -> int:
        """Number of devices."""
        return self._mesh.size

    def __call__(
        self, x: Float[np.ndarray, "rows values"]
    ) -> tuple[Float[np.ndarray, "rows columns"], UInt8[np.ndarray, " rows"]]:
        """Columns and status of every row; no rows give empty arrays of the same widths."""
        return self.everything(x)[:2]

    def everything(self, x: Float[np.ndarray, "rows values"]) -> tuple[np.ndarray, ...]:
        """All that `row` returns, for every row: columns, status, and what stands beside them."""
        return self._in_calls(self._row, x)

    def with_gradient(
        self, of: Callable[[Array], Array], x: Float[np.ndarray, "rows values"]
    ) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, "rows values"]]:
        """A number of each row, and its derivatives by the row's values, on one device.

        Searches ask for few rows. And reverse derivatives of Optimistix's root finds cannot be traced inside
        of `shard_map`.

        Args:
            of: function from the columns of one row, shape (columns,), to the number. Pass the same object
                again for further rows: another one is compiled anew.
            x: values of the rows.
        """
        if of not in self._gradients:
            self._gradients[of] = jax.value_and_grad(lambda row: of(self._row(row)[0]))
        return self._in_calls(self._gradients[of], x, spread=False)

    def _in_calls(self, row: Callable, x: np.ndarray, spread: bool = True) -> tuple[np.ndarray, ...]:
        """Results of any number of rows, in calls of one size. Only whole calls go to several devices."""
        if not len(x):
            shapes = jax.eval_shape(row, jax.ShapeDtypeStruct(x.shape[1:], x.dtype))
            return tuple(np.zeros((0, *one.shape), one.dtype) for one in shapes)
        step = next((size for size in SMALL_CALLS if len(x) <= size), CALL_ROWS)
        pieces = [x[first : first + step] for first in range(0, len(x), step)]
        spread = spread and self.devices > 1 and step == CALL_ROWS
        parts = [self._call(row, piece, step, spread) for piece in pieces]
        return tuple(np.concatenate(part) for part in zip(*parts, strict=True))

    def _call(
        self, row: Callable, x: np.ndarray, step: int, spread: bool
    ) -> tuple[np.ndarray, ...]:
        """Results of at most `step` rows, padded so that all devices have whole groups of rows."""
        group = self._batch_size * (self.devices if spread else 1)
        padded = group * -(-step // group)
        placed = jax.device_put(filled(x, padded), self._split if spread else self._mesh.devices[0])
        found = self._program(row, spread)(placed)
        return first_rows(tuple(found), len(x))

    def _program(self, row: Callable, spread: bool) -> Callable:
        """The program of a function for one device or for all; compiled for each number of rows of a call."""
        if (row, spread) not in self._programs:
            batch_size = self._batch_size
            part = lambda x: jax.lax.map(row, x, batch_size=batch_size)  # noqa: E731
            if spread:
                program = jax.jit(jax.shard_map(
                    part, mesh=self._mesh, in_specs=P("rows"), out_specs=P("rows"), check_vma=False
                ))  # fmt: skip
            elif row is self._row and self._identity is not None:
                program = cached_program(part, f"rows of a study|{self._identity}|{batch_size}")
            else:
                program = jax.jit(part)
            self._programs[row, spread] = program
        return self._programs[row, spread]
