"""White noise along the course of a channel, as one input of a study that picks it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
from jaxtyping import Array

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import dimension_of, to_si, unit_of_column

from .response import NOISE, Known

BITS = 32
"""Number of bits of the number that picks the noise of a row: the seeds of JAX's random numbers have as
many."""


@dataclass(frozen=True)
class WhiteNoise:
    """Independent noise at each point of some channels.

    A row's noise follows from one number, the input `noise`: the same number gives the same noise wherever
    the row is computed. It is one input, so it has one index beside the other inputs.

    Attributes:
        sd: standard deviation [SI] by channel.
    """

    sd: Mapping[str, float] = field(default_factory=dict)

    @property
    def known(self) -> dict[str, Known]:
        """The number that picks the noise: from 0 to 1, and without noise where it is negative."""
        return {NOISE: Known(-1.0, "1")} if self.sd else {}

    def on(self, channels: Mapping[str, Array], values: Mapping[str, Array]) -> dict[str, Array]:
        """Channels with a row's noise.

        Args:
            channels: [SI], any shapes.
            values: values of the row; no noise is added if `noise` is not among them.
        """
        found = dict(channels)
        if NOISE not in values:
            return found
        number = jax.lax.stop_gradient(values[NOISE])
        seed = (jnp.clip(number, 0.0, 1.0 - 2.0**-BITS) * 2.0**BITS).astype(jnp.uint32)
        for k, name in enumerate(sorted(self.sd)):
            key = jax.random.fold_in(jax.random.key(seed), k)
            noise = self.sd[name] * jax.random.normal(key, jnp.shape(found[name]))
            moved = found[name] + jnp.where(number < 0.0, 0.0, noise)
            is_fraction = name.rpartition(".")[2].startswith("xi0")
            found[name] = jnp.clip(moved, 0.0, 1.0) if is_fraction else moved
        return found


def noise_of(stated: Mapping[str, float], channels: Mapping[str, str], where: str) -> WhiteNoise:
    """The noise that a study states.

    Args:
        stated: 1-sigma by column with its unit, `pressure_kPa`.
        channels: channels that can have noise, with an example of a unit of each.
        where: file and table, for messages.

    Raises:
        InputError: for a channel that is not there, or a unit of something else.
    """
    found = {}
    for column, sd in stated.items():
        name, unit = (column, "1") if column in channels else _split(column)
        if name not in channels:
            shown = {c if unit == "1" else f"{c}_{unit}" for c, unit in channels.items()}
            raise InputError(f"{where}: the model has no channel {column!r}, {nearest(column, shown)}")
        if dimension_of(unit) != dimension_of(channels[name]):
            raise InputError(
                f"{where}: {column} must be a {dimension_of(channels[name])}, such as in {channels[name]}"
            )
        found[name] = float(to_si(sd, unit, difference=True))
    return WhiteNoise(found)


NoiseFor = Callable[[Mapping[str, str]], WhiteNoise]
"""The noise that a study states, of a model whose channels are given, each with a unit; see `noise_of`."""


def _split(column: str) -> tuple[str, str]:
    try:
        return unit_of_column(column)
    except InputError:
        return column, "1"
