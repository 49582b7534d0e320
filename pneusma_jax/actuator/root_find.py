"""Roots of the balance: near a guess, from rest, all of them; and what makes a root differentiable.

No function here carries derivatives but `attached`, which gives those of any order by the implicit function
theorem. Searches are therefore free to try, and compile no tangents.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Bool, Float, PyTree

from ..nitinol.spring import MartensiteFraction
from ..numerics.linear import determinant, solve_small
from ..numerics.newton import BoundedNewton, newton_rows, solve_blocks
from ..numerics.safe import frozen
from . import Actuator
from .balance import (
    Problem,
    all_finite,
    calm,
    freedoms,
    joint_residual,
    measured,
    start,
)

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
NODES = {1: 24, 2: 8, 3: 5}
"""Number of trial fractions of each measured spring, by the number of measured springs. With these, none of
20,000 random states of PneuSMA1 and PneuSMA2 to 50 kPa is missed. At least as many trials as `in_between`
makes."""
MOST_ROOTS = 8
"""Maximum of equilibria that are told apart; three is the most that was seen."""


class Ended(eqx.Module):
    """End of an attempt of Newton's method.

    Attributes:
        unknowns: joint unknowns of the row, shape (unknowns,).
        steps: number of steps.
        good: true if the unknowns are a root.
        closing: true if steps beyond `FEW_STEPS` may lead to a root.
        signs: signs of the determinants before the last step, see `stiffness_signs`, shape (2,).
        slope: slope of the measured resistances over the fractions in the direction in which they change
            least, in units of the contrast [1]; see `_least_slope`.
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
    found = optx.root_find(  # type: ignore[var-annotated]
        lambda y, given: joint_residual(y, given[0], 1, given[1]), method, guess, (problem, held),
        options={"free": count, "few": few, "closing": CLOSING},
        max_steps=most_steps, throw=False,
    )  # fmt: skip
    # held at a bound, a step may end without a root
    good = (found.result == optx.RESULTS.successful) & (found.stats["excess"] < NEARLY)
    closing, slope = found.stats["excess"] < CLOSING, found.stats["slope"]
    told = _signs(slope, count), _least_slope(slope, count), slope
    return Ended(found.value, found.stats["num_steps"], good, closing, *told)


def attached(problem: Problem, root: Array, stiffness: Array | None = None) -> Array:
    """The same root, with derivatives by the numbers of the problem: of any order in a plane, else three.

    Args:
        problem: one row.
        root: joint unknowns.
        stiffness: slope of the joint residual there, if it is known.
    """
    problem, root = calm(problem, root)
    if stiffness is not None:
        finite = jnp.all(jnp.isfinite(stiffness))
        stiffness = frozen(jnp.where(finite, stiffness, jnp.eye(len(stiffness))))
    return _attached(frozen(root), problem, stiffness)


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
    told = jax.vmap(lambda slope: (_signs(slope, count), _least_slope(slope, count)))(state.slope)
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


@eqx.filter_custom_jvp
def _attached(root: Array, problem: Problem, stiffness: Array | None) -> Array:
    """See `attached`. Nothing of its derivatives is traced where none is asked for."""
    return root


@_attached.def_jvp
def _attached_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    """Derivative by the implicit function theorem: one Jacobian, one linear system.

    The root within carries derivatives itself, so that this rule has derivatives of any order.
    """
    root, problem, stiffness = primals
    root = _attached(root, problem, stiffness)
    slope = _slope(root, problem, stiffness)
    _, missed = eqx.filter_jvp(lambda given: joint_residual(root, given), (problem,), (tangents[1],))
    return root, -solve_blocks(slope, missed, freedoms(problem))


@eqx.filter_custom_jvp
def _slope(root: Array, problem: Problem, stiffness: Array | None) -> Array:
    """Slope of the joint residual at a root; the last step of the root-find has left it, all but 1e-8."""
    return _slope_at(root, problem) if stiffness is None else stiffness


