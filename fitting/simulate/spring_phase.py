"""Martensite fraction of a spring on a stand from its resistance alone, all rows together.

A diagnosis takes the fraction from force and resistance. A prediction of the force may use the resistance
only. Where a spring that is cold or hot throughout explains every reading, it is. A hot wire's resistance
hardly depends on its fraction. Noise cannot cross full heat, so it would look like a colder wire. Elsewhere
the fraction is a random walk behind the readings.
"""

import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording
from fitting.specimens import Rows, stack
from fitting.specimens.rows import with_numbers
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.simulation import numbers_of, tables_of
from fitting.specimens.specimen import RowOptions
from fitting.specimens.spring import SPRING
from pneusma_jax.program_cache import stored_jit

FEWEST = 4
"""Minimum number of readings for a test of a fraction."""
DEVIATIONS = 3.0
"""Maximum excess of a reduced chi-square over 1 that chance makes, and of chi-square over that of another
fraction, as a square [sd]."""
FRACTIONS = np.linspace(0.0, 1.0, 41)
"""Constant fractions that compete with full heat and full cold [1]."""


def fraction_throughout(
    recording: Recording,
    rows: np.ndarray,
    model: AugmentedModel,
    temperature: np.ndarray | None,
    spring: pj.Spring,
    state: pj.SpringState,
) -> float | None:
    """Full cold (1) or full heat (0), if that throughout explains the readings of chosen rows; else None.

    It must miss them by no more than noise. No other constant fraction may explain them clearly better.

    Args:
        recording: recording of kind spring; readings may be missing.
        rows: true for rows that are predicted, shape (rows,).
        model: constants in place of the tables', and effects.
        temperature: temperature [degC] where effects use it, shape (chosen,).
        spring: spring element.
        state: memory before the first row.
    """
    chosen = {name: np.asarray(column)[rows] for name, column in recording.columns.items()}
    part = dataclasses.replace(recording, columns={"force_N": np.full(int(rows.sum()), np.nan)} | chosen)
    if np.sum(~part.missing("resistance")) < FEWEST:
        return None
    alone = _as_rows(part, model)
    warm = None if temperature is None else _lengthened(temperature, len(alone.mask))
    stand, weight = (spring, model.effects, state, warm), np.asarray(alone.weight["resistance"])
    square = np.array([_square(stand, alone, weight, xi0) for xi0 in (0.0, 1.0)])
    count, end = int(np.sum(weight > 0.0)), int(np.argmin(square))
    if not square[end] <= count + DEVIATIONS * np.sqrt(2.0 * count):
        return None
    least = min(_square(stand, alone, weight, xi0) for xi0 in FRACTIONS)
    return float(end) if square[end] - least <= DEVIATIONS**2 else None


def _as_rows(recording: Recording, model: AugmentedModel) -> Rows:
    """A recording as padded arrays, with the constants of a model."""
    campaign = Campaign(recording.name, [recording], recording.path or Path(recording.name))
    options = RowOptions(most=None, fewest=1)
    (made,) = SPRING.rows_for(campaign, options, **tables_of(SPRING, recording, model))
    stacked = stack([with_numbers(made, numbers_of(SPRING, model, recording.specimen))])
    return jax.tree.map(lambda leaf: np.asarray(leaf)[0, ...], stacked)


def _lengthened(column: np.ndarray, size: int) -> np.ndarray:
    """A column as long as padded rows."""
    return np.pad(np.asarray(column, float), (0, size - len(column)), mode="edge")


def _square(stand: tuple, rows: Rows, weight: np.ndarray, xi0: float) -> float:
    """Chi-square of the readings by one fraction throughout."""
    found = np.asarray(_resistance(stand, rows, jnp.full(len(weight), float(xi0))))
    return float(np.sum((weight * (found - np.asarray(rows.measured["resistance"])))[weight > 0.0] ** 2))


@stored_jit()
def _resistance(stand: tuple, rows: Rows, xi0: Array) -> Float[Array, " rows"]:
    """Resistance that an instrument shows of a spring with these fractions."""
    spring, effects, state, temperature = stand
    found = pj.simulate_spring(
        spring, rows.inputs["elongation"], pj.MartensiteFraction(xi0), state,
        time=rows.time, effects=effects, temperature=temperature,
    )  # fmt: skip
    return found.seen["resistance"]
