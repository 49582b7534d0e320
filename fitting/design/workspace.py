"""The area that the tip can reach in its plane, from states round the edge of pressure and activation."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.calibration import Calibration
from pneusma_jax.errors import InputError
from pneusma_jax.numerics.safe import namespace_of

from .bodies import Body, Solved, solve_states
from .study import Sweep

FINER = 10
"""Factor on the states round the edge by which an area is checked [1]. With 48 states the areas of three
walls of PneuSMA2 were 3 to 6 % too small, with 36 states that of a wide design 12 %. With 480 states they
differ by 0.1 % or less from those of 960."""


def edge_states(table: Calibration, sweep: Sweep) -> tuple[np.ndarray, np.ndarray]:
    """States round the edge, one after the other.

    Activation starts with full heat of one spring and ends with full heat of the other one; between them both
    are cold. With a single spring it goes from cold to full heat.

    Args:
        table: table of an actuator that bends in a plane.
        sweep: ranges.

    Returns:
        Gauge pressures [Pa], shape (states,), and martensite fractions, shape (states, springs).

    Raises:
        InputError: if the actuator has not one or two springs, or bends freely.
    """
    arrangement = pj.layout(table)
    count = len(arrangement.spring_numbers)
    if arrangement.bending_plane is None or count not in (1, 2):
        raise InputError(
            f"{table.path or table.name}: a workspace area needs an actuator that bends in a plane by "
            "one or two "
            f"springs, but this one has {count} and bends "
            + ("freely" if arrangement.bending_plane is None else "in a plane")
        )
    along = np.linspace(0.0, 1.0, sweep.points + 1)
    across = np.linspace(-1.0 if count == 2 else 0.0, 1.0, (2 if count == 2 else 1) * sweep.points + 1)
    loop = [(0.0, s) for s in across] + [(p, 1.0) for p in along[1:]]
    loop += [(1.0, s) for s in across[::-1][1:]] + [(p, across[0]) for p in along[::-1][1:-1]]
    share, heat = np.array(loop).T
    pressure = sweep.low + share * (sweep.high - sweep.low)
    fractions = np.ones((len(loop), count))
    fractions[:, -1] -= np.maximum(heat, 0.0) * (1.0 - sweep.xi0_min)
    if count == 2:
        fractions[:, 0] -= np.maximum(-heat, 0.0) * (1.0 - sweep.xi0_min)
    return pressure, fractions


def tip_in_plane(solved: Solved) -> Array:
    """Place of the tip in the plane of bending [m]: towards side 1, and along the straight tube."""
    side = jnp.asarray(solved.body.segments[0].side_direction)
    return jnp.stack([solved.end_pose[:2, 3] @ side, solved.end_pose[2, 3]])


def finer_area(body: Body, table: Calibration, sweep: Sweep) -> float:
    """Area from `FINER` times as many states round the edge [m2]; NaN where one has no equilibrium."""
    pressure, fractions = edge_states(table, replace(sweep, points=FINER * sweep.points))
    if body.effects:
        found = solve_states(body, pressure, fractions)[1][0]
    else:
        drives = tuple(pj.MartensiteFraction(column) for column in fractions.T)
        found = pj.solve_batch(body.segments[0], pressure, drives)
    half, length = 0.5 * np.asarray(found.bend_angle), np.asarray(found.length)
    chord = length * np.sinc(half / np.pi)
    return float(enclosed_area(np.stack([chord * np.sin(half), chord * np.cos(half)], axis=1)))


def enclosed_area(tips: Array) -> Array:
    """Area of a polygon of tips [m2], shape (states, 2); parts that are run round twice count twice."""
    x, y = tips[:, 0], tips[:, 1]
    xp = namespace_of(tips)
    return 0.5 * xp.abs(xp.sum(x * xp.roll(y, -1) - y * xp.roll(x, -1)))
