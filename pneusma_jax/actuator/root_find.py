"""Newton's method on the balance, from a guess: an attempt of one row, or of many.

No function here carries derivatives; those of a root are in `implicit`. Searches are therefore free to try,
and compile no tangents.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PyTree

from ..late import optimistix as optx
from ..numerics.newton import BoundedNewton, newton_rows
from ..numerics.safe import frozen
from . import Actuator
from .balance import Problem, freedoms, joint_residual
from .stability import least_slope, signs_of

MOST_STEPS = 40
"""Maximum of Newton steps of an attempt. Rows near a fold or a corner need the most."""
FEW_STEPS = 12
"""Maximum of Newton steps from one of many starts, unless it comes near a root. Another start finds what
takes longer from this one."""
CLOSING = 1e-4
"""Maximum of the scaled residual [1] with which an attempt goes on beyond `FEW_STEPS`. Where two equilibria
are close, a step only halves the distance to them. Ending all attempts after 12 steps lost 13 pairs in
300,000 rows. Attempts that found one later had residuals up to 9e-6 then."""
STUCK = 5
"""Number of Newton steps after which an attempt from one of many starts is given up while a fraction stays at
an end and misses its resistance. Of 780 attempts that found nothing in 10,000 random rows of PneuSMA2, 752
ended so."""
BALANCED = 1e-9
"""Maximum of the scaled residual in equilibrium [1]: 3e-9 N on the source's actuators, whose wall of 28 mm2
makes the unit 2.8 N."""
NEARLY = 1e-6
"""Maximum of the scaled residual before the last step [1]; that step is at most 1e-8 long."""


class Ended(eqx.Module):
    """End of an attempt of Newton's method.

    Attributes:
        unknowns: joint unknowns of the row, shape (unknowns,).
        steps: number of steps.
        good: true if the unknowns are a root.
        closing: true if steps beyond `FEW_STEPS` may lead to a root.
        signs: signs of the determinants before the last step, see `stiffness_signs`, shape (2,).
        slope: slope of the measured resistances over the fractions in the direction in which they change
            least, in units of the contrast [1]; see `least_slope`.
        stiffness: slope of the joint residual before the last step, shape (unknowns, unknowns).
    """

    unknowns: Float[Array, "unknowns"]
    steps: Array
    good: Bool[Array, ""]
    closing: Bool[Array, ""]
    signs: Float[Array, "2"]
    slope: Array
    stiffness: Float[Array, "unknowns unknowns"]


def newton(
    problem: Problem,
    guess: Array,
    most_steps: int = MOST_STEPS,
    held: tuple[Array, Array] | None = None,
    few: int = MOST_STEPS,
    method: BoundedNewton = BoundedNewton(),
) -> Ended:
    """Root near a guess of the joint unknowns. No derivatives.

    Args:
        problem: one row.
        guess: joint unknowns to start from.
        most_steps: maximum number of steps of the attempt.
        held: fractions of measured springs that are held; see `joint_residual`.
        few: number of steps after which only an attempt near a root goes on, see `CLOSING`.
        method: root finder.
    """
    problem, guess, held = frozen((problem, guess, held))
    count = freedoms(problem)
    found = optx.root_find(
        lambda y, given: joint_residual(y, given[0], 1, given[1]), method, guess, (problem, held),
        options={"free": count, "few": few, "closing": CLOSING},
        max_steps=most_steps, throw=False,
    )  # fmt: skip
    # held at a bound, a step may end without a root
    good = (found.result == optx.RESULTS.successful) & (found.stats["excess"] < NEARLY)
    closing, slope = found.stats["excess"] < CLOSING, found.stats["slope"]
    told = signs_of(slope, count), least_slope(slope, count), slope
    return Ended(found.value, found.stats["num_steps"], good, closing, *told)


def newton_many(
    actuator: Actuator, each: tuple, guess: Array, before: Array, held: Array, ended: Array, block: int,
    most_steps: Array,
) -> Ended:
    """`newton` of many rows of one actuator, see `newton_rows`.

    Args:
        actuator: the actuator of all rows.
        each: pressures, activations and states, arrays of shape (rows, ...).
        guess: joint unknowns to start from, shape (rows, unknowns).
        before: number of steps that were made already, shape (rows,).
        held: true for fractions of measured springs that stay as guessed, shape (rows, measured).
        ended: rows that are left alone, shape (rows,).
        block: number of rows that are computed side by side; the number of rows is a multiple of it.
        most_steps: maximum number of steps of the attempt.
    """
    actuator, each, guess = frozen((actuator, each, guess))
    count = actuator.freedoms

    def missed(y: Array, row: tuple) -> Array:
        row, held = row
        return joint_residual(y, Problem(actuator, *row), 1, (held, jax.lax.stop_gradient(y[count:])))

    options = {"free": count, "count": before}
    if guess.shape[1] > count:  # from one of many starts
        options |= {"few": FEW_STEPS, "closing": CLOSING, "stuck": STUCK}
    unknowns, state = newton_rows(missed, (each, held), guess, options, ended, block, most_steps)
    told = jax.vmap(lambda slope: (signs_of(slope, count), least_slope(slope, count)))(state.slope)
    closing = state.excess < CLOSING
    return Ended(unknowns, state.count - before, _balanced(state), closing, *told, state.slope)


def _balanced(state: Any) -> Array:
    """True for systems of `newton_rows` that ended in a root."""
    return (state.moved <= BoundedNewton().close) & (state.excess < NEARLY)


def newton_side_by_side(
    problem_of: Callable[[PyTree], Problem], rows: PyTree, guess: Array, ended: Array, block: int
) -> tuple[Array, Array, Array]:
    """Roots near guesses of problems that differ in some numbers only. No derivatives.

    Args:
        problem_of: the problem from one of `rows`.
        rows: numbers of each problem, arrays of shape (problems, ...).
        guess: joint unknowns to start from, shape (problems, unknowns); fractions are held to [0, 1].
        ended: problems that are left alone, shape (problems,).
        block: number of problems that are computed side by side; their number is a multiple of it.

    Returns:
        Joint unknowns, whether they are a root, and the number of steps.
    """
    rows, guess = frozen((rows, guess))
    count = freedoms(problem_of(jax.tree.map(lambda x: x[0], rows)))
    guess = jnp.concatenate([guess[:, :count], jnp.clip(guess[:, count:], 0.0, 1.0)], axis=1)
    missed = lambda y, row: joint_residual(y, frozen(problem_of(row)), 1)  # noqa: E731
    before, most = jnp.zeros(len(guess), int), jnp.asarray(MOST_STEPS)
    options = {"free": count, "count": before, "few": MOST_STEPS, "closing": CLOSING, "stuck": STUCK}
    unknowns, state = newton_rows(missed, rows, guess, options, ended, block, most)
    return unknowns, _balanced(state) & ~ended, state.count
