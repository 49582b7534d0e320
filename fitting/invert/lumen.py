"""A lumen: the centre line of a tube with its diameter, read from a CSV, and distances from it."""

from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.notes import joined
from pneusma_jax.errors import InputError
from pneusma_jax.units import UNITS, to_si

from .csv_file import check_sizes, columns_of, unit_of


@dataclass(frozen=True)
class Lumen:
    """A tube to pass through, in the frame of the chain's base: z along the straight chain.

    Attributes:
        name: name of the file.
        points: points of its centre line [m], shape (points, 3); the chain begins at the first.
        diameter: diameter at these points [m], shape (points,).
    """

    name: str
    points: np.ndarray
    diameter: np.ndarray

    @property
    def lengths(self) -> np.ndarray:
        """Distance along the centre line at every point [m]."""
        return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1)))

    @property
    def tortuosity(self) -> float:
        """Length of the centre line over the distance of its ends [1]."""
        return float(self.lengths[-1] / np.linalg.norm(self.points[-1] - self.points[0]))


def read_lumen(path: str | Path) -> Lumen:
    """Read a centre line from a CSV with columns `x_mm, y_mm, z_mm, diameter_mm`, any unit of length.

    Raises:
        InputError: one line with file, row and column.
    """
    path = Path(path)
    given, columns = columns_of(path), {}
    for wanted in COLUMNS:
        named = [n for n in given if n.rpartition("_")[0] == wanted]
        if not named:
            raise InputError(f"{path}: column {wanted}_mm is missing")
        if len(named) > 1:
            raise InputError(f"{path}: columns {joined(named)} say the same; leave one out")
        unit = unit_of(named[0], str(path))
        if UNITS[unit].dimension != "length":
            raise InputError(f"{path}: column {named[0]} is no length; {wanted}_mm is one")
        columns[wanted] = to_si(given.pop(named[0]), unit)
        check_sizes(columns[wanted], MILLIMETRE, named[0], str(path))
    if given:
        known = ", ".join(f"{n}_mm" for n in COLUMNS)
        raise InputError(f"{path}: unknown column {next(iter(given))!r}; a lumen has {known}")
    points = np.column_stack([columns[n] for n in "xyz"])
    if len(points) < 2:
        raise InputError(f"{path}: a centre line needs at least two points")
    if np.any(np.linalg.norm(np.diff(points, axis=0), axis=1) <= 0.0):
        raise InputError(f"{path}: two points of the centre line that follow each other are the same")
    if np.any(columns["diameter"] <= 0.0):
        raise InputError(f"{path}: every diameter must be positive")
    if np.linalg.norm(points[0]) > 0.5 * columns["diameter"][0]:
        place = ", ".join(f"{1e3 * x:g}" for x in points[0])
        raise InputError(
            f"{path}: the chain begins at 0, 0, 0, but the lumen at {place} mm, which is out of its reach. "
            "Give the points in the frame of the chain's base, z along the straight chain"
        )
    return Lumen(path.stem, points, columns["diameter"])


MILLIMETRE = 1e-3
"""Length that counts as one [m], as of a tip."""
COLUMNS = ("x", "y", "z", "diameter")
"""Columns of a lumen, without their unit."""


def distances(points: Array, lumen: tuple[Array, Array]) -> tuple[Array, Array]:
    """Distance of points from a centre line, and the lumen's radius where each is nearest [m].

    Args:
        points: shape (points, 3).
        lumen: the centre line's points and diameters.
    """
    line, diameter = lumen
    begin, along = line[:-1], jnp.diff(line, axis=0)
    still = jax.lax.stop_gradient(points)  # the choice of the nearest piece has no derivative
    share = jnp.einsum("psk,sk->ps", still[:, None] - begin, along) / jnp.sum(along**2, axis=1)
    aside = still[:, None] - begin - jnp.clip(share, 0.0, 1.0)[..., None] * along
    nearest = jnp.argmin(jnp.sum(aside**2, axis=-1), axis=1)
    begin, along, wide, change = (
        begin[nearest],
        along[nearest],
        diameter[:-1][nearest],
        jnp.diff(diameter)[nearest],
    )
    share = jnp.clip(jnp.sum((points - begin) * along, axis=1) / jnp.sum(along**2, axis=1), 0.0, 1.0)
    away = jnp.sqrt(jnp.sum((points - begin - share[:, None] * along) ** 2, axis=1) + 1e-18)
    return away, 0.5 * (wide + share * change)


def progress(point: Array, line: Array) -> Array:
    """Distance along a centre line to the place that is nearest to a point [m].

    Args:
        point: shape (3,).
        line: points of the centre line, shape (points, 3).
    """
    begin, along = line[:-1], jnp.diff(line, axis=0)
    square = jnp.sum(along**2, axis=1)
    share = jnp.clip(jnp.sum((point - begin) * along, axis=1) / square, 0.0, 1.0)
    away = jax.lax.stop_gradient(jnp.sum((point - begin - share[:, None] * along) ** 2, axis=1))
    nearest, length = jnp.argmin(away), jnp.sqrt(square)
    before = jnp.cumsum(length) - length
    return before[nearest] + share[nearest] * length[nearest]


def refined(lumen: Lumen) -> tuple[np.ndarray, np.ndarray]:
    """The same line and diameters with a power of two of points, so that few compiled programs serve all
    lumens.

    The longest pieces are halved; the line between the points stays as it is.
    """
    points, diameter = lumen.points, lumen.diameter
    wanted = 1 << (len(points) - 1).bit_length()
    for _ in range(wanted - len(points)):
        k = int(np.argmax(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        points = np.insert(points, k + 1, points[k : k + 2].mean(axis=0), axis=0)
        diameter = np.insert(diameter, k + 1, diameter[k : k + 2].mean())
    return points, diameter
