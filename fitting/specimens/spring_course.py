"""Latent trajectory of a spring under a model with effects: the martensite fractions that explain all its
channels best.

The method is that of `inference.latent_trajectory.smoother.profile`. It extends to noise with serial
correlation and to many directions of derivatives at once.
"""

from collections.abc import Callable, Sequence
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from fitting.inference.differences import STEP
from fitting.inference.latent_trajectory.elimination import Elimination
from fitting.inference.latent_trajectory.gauss_newton import ended, largest, settle
from fitting.inference.latent_trajectory.smoother import Local, variances
from fitting.specimens.rows import Rows

from .steady_fraction import steady_near

HELD = 1e-6
"""Weight of the current trajectory in every row. It keeps rows in place whose channels are uninformative."""
ROUNDS = 8
"""Maximum number of Gauss-Newton iterations."""
SETTLED = 3e-3
"""Maximum step of a fraction at which the iterations end [1]."""
FIRST = 0
"""Number of the search that only looks at the first guess: it makes one candidate all the same."""
LONGEST = 0.3
"""Maximum step of the fraction in one iteration [1]."""


class Noise(eqx.Module):
    """Inverse covariance of a channel's errors, tridiagonal: first-order autoregressive noise, as in
    `Channel.whitened`.

    Attributes:
        weight: inverse standard deviation of every row, zero where nothing was measured.
        diagonal, upper: bands of the inverse covariance of errors of unit size, shape (rows,); the last entry
            of `upper` is zero.
    """

    weight: Array
    diagonal: Array
    upper: Array

    @classmethod
    def of(cls, rows: Rows, name: str) -> "Noise":
        """Inverse covariance of one output of a recording."""
        weight, correlation = _weight_and_correlation(rows, name)
        counted = weight > 0.0
        follows = jnp.concatenate([jnp.zeros(1, bool), counted[1:] & counted[:-1]])
        own = jnp.where(follows, 1.0 / (1.0 - correlation**2), counted)
        before = jnp.where(follows, correlation / (1.0 - correlation**2), 0.0)
        shift = lambda column: jnp.concatenate([column[1:], jnp.zeros(1)])  # noqa: E731
        return cls(weight, own + shift(before * correlation), -shift(before))

    def times(self, error: Array) -> Array:
        """Inverse covariance times errors of shape (rows,)."""
        scaled = self.weight * error
        above, below = self.upper * jnp.roll(scaled, -1), jnp.roll(self.upper * scaled, 1)
        return self.weight * (self.diagonal * scaled + above + below)

    @property
    def inverse_covariance(self) -> tuple[Array, Array]:
        """Diagonal, and the entry for every row and the one before, shape (rows,)."""
        beside = self.upper * self.weight * jnp.roll(self.weight, -1)  # the last entry is zero
        return self.diagonal * self.weight**2, jnp.roll(beside, 1)

    def information_on(self, slope: Array) -> tuple[Array, Array]:
        """Fisher information on a trajectory by which the channel changes by `slope`: diagonal and upper
        diagonal."""
        scaled = self.weight * slope
        return self.diagonal * scaled**2, self.upper * scaled * jnp.roll(scaled, -1)


class _System(eqx.Module):
    """The least-squares problem of a trajectory: the channels and the random walk.

    Attributes:
        noise: inverse covariances by channel.
        measured: measured values, shape (channels, rows).
        coupling: inverse variance of the increment from the row before, shape (rows,); zero for the first.
    """

    noise: list[Noise]
    measured: Float[Array, "channels rows"]
    coupling: Float[Array, " rows"]

    def weighed(self, errors: Array) -> Array:
        """Inverse covariance times errors of all channels, (channels, rows)."""
        return jnp.stack([n.times(e) for n, e in zip(self.noise, errors, strict=True)])

    def walk(self, course: Array) -> Array:
        """Gradient of half the increments' weighted sum of squares, (rows,)."""
        rise = self.coupling * jnp.diff(course, prepend=course[:1])
        return rise - _next_row(rise)

    def square(self, missing: Array, course: Array) -> Array:
        """Weighted sum of squares of the channels' errors and of the increments."""
        rise = jnp.diff(course, prepend=course[:1])
        return jnp.sum(missing * self.weighed(missing)) + jnp.sum(self.coupling * rise**2)

    def bands(self, local: Local) -> tuple[Array, Array, Array]:
        """Channels' gradient in every row; then diagonal and upper diagonal of the normal equations.
        Couplings to remembered rows are left out."""
        channels = [n.information_on(s) for n, s in zip(self.noise, local.slope, strict=True)]
        later = sum(n.information_on(s)[0] for n, s in zip(self.noise, local.remembered, strict=True))
        information = sum(own for own, _ in channels) + jnp.zeros_like(later).at[local.source].add(later)
        diagonal = information + self.coupling + _next_row(self.coupling) + HELD
        return information, diagonal, sum(upper for _, upper in channels) - _next_row(self.coupling)

    def step(self, local: Local, course: Array, predicted: Array) -> Array:
        """Gauss-Newton step of a trajectory, limited in size and kept within 0 to 1."""
        missing = self.measured - predicted
        pull = local.back(self.weighed(missing)) - self.walk(course)
        change = jnp.clip(self._solution(local, pull), -LONGEST, LONGEST)
        return jnp.clip(course + change, 0.0, 1.0) - course

    def _solution(self, local: Local, right: Array) -> Array:
        """Solution of the linear system."""
        inverse = [n.inverse_covariance for n in self.noise]
        information, correlated = (jnp.stack(parts) for parts in zip(*inverse, strict=True))
        renews = local.source == jnp.arange(local.source.size)
        system = Elimination.of(
            local.slope, local.remembered, renews, information, correlated, self.coupling, HELD
        )
        return system.solve(right)


