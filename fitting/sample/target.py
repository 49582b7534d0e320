"""The sampled density: priors and likelihood over the fitting coordinates of `fitting.inference.parameters`.

Coordinates are the parameters' own (the logarithm of those with `scale="log"`), inside the box of their
bounds. Outside it the probability is zero. A truncated Gaussian posterior stays one, so that the Laplace
approximation is exact for it. Scales need no care because the samplers are affine invariant. A logistic map
to an unbounded line would bend such a posterior for nothing.

A parameter's Gaussian prior, truncated at its bounds, is a density of its *value*. For a parameter fitted by
its logarithm u the Jacobian `exp(u)` is applied. Without a prior a parameter is flat between its bounds in
the fitted coordinate: its value, or its logarithm. A tied parameter's prior multiplies in as one more
observation, as in the fit.
"""

import functools
import hashlib
from collections.abc import Callable, Sequence
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from fitting.inference.parameters import Layout, Parameters
from fitting.specimens.specimen import SigmoidLaw
from pneusma_jax.errors import InputError
from pneusma_jax.numerics.rows import joined, lots
from pneusma_jax.numerics.safe import as_array
from pneusma_jax.precision import require_float64
from pneusma_jax.program_cache import stored_jit

from .likelihood import GivenLikelihood, KnownNoise, Residual, UnknownNoise
from .order import Check, KnownNoiseInOrder


