"""Roots of the balance: near a guess, from rest, all of them; and what makes a root differentiable.

No function here carries derivatives but `attached`, which gives those of any order by the implicit function
theorem. Searches are therefore free to try, and compile no tangents.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ..nitinol.spring import MartensiteFraction
from ..numerics.linear import determinant, solve_small
from ..numerics.newton import BoundedNewton, solve_blocks
from ..numerics.safe import frozen
from .balance import (
    Problem,
    all_finite,
    at_phases,
    calm,
    freedoms,
    joint_residual,
    measured,
    residual,
    start,
)

MOST_STEPS = 40
"""Maximum of Newton steps of an attempt. Rows near a fold or a corner need the most."""
FEW_STEPS = 20
"""Maximum of Newton steps from one of many starts. Another start finds what takes longer from this one."""
LOAD_STEPS = 16
"""Number of steps in which pressure, heat and loads are brought on from rest, where Newton fails from the
start."""
BALANCED = 1e-9
"""Maximum of the scaled residual in equilibrium [1]: 3e-9 N on the source's actuators, whose wall of 28 mm2
makes the unit 2.8 N."""
NEARLY = 1e-6
"""Maximum of the scaled residual before the last step [1]; that step is at most 1e-8 long."""
DISTINCT = 1e-5
"""Minimum difference of two equilibria in a scaled unknown [1]; Newton's method ends at 1e-8."""
NODES = {1: 17, 2: 8, 3: 5}
"""Number of trial fractions of each measured spring, by the number of measured springs. With these, none of
20,000 random states of PneuSMA1 and PneuSMA2 to 50 kPa is missed."""
MOST_ROOTS = 8
"""Maximum of equilibria that are told apart; three is the most that was seen."""


def newton(
    problem: Problem, guess: Array, most_steps: int = MOST_STEPS
) -> tuple[Array, Array, Bool[Array, ""]]:
    """Root near a guess of the joint unknowns, number of steps, and whether it is one. No derivatives."""
    problem, guess = frozen((problem, guess))
    found = optx.root_find(  # type: ignore[var-annotated]
        lambda y, given: joint_residual(y, given, 1), BoundedNewton(), guess, problem,
        options={"free": freedoms(problem)}, max_steps=most_steps, throw=False,
    )  # fmt: skip
    # held at a bound, a step may end without a root
    good = (found.result == optx.RESULTS.successful) & (found.stats["excess"] < NEARLY)
    return found.value, found.stats["num_steps"], good


def attached(problem: Problem, root: Array) -> Array:
    """The same root, with derivatives by the numbers of the problem: of any order in a plane, else three."""
    count = freedoms(problem)
    problem, root, _ = calm(problem, root)

    def tangent(linear: Callable[[Array], Array], vector: Array) -> Array:
        return solve_blocks(jax.jacfwd(linear)(vector), vector, count)

    return jax.lax.custom_root(
        lambda y: joint_residual(y, problem), frozen(root), lambda _, y: y, tangent
    )


def from_rest(
    problem: Problem, root: Array, steps: Array, good: Array, done: Array
) -> tuple[Array, Array, Bool[Array, ""]]:
    """Root of a problem whose phases are given, with the load brought on in `LOAD_STEPS` steps from rest.

    Args:
        problem: one row.
        root, steps, good: what was found so far; returned where it is `done`.
        done: whether there is nothing to do. Not a condition around the loop: a batch would run both ways.
    """
    rest = _at_rest(problem)

    def attempt(carry: tuple) -> tuple:
        stage, unknowns, steps, _ = carry
        share = stage / LOAD_STEPS
        mix = lambda a, b: a + share * (b - a) if eqx.is_inexact_array(a) else a  # noqa: E731
        found, more, good = newton(jax.tree.map(mix, rest, problem), unknowns)
        return stage + 1, jnp.where(good, found, unknowns), steps + more, good

    def unfinished(carry: tuple) -> Array:
        return carry[0] <= LOAD_STEPS

    begin = jnp.where(done, root, start(problem.actuator))
    first = (jnp.where(done, LOAD_STEPS + 1, 1), begin, steps, good)
    _, unknowns, steps, good = jax.lax.while_loop(unfinished, attempt, first)
    return unknowns, steps, good


def _at_rest(problem: Problem) -> Problem:
    """The row without pressure and loads, springs cold."""
    cold = tuple(
        MartensiteFraction(jnp.ones_like(a.value)) if isinstance(a, MartensiteFraction) else a
        for a in problem.activations
    )
    unloaded = problem.actuator.with_loads(*jax.tree.map(jnp.zeros_like, problem.actuator.loads))
    return Problem(unloaded, jnp.zeros_like(problem.pressure), cold, problem.states, problem.chain)


def at_given_phases(problem: Problem, guess: Array) -> tuple[Array, Array, Bool[Array, ""]]:
    """Root of a problem without measured springs: from the guess, else `from_rest`."""
    problem = frozen(problem)
    root, steps, good = newton(problem, guess)
    return from_rest(problem, root, steps, good, good | ~all_finite(problem))


