"""The search for the course of a hidden state: damped Gauss-Newton, and the linear systems of its steps."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.lax.linalg import tridiagonal_solve
from jaxtyping import Array, Bool, Float, PyTree

CONJUGATE = 16
"""Most steps of conjugate gradients in each of the search's."""
CLOSE = 1e-3
"""Error of those, relative, at which they stop."""

Step = Callable[[Array], tuple[Array, Array, PyTree]]
"""The step from a state, limited; the sum of squares at that state; and what else is known there."""


class _Search(eqx.Module):
    """Where a search stands.

    Attributes:
        best: state of the least sum of squares so far, `least`; and what else is known there, `known`.
        trial: state to try next: `best` and a `share` of its step `move`.
        count: trials made.
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
        """The beginning."""
        still, half = jnp.zeros_like(start), jnp.asarray(0.5)
        return cls(start, jnp.asarray(jnp.inf), blank, start, still, half, jnp.asarray(0))


def settle(
    step: Step,
    start: Float[Array, " rows"],
    told: Bool[Array, " rows"],
    close: float,
    most: int,
    blank: PyTree = None,
) -> tuple[Array, PyTree]:
    """State of the least sum of squares that a search finds, shape (rows,), and what else is known there.

    A step that makes the state worse is halved; after one that makes it better the next may be twice as long,
    at most whole. Without tangents: end with `ended` for derivatives.

    Args:
        step: see `Step`.
        start: the state to begin at.
        told: rows by whose change the end is judged.
        close: largest change at which the search ends.
        most: trials.
        blank: anything of the structure and shapes of what else `step` tells.
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
        moved = largest(search.trial - search.best, told)
        return (search.count == 0) | (moved > close) & (search.count < most)

    found = jax.lax.while_loop(unfinished, trial, _Search.at(jax.lax.stop_gradient(start), blank))
    return found.best, found.known


def ended(settled: Array, last: Array, told: Array, close: float) -> Array:
    """The settled state with the derivatives of one step more, `last`, which is made if it is small."""
    small = largest(last, told) <= close
    return settled + last - jax.lax.stop_gradient(jnp.where(small, 0.0, last))


def largest(change: Array, told: Array) -> Array:
    """Largest change of a row that counts."""
    return jnp.max(jnp.abs(change), where=told, initial=0.0)


def solve_coupled(times: Callable, right: Array, diagonal: Array, upper: Array) -> Array:
    """Solution of a symmetric positive system by conjugate gradients, preconditioned by a tridiagonal one.

    Args:
        times: the system times a vector of shape (rows,).
        right: its right-hand side.
        diagonal, upper: of a tridiagonal system close to it; `upper` ends with a zero.
    """

    def iterate(_: object, right: Array) -> Array:
        return _conjugate_gradients(times, right, lambda rest: solve_tridiagonal(diagonal, upper, rest))

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


def solve_tridiagonal(diagonal: Array, upper: Array, right: Array) -> Array:
    """Solution of a symmetric tridiagonal system; `upper` ends with a zero."""
    lower = jnp.concatenate([jnp.zeros(1), upper[:-1]])
    return tridiagonal_solve(lower, diagonal, upper, right[:, None])[:, 0]
