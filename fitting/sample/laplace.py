"""The Gaussian approximation at the most probable point, which is the basis of a fit's standard errors."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.inference.least_squares import Box, solve
from fitting.inference.parameters import Layout
from fitting.inference.parameters.transforms import to_bounded, to_unconstrained
from pneusma_jax.errors import InputError
from pneusma_jax.late import optimistix as optx
from pneusma_jax.numerics.safe import as_array
from pneusma_jax.program_cache import stored_jit

from .likelihood import UnknownNoise
from .target import Target

NEGLIGIBLE = 1e-11
"""Maximum eigenvalue of the scaled precision, relative to the largest, that counts as undetermined."""
SCALE_ROUNDS = 20
AT_BOUND = 1e-9


@dataclass(frozen=True)
class Laplace:
    """Gaussian approximation over the coordinates of a target.

    Attributes:
        mode: most probable point, as a density of the parameters' values, shape (n,).
        covariance: covariance, shape (n, n); rows of undetermined parameters are zero.
        known: true for determined parameters, shape (n,); false on a bound and where the data determine
            nothing.
        at_bound: true if the mode lies on a bound, shape (n,); the others' covariance assumes that it is
            truly there.
        alone: standard deviation of each coordinate if all others were known, shape (n,); infinite without
            slope.
        value: value of every parameter at the mode, tied ones included.
        sd: standard deviation of the same by linear propagation; NaN for undetermined parameters.
        log_probability: log-density at the mode, in the coordinates.
    """

    mode: Float[np.ndarray, " n"]
    covariance: Float[np.ndarray, "n n"]
    known: np.ndarray
    at_bound: np.ndarray
    alone: np.ndarray
    value: dict[str, float]
    sd: dict[str, float]
    log_probability: float


def laplace(target: Target, start: Float[Array, " n"]) -> Laplace:
    """Find the mode near a start, and the curvature at it.

    For a residual the mode is that of the fit with its priors. The precision is Gauss and Newton's `J^T J` in
    units of the noise, exactly as in the fit's standard errors. For a log-likelihood it is minus its second
    derivative.

    Args:
        target: target to approximate.
        start: start within the bounds, shape (n,).

    Raises:
        InputError: if the log-probability is not finite at the start or no mode is found.
    """
    if not np.isfinite(float(eqx.filter_jit(target.log_probability)(as_array(start)))):
        raise InputError(
            "the model has no finite answer at the starting values; start elsewhere, or set bounds"
        )
    if target.likelihood.residual is None:
        mode, precision = _by_curvature(target, as_array(start))
    else:
        mode, precision = _by_least_squares(target, as_array(start))
    return _describe(target, np.asarray(mode), np.asarray(precision))


def _by_least_squares(target: Target, start: Array) -> tuple[Array, Array]:
    likelihood, scale = target.likelihood, as_array(1.0)
    for _ in range(SCALE_ROUNDS if isinstance(likelihood, UnknownNoise) else 1):
        start, triangle, squares = _fit(target, start, scale)
        if not isinstance(likelihood, UnknownNoise):
            break
        previous, scale = scale, jnp.sqrt(squares / likelihood.observations)
        if abs(float(scale / previous) - 1.0) < 1e-6:
            break
    triangle = np.asarray(triangle)
    return start, triangle.T @ triangle


@eqx.filter_jit
def _fit(target: Target, start: Array, scale: Array) -> tuple[Array, Array, Array]:
    """Least-squares solution in units of a noise scale: vector, triangle, sum of squares of the data."""

    def rows(vector: Array, target: Target) -> Array:
        own = jnp.ravel(target.likelihood.residual(target.values(vector), target.data))
        return jnp.concatenate([own / scale, target.prior_rows(vector)])

    relative = ~jnp.asarray(target.layout.logarithmic, bool)
    outcome = solve(rows, start, target, box=Box(target.lower, target.upper), relative=relative)
    data = outcome.residual[: outcome.residual.size - len(target.prior_names)]
    return outcome.vector, outcome.triangle, jnp.sum((data * scale) ** 2)


@eqx.filter_jit
def _by_curvature(target: Target, start: Array) -> tuple[Array, Array]:
    def cost(vector: Array) -> Array:
        prior = 0.5 * jnp.sum(target.prior_rows(vector) ** 2)
        return prior - target.likelihood(target.values(vector), target.data)

    softness = jnp.ones_like(start)
    bounds = (target.lower, target.upper, softness)
    found = optx.minimise(
        lambda free, _: cost(to_bounded(free, *bounds)),
        optx.BFGS(rtol=1e-10, atol=1e-10),
        to_unconstrained(start, *bounds),
        max_steps=2000,
        throw=False,
    )
    mode = to_bounded(found.value, *bounds)
    mode = jnp.where(cost(mode) < cost(start), mode, start)
    return mode, jax.hessian(cost)(mode)


def _describe(target: Target, mode: np.ndarray, precision: np.ndarray) -> Laplace:
    if not (np.all(np.isfinite(mode)) and np.all(np.isfinite(precision))):
        raise InputError(
            "no most probable point was found: the model or its derivative is not finite near the start"
        )
    lower, upper = np.asarray(target.lower), np.asarray(target.upper)
    width = upper - lower
    slack = AT_BOUND * np.where(np.isfinite(width), width, np.abs(mode))
    at_bound = (mode - lower <= slack) | (upper - mode <= slack)
    covariance, known = _inverse(precision, ~at_bound)
    slopes = {name: np.asarray(slope) for name, slope in _slopes(target.layout, target.stored, mode).items()}
    sd = {
        name: float(np.sqrt(slope @ covariance @ slope)) if np.all(known[slope != 0.0]) else np.nan
        for name, slope in slopes.items()
    }
    value = {name: float(values) for name, values in target.all_values(mode).items()}
    log_probability = float(eqx.filter_jit(target.log_probability)(as_array(mode)))
    diagonal = np.diag(precision)
    alone = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), np.inf)
    return Laplace(
        mode, covariance, known, at_bound, alone, value, {name: sd[name] for name in value}, log_probability
    )


@stored_jit()
def _slopes(layout: Layout, stored: Array, mode: Array) -> dict[str, Array]:
    """Derivatives of every parameter by the coordinates."""
    return jax.jacfwd(lambda vector: layout.values(vector, stored))(mode)


def _inverse(precision: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of the determined free coordinates, and their mask. Others are held at their values."""
    covariance, known = np.zeros_like(precision), np.zeros(len(precision), bool)
    indices = np.flatnonzero(free & (np.diag(precision) > 0.0))
    if not len(indices):
        return covariance, known
    norm = np.sqrt(np.diag(precision)[indices])
    eigenvalues, axes = np.linalg.eigh(precision[np.ix_(indices, indices)] / np.outer(norm, norm))
    determined = eigenvalues > NEGLIGIBLE * eigenvalues[-1]
    scaled = axes[:, determined] / np.sqrt(eigenvalues[determined])
    known[indices] = np.linalg.norm(axes[:, ~determined], axis=1) < 1e-6
    root = np.where(known[indices, None], scaled / norm[:, None], 0.0)
    covariance[np.ix_(indices, indices)] = root @ root.T
    return covariance, known


