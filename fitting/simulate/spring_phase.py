"""Martensite fraction of a spring on a stand from its resistance alone, all rows together.

A diagnosis takes the fraction from force and resistance. A prediction of the force may use the resistance
only. Where a spring that is cold or hot throughout explains every reading, it is. A hot wire's resistance
hardly depends on its fraction. Noise cannot cross full heat, so it would look like a colder wire. Elsewhere
the fraction is a random walk behind the readings. Effects are part of what the readings are explained by.
"""

import dataclasses
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording
from fitting.inference.latent_trajectory.denoise import martensite_fraction
from fitting.specimens import Rows, stack
from fitting.specimens.process_noise import with_process_noise
from fitting.specimens.rows import with_numbers
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.simulation import numbers_of, tables_of
from fitting.specimens.specimen import RowOptions
from fitting.specimens.spring import PROCESS_NOISES, SPRING
from fitting.specimens.spring_course import best_course
from pneusma_jax.nitinol import SpringResponse
from pneusma_jax.program_cache import stored_jit

FEWEST = 4
"""Minimum number of readings for a trajectory."""
DEVIATIONS = 3.0
"""Maximum excess of a reduced chi-square over 1 that chance makes [sd]."""


def fraction_behind(
    recording: Recording,
    rows: np.ndarray,
    model: AugmentedModel,
    read: SpringResponse,
    inputs: Mapping[str, np.ndarray],
    spring: pj.Spring,
    state: pj.SpringState,
) -> np.ndarray:
    """Martensite fraction in chosen rows of a recording, shape (chosen,).

    Args:
        recording: recording of kind spring; readings may be missing.
        rows: true for rows that are predicted, shape (rows,).
        model: constants in place of the tables', and effects.
        read: the spring by single readings, shape (chosen,).
        inputs: time [s], resistance [ohm] and, where effects use it, temperature [degC], by name, shape
            (chosen,).
        spring: spring element.
        state: memory before the first row.
    """
    chosen = {name: np.asarray(column)[rows] for name, column in recording.columns.items()}
    part = dataclasses.replace(recording, columns=chosen)
    single = np.asarray(read.xi0)
    if len(single) < FEWEST or np.sum(~part.missing("resistance")) < FEWEST:
        return single
    stacked = _stacked(part, model)
    alone = jax.tree.map(lambda leaf: leaf[0], stacked)
    size = len(alone.mask)
    temperature = inputs.get("temperature") if model.added else None
    stand = (spring, model.effects, state, None if temperature is None else _lengthened(temperature, size))
    for end in (1.0, 0.0):
        if _explains(stand, alone, end):
            return np.full(len(single), end)
    if not model.added:
        return martensite_fraction(spring, inputs["time"], inputs["resistance"], np.asarray(read.gamma))
    with_walk = jax.tree.map(lambda leaf: leaf[0], with_process_noise({}, stacked, 1.0, PROCESS_NOISES, True))
    finite, steps = np.isfinite(single), np.arange(len(single))
    begun = np.interp(steps, steps[finite], single[finite]) if finite.any() else np.ones(len(single))
    return np.asarray(_course(stand, with_walk, jnp.asarray(_lengthened(begun, size))))[: len(single)]


def _stacked(recording: Recording, model: AugmentedModel) -> Rows:
    """A recording as a stack of one, with the constants of a model."""
    campaign = Campaign(recording.name, [recording], recording.path or Path(recording.name))
    options = RowOptions(most=None, fewest=1)
    (made,) = SPRING.rows_for(campaign, options, **tables_of(SPRING, recording, model))
    return stack([with_numbers(made, numbers_of(SPRING, model, recording.specimen))])


def _lengthened(column: np.ndarray, size: int) -> np.ndarray:
    """A column as long as padded rows."""
    return np.pad(np.asarray(column, float), (0, size - len(column)), mode="edge")


def _explains(stand: tuple, rows: Rows, xi0: float) -> bool:
    """True if one fraction throughout misses the readings by no more than noise."""
    weight = np.asarray(rows.weight["resistance"])
    found = np.asarray(_resistance(stand, rows, jnp.full(len(weight), xi0)))
    missed = (weight * (found - np.asarray(rows.measured["resistance"])))[weight > 0.0]
    return bool(np.mean(missed**2) <= 1.0 + DEVIATIONS * np.sqrt(2.0 / len(missed)))


def _follow(stand: tuple, rows: Rows, xi0: Array) -> tuple[Float[Array, "1 rows"], SpringResponse]:
    """Resistance of a spring at a trajectory of its fraction, as the one channel."""
    spring, effects, state, temperature = stand
    found = pj.simulate_spring(
        spring, rows.inputs["elongation"], pj.MartensiteFraction(xi0), state,
        time=rows.time, effects=effects, temperature=temperature,
    )  # fmt: skip
    return found.seen["resistance"][None], found.rows


@stored_jit()
def _resistance(stand: tuple, rows: Rows, xi0: Array) -> Float[Array, " rows"]:
    return _follow(stand, rows, xi0)[0][0]


@stored_jit()
def _course(stand: tuple, rows: Rows, begun: Array) -> Float[Array, " rows"]:
    frozen = jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, stand)
    along = partial(_follow, stand, rows), partial(_follow, frozen, rows)
    return best_course(*along, begun, ("resistance",), rows).course
