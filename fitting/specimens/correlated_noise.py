"""Noise that is correlated along a recording, as of an instrument's zero that is off or drifts.

Rows carry a transformation of their residuals, after which these are independent.
"""

from collections.abc import Mapping
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.inference.lasting_noise import Size, modes_of

from .rows import Rows, with_extra

KEY = "correlated"
"""Name in `Rows.extra` of the transformations by output."""


class Whitening(eqx.Module):
    """Inverse root of the covariance `scale^2 I + modes widths modes'` of one output of one recording.

    Attributes:
        modes: orthonormal modes of the zero, zero in rows that do not count, shape (rows, modes).
        shrunk: modes times the part that is taken off each, shape (rows, modes).
        scale: standard deviation of the white noise, as a factor on the stated one.
    """

    modes: Float[Array, "rows modes"]
    shrunk: Float[Array, "rows modes"]
    scale: Float[Array, ""]

    def __call__(self, residual: Float[Array, "rows *columns"]) -> Float[Array, "rows *columns"]:
        """Residuals in standard deviations of the stated noise, made independent."""
        return (residual - self.shrunk @ (self.modes.T @ residual)) / self.scale

    @property
    def taken(self) -> Float[Array, "rows modes"]:
        """Modes times the root of the part that the zero takes off their precision.

        The precision of the noise is `(I - taken taken') / scale^2`.
        """
        part = jnp.sum(self.modes * self.shrunk, axis=0)
        return self.modes * jnp.sqrt(part * (2.0 - part))

    @property
    def spread(self) -> Float[Array, " rows"]:
        """Standard deviation of a row's noise with its zero, in that of the stated noise.

        It is that of a new recording, whose zero nobody knows yet.
        """
        part = jnp.sum(self.modes * self.shrunk, axis=0)
        zero = self.modes**2 @ (1.0 / (1.0 - part) ** 2 - 1.0)
        return self.scale * jnp.sqrt(1.0 + zero)


def whitening(rows: Rows, output: str, size: Size) -> Whitening:
    """Transformation of one output, for zeros of this size."""
    held, count = np.asarray(rows.weight[output]) > 0.0, len(rows.mask)
    modes, width = modes_of(np.asarray(rows.time)[held], rows.own_share(output)[held], *size[:2])
    placed = np.zeros((count, modes.shape[1]))
    placed[held] = modes
    part = 1.0 - size[2] / np.sqrt(size[2] ** 2 + width)
    return Whitening(placed, placed * part, np.asarray(float(size[2])))


def correlated(rows: Rows, sizes: Mapping[str, Size]) -> Rows:
    """The same recording with noise that is correlated by zeros of these sizes, by output."""
    own = {name: whitening(rows, name, sizes[name]) for name in rows.weight if name in sizes}
    return with_extra(rows, **{KEY: own})


def spread_of(rows: Rows, output: str) -> Float[np.ndarray, " rows"]:
    """Standard deviation of each row's noise over the stated one [1], zeros of instruments included.

    Args:
        rows: one recording.
        output: name of the output.
    """
    known = rows.extra.get(KEY, {})
    return np.asarray(known[output].spread) if output in known else np.ones(len(rows.mask))


def correlated_stack(stacked: Rows, sizes: Mapping[str, Size]) -> Rows:
    """The same for a stack of recordings."""
    each = [jax.tree.map(lambda x: x[k], stacked) for k in range(len(stacked.mask))]  # noqa: B023
    own = [correlated(one, sizes).extra[KEY] for one in each]
    together = jax.tree.map(lambda *leaves: jnp.stack(leaves), *own)
    return with_extra(stacked, **{KEY: together})


def uncorrelated(rows: Rows) -> Rows:
    """The same recording or stack with independent noise."""
    return replace(rows, extra={name: x for name, x in rows.extra.items() if name != KEY})


def independent(rows: Rows, output: str, residual: Array) -> Array:
    """Residuals of one output in standard deviations, made independent where their noise is correlated.

    Args:
        rows: one recording.
        output: name of the output.
        residual: residuals or their derivatives, shape (rows,); zero in rows that do not count.
    """
    known = rows.extra.get(KEY, {})
    if output not in known:
        return residual
    return jnp.where(jnp.asarray(rows.weight[output]) > 0.0, known[output](residual), 0.0)
