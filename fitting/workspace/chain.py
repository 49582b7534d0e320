"""Where the tip of a chain can be: its segments' states, put together in random combinations."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from fitting.augmented import AugmentedModel
from fitting.simulation.specimen import BASE
from pneusma_jax.chain_designs import ChainDesign, make_chain
from pneusma_jax.segments import chain_shape
from pneusma_jax.units import from_si

from .grid import compute_workspace, modelled_actuator


@dataclass
class ChainReach:
    """Places of a chain's tip.

    Attributes:
        name: of the chain.
        pressure: gauge [Pa], shape (states,).
        fractions: martensite fraction by segment (from 1) and spring [1], shape (states,).
        tip: in the frame of the base [m], shape (states, 3); NaN where a segment has no result.
        cautions: in words.
    """

    name: str
    pressure: np.ndarray
    fractions: dict[tuple[int, int], np.ndarray]
    tip: np.ndarray
    cautions: list[str]

    @property
    def solved(self) -> int:
        """How many states were found."""
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
    """Solve each kind of segment on a grid, and put states of one pressure together.

    Segments share the pressure and hand each other no load, so each is in an equilibrium of its own.

    Args:
        design: of the chain.
        pressure, xi0, alloy, silicone, model, progress: as for `compute_workspace`.
        samples: combinations at each pressure.
        seed: of the choice of combinations.

    Raises:
        InputError: for a table that cannot be used, or a model with effects.
    """
    if model.added:
        raise pj.InputError(f"{model.path}: a chain takes a model's numbers, but not its effects")
    kinds = {
        name: compute_workspace(name, pressure, xi0, alloy, silicone, model, progress)
        for name in dict.fromkeys(design.designs)
    }
    chain = make_chain(design, lambda name: modelled_actuator(name, alloy, silicone, model))
    random = np.random.default_rng(seed)
    shape = (len(pressure), samples)
    at = np.broadcast_to(np.arange(len(pressure))[:, None], shape).ravel()
    bends, lengths, fractions = [], [], {}
    for k, name in enumerate(design.designs, 1):
        space = kinds[name]
        branch = random.integers(len(space.heat), size=at.size)
        level = random.integers(len(space.xi0), size=at.size)
        size, direction = space.bend[branch, level, at], space.direction[branch, level, at]
        size = np.abs(size)  # the direction says where to
        bends.append(np.stack([size * np.cos(direction), size * np.sin(direction)], axis=-1))
        lengths.append(space.length[branch, level, at])
        chosen = space.fractions()[branch, level]
        fractions |= {(k, n): chosen[:, i] for i, n in enumerate(space.springs)}
    found = chain_shape(chain, jnp.asarray(np.stack(bends, axis=1)), jnp.asarray(np.stack(lengths, axis=1)))
    cautions = [f"{name}: {sentence}" for name, space in kinds.items() for sentence in space.cautions]
    tip = np.asarray(found.end_pose)[:, :3, 3]
    return ChainReach(design.name, np.asarray(pressure)[at], fractions, tip, cautions)
