"""Coordinates for gradient-based samplers: without bounds, and whitened by the Gaussian approximation.

A sampler moves z. From it the coordinates u of a target follow in three maps:

    z -> y = centre + root bent(z) -> w = y, folded at the bounds -> u = w, +-exp(w), or a law from its ends

A curved valley is straight in z (`bend`). The root of the approximation's covariance gives z about unit
variance in every direction. The last map is the chart of `chart`, in which the posterior is closest to a
Gaussian.

Bounds are mirrors: y is folded at them as often as needed, so that a straight valley stays straight up to the
bound. A logistic map between bounds would bend it. On the shipped tubes, whose walls have a tolerance of five
standard errors, trajectories took 57 gradients with such a map and take 6 with mirrors.

The density of z carries the Jacobian of the chart; folding keeps it, and the linear map changes it by a
constant only. Beyond mirrors the density of z repeats, so it cannot be normalised, but u is well defined:
judge chains by u.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from pneusma_jax.numerics.rows import joined, lots
from pneusma_jax.numerics.safe import as_array

from .bend import BentChart, Rows, bend_of, bent, order_of, unbent
from .chart import Chart
from .laplace import Laplace, start_spread
from .likelihood import UnknownNoise
from .plateaus import Plateaus
from .target import Target

BLOCK = 64
"""Number of points for which the program of residuals is compiled."""


class WhitenedMaps(eqx.Module):
    """The maps from z to u, see the module.

    Attributes:
        sign: chart of each coordinate, shape (n,): 0 for itself, 1 for its logarithm, -1 for that of its
            negative.
        lower, upper: bounds of w, infinite for none, shape (n,).
        centre: centre of y, shape (n,).
        root: root of y's covariance, shape (n, n).
        bend: the bend of the density's valley, shape (n, n, n); see `fitting.sample.bend`.
        plateaus: law whose constants move by its ends; None for none. These two have no mirrors.
    """

    sign: Float[Array, " n"]
    lower: Float[Array, " n"]
    upper: Float[Array, " n"]
    centre: Float[Array, " n"]
    root: Float[Array, "n n"]
    bend: Float[Array, "n n n"]
    plateaus: Plateaus | None = eqx.field(static=True, default=None)

    @classmethod
    def around(cls, target: Target, approximation: Laplace, chart: Chart, seed: int = 0) -> "WhitenedMaps":
        """The maps that whiten a target's Gaussian approximation, and straighten its valley.

        Args:
            target: target to sample.
            approximation: its Laplace approximation.
            chart: its chart.
            seed: seed of the draws that judge whether the valley is straight.
        """
        ends = np.stack([np.asarray(target.lower), np.asarray(target.upper)])
        lower, upper = np.sort(_log_ends(chart, ends), axis=0)
        if chart.plateaus is not None:
            lower[[chart.plateaus.mean, chart.plateaus.span]] = -np.inf
            upper[[chart.plateaus.mean, chart.plateaus.span]] = np.inf
        centre = np.clip(chart.to_chart(approximation.mode), lower, upper)
        root = chart.scaled_root(approximation, start_spread(target, approximation))
        size = target.dimension
        straight = (chart.sign, lower, upper, centre, root, np.zeros((size, size, size)))
        maps = cls(*(as_array(np.asarray(part, float)) for part in straight), plateaus=chart.plateaus)
        if target.likelihood.residual is None:
            return maps
        order = order_of(_rows_of(maps, target), approximation.known)
        maps = eqx.tree_at(lambda m: m.root, maps, as_array(np.asarray(maps.root)[:, order]))
        bend = bend_of(_rows_of(maps, target), approximation.known[order], seed)
        return eqx.tree_at(lambda m: m.bend, maps, as_array(bend))

    def whitened(self, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Coordinates z of a point of the target within its bounds."""
        w = Chart(np.asarray(self.sign), self.plateaus).to_chart(np.asarray(u))
        straight = np.linalg.lstsq(np.asarray(self.root), w - np.asarray(self.centre))[0]
        return unbent(straight[None], np.asarray(self.bend))[0]

    @property
    def chart(self) -> Chart:
        """Coordinates for walkers, which need no mirrors: z where a valley is bent, else w."""
        sign, centre, root, bend = map(np.asarray, (self.sign, self.centre, self.root, self.bend))
        regular = np.linalg.matrix_rank(root / np.linalg.norm(root, axis=1, keepdims=True)) == len(root)
        if regular and np.any(bend):
            return BentChart(sign, centre, root, bend, self.plateaus)
        return Chart(sign, self.plateaus)

    def coordinates(self, z: Float[Array, " n"]) -> Float[Array, " n"]:
        """Coordinates u of the target."""
        bent, w = self.sign != 0.0, self._folded(z)
        u = jnp.where(bent, self.sign * jnp.exp(jnp.where(bent, w, 0.0)), w)
        return u if self.plateaus is None else self.plateaus.plain(u)

    def log_density(self, target: Target, z: Float[Array, " n"]) -> Float[Array, ""]:
        """Log-density of z up to a constant; -inf where the model has no answer."""
        u = self.coordinates(z)
        nearest = jnp.clip(u, target.lower, target.upper)  # rounding of the logarithm
        if self.plateaus is not None:  # no mirrors: beyond the bounds the density is none
            moved = np.isin(np.arange(target.dimension), (self.plateaus.mean, self.plateaus.span))
            nearest = jnp.where(moved, u, nearest)
        density = target.log_probability(nearest) + self.log_jacobian(z)
        return jnp.where(jnp.isfinite(density), density, -jnp.inf)

    def log_jacobian(self, z: Float[Array, " n"]) -> Float[Array, ""]:
        """Logarithm of the Jacobian from z to u, up to a constant."""
        return jnp.sum(jnp.where(self.sign != 0.0, self._folded(z), 0.0))

    def _folded(self, z: Array) -> Array:
        """Chart coordinates w: y, mirrored at bounds."""
        y = self.centre + self.root @ bent(z, self.bend)
        low, high = jnp.isfinite(self.lower), jnp.isfinite(self.upper)
        start, end = jnp.where(low, self.lower, 0.0), jnp.where(high, self.upper, 0.0)
        width = jnp.where(low & high & (end > start), end - start, 1.0)
        way = jnp.mod(y - start, 2.0 * width)
        between = start + jnp.where(way > width, 2.0 * width - way, way)
        above, below = start + jnp.abs(y - start), end - jnp.abs(end - y)
        return jnp.where(low & high, between, jnp.where(low, above, jnp.where(high, below, y)))


