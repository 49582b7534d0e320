"""White noise of channels: one more input of a study, a number that selects the noise of a whole row.

A channel is what a recording has a column of, such as a pressure. A row of a study is one sample of all its
inputs. Of a study over time, a channel of a row is a series.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
from jaxtyping import Array

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import dimension_of, to_si, unit_of_column

from .response import NOISE, Variable

BITS = 32
"""Number of bits of the seed that selects the noise of a row, as many as a seed of JAX can have."""


@dataclass(frozen=True)
class WhiteNoise:
    """Independent noise at each point of some channels.

    A row's noise follows from one number, the input `noise`. The same number gives the same noise wherever
    the row is computed. As one input it has one sensitivity index, like every other.

    Attributes:
        sd: standard deviation [SI] by channel.
    """

    sd: Mapping[str, float] = field(default_factory=dict)

    @property
    def variables(self) -> dict[str, Variable]:
        """The input `noise`: a number from 0 to 1, or a negative one for no noise, its value by default."""
        return {NOISE: Variable(-1.0, "1")} if self.sd else {}

    def on(self, channels: Mapping[str, Array], values: Mapping[str, Array]) -> dict[str, Array]:
        """Channels with a row's noise.

        Args:
            channels: values [SI] by channel, of any shapes.
            values: inputs of the row, by name; no noise is added if `noise` is not among them.

        Returns:
            Channels in the same shapes. Martensite fractions, whose names begin with `xi0`, stay in 0 to 1.
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
        stated: 1-sigma by column. Its name is the channel with a unit, `pressure_kPa`, or a channel without a
            unit alone.
        channels: channels that can have noise, with an example of a unit of each.
        where: file and table, for messages.

    Raises:
        InputError: for a channel that is not there, or a unit of something else.
    """
    found = {}
    for column, sd in stated.items():
        name, unit = (column, "1") if column in channels else _split(column)
        if name not in channels:
            columns = {c if of == "1" else f"{c}_{of}" for c, of in channels.items()}
            raise InputError(f"{where}: the model has no channel {column!r}, {nearest(column, columns)}")
        if dimension_of(unit) != dimension_of(channels[name]):
            raise InputError(
                f"{where}: {column} must be a {dimension_of(channels[name])}, such as in {channels[name]}"
            )
        found[name] = float(to_si(sd, unit, difference=True))
    return WhiteNoise(found)


NoiseFor = Callable[[Mapping[str, str]], WhiteNoise]
"""`noise_of` for one study: the argument is the channels of the model, each with a unit."""


def _split(column: str) -> tuple[str, str]:
    """Channel and unit of a column's name; the unit is 1 for a name that ends with no unit."""
    try:
        return unit_of_column(column)
    except InputError:
        return column, "1"