@_slope.def_jvp
def _slope_jvp(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    root, problem, stiffness = primals
    change = eqx.filter_jvp(_slope_at, (root, problem), tangents[:2])[1]
    return _slope(root, problem, stiffness), change


def _slope_at(root: Array, problem: Problem) -> Array:
    return jax.jacfwd(lambda y: joint_residual(y, problem))(root)


def at_rest(problem: Problem) -> Problem:
    """The row without pressure and loads, springs cold."""
    cold = tuple(
        MartensiteFraction(jnp.ones_like(a.value)) if isinstance(a, MartensiteFraction) else a
        for a in problem.activations
    )
    unloaded = problem.actuator.with_loads(*jax.tree.map(jnp.zeros_like, problem.actuator.loads))
    return Problem(unloaded, jnp.zeros_like(problem.pressure), cold, problem.states, problem.chain)


def loaded_by(share: Array, rest: Problem, problem: Problem) -> Problem:
    """The row with a share of its pressure, heat and loads."""
    return jax.tree.map(
        lambda a, b: jnp.where(share == 1.0, b, a + share * (b - a)) if eqx.is_inexact_array(a) else a,
        rest, problem,
    )  # fmt: skip


def at_given_phases(problem: Problem, guess: Array) -> Ended:
    """Root of a problem without measured springs: from the guess, else in `LOAD_STEPS` steps from rest."""
    problem, guess = frozen((problem, guess))
    rest, finite = at_rest(problem), all_finite(problem)

    def attempt(carry: tuple) -> tuple:
        # one loop for both ways, so that Newton's method is compiled once
        stage, begin, before = carry
        at_once = stage == 0
        share = jnp.where(at_once, 1.0, stage / LOAD_STEPS)
        found = newton(loaded_by(share, rest, problem), begin)
        found = eqx.tree_at(lambda f: f.steps, found, found.steps + before.steps)
        begin = jnp.where(at_once, start(problem.actuator), jnp.where(found.good, found.unknowns, begin))
        ended = at_once & (found.good | ~finite)
        return jnp.where(ended, LOAD_STEPS + 1, stage + 1), begin, found

    no = jnp.asarray(False)
    nothing = Ended(
        guess, jnp.asarray(0), no, no, jnp.zeros(2), jnp.ones(()), jnp.eye(guess.size)
    )
    return jax.lax.while_loop(lambda c: c[0] <= LOAD_STEPS, attempt, (jnp.asarray(0), guess, nothing))[2]


DENSER = 3
"""Power by which fractions of a grid crowd towards 1: the nearest of 12 is then 0.001 from it."""


def denser_when_cold(size: int) -> np.ndarray:
    """Fractions from 0 to 1 that lie closer towards 1, where equilibria come close to each other."""
    return 1.0 - np.linspace(1.0, 0.0, size) ** DENSER


def trial_fractions(springs: int) -> np.ndarray:
    """Fractions of measured springs at which equilibria are looked for, shape (trials, springs)."""
    axis = denser_when_cold(NODES[springs])
    return np.stack(np.meshgrid(*[axis] * springs, indexing="ij"), axis=-1).reshape(-1, springs)


WAYS = np.asarray([(a, b) for a in range(4) for b in range(4) if a != b])
"""Pairs of the first four equilibria."""
SHARES = (0.5, 1.3)
"""Between two equilibria lies a third, and beyond the last ones may lie others: where more are looked for, in
distances of such a pair."""


def in_between(roots: Array, real: Array, count: int) -> Array:
    """Joint unknowns between known equilibria and beyond them; for NumPy and JAX.

    Args:
        roots, real: see `Roots`; with any leading axes.
        count: number of unknowns before the fractions.
    """
    xp = np if isinstance(roots, np.ndarray) else jnp
    near = xp.where(real[..., None], roots, roots[..., :1, :])
    first, second = near[..., WAYS[:, 0], :], near[..., WAYS[:, 1], :]
    between = xp.concatenate([first + share * (second - first) for share in SHARES], axis=-2)
    return xp.concatenate([between[..., :count], xp.clip(between[..., count:], 0.0, 1.0)], axis=-1)


COOLER = (0.0, 0.2, 5.0)
"""Heats of a spring, over the one found, from which neighbours of an equilibrium are looked for [1]."""
INSIDE = (1e-4, 1e-3, 1e-2)
"""The same for a spring that was found cold [1]."""


def beside_cold(roots: Array, real: Array, count: int) -> tuple[Array, np.ndarray]:
    """Joint unknowns of equilibria, with one spring after the other cold or nearly so; for NumPy and JAX.

    Where resistances hardly change with fractions, another equilibrium with a nearly cold spring may be so
    near that no other start leads to it. The fraction of this spring is first held. Otherwise a spring that
    is exactly cold would be heated while the rest still moves.

    Args:
        roots, real: see `Roots`; with any leading axes.
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


class Roots(eqx.Module):
    """Equilibria of one row, the least heated first.

    Attributes:
        unknowns: joint unknowns of each equilibrium, shape (MOST_ROOTS, freedoms + measured).
        real: true for entries that are roots, shape (MOST_ROOTS,).
        signs: sign of the stiffness at the measured resistances, shape (MOST_ROOTS,).
        steps: number of Newton steps in all.
    """

    unknowns: Float[Array, "roots n"]
    real: Bool[Array, "roots"]
    signs: Float[Array, "roots"]
    steps: Array

    @property
    def count(self) -> Array:
        """Number of equilibria."""
        return jnp.sum(self.real)

    def joined(self, found: Ended, counted: Array, count: int) -> "Roots":
        """These roots and those of many attempts.

        Args:
            found: ends of the attempts, arrays of shape (attempts, ...).
            counted: true if their roots are equilibria; with fractions held they are not.
            count: number of unknowns before the fractions.
        """
        every = jnp.concatenate([self.unknowns, found.unknowns])
        best, real = distinct(every, jnp.concatenate([self.real, found.good & counted]), count)
        signs = jnp.concatenate([self.signs, found.signs[:, 1]])[best]
        return Roots(every[best], real, signs, self.steps + jnp.sum(found.steps))


def no_roots(unknowns: int) -> Roots:
    """None yet."""
    none = jnp.zeros((MOST_ROOTS, unknowns))
    return Roots(none, jnp.zeros(MOST_ROOTS, bool), jnp.zeros(MOST_ROOTS), jnp.asarray(0))


def all_roots(problem: Problem) -> Roots:
    """All equilibria of a row with measured springs, ordered by the phase of the hottest one.

    At given phases there is one equilibrium, so it is found for a grid of fractions. Newton's method for
    configuration and fractions together starts from each of these. Then it starts between the equilibria, and
    at last beside them, see `beside_cold`.
    """
    problem = frozen(problem)
    grid = jnp.asarray(trial_fractions(len(measured(problem))))
    count = freedoms(problem)
    first = jnp.broadcast_to(start(problem.actuator), (len(grid), count))

    def search(carry: tuple) -> tuple:
        # one loop for all, so that Newton's method is compiled once
        stage, (begin, fixed), known = carry
        attempt = lambda y, fixed: newton(problem, y, held=(fixed, y[count:]), few=FEW_STEPS)  # noqa: E731
        found = jax.vmap(attempt)(begin, fixed)
        known = known.joined(found, ~holds_fractions(stage), count)
        return stage + 1, next_starts(stage, begin, found, known, count), known

    begun = jnp.concatenate([first, grid], axis=1), jnp.ones(grid.shape, bool)
    carry = (jnp.asarray(0), begun, no_roots(count + grid.shape[1]))
    return jax.lax.while_loop(lambda c: c[0] < STAGES, search, carry)[2]


STAGES = 5
"""Number of stages of `all_roots`: with the fractions of a grid held, from there, between the equilibria
found, beside them with one fraction held, and from there."""


def holds_fractions(stage: Array) -> Array:
    """True if fractions are held in a stage of `all_roots`."""
    return (stage == 0) | (stage == 3)


def next_starts(stage: Array, begin: Array, found: Ended, known: Roots, count: int) -> tuple[Array, Array]:
    """Joint unknowns from which the stage after one of `all_roots` starts, and which fractions are held.

    Args:
        stage: number of the stage that ended.
        begin, found: its starts, shape (starts, unknowns), and how its attempts ended.
        known: equilibria so far.
        count: number of unknowns before the fractions.
    """
    width = np.arange(len(begin))
    from_there = jnp.where(found.good[:, None], found.unknowns, begin)
    between = in_between(known.unknowns, known.real, count)
    beside, held = beside_cold(known.unknowns, known.real, count)
    between, beside, held = (x[width % len(x)] for x in (between, beside, held))
    later = jnp.where(stage == 1, between, beside)
    return jnp.where(holds_fractions(stage), from_there, later), jnp.asarray(held) & (stage == 2)


def distinct(found: Array, good: Array, count: int) -> tuple[Array, Array]:
    """Different ones among roots, the least heated first: by the hottest spring, then by all.

    For NumPy and JAX, with any leading axes.

    Args:
        found: candidates, shape (..., candidates, unknowns); columns from `count` on are fractions.
        good: true for candidates that are roots, shape (..., candidates).
        count: number of unknowns before the fractions.

    Returns:
        Which candidates they are, `MOST_ROOTS` at most, and which of these are roots.
    """
    xp = np if isinstance(found, np.ndarray) else jnp
    heats = xp.sum(1.0 - found[..., count:], axis=-1)
    hottest = xp.round((1.0 - xp.min(found[..., count:], axis=-1, initial=1.0)) / DISTINCT)
    order = xp.lexsort((heats, xp.where(good, hottest, np.inf)), axis=-1)
    found = xp.take_along_axis(found, order[..., None], axis=-2)
    good = xp.take_along_axis(good, order, axis=-1)
    apart = xp.max(xp.abs(found[..., :, None, :] - found[..., None, :, :]), axis=-1) > DISTINCT
    earlier = np.tril(np.ones((good.shape[-1],) * 2, bool), -1)
    new = good & ~xp.any(earlier & good[..., None, :] & ~apart, axis=-1)
    first = xp.argsort(~new, axis=-1, stable=True)[..., :MOST_ROOTS]
    return xp.take_along_axis(order, first, axis=-1), xp.take_along_axis(new, first, axis=-1)


def stiffness_signs(problem: Problem, root: Array) -> Float[Array, "2"]:
    """Sign of the determinant of the stiffness at the phases, and of the one at the measured resistances.

    Args:
        problem: one row.
        root: joint unknowns of an equilibrium.

    Returns:
        Twice a sign, 1 or -1; 0 where it is singular.
    """
    problem, root = frozen((problem, root))
    return _signs(jax.jacfwd(lambda y: joint_residual(y, problem, 1))(root), freedoms(problem))


def _signs(slope: Float[Array, "n n"], count: int) -> Float[Array, "2"]:
    """`stiffness_signs` from the slope of the joint residual; `count` unknowns are the configuration."""
    own = determinant(slope[:count, :count])
    if len(slope) == count:
        return jnp.sign(jnp.stack([own, own]))
    return jnp.sign(jnp.stack([own, own * determinant(_reduced(slope, count))]))


def _reduced(slope: Float[Array, "n n"], count: int) -> Array:
    """Slope of what measured resistances miss over the fractions, while the configuration gives way."""
    first, rest = slope[:count], slope[count:]
    across = jax.vmap(solve_small, (None, 1), 1)(first[:, :count], first[:, count:])
    return rest[:, count:] - rest[:, :count] @ across


def _least_slope(slope: Float[Array, "n n"], count: int) -> Array:
    """About the smallest singular value of `_reduced` [1]; 1 without measured resistances."""
    if len(slope) == count:
        return jnp.ones(())
    reduced = _reduced(slope, count)
    return jnp.abs(determinant(reduced)) / jnp.max(jnp.abs(reduced)) ** (len(reduced) - 1)