def _next_row(column: Array) -> Array:
    """The column shifted to the row after; zero for the last."""
    return jnp.concatenate([column[1:], jnp.zeros(1)])


Outputs = Callable[[Array, Array], tuple[Array, Array, PyTree]]
"""Function from a trajectory, and from the one that decides what the spring remembers, to the channels, shape
(channels, rows), a mask of the rows that it remembers from then on, shape (rows,), and auxiliary results."""
Moved = Callable[[Array, Array, Array], Array]
"""Function from the same two trajectories, and from the channels along the first, to these channels with
their derivatives by the constants."""


class Found(eqx.Module):
    """The trajectory that explains all channels best.

    Attributes:
        course: martensite fraction, shape (rows,).
        predicted: predicted channels, shape (channels, rows).
        known: auxiliary results of `Outputs` at the solution.
        taken: leverage of a measured value on the trajectory in every row, 0 to 1.
        taken_from_errors: degrees of freedom for error that it takes from the readings of every row, 0 to 1.
        local: linearisation of the channels about the trajectory.
    """

    course: Float[Array, " rows"]
    predicted: Float[Array, "channels rows"]
    known: PyTree
    taken: Float[Array, " rows"]
    taken_from_errors: Float[Array, " rows"]
    local: Local


def best_course(outputs: Moved, frozen: Outputs, read: Array, names: Sequence[str], rows: Rows) -> Found:
    """Martensite fraction, modelled as a random walk, that explains all channels best.

    The method is damped Gauss-Newton from a first guess. A spring remembers its hottest row, so later rows
    are coupled to it. Which row that is, a steady course near the first guess decides.

    The search carries no tangents. After it the model is run once more for derivatives. The last step along
    the channels' slopes makes them those of the implicit function.

    The law stands at few places of the program, since a law with every effect takes long to compile. So its
    slopes by the trajectory are differences, and one loop makes three searches. The first one looks at the
    first guess only, the second one searches, and the third one looks where a further step would end.

    Args:
        outputs: gives the channels their derivatives.
        frozen: function from a trajectory to the channels, without derivatives.
        read: first guess of the trajectory, shape (rows,).
        names: names of the channels.
        rows: recording as arrays.
    """
    measured = jnp.stack([rows.measured[name] for name in names])
    interval = jnp.maximum(jnp.diff(rows.time, prepend=rows.time[:1]), 1e-6)
    variance = rows.extra["process_noise"] * interval
    coupling = jnp.where(jnp.arange(interval.size) > 0, 1.0 / variance, 0.0)
    system = _System([Noise.of(rows, name) for name in names], measured, coupling)

    begin = jax.lax.stop_gradient(jnp.clip(read, 0.0, 1.0))
    precision = jnp.stack([lasting_precision(rows, name) for name in names])
    everywhere, nothing = jnp.ones(rows.time.shape, bool), jnp.zeros_like(measured)
    shapes = jax.eval_shape(lambda course: frozen(course, course)[2], begin)
    no_response = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    no_answer = jnp.full_like(measured, jnp.nan)
    blank = Local(no_answer, nothing, nothing, jnp.zeros(read.shape, int)), no_response

    def searched(carry: tuple, most: Array) -> tuple[tuple, tuple]:
        """A search of at most so many candidates, and the start of the next one."""
        start, decided_by = carry

        def step(course: Array) -> tuple[Array, Array, tuple[Local, PyTree]]:
            local, response = _linearised(partial(frozen, decided_by=decided_by), course)
            move = system.step(local, course, local.predicted)
            return move, system.square(measured - local.predicted, course), (local, response)

        solution, (local, response) = settle(step, start, everywhere, SETTLED, most, blank)
        steady = steady_near(rows.time, begin, jnp.sum(precision * local.slope**2, axis=0))
        after = solution + system.step(local, solution, local.predicted)
        begins = most == FIRST
        following = jnp.where(begins, begin, after), jnp.where(begins, steady, decided_by)
        return following, (solution, local, response, decided_by)

    _, found = jax.lax.scan(searched, (begin, begin), jnp.array([FIRST, ROUNDS, 1]))
    solution, local, known, steady = _at(found, 1)
    after, then = _at((found[0], found[1].predicted), 2)
    at_solution = outputs(solution, steady, local.predicted)
    last = system.step(local, solution, at_solution)
    # where a row begins to renew the metal's memory all later ones jump, which the slopes cannot predict
    better = system.square(measured - then, after) <= system.square(measured - local.predicted, solution)
    made = better & (largest(last, everywhere) <= SETTLED)
    course = ended(solution, last, made)
    predicted = at_solution + local.along(course - solution)
    predicted = predicted + jax.lax.stop_gradient(jnp.where(made, then - predicted, 0.0))
    information, diagonal, upper = system.bands(local)
    inside = (solution > 0.0) & (solution < 1.0)
    leverage = jnp.where(inside, jnp.clip(information * variances(diagonal, upper), 0.0, 1.0), 0.0)
    from_errors = jnp.where(inside, _taken_from_errors(information, diagonal, upper), 0.0)
    return Found(course, predicted, known, leverage, from_errors, local)