class Target(eqx.Module):
    """A posterior, as numbers (traced) and structure (static).

    Make one with `from_residual` or `from_log_likelihood`.

    Attributes:
        likelihood: log-likelihood, a function of `(values, data)`.
        data: data for the likelihood.
        stored: values of the parameters that are not free, in the layout's order, shape (all,).
        lower, upper: bounds of the coordinates, infinite for none, shape (n,).
        prior_mean, prior_sd: priors of the parameters `prior_names`, shape (p,).
        layout: conversion of coordinates to values.
        prior_names: parameters with a prior, free or tied.
        in_turn: true if the points of a block are evaluated one after another. That is worth it where a
            residual holds a search: side by side all points wait for the longest one. Walkers of an
            open alloy take 0.73 ms a point for 2.5.
        sigmoid_law: law whose constants chains move by the law's ends, see `plateaus`; None for none.
    """

    likelihood: KnownNoise | UnknownNoise | GivenLikelihood
    data: PyTree
    stored: Float[Array, " all"]
    lower: Float[Array, " n"]
    upper: Float[Array, " n"]
    prior_mean: Float[Array, " p"]
    prior_sd: Float[Array, " p"]
    layout: Layout = eqx.field(static=True)
    prior_names: tuple[str, ...] = eqx.field(static=True)
    in_turn: bool = eqx.field(static=True, default=False)
    sigmoid_law: SigmoidLaw | None = eqx.field(static=True, default=None)

    @classmethod
    def from_residual(
        cls,
        residual: Residual,
        parameters: Parameters,
        data: PyTree = None,
        noise: Literal["known", "unknown"] = "known",
        orders: Sequence[Check] = (),
        in_turn: bool = False,
    ) -> "Target":
        """Posterior of a least-squares problem, as `fit_least_squares` takes it.

        Args:
            residual: function `residual(values, data)`, weighted; differentiable by JAX.
            parameters: parameters; the free ones are sampled, and their priors and bounds count.
            data: data for the residual.
            noise: `"known"` for residuals in units of sigma; `"unknown"` to integrate one common factor out.
            orders: functions of the values, true where terms keep an order; of known noise only.
            in_turn: attribute of the target.

        Raises:
            InputError: if nothing is free, there are no residuals, or unknown noise has too few of them.
            ValueError: if `noise` is neither word.
        """
        if noise not in ("known", "unknown"):
            raise ValueError(f"Argument `noise` must be 'known' or 'unknown', but it is {noise!r}.")
        likelihood = KnownNoiseInOrder(residual, tuple(orders)) if orders else KnownNoise(residual)
        target = cls._make(likelihood, parameters, data, in_turn)
        rows = jax.eval_shape(
            lambda v: jnp.ravel(residual(v, target.data)), target.values(target.pack(parameters))
        ).size
        if rows == 0:
            raise InputError("the residual has no rows: there is no data to learn from")
        if noise == "known":
            return target
        if rows <= len(target.layout.free):
            raise InputError(
                f"{rows} independent residuals cannot tell the size of the noise beside "
                f"{len(target.layout.free)} free parameters; state sigma, or add data"
            )
        return cls._make(UnknownNoise(residual, jnp.asarray(float(rows))), parameters, data, in_turn)

    @classmethod
    def from_log_likelihood(
        cls,
        log_likelihood: Callable[[dict[str, Array], PyTree], Array],
        parameters: Parameters,
        data: PyTree = None,
        residual: Residual | None = None,
    ) -> "Target":
        """Posterior of any log-likelihood.

        Args:
            log_likelihood: function `log_likelihood(values, data)` to a scalar; twice differentiable unless
                there is a residual.
            parameters, data: parameters and data as for `from_residual`.
            residual: weighted residual, see `GivenLikelihood`.

        Raises:
            InputError: if nothing is free.
        """
        return cls._make(GivenLikelihood(log_likelihood, residual), parameters, data)

    @classmethod
    def _make(
        cls, likelihood: Any, parameters: Parameters, data: PyTree, in_turn: bool = False
    ) -> "Target":
        require_float64()
        layout = parameters.layout()
        if not layout.free:
            raise InputError("no parameter is free; set vary=True and no tie for those to be sampled")
        parameters.valuesdict()  # refuses ties without a finite value
        names = tuple(name for name, p in parameters.items() if p.prior is not None and (p.free or p.tie))
        lower, upper = (as_array(side) for side in parameters.box())
        return cls(
            likelihood=likelihood,
            data=jax.tree.map(as_array, data),  # Python floats would be compiled in as constants
            stored=as_array(parameters.stored()),
            lower=lower,
            upper=upper,
            prior_mean=as_array(np.array([parameters[name].prior.mean for name in names], float)),
            prior_sd=as_array(np.array([parameters[name].prior.sd for name in names], float)),
            layout=layout,
            prior_names=names,
            in_turn=in_turn,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sampled parameters, in the order of the coordinates."""
        return self.layout.free

    @property
    def dimension(self) -> int:
        """Number of coordinates n."""
        return len(self.layout.free)

    def pack(self, parameters: Parameters) -> Float[Array, " n"]:
        """Coordinates of the present values of a set of parameters."""
        return parameters.pack()

    def values(self, vector: Float[Array, " n"]) -> dict[str, Array]:
        """All values by name at a point, fixed and tied ones included."""
        return self.layout.values(vector, self.stored)

    def prior_rows(self, vector: Float[Array, " n"]) -> Float[Array, " p"]:
        """Distances from the prior means in standard deviations."""
        if not self.prior_names:
            return jnp.zeros(0, vector.dtype)
        values = self.values(vector)
        return (jnp.stack([values[name] for name in self.prior_names]) - self.prior_mean) / self.prior_sd

    def inside(self, vector: Float[Array, " n"]) -> Array:
        """True if a point is within all bounds."""
        return jnp.all((vector >= self.lower) & (vector <= self.upper))

    def log_prior(self, vector: Float[Array, " n"]) -> Float[Array, ""]:
        """Log-density of the prior over the coordinates, up to a constant; -inf outside the bounds."""
        jacobian = [
            vector[i]
            for i, name in enumerate(self.names)
            if self.layout.logarithmic[i] and name in self.prior_names
        ]
        density = sum(jacobian, -0.5 * jnp.sum(self.prior_rows(vector) ** 2))
        return jnp.where(self.inside(vector), density, -jnp.inf)

    def log_probability(self, vector: Float[Array, " n"]) -> Float[Array, ""]:
        """Log-density of the posterior over the coordinates, up to a constant; NaN where the model has no
        answer.

        Outside the bounds the model is evaluated at the nearest point inside.
        """
        nearest = jnp.clip(vector, self.lower, self.upper)
        likelihood = self.likelihood(self.values(nearest), self.data)
        return jnp.where(self.inside(vector), self.log_prior(nearest) + likelihood, -jnp.inf)

    def all_values(self, coordinates: Float[Array, "... n"]) -> dict[str, np.ndarray]:
        """All parameters that depend on the coordinates, at many points: arrays of the points' shape."""
        points = np.reshape(np.asarray(coordinates), (-1, self.dimension))
        shape = np.shape(coordinates)[:-1]
        tied = [name for name, _ in self.layout.ties]
        values = _values(self.layout, self.stored, points)
        return {name: np.asarray(values[name]).reshape(shape) for name in (*self.names, *tied)}

    def fingerprint(self) -> str:
        """Hash of everything that defines this posterior, except the code of the model."""
        digest = hashlib.sha256(
            repr((self.layout, self.prior_names, type(self.likelihood).__name__)).encode()
        )
        for leaf in jax.tree.leaves(eqx.filter(self, eqx.is_array)):
            array = np.asarray(leaf)
            digest.update(f"{array.shape} {array.dtype}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()


@stored_jit()
def _values(layout: Layout, stored: Array, points: Array) -> dict[str, Array]:
    """Every parameter at many points, shape (points, n), in one compiled program."""
    return jax.vmap(lambda vector: layout.values(vector, stored))(points)


@functools.lru_cache(maxsize=64)
def _program(functions: tuple, static: Any, structure: Any) -> Callable:
    """Compiled log-probability of a block of points; one program for each structure of a target.

    Args:
        functions: leaves of the target that are no arrays, such as the residual.
        static: structure of the tree of these.
        structure: structure of the tree of its arrays, which the program takes as arguments.
    """

    def block(leaves: list[Array], points: Array) -> Array:
        fixed = jax.tree.unflatten(static, functions)
        target = eqx.combine(jax.tree.unflatten(structure, leaves), fixed)
        each = target.log_probability
        return jax.lax.map(each, points) if target.in_turn else jax.vmap(each)(points)

    return jax.jit(block)


class LogDensity:
    """The log-probability in the form of emcee's `vectorize=True`: one compiled program for blocks of one
    shape.

    Both halves of an ensemble have the same size, so only the last block of a larger call is ever padded. NaN
    and +inf count as impossible, and as failures.

    Args:
        target: target to sample.
        block: number of points for which the program is compiled, half an ensemble.
    """

    def __init__(self, target: Target, block: int):
        arrays, fixed = eqx.partition(target, eqx.is_array)
        self._leaves, structure = jax.tree.flatten(arrays)
        functions, static = jax.tree.flatten(fixed)
        self._program = _program(tuple(functions), static, structure)
        self.block = block
        self.evaluations = 0
        self.failures = 0

    def __call__(self, points: Float[np.ndarray, "m n"]) -> Float[np.ndarray, " m"]:
        """Log-probabilities; -inf for the impossible."""
        points = np.asarray(points, float)
        count = len(points)
        found = joined([np.asarray(self._program(self._leaves, x)) for x in lots(points, self.block)], count)
        broken = np.isnan(found) | (found == np.inf)
        self.evaluations += count
        self.failures += int(broken.sum())
        return np.where(broken, -np.inf, found)
