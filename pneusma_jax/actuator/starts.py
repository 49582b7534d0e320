"""Starts from which equilibria of a row by resistance are looked for.

There is a grid of fractions. Once some equilibria are known, others are looked for between them and beside
those with a nearly cold spring.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

NODES = {1: 24, 2: 8, 3: 5}
"""Number of trial fractions of each measured spring, by the number of measured springs. With these, none of
20,000 random states of PneuSMA1 and PneuSMA2 to 50 kPa is missed. At least as many trials as `in_between`
makes."""
DENSER = 3
"""Power by which fractions of a grid crowd towards 1: the nearest of 12 is then 0.001 from it."""
WAYS = np.asarray([(a, b) for a in range(4) for b in range(4) if a != b])
"""Pairs of the first four equilibria."""
SHARES = (0.5, 1.3)
"""Between two equilibria lies a third, and beyond the last ones may lie others: where more are looked for, in
distances of such a pair."""
COOLER = (0.0, 0.2, 5.0)
"""Heats of a spring, over the one found, from which neighbours of an equilibrium are looked for [1]."""
INSIDE = (1e-4, 1e-3, 1e-2)
"""The same for a spring that was found cold [1]."""


def denser_when_cold(size: int) -> np.ndarray:
    """Fractions from 0 to 1 that lie closer towards 1, where equilibria come close to each other."""
    return 1.0 - np.linspace(1.0, 0.0, size) ** DENSER


def trial_fractions(springs: int) -> np.ndarray:
    """Fractions of measured springs at which equilibria are looked for, shape (trials, springs)."""
    axis = denser_when_cold(NODES[springs])
    return np.stack(np.meshgrid(*[axis] * springs, indexing="ij"), axis=-1).reshape(-1, springs)


def in_between(roots: Array, real: Array, count: int) -> Array:
    """Joint unknowns between known equilibria and beyond them; for NumPy and JAX.

    Args:
        roots, real: see `root_search.Roots`; with any leading axes.
        count: number of unknowns before the fractions.
    """
    xp = np if isinstance(roots, np.ndarray) else jnp
    near = xp.where(real[..., None], roots, roots[..., :1, :])
    first, second = near[..., WAYS[:, 0], :], near[..., WAYS[:, 1], :]
    between = xp.concatenate([first + share * (second - first) for share in SHARES], axis=-2)
    return xp.concatenate([between[..., :count], xp.clip(between[..., count:], 0.0, 1.0)], axis=-1)


def beside_cold(roots: Array, real: Array, count: int) -> tuple[Array, np.ndarray]:
    """Joint unknowns of equilibria, with one spring after the other cold or nearly so; for NumPy and JAX.

    Where resistances hardly change with fractions, another equilibrium with a nearly cold spring may be so
    near that no other start leads to it. The fraction of this spring is first held. Otherwise a spring that
    is exactly cold would be heated while the rest still moves.

    Args:
        roots, real: see `root_search.Roots`; with any leading axes.
        count: number of unknowns before the fractions.

    Returns:
        Unknowns, several for each root, and which fractions are to be held, shape (starts, measured).
    """
    xp = np if isinstance(roots, np.ndarray) else jnp
    near = xp.where(real[..., None], roots, roots[..., :1, :])
    size, starts = near.shape[-1], []
    for k in range(count, size):
        own = near[..., k]
        for share, inside in zip(COOLER, INSIDE, strict=True):
            heat = xp.clip(xp.where(own < 1.0, share * (1.0 - own), inside), 0.0, 1.0)
            starts.append(xp.where(np.arange(size) == k, 1.0 - heat[..., None], near))
    held = np.repeat(np.eye(size - count, dtype=bool), len(COOLER) * near.shape[-2], axis=0)
    return xp.concatenate(starts, axis=-2), held
