"""Clearance of a chain of segments from itself.

A piece is a segment with the rigid connector after it; its centre line is an arc with a straight end.
Clearance is the smallest distance between two centre lines less both radii.

Neighbouring points of a tube are close without touching. So in adjoining pieces, pairs of points less than a
segment's length apart along the centre line are left out. By Schur's comparison theorem such a pair can only
touch if the more bent segment touches itself from end to end. That is checked for every segment; it matters
past a bend of half a turn.

Values and first derivatives are exact to about 1e-9 m. The closest pair is found without derivatives and then
held fixed: at a minimum, the distance does not depend on the pair to first order. Where two pairs are equally
close, clearance is continuous but not smooth, and the gradient is that of one of them.
"""

import itertools
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.safe import safe_norm
from .kinematics import arc_frame, arc_points, tangent, transform

COARSE = 33  # Number of points per piece in the first search; 1.75 mm apart on a 56 mm segment
FINE = 9  # Number of points per piece in a refinement, whose grid is four times finer than the one before
REFINEMENTS = 10  # Number of refinements about the best pair


class Pieces(eqx.Module):
    """Segments in space, each with the rigid connector after it; arrays have a leading axis of segments.

    Attributes:
        bend: bend angle vector in the frame of the base [rad].
        length: length of the segment's centre line [m].
        connector: length of the rigid connector after it [m].
        radius: radius of the tube [m].
        base: frame at the segment's start.
    """

    bend: Float[Array, "n 2"]
    length: Float[Array, "n"]
    connector: Float[Array, "n"]
    radius: Float[Array, "n"]
    base: Float[Array, "n 4 4"]

    def point(self, s: Array) -> Float[Array, "*k 3"]:
        """Points of one piece (no leading axis) at distances `s` from its base along the centre line [m]."""
        on_arc = jnp.minimum(s, self.length)
        arc = arc_points(self.bend, self.length, on_arc / self.length)
        ahead = (s - on_arc)[..., None] * tangent(arc_frame(self.bend, self.length))
        return transform(self.base, arc + ahead)


class Clearance(eqx.Module):
    """Free space between parts of a chain; negative where they would overlap.

    Attributes:
        within: clearance of a segment's end, or the connector after it, from its base [m], shape (n,).
        between: clearance of every pair of segments [m], shape (pairs,).
        pairs: static; indices of the segments of each pair, from 0.
    """

    within: Float[Array, "n"]
    between: Float[Array, "pairs"]
    pairs: tuple[tuple[int, int], ...] = eqx.field(static=True)

    @property
    def smallest(self) -> Array:
        """The smallest clearance of the chain [m]; of a history, that of each row."""
        between = jnp.min(self.between, axis=-1, initial=jnp.inf)
        return jnp.minimum(jnp.min(self.within, axis=-1), between)


@eqx.filter_jit
def chain_clearance(pieces: Pieces) -> Clearance:
    """Clearance within every segment and between every two of them.

    Args:
        pieces: pieces of one configuration; use `jax.vmap` for a history.
    """
    count = pieces.length.shape[0]
    pairs = tuple(itertools.combinations(range(count), 2))
    take = lambda index: jax.tree.map(lambda x: x[jnp.asarray(index, dtype=int)], pieces)  # noqa: E731
    within = jax.vmap(_within)(pieces)
    if not pairs:
        return Clearance(within, jnp.zeros(0), pairs)
    first, second = take([i for i, _ in pairs]), take([j for _, j in pairs])
    adjoining = jnp.asarray([j == i + 1 for i, j in pairs])
    return Clearance(within, jax.vmap(_between)(first, second, adjoining), pairs)


def _within(piece: Pieces) -> Array:
    """Clearance of a piece from itself, over pairs of points at least the segment's length apart [m].

    A position in the unit square gives two distances. One is that of the first point from the base. The other
    is that of the second point from the first, beyond the segment's length. Without a connector the
    only pair is base and end: `L |sinc(phi / 2)| - 2 r`.
    """

    def distance(ab: Array, piece: Pieces) -> Array:
        start = ab[..., 0] * piece.connector
        end = piece.length + start + ab[..., 1] * (piece.connector - start)
        return safe_norm(piece.point(end) - piece.point(start))

    closed = safe_norm(piece.bend) >= 2.0 * jnp.pi  # a full turn runs into itself, wherever its end may be
    return jnp.where(closed, 0.0, _smallest(distance, piece)) - 2.0 * piece.radius


def _between(one: Pieces, other: Pieces, adjoining: Array) -> Array:
    """Clearance of two pieces, `other` the one nearer the tip [m].

    A position in the unit square gives the distances of the two points from the ends that face each other.
    """

    def distance(ab: Array, one: Pieces, other: Pieces) -> Array:
        exclusion = jnp.where(adjoining, jnp.minimum(one.length, other.length), 0.0)
        size = one.length + one.connector
        back = ab[..., 0] * size
        least = jnp.maximum(exclusion - back, 0.0)
        ahead = least + ab[..., 1] * (other.length + other.connector - least)
        return safe_norm(other.point(ahead) - one.point(size - back))

    return _smallest(distance, one, other) - one.radius - other.radius


def _smallest(distance: Callable[..., Array], *pieces: Pieces) -> Array:
    """Smallest value of a distance over the unit square, by search on ever finer grids.

    Derivatives are taken at a fixed position in the square.

    Args:
        distance: function of positions, shape (..., 2) in [0, 1], and the pieces.
        pieces: arguments of `distance`.
    """
    frozen = jax.lax.stop_gradient(pieces)

    def best(low: Array, high: Array, count: int) -> Array:
        """Position of the smallest distance on a grid between two corners."""
        share = jnp.linspace(0.0, 1.0, count)
        grid = jnp.stack(jnp.meshgrid(share, share, indexing="ij"), axis=-1).reshape(-1, 2)
        places = low + grid * (high - low)
        return places[jnp.argmin(distance(places, *frozen))]

    def refined(k: Array, place: Array) -> Array:
        half_width = (0.5 * (FINE - 1)) ** -k.astype(place.dtype) / (COARSE - 1)
        return best(jnp.maximum(place - half_width, 0.0), jnp.minimum(place + half_width, 1.0), FINE)

    place = jax.lax.fori_loop(0, REFINEMENTS, refined, best(jnp.zeros(2), jnp.ones(2), COARSE))
    return distance(place, *pieces)
