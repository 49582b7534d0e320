"""The search for a latent trajectory: damped Gauss-Newton, and the linear systems of its steps."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PyTree

CONJUGATE = 16
"""Maximum number of conjugate-gradient iterations per Gauss-Newton step."""
CLOSE = 1e-3
"""Relative error at which these iterations stop."""

Step = Callable[[Array], tuple[Array, Array, PyTree]]
"""Function from a state to its limited step, the sum of squares at the state, and auxiliary results."""


class _Search(eqx.Module):
    """State of the search.

    Attributes:
        best: state of the least sum of squares so far, `least`, with its auxiliary results, `known`.
        trial: next candidate state: `best` and a `share` of its step `move`.
        count: number of candidates tried.
    """

    best: Array
    least: Array
    known: PyTree
    trial: Array
    move: Array
    share: Array
    count: Array

    @classmethod
    def at(cls, start: Array, blank: PyTree) -> "_Search":
        """State at the start of the search."""
        still, half = jnp.zeros_like(start), jnp.asarray(0.5)
        return cls(start, jnp.asarray(jnp.inf), blank, start, still, half, jnp.asarray(0))


def settle(
    step: Step,
    start: Float[Array, " rows"],
    judged: Bool[Array, " rows"],
    close: float,
    most: int,
    blank: PyTree = None,
) -> tuple[Array, PyTree]:
    """State of the least sum of squares that a search finds, shape (rows,), and its auxiliary results.

    A step that worsens the state is halved. After one that improves it the next may be twice as long, at most
    whole. There are no tangents: end with `ended` for derivatives.

    The bounded trust-region step of `inference.least_squares` factorises a dense matrix instead of
    eliminating rows. It took 140 times as long for a trajectory of 50 rows, 1,300 times for 200, and 7,500
    times for 400 (670 ms instead of 0.09 ms). Its sums of squares were less by at most 5e-5.

    Args:
        step: function of type `Step`.
        start: initial state, shape (rows,).
        judged: mask of the rows whose change decides the end, shape (rows,).
        close: largest change at which the search ends.
        most: maximum number of candidates.
        blank: any value with the structure and shapes of the auxiliary results of `step`.
    """

    def trial(search: _Search) -> _Search:
        move, square, known = step(search.trial)
        better = square < search.least
        now = search.trial, square, known, move
        before = search.best, search.least, search.known, search.move
        best, least, known, move = jax.tree.map(lambda new, old: jnp.where(better, new, old), now, before)
        share = jnp.where(better, jnp.minimum(2.0 * search.share, 1.0), 0.5 * search.share)
        return _Search(best, least, known, best + share * move, move, share, search.count + 1)

    def unfinished(search: _Search) -> Array:
        change = largest(search.trial - search.best, judged)
        return (search.count == 0) | (change > close) & (search.count < most)

    found = jax.lax.while_loop(unfinished, trial, _Search.at(jax.lax.stop_gradient(start), blank))
    return found.best, found.known


def ended(solution: Array, last: Array, made: Array) -> Array:
    """The final state with the derivatives of one further step, `last`; the step itself is added if `made` is
    true."""
    return solution + last - jax.lax.stop_gradient(jnp.where(made, 0.0, last))


def largest(change: Array, judged: Array) -> Array:
    """Largest change of a row that counts."""
    return jnp.max(jnp.abs(change), where=judged, initial=0.0)


def solve_coupled(times: Callable, right: Array, precondition: Callable[[Array], Array]) -> Array:
    """Solution of a symmetric positive system by conjugate gradients.

    Args:
        times: function that multiplies the system matrix by a vector of shape (rows,).
        right: right-hand side, shape (rows,).
        precondition: function that solves an approximate system, such as that of white noise.
    """

    def iterate(_: object, right: Array) -> Array:
        return _conjugate_gradients(times, right, precondition)

    return jax.lax.custom_linear_solve(times, right, iterate, symmetric=True)


def _conjugate_gradients(times: Callable, right: Array, precondition: Callable) -> Array:
    tiny = jnp.finfo(right.dtype).tiny

    def better(carry: tuple) -> tuple:
        found, rest, direction, size, count = carry
        image = times(direction)
        along = size / jnp.maximum(jnp.dot(direction, image), tiny)
        found, rest = found + along * direction, rest - along * image
        smooth = precondition(rest)
        after = jnp.dot(rest, smooth)
        return found, rest, smooth + after / jnp.maximum(size, tiny) * direction, after, count + 1

    first = precondition(right)
    enough = CLOSE**2 * jnp.dot(right, first)

    def unfinished(carry: tuple) -> Array:
        return (carry[3] > enough) & (carry[4] < CONJUGATE)

    carry = (jnp.zeros_like(right), right, first, jnp.dot(right, first), jnp.asarray(0))
    return jax.lax.while_loop(unfinished, better, carry)[0]


def banded_side_by_side(diagonal: Array, upper: Array) -> Callable[[Array], Array]:
    """Function that solves a symmetric positive tridiagonal system, shape (rows,) -> (rows,).

    LAPACK's batches are split over the threads of the runtime and wait for them. With as many parallel
    programs as threads they wait for ever. This needs no library. The method is parallel cyclic reduction
    (Hockney and Jesshope, Parallel Computers, 1981). Each step couples a row to rows twice as far away, until
    none is left.

    Args:
        diagonal: main diagonal, shape (rows,).
        upper: upper diagonal, shape (rows,); the last entry is zero.
    """
    lower, steps = _shifted(upper, 1), []
    for distance in _distances(diagonal.shape[0]):
        before = -lower / _shifted(diagonal, distance, 1.0)
        after = -upper / _shifted(diagonal, -distance, 1.0)
        steps.append((before, after))
        diagonal = diagonal + before * _shifted(upper, distance) + after * _shifted(lower, -distance)
        lower, upper = before * _shifted(lower, distance), after * _shifted(upper, -distance)

    def solve(right: Array) -> Array:
        for distance, (before, after) in zip(_distances(right.shape[0]), steps, strict=True):
            right = right + before * _shifted(right, distance) + after * _shifted(right, -distance)
        return right / diagonal

    return solve


def _distances(rows: int) -> list[int]:
    return [2**k for k in range((rows - 1).bit_length())]


def _shifted(values: Array, distance: int, fill: float = 0.0) -> Array:
    """Values of the row `distance` before each; `fill` where there is none."""
    edge = jnp.full(abs(distance), fill, values.dtype)
    if distance > 0:
        return jnp.concatenate([edge, values[:-distance]])
    return jnp.concatenate([values[-distance:], edge])
