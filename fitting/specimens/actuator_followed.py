"""Martensite fractions of an actuator whose model has effects.

They are read from the resistances under the whole model, then corrected to first order while parameters
change. Fits and samplers of a model on disk use them. A diagnosis treats the fractions as latent trajectories
instead.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from pneusma_jax.nitinol import Alloy
from pneusma_jax.nitinol.resistivity import PhaseReading
from pneusma_jax.pipeline import PLAIN, Pipeline

from .actuator_phase import (
    BLIND,
    NUDGE,
    ROUNDS,
    SETTLED,
    largest_change,
    noise_of,
    relaxed,
    replaced,
    smoothed,
)
from .actuator_rows import body_of
from .rows import Rows, numbers

FOLD = 0.08
"""Minimum ratio of two slopes of the resistance over the fraction: with all couplings, over the one at fixed
strain. Below it the resistance is not followed, since two configurations share one resistance there."""
UNSETTLED = "unsettled"
"""Name in `Rows.extra` of a mark: true if the rounds of a recording ended at no solution."""


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
    layout = recordings[0].extra["layout"]
    wired = [(k, n) for k, n in enumerate(layout.spring_numbers) if f"resistance_{n}" in recordings[0].inputs]
    if not wired:
        return recordings
    fixed = [
        replaced(rows, gain=tuple(0.0 * np.asarray(g) for g in rows.extra["gain"])) for rows in recordings
    ]
    rounds = [_linearised(fixed, wired, evaluate)]
    for _ in range(ROUNDS):
        last, before = rounds[max(len(rounds) - 2, 0)].fixed, rounds[-1].fixed
        after = [_smoothed(rows, wired, *rounds[-1].of(j)) for j, rows in enumerate(before)]
        after = [relaxed(*three) for three in zip(last, before, after, strict=True)]
        end = [change < SETTLED for change in map(largest_change, before, after)]
        rounds.append(_linearised(after, wired, evaluate))
        if all(end):
            break
    return [_followed(*_chosen(rounds, j, end[j], wired), wired) for j in range(len(recordings))]


@dataclass(frozen=True)
class _Round:
    """Recordings with fixed fractions, and the model linearised there.

    Attributes:
        fixed: recordings, whose fractions follow no resistance.
        base: drivers of the model, by name, each of shape (recordings, rows).
        slopes: slope of the resistance over the fraction, by place of the spring [ohm], of the same shape.
    """

    fixed: list[Rows]
    base: dict[str, np.ndarray]
    slopes: dict[int, np.ndarray]

    def of(self, j: int) -> tuple[dict[str, np.ndarray], dict[int, np.ndarray]]:
        """Drivers and slopes of recording j without padding; NaN in rows without an equilibrium."""
        count = len(self.fixed[j].mask)
        cut = lambda columns: {name: x[j, :count] for name, x in columns.items()}  # noqa: E731
        return cut(self.base), cut(self.slopes)


def _linearised(
    fixed: list[Rows],
    wired: Sequence[tuple[int, int]],
    evaluate: Callable[[list[Rows]], dict[str, np.ndarray]],
) -> _Round:
    """The model at fixed fractions, with slopes by finite differences."""
    base, slopes = evaluate(fixed), {}
    for k, n in wired:
        perturbed = evaluate([_perturbed(rows, k) for rows in fixed])
        slopes[k] = (perturbed[f"ohms_{n}"] - base[f"ohms_{n}"]) / (perturbed[f"xi0_{n}"] - base[f"xi0_{n}"])
    return _Round(fixed, base, slopes)


def _finite(slope: np.ndarray) -> np.ndarray:
    """The same slopes with zero in rows without an equilibrium."""
    return np.nan_to_num(slope, posinf=0.0, neginf=0.0)


def _chosen(
    rounds: Sequence[_Round], j: int, ended: bool, wired: Sequence[tuple[int, int]]
) -> tuple[Rows, dict[str, np.ndarray], dict[int, np.ndarray], bool]:
    """Recording j, its drivers and slopes, and whether its rounds ended at a solution.

    They are of its last round, or else of the one that misses its resistances least.
    """
    chosen = rounds[-1] if ended else min(rounds[1:], key=lambda one: _misfit(one, j, wired))
    return chosen.fixed[j], *chosen.of(j), ended


def _misfit(found: _Round, j: int, wired: Sequence[tuple[int, int]]) -> tuple[int, float]:
    """Number of rows of recording j without an equilibrium, and how far the others miss their resistances.

    The latter is a sum of squares, in standard deviations of a reading.
    """
    rows, (base, _) = found.fixed[j], found.of(j)
    read = {k: np.asarray(rows.inputs[f"resistance_{n}"]) - base[f"ohms_{n}"] for k, n in wired}
    missed = np.array([x / noise_of(rows, k) for k, x in read.items() if noise_of(rows, k) > 0.0])
    return int(np.sum(~np.isfinite(missed))), float(np.nansum(missed**2))


def _followed(
    rows: Rows,
    base: Mapping[str, np.ndarray],
    slopes: Mapping[int, np.ndarray],
    ended: bool,
    wired: Sequence[tuple[int, int]],
) -> Rows:
    """A recording whose fractions follow its resistances from the given ones on."""
    reading = {
        name: tuple(np.nan_to_num(base[f"{name}_{n}"]) for n in rows.extra["layout"].spring_numbers)
        for name in ("ohms", "gamma")
    }
    gain, coupled = ([np.zeros(len(rows.mask)) for _ in reading["gamma"]] for _ in range(2))
    for k, n in wired:
        gain[k], coupled[k] = _gains(rows, k, n, reading["gamma"][k], _finite(slopes[k]))
    columns = {"gain": tuple(gain), "coupled_gain": tuple(coupled), **reading}
    return replaced(rows, **columns, **{UNSETTLED: np.asarray(not ended)})


def _gains(
    rows: Rows, k: int, number: int, gamma: np.ndarray, total: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Change of fraction per resistance [1/ohm]: at a fixed strain, and with that of strain counted.

    Both are reduced where noise or a fold hides the fraction.

    Args:
        rows: recording; k, number: place and number of the spring.
        gamma: shear strain of every row [1].
        total: slope of the resistance over the fraction with all couplings [ohm], shape (rows,).
    """
    noise = float(rows.extra[f"noise_resistance_{number}"])
    if not noise > 0.0:
        return np.zeros(len(gamma)), np.zeros(len(gamma))
    spring = body_of(numbers({}, rows), rows).springs[k]
    law = lambda x: spring.alloy.resistivity(x, jnp.asarray(gamma)) * spring.geometry.wire_length  # noqa: E731
    xi0 = jnp.asarray(rows.extra["xi0"][k])
    partial = np.asarray(jax.jvp(law, (xi0,), (jnp.ones_like(xi0),))[1])
    square = np.where(total * partial > 0.0, total**2, 0.0)
    trust = square / (square + (FOLD * partial) ** 2 + (noise / BLIND) ** 2)
    gain = trust / np.where(partial == 0.0, np.inf, partial)
    return gain, gain / (1.0 + gain * (total - partial))


def _perturbed(rows: Rows, k: int) -> Rows:
    """The recording with the martensite fraction of spring k shifted by `NUDGE`."""
    xi0 = [np.asarray(x) for x in rows.extra["xi0"]]
    xi0[k] = xi0[k] + np.where(xi0[k] > 0.5, -NUDGE, NUDGE)
    return replaced(rows, xi0=tuple(xi0))


def _smoothed(
    rows: Rows,
    wired: Sequence[tuple[int, int]],
    base: Mapping[str, np.ndarray],
    slopes: Mapping[int, np.ndarray],
) -> Rows:
    """One round of smoothing of all fractions. Rows without an equilibrium follow their neighbours."""
    for k, n in wired:
        if noise_of(rows, k) > 0.0:
            missed = np.nan_to_num(np.asarray(rows.inputs[f"resistance_{n}"]) - base[f"ohms_{n}"])
            rows = smoothed(rows, k, missed, _finite(slopes[k]))
    return rows
