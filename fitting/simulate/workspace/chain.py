"""Reachable tip positions of a chain, over random combinations of its segments' activations.

Segments of a chain without loads are each in an equilibrium of their own. Those of one kind are solved once,
on a grid, and combined. A loaded chain is one equilibrium, and every combination is solved.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from fitting.specimens.cautions import chain_touching_cautions, touching_cautions
from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import chain_without
from pneusma_jax.calibration import named_table
from pneusma_jax.serial_chain.designs import ChainDesign, make_chain
from pneusma_jax.serial_chain.segments import chain_shape
from pneusma_jax.units import from_si

from .grid import branches_of, compute_workspace, fractions_of, modelled_actuator

CHUNK = 256  # Number of loaded chains that are solved at once


@dataclass
class ChainReach:
    """Tip positions of a chain.

    Attributes:
        name: name of the chain.
        pressure: gauge pressure [Pa], shape (states,).
        fractions: martensite fraction by segment (from 1) and spring [1], shape (states,).
        tip: tip position in the frame of the base [m], shape (states, 3); NaN where a segment has no result.
        cautions: warnings in words.
    """

    name: str
    pressure: np.ndarray
    fractions: dict[tuple[int, int], np.ndarray]
    tip: np.ndarray
    cautions: list[str]

    @property
    def solved(self) -> int:
        """Number of states with a result."""
        return int(np.isfinite(self.tip).all(axis=1).sum())

    def columns(self) -> dict[str, np.ndarray]:
        """The states as columns of a CSV."""
        tips = from_si(self.tip, "mm")
        return {
            "pressure_kPa": from_si(self.pressure, "kPa"),
            **{f"segment_{k}_xi0_{n}": values for (k, n), values in self.fractions.items()},
            **{f"tip_{axis}_mm": tips[:, k] for k, axis in enumerate("xyz")},
        }


def compute_chain_reach(
    design: ChainDesign,
    pressure: np.ndarray,
    xi0: np.ndarray,
    samples: int,
    seed: int = 0,
    alloy: Any = None,
    silicone: Any = None,
    model: AugmentedModel = BASE,
    progress: Callable[[int], object] = lambda rows: None,
) -> ChainReach:
    """Solve each kind of segment on a grid and combine states of one pressure; under loads, solve every
    chain.

    Args:
        design: design of the chain.
        pressure, xi0, alloy, silicone, model, progress: arguments as for `compute_workspace`.
        samples: number of combinations at each pressure.
        seed: seed of the choice of combinations.

    Raises:
        InputError: for a table that cannot be used, or a model with effects that change a chain.
    """
    without = chain_without(model)
    model = dataclasses.replace(model, added=())
    build = lambda name: modelled_actuator(name, alloy, silicone, model)  # noqa: E731
    chain = make_chain(design, build, lambda name: _density(name, silicone, model))
    if chain.loaded:
        bodies = {name: build(name) for name in dict.fromkeys(design.designs)}
        asked = _Asked(np.asarray(pressure), np.asarray(xi0), samples, seed)
        found = _loaded_reach(design, chain, bodies, asked, progress)
        return dataclasses.replace(found, cautions=found.cautions + without)
    kinds = {
        name: compute_workspace(name, pressure, xi0, alloy, silicone, model, progress)
        for name in dict.fromkeys(design.designs)
    }
    random = np.random.default_rng(seed)
    shape = (len(pressure), samples)
    at = np.broadcast_to(np.arange(len(pressure))[:, None], shape).ravel()
    bends, lengths, fractions = [], [], {}
    for k, name in enumerate(design.designs, 1):
        space = kinds[name]
        branch = random.integers(len(space.heat), size=at.size)
        level = random.integers(len(space.xi0), size=at.size)
        size, direction = space.bend[branch, level, at], space.direction[branch, level, at]
        size = np.abs(size)  # the direction of the bend carries the sign
        bends.append(np.stack([size * np.cos(direction), size * np.sin(direction)], axis=-1))
        lengths.append(space.length[branch, level, at])
        chosen = space.fractions()[branch, level]
        fractions |= {(k, n): chosen[:, i] for i, n in enumerate(space.springs)}
    found = chain_shape(chain, jnp.asarray(np.stack(bends, axis=1)), jnp.asarray(np.stack(lengths, axis=1)))
    cautions = [f"{name}: {sentence}" for name, space in kinds.items() for sentence in space.cautions]
    cautions += chain_touching_cautions(found, "chains")
    tip = np.asarray(found.end_pose)[:, :3, 3]
    return ChainReach(design.name, np.asarray(pressure)[at], fractions, tip, cautions + without)


def _density(name: str, silicone: Any, model: AugmentedModel) -> float | None:
    """Density of the silicone of a design [kg/m3]."""
    if silicone is None:
        silicone = named_table(model.table("actuator", name), "material")
    return model.table("silicone", silicone).values().get("density")


@dataclasses.dataclass(frozen=True)
class _Asked:
    """What is combined: pressures [Pa], fractions [1]; combinations at each pressure, and their seed."""

    pressure: np.ndarray
    xi0: np.ndarray
    samples: int
    seed: int


def _loaded_reach(
    design: ChainDesign,
    chain: pj.SegmentChain,
    bodies: dict[str, pj.Actuator],
    asked: _Asked,
    progress: Callable[[int], object],
) -> ChainReach:
    """Tips of a loaded chain: random activations of its segments, each chain solved as a whole."""
    random = np.random.default_rng(asked.seed)
    at = np.repeat(asked.pressure, asked.samples)
    fractions: dict[tuple[int, int], np.ndarray] = {}
    for k, name in enumerate(design.designs, 1):
        heat = branches_of(bodies[name])
        branch, level = (random.integers(n, size=at.size) for n in (len(heat), len(asked.xi0)))
        chosen = fractions_of(heat, asked.xi0)[branch, level]
        fractions |= {(k, n): chosen[:, i] for i, n in enumerate(bodies[name].spring_numbers)}
    drives = tuple(
        tuple(fractions[k, n] for n in body.spring_numbers) for k, body in enumerate(chain.segments, 1)
    )
    tips, good, stable, touching, bend = [], [], [], [], []
    for start in range(0, at.size, CHUNK):
        rows = np.minimum(np.arange(start, start + min(CHUNK, at.size)), at.size - 1)
        found = _tips(chain, at[rows], jax.tree.map(lambda x, rows=rows: x[rows], drives))
        count = min(CHUNK, at.size - start)
        for values, more in zip((tips, good, stable, touching, bend), found, strict=True):
            values.append(np.asarray(more)[:count])
        progress(count)
    tip, good, stable, touching, bend = map(np.concatenate, (tips, good, stable, touching, bend))
    lost, shaky = int(np.sum(~good)), int(np.sum(good & ~stable))
    cautions = []
    if lost:
        cautions.append(f"{lost} of {at.size} chains have no result: {pj.Status.no_equilibrium.sentence}")
    if shaky:
        cautions.append(f"{shaky} of {at.size} chains would not stay in their equilibrium: they may buckle")
    cautions += touching_cautions(bend, good & touching, rows="chains")
    return ChainReach(design.name, at, fractions, tip, cautions)


@eqx.filter_jit
def _tips(chain: pj.SegmentChain, pressure: Any, drives: tuple) -> tuple[Any, ...]:
    """Tips of many states of a loaded chain [m]; masks of those found, of the stable ones, and of those with
    parts that overlap; and bend angles of all segments together [deg]."""

    def one(pressure: Any, drives: tuple) -> tuple[Any, ...]:
        activations = [tuple(pj.MartensiteFraction(x) for x in drive) for drive in drives]
        found = pj.solve_chain(chain, pressure, activations, throw=False)
        overlap = found.shape.clearance().smallest < 0.0
        bend = jnp.rad2deg(found.shape.total_bend)
        return found.end_pose[:3, 3], found.converged, found.stable, overlap, bend

    return jax.vmap(one)(pressure, drives)