def _taken_from_errors(information: Array, diagonal: Array, upper: Array) -> Float[Array, " rows"]:
    """Degrees of freedom for error that a trajectory takes from every row: the diagonal of `2 S - S S'`.

    S is the smoother, symmetric in units of the noise. What it leaves of noise has the mean square
    `trace((I - S)^2)` (T. Hastie and R. Tibshirani, Generalized Additive Models, 1990, section 3.5). The
    trace of S holds for a fraction that walks as far as its prior says. The prior's variance is a multiple of
    the one that readings imply, so a fraction walks less.

    `S - S S'` is the derivative of S by the logarithm of the readings' information.

    Args:
        information: of the readings of every row, shape (rows,).
        diagonal, upper: bands of the normal equations.
    """

    def leverage(factor: Array) -> Array:
        variance = variances(diagonal + (factor - 1.0) * information, upper)
        return jnp.clip(factor * information * variance, 0.0, 1.0)

    own, rise = jax.jvp(leverage, (jnp.ones(()),), (jnp.ones(()),))
    return own + rise


def lasting_precision(rows: Rows, name: str) -> Array:
    """Inverse variance of every value of an output beside what changes slowly, shape (..., rows).

    Args:
        rows: recording or stack.
        name: name of the output.
    """
    weight, correlation = _weight_and_correlation(rows, name)
    return weight**2 * (1.0 - correlation) / (1.0 + correlation)


def _weight_and_correlation(rows: Rows, name: str) -> tuple[Array, Array | float]:
    """Inverse standard deviation and serial correlation of an output; a diagnosis has its own."""
    weight = rows.extra.get(f"weight_{name}", rows.weight[name])
    return weight, rows.extra.get(f"correlation_{name}", 0.0)


def _at(tree: PyTree, k: int) -> PyTree:
    """Result number k of a loop, without derivatives."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x[k]), tree)


def _linearised(
    outputs: Callable[[Array], tuple[Array, Array, PyTree]], course: Array
) -> tuple[Local, PyTree]:
    """The channels at a trajectory and their linearisation.

    A spring remembers its hottest row since its memory was last renewed, by heating or by loading. The second
    result are the auxiliary ones of `outputs`.
    """
    predicted, kept, response = outputs(course)
    step = jnp.where(course > 0.5, -STEP, STEP)  # towards the inside
    ways = jnp.stack([jnp.ones_like(step), kept])
    moved = jax.vmap(lambda course: outputs(course)[0])(course + step * ways)
    source = jax.lax.cummax(jnp.where(kept, jnp.arange(course.size), 0))
    whole, by_memory = moved - predicted
    by_memory = jnp.where(kept, 0.0, by_memory)
    return Local(predicted, (whole - by_memory) / step, by_memory / step[source], source), response