DENSER = 3
"""Power by which fractions of a grid crowd towards 1: the nearest of 12 is then 0.001 from it."""


def denser_when_cold(size: int) -> np.ndarray:
    """Fractions from 0 to 1 that lie closer towards 1, where equilibria come close to each other."""
    return 1.0 - np.linspace(1.0, 0.0, size) ** DENSER


class Roots(eqx.Module):
    """Equilibria of one row, the least heated first.

    Attributes:
        unknowns: of each, shape (MOST_ROOTS, freedoms + measured).
        real: which of them are roots, shape (MOST_ROOTS,).
        steps: of Newton's method in all.
    """

    unknowns: Float[Array, "roots n"]
    real: Bool[Array, "roots"]
    steps: Array

    @property
    def count(self) -> Array:
        """Number of equilibria."""
        return jnp.sum(self.real)


def all_roots(problem: Problem) -> Roots:
    """All equilibria of a row with measured springs, ordered by the phase of the hottest one.

    At given phases there is one equilibrium. So it is found for a grid of fractions, and Newton's method for
    configuration and fractions together starts from each of these.
    """
    problem = frozen(problem)
    springs = len(measured(problem))
    axis = denser_when_cold(NODES[springs])
    grid = jnp.stack(jnp.meshgrid(*[axis] * springs, indexing="ij"), axis=-1).reshape(-1, springs)
    first = start(problem.actuator)
    seen, steps_1, there = jax.vmap(lambda x: newton(at_phases(problem, x), first))(grid)
    begin = jnp.concatenate([jnp.where(there[:, None], seen, first), grid], axis=1)
    search = jax.vmap(lambda y: newton(problem, y, FEW_STEPS))
    found, steps_2, good = search(begin)
    count = freedoms(problem)
    roots, real = distinct(found, good, count)
    # between two equilibria lies a third, and beyond the last ones may lie others
    near = jnp.where(real[:, None], roots, roots[0])
    ways = jnp.asarray([(a, b) for a in range(4) for b in range(4) if a != b])
    shares = (0.5, 1.3)
    between = jnp.concatenate([near[ways[:, 0]] + s * (near[ways[:, 1]] - near[ways[:, 0]]) for s in shares])
    between = jnp.concatenate([between[:, :count], jnp.clip(between[:, count:], 0.0, 1.0)], axis=1)
    more, steps_3, better = search(between)
    roots, real = distinct(jnp.concatenate([roots, more]), jnp.concatenate([real, better]), count)
    return Roots(roots, real, jnp.sum(steps_1) + jnp.sum(steps_2) + jnp.sum(steps_3))


def distinct(found: Array, good: Array, count: int) -> tuple[Array, Array]:
    """Different ones among roots, the least heated first: by the hottest spring, then by all.

    Args:
        found: candidates, shape (candidates, unknowns); columns from `count` on are fractions.
        good: which of them are roots.
        count: number of unknowns before the fractions.

    Returns:
        `MOST_ROOTS` of them, and which are roots.
    """
    heats = jnp.sum(1.0 - found[:, count:], axis=1)
    hottest = jnp.round((1.0 - jnp.min(found[:, count:], axis=1)) / DISTINCT)
    order = jnp.lexsort((heats, jnp.where(good, hottest, jnp.inf)))
    found, good = found[order], good[order]
    apart = jnp.max(jnp.abs(found[:, None] - found[None]), axis=-1) > DISTINCT
    earlier = np.tril(np.ones((good.size, good.size), bool), -1)
    new = good & ~jnp.any(earlier & good[None, :] & ~apart, axis=1)
    first = jnp.argsort(~new, stable=True)[:MOST_ROOTS]
    return found[first], new[first]


def stiffness_signs(problem: Problem, root: Array) -> tuple[Array, Array]:
    """Sign of the determinant of the stiffness at the phases, and of the one at the measured resistances.

    Args:
        problem: one row.
        root: joint unknowns of an equilibrium.

    Returns:
        Twice a sign, 1 or -1; 0 where it is singular.
    """
    problem, root = frozen((problem, root))
    count = freedoms(problem)
    at = lambda z: residual(z, at_phases(problem, root[count:]), 1)  # noqa: E731
    own = jax.jacfwd(at)(root[:count])
    whole = jax.jacfwd(lambda y: joint_residual(y, problem, 1))(root)
    if root.size == count:
        return jnp.sign(determinant(own)), jnp.sign(determinant(whole))
    first, rest = whole[:count], whole[count:]
    across = jax.vmap(solve_small, (None, 1), 1)(first[:, :count], first[:, count:])
    reduced = rest[:, count:] - rest[:, :count] @ across
    return jnp.sign(determinant(own)), jnp.sign(determinant(first[:, :count]) * determinant(reduced))
