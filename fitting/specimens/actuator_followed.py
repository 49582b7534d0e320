"""Martensite fractions of an actuator whose model has effects.

They are read from the resistances under the whole model, then corrected to first order while parameters
change. Fits and samplers of a model on disk use them. A diagnosis treats the fractions as latent trajectories
instead.
"""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.latent_trajectory.denoise import resistance_and_slope
from pneusma_jax.nitinol import Alloy
from pneusma_jax.nitinol.resistivity import PhaseReading
from pneusma_jax.pipeline import PLAIN, Pipeline

from .actuator_phase import (
    BLIND,
    UNSETTLED,
    Ended,
    finite,
    noise_of,
    settled_rounds,
    wired_springs,
    without_gains,
)
from .actuator_rows import body_of
from .rows import Rows, numbers, with_extra

FOLD = 0.08
"""Minimum ratio of two slopes of the resistance over the fraction: with all couplings, over the one at fixed
strain. Below it the resistance is not followed, since two configurations share one resistance there."""


class FollowedPhase(eqx.Module):
    """A martensite fraction that is read from a smoothed resistance.

    It is corrected to first order for changes of sensors, resistivities and strain. The correction vanishes
    where a hot wire's resistance no longer depends on the fraction.

    Strain changes the reading only in the last iteration of a row. Otherwise strain and fraction could drift
    to another configuration of the same resistance. Before, the fraction follows the resistance with the gain
    that counts strain to first order. So that iteration starts close to its solution. Near full heat the
    fraction changes up to 20 times as much with the resistance at a fixed strain.

    Attributes:
        xi0: smoothed martensite fraction [1]; ohms: its resistance [ohm]; gain: change of fraction per
            resistance at a fixed strain [1/ohm].
        gamma: shear strain at which the fraction was read [1].
        coupled_gain: change of fraction per resistance, with that of strain counted [1/ohm].
        strained: true if strain changes the reading.
    """

    xi0: Array
    ohms: Array
    gain: Array
    gamma: Array
    coupled_gain: Array
    strained: bool = eqx.field(static=True, default=True)

    def held(self) -> "FollowedPhase":
        """The same fraction, read at its original strain, whose change counts to first order."""
        return FollowedPhase(self.xi0, self.ohms, self.coupled_gain, self.gamma, self.coupled_gain, False)

    def read(
        self, alloy: Alloy, gamma: Array, wire_length: Array, pipeline: Pipeline = PLAIN
    ) -> PhaseReading:
        """Martensite fraction after one linear correction of the smoothed one."""
        wire = pipeline.apply("wire_resistance", self.ohms)
        at = gamma if self.strained else self.gamma
        surplus = wire - alloy.resistivity(self.xi0, at) * wire_length
        no = jnp.zeros((), bool)
        return PhaseReading(jnp.clip(self.xi0 + self.gain * surplus, 0.0, 1.0), no, no)


def settled(recordings: list[Rows], evaluate: Callable[[list[Rows]], dict[str, np.ndarray]]) -> list[Rows]:
    """Recordings whose martensite fractions are read anew, smoothed about the predictions of a model, as in
    `actuator_phase`.

    Where the rounds end at no solution, those fractions count that miss the resistances least, and
    `UNSETTLED` is true.

    Args:
        recordings: recordings with earlier fractions.
        evaluate: function from recordings to the model's drivers, by name, each of shape (recordings, rows).
    """
    wired = wired_springs(recordings[0])
    if not wired:
        return recordings
    fixed = [without_gains(rows) for rows in recordings]
    return [_followed(end, wired) for end in settled_rounds(fixed, wired, evaluate)]


def _followed(end: Ended, wired: Sequence[tuple[int, int]]) -> Rows:
    """A recording whose fractions follow its resistances from the given ones on."""
    rows, base = end.rows, end.base
    reading = {
        name: tuple(np.nan_to_num(base[f"{name}_{n}"]) for n in rows.extra["layout"].spring_numbers)
        for name in ("ohms", "gamma")
    }
    gain, coupled = ([np.zeros(len(rows.mask)) for _ in reading["gamma"]] for _ in range(2))
    for k, n in wired:
        gain[k], coupled[k] = _gains(rows, k, reading["gamma"][k], finite(end.slopes[k][f"ohms_{n}"]))
    columns = {"gain": tuple(gain), "coupled_gain": tuple(coupled), **reading}
    return with_extra(rows, **columns, **{UNSETTLED: np.asarray(not end.ended)})


def _gains(rows: Rows, k: int, gamma: np.ndarray, total: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Change of fraction per resistance [1/ohm]: at a fixed strain, and with that of strain counted.

    Both are reduced where noise or a fold hides the fraction.

    Args:
        rows: recording.
        k: place of the spring.
        gamma: shear strain of every row [1].
        total: slope of the resistance over the fraction with all couplings [ohm], shape (rows,).
    """
    noise = noise_of(rows, k)
    if not noise > 0.0:
        return np.zeros(len(gamma)), np.zeros(len(gamma))
    spring = body_of(numbers({}, rows), rows).springs[k]
    partial = np.asarray(resistance_and_slope(spring, rows.extra["xi0"][k], gamma)[1])
    square = np.where(total * partial > 0.0, total**2, 0.0)
    trust = square / (square + (FOLD * partial) ** 2 + (noise / BLIND) ** 2)
    gain = trust / np.where(partial == 0.0, np.inf, partial)
    return gain, gain / (1.0 + gain * (total - partial))