@eqx.filter_jit
def _rows(points: Array, bend: Array, target: Target, maps: WhitenedMaps, scale: Array) -> Array:
    """Residuals in units of a scale, and priors, at whitened points beside a bend."""
    bent_maps = eqx.tree_at(lambda m: m.bend, maps, bend)

    def one(z: Array) -> Array:
        u = jnp.clip(bent_maps.coordinates(z), target.lower, target.upper)
        own = jnp.ravel(target.likelihood.residual(target.values(u), target.data))
        return jnp.concatenate([own / scale, target.prior_rows(u)])

    return jax.lax.map(one, points)


def _rows_of(maps: WhitenedMaps, target: Target) -> Rows:
    """The same in units of the noise at the mode, for any number of points."""

    def rows(points: np.ndarray, bend: np.ndarray, scale: float = 1.0) -> np.ndarray:
        known = as_array(bend), target, maps, as_array(scale)
        return joined([np.asarray(_rows(as_array(x), *known)) for x in lots(points, BLOCK)], len(points))

    if not isinstance(target.likelihood, UnknownNoise):
        return rows
    here = rows(np.zeros((1, target.dimension)), np.asarray(maps.bend))[0]
    data = here[: len(here) - len(target.prior_names)]
    return partial(rows, scale=float(np.sqrt(np.sum(data**2) / target.likelihood.observations)))


def _log_ends(chart: Chart, ends: np.ndarray) -> np.ndarray:
    """Bounds in the chart; a bound at zero, or beyond it, becomes minus infinity."""
    bent = chart.sign != 0
    with np.errstate(divide="ignore", invalid="ignore"):  # zero times an infinite bound, where unused
        inside = np.maximum(np.where(bent, chart.sign * ends, 1.0), 0.0)
        return np.where(bent, np.log(inside), ends)