def start_spread(target: Target, found: Laplace) -> Float[np.ndarray, "n n"]:
    """Matrix L of `mode + L z`, z standard normal: the approximation where it is determined, else prior or
    bounds.

    Args:
        target: target to sample.
        found: Laplace approximation of the target.
    """
    root = np.zeros_like(found.covariance)
    known = np.flatnonzero(found.known)
    if len(known):
        block = found.covariance[np.ix_(known, known)]
        sd = np.sqrt(np.diag(block))  # moduli in pascals beside thicknesses in metres would drown in rounding
        eigenvalues, axes = np.linalg.eigh(block / np.outer(sd, sd))
        root[np.ix_(known, known)] = sd[:, None] * axes * np.sqrt(np.maximum(eigenvalues, 0.0))
    width = np.asarray(target.upper) - np.asarray(target.lower)
    for i in np.flatnonzero(~found.known):
        choices = [found.alone[i], 0.1 * width[i]]
        if target.names[i] in target.prior_names and not target.layout.logarithmic[i]:
            choices.append(float(target.prior_sd[target.prior_names.index(target.names[i])]))
        guess = min(choices)
        guess = guess if np.isfinite(guess) else 0.1 * max(abs(found.mode[i]), 1e-3)
        root[i, i] = guess
    return root
