"""Many inverse problems at once: damped Gauss-Newton steps in a box, in one compiled program.

A problem may have more drives than goals. Then the least heating is wanted: a small weight draws all springs
towards cold, and fades when the steps are short. A drive at an end of its range stays there while the miss
would make it go further.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from fitting.design.bodies import Body
from fitting.inference.program_cache import stored_jit

from .derivatives import values_with_slope
from .forward import Memories
from .goals import sizes

MOST_STEPS = 40
"""Maximum of steps from a start; 4 to 12 are taken where the target can be reached."""
SEARCHING = 15
"""Maximum of steps with the weight of heating; after them only the miss is closed."""
CLOSE = 1e-5
"""Miss at which a search ends, in sizes of the goals [1]."""
STILL = 1e-7
"""Step in the box at which a search ends [1]."""
BLOCK = 64
"""Number of searches side by side; a block waits for its slowest."""
WEIGHT, LAST_WEIGHT = 1e-3, 1e-9
"""Weight of heating while the way is looked for, and when only the miss is left to close [1]. With the
first, a curvature is missed by about 1e-5 1/m, and the heating is the least to a few thousandths."""
NEAR = 3e-3
"""Step in the box from which on only the miss is closed [1]."""
COLD_PRESSURE = 0.1
"""Weight of pressure beside that of a spring's heat [1]: pressure costs little, heat is slow."""


class Box(eqx.Module):
    """Ranges of the drives: the pressure, then all springs.

    Attributes:
        low, high: [Pa, 1], shape (drives,). Equal ends hold a drive.
        rest: drives that cost nothing: no pressure, cold springs, shape (drives,).
    """

    low: Array
    high: Array
    rest: Array

    def drives(self, place: Array) -> Array:
        """Drives at a place in the box [1]."""
        return self.low + place * (self.high - self.low)

    def place(self, drives: Array) -> Array:
        """Place in the box of drives; the middle where an end equals the other."""
        wide = self.high > self.low
        return jnp.where(wide, (drives - self.low) / jnp.where(wide, self.high - self.low, 1.0), 0.5)


@eqx.filter_jit
def places_of(box: Box, drives: Array) -> Array:
    """Places of many drives, shape (rows, drives)."""
    return jax.vmap(box.place)(drives)


@eqx.filter_jit
def drives_of(box: Box, places: Array) -> Array:
    """Drives at many places, shape (rows, drives)."""
    return jax.vmap(box.drives)(places)


class Found(eqx.Module):
    """Result of a search.

    Attributes:
        place: place in the box [1], shape (drives,).
        miss: distance from the goals, in sizes of the goals [1].
        values: values of the goals [SI], shape (columns,).
        effort: square of the distance from rest [1].
        slope: derivative of half the squared miss by the place [1], shape (drives,).
        unknowns: unknowns of the state, to start a neighbouring one, shape (segments, freedoms).
        steps: taken.
    """

    place: Array
    miss: Array
    values: Array
    effort: Array
    slope: Array
    unknowns: Array
    steps: Array


def search(
    body: Body,
    goals: tuple[str, ...],
    box: Box,
    wanted: Array,
    begin: Array,
    memories: Memories,
    guess: Array,
    most: Array | int = MOST_STEPS,
) -> Found:
    """One inverse problem from one start.

    Args:
        body: the body that is driven.
        goals: static; names.
        box: ranges of the drives.
        wanted: values of the goals in SI, shape (columns,).
        begin: place in the box, shape (drives,).
        memories: memories of the springs.
        guess: unknowns of a state near the start.
        most: maximum of steps.
    """
    scale, count = sizes(goals), begin.size
    cost = jnp.concatenate([jnp.full(1, COLD_PRESSURE), jnp.ones(count - 1)])
    rest = jnp.clip(box.place(box.rest), 0.0, 1.0)
    wide = box.high > box.low

    def look(place: Array, guess: Array) -> tuple:
        values, slope, unknowns = values_with_slope(body, goals, box.drives, place, memories, guess)
        return (values - wanted) / scale, slope / scale[:, None], values, unknowns

    def total(miss: Array, place: Array, weight: Array) -> Array:
        return 0.5 * miss @ miss + 0.5 * weight * jnp.sum(cost * (place - rest) ** 2)

    def go_on(carry: tuple) -> Array:
        return ~carry[-1]

    def advance(carry: tuple) -> tuple:
        place, seen, damping, weight, steps, _ = carry
        miss, slope, _, unknowns = seen
        gradient = slope.T @ miss + weight * cost * (place - rest)
        held = ~wide | ((place <= 0.0) & (gradient > 0.0)) | ((place >= 1.0) & (gradient < 0.0))
        free = jnp.where(held, 0.0, 1.0)
        matrix = slope.T @ slope + jnp.diag(
            weight * cost + damping * jnp.maximum(jnp.sum(slope**2, axis=0), 1e-8)
        )
        matrix = matrix * free[:, None] * free[None, :] + jnp.diag(1.0 - free)
        step = -jnp.linalg.solve(matrix, free * gradient)
        trial = jnp.clip(place + jnp.clip(step, -0.3, 0.3), 0.0, 1.0)
        after = look(trial, unknowns)
        better = total(after[0], trial, weight) < total(miss, place, weight)
        better = better & jnp.all(jnp.isfinite(after[0])) & jnp.all(jnp.isfinite(after[1]))
        keep = lambda new, old: jnp.where(better, new, old)  # noqa: E731
        moved = jnp.max(jnp.abs(trial - place))
        place, seen = keep(trial, place), jax.tree.map(keep, after, seen)
        small = jnp.linalg.norm(seen[0]) < CLOSE
        faint = weight <= LAST_WEIGHT
        near = (better & (moved < NEAR)) | (damping > 1e3) | (steps > SEARCHING)
        # where no step helps any more, however short, the search has come to its end
        still = jnp.where(better, moved < STILL, damping > 1e6) & faint
        damping = jnp.where(better, jnp.maximum(0.1 * damping, 1e-12), 10.0 * jnp.maximum(damping, 1e-6))
        damping = jnp.where(near & ~faint, 1e-6, damping)
        done = (small & faint) | still | (steps + 1 >= most)
        weight = jnp.where(near, LAST_WEIGHT, weight)
        return place, seen, damping, weight, steps + 1, done

    begin = jnp.where(wide, jnp.clip(begin, 0.0, 1.0), 0.5)
    seen = look(begin, guess)
    bad = ~jnp.all(jnp.isfinite(seen[0]))
    carry = (begin, seen, jnp.asarray(1e-3), jnp.asarray(WEIGHT), jnp.asarray(0), bad)
    place, (miss, slope, values, unknowns), _, _, steps, _ = jax.lax.while_loop(go_on, advance, carry)
    size = jnp.where(bad, jnp.inf, jnp.linalg.norm(miss))
    effort = jnp.sum(cost * (place - rest) ** 2)
    return Found(place, size, values, effort, slope.T @ miss, unknowns, steps)


@stored_jit(Found)
def search_all(
    body: Body,
    goals: tuple[str, ...],
    boxes: Box,
    wanted: Array,
    begin: Array,
    memories: Memories,
    guess: Array,
    most: Array,
) -> Found:
    """Many searches; all arrays but the memories and the number of steps have a leading axis of searches."""
    one = lambda row: search(body, goals, *row[:3], memories, row[3], most)  # noqa: E731
    return jax.lax.map(one, (boxes, wanted, begin, guess), batch_size=BLOCK)
