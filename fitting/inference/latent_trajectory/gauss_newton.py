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


def ended(settled: Array, last: Array, made: Array) -> Array:
    """The settled state with the derivatives of one step more, `last`, and with the step if it is `made`."""
    return settled + last - jax.lax.stop_gradient(jnp.where(made, 0.0, last))


def largest(change: Array, told: Array) -> Array:
    """Largest change of a row that counts."""
    return jnp.max(jnp.abs(change), where=told, initial=0.0)


def solve_coupled(times: Callable, right: Array, precondition: Callable[[Array], Array]) -> Array:
    """Solution of a symmetric positive system by conjugate gradients.

    Args:
        times: the system times a vector of shape (rows,).
        right: its right-hand side.
        precondition: solves a system close to it, such as its bands.
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


def banded(diagonal: Array, upper: Array) -> Callable[[Array], Array]:
    """Function that solves a symmetric tridiagonal system by LAPACK, shape (rows,) -> (rows,).

    Only for programs that run one at a time: a batch of these solves is split over the threads of the runtime
    and waits for them, for ever where as many programs run side by side as there are threads.

    Args:
        diagonal: shape (rows,).
        upper: next to it; ends with a zero.
    """
    lower = jnp.concatenate([jnp.zeros(1), upper[:-1]])
    return lambda right: tridiagonal_solve(lower, diagonal, upper, right[:, None])[:, 0]


def banded_side_by_side(diagonal: Array, upper: Array) -> Callable[[Array], Array]:
    """As `banded`, of a positive system, for programs that run side by side; alone it is half as fast.

    By parallel cyclic reduction (Hockney and Jesshope, Parallel Computers, 1981): each step couples a row to
    rows twice as far off, until none is left.
    """
    lower, steps = _moved(upper, 1), []
    for distance in _distances(diagonal.shape[0]):
        before = -lower / _moved(diagonal, distance, 1.0)
        after = -upper / _moved(diagonal, -distance, 1.0)
        steps.append((before, after))
        diagonal = diagonal + before * _moved(upper, distance) + after * _moved(lower, -distance)
        lower, upper = before * _moved(lower, distance), after * _moved(upper, -distance)

    def solve(right: Array) -> Array:
        for distance, (before, after) in zip(_distances(right.shape[0]), steps, strict=True):
            right = right + before * _moved(right, distance) + after * _moved(right, -distance)
        return right / diagonal

    return solve


def _distances(rows: int) -> list[int]:
    return [2**k for k in range((rows - 1).bit_length())]


def _moved(values: Array, distance: int, fill: float = 0.0) -> Array:
    """Values of the row `distance` before each; `fill` where there is none."""
    edge = jnp.full(abs(distance), fill, values.dtype)
    if distance > 0:
        return jnp.concatenate([edge, values[:-distance]])
    return jnp.concatenate([values[-distance:], edge])
