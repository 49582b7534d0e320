"""Coordinates in which a specimen's own numbers follow the constants that it shares with others.

Recordings may tell a product of a shared constant and a dimension a hundred times better than each of the
two: of a tube, stiffness times wall. A shared constant is a mean plus a spread times a distance. So in plain
coordinates the posterior is a thin valley that bends. Here a dimension is what it would be if the shared
constants were those of the specimen's own fit. It moves with them along the valley of that fit, as its
covariance says: by powers where all are positive, else along a straight line. The density of the dimension
itself is kept by the Jacobian.

The coordinates change how fast chains mix, and no result. So standard errors count here as scales alone, also
those that `characterise` withholds because the misfit jumps within them.
"""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from fitting.inference.parameters import Parameters

NEGLIGIBLE = 1e-9
"""Minimum eigenvalue of the correlations of shared constants that is inverted."""


class Valley(eqx.Module):
    """How the free parameters of one campaign move with the shared ones.

    Attributes:
        fitted: values at the campaign's own fit, SI, shape (n,).
        slope: change of each parameter with each shared one, zero of those that do not move, shape (n, n);
            relative to both values where `power` holds.
        power: true where a parameter moves by powers, shape (n,).
        moves: true for parameters that move, shape (n,).
        logarithmic: true for parameters that are sampled by their logarithm, shape (n,).
        lower, upper: bounds of the parameters, SI, shape (n,).
        mean, weight: priors of those that move, and one over their standard deviations; zero of others.
    """

    fitted: Float[Array, " n"]
    slope: Float[Array, "n n"]
    power: Bool[Array, " n"]
    moves: Bool[Array, " n"]
    logarithmic: Bool[Array, " n"]
    lower: Float[Array, " n"]
    upper: Float[Array, " n"]
    mean: Float[Array, " n"]
    weight: Float[Array, " n"]

    def moved(self, values: Float[Array, " n"]) -> tuple[Array, Array, Array]:
        """Parameters at values in these coordinates, kept inside their bounds, SI, shape (n,).

        Then the distances of those that move from their priors, shape (n,), and the logarithm of the
        Jacobian: minus infinity outside the bounds.
        """
        positive = self.power & (values > 0.0)
        log = lambda x: jnp.log(jnp.where(x > 0.0, x, 1.0))  # noqa: E731
        powers = self.slope @ (log(values) - log(self.fitted))
        line = self.slope @ (values - self.fitted)
        there = jnp.where(positive, values * jnp.exp(jnp.where(positive, powers, 0.0)), values + line)
        there = jnp.where(self.moves, there, values)
        inside = jnp.all(~self.moves | (there >= self.lower) & (there <= self.upper))
        there = jnp.where(self.moves, jnp.clip(there, self.lower, self.upper), there)
        slopes = jnp.where(positive, powers, 0.0) + jnp.where(self.logarithmic, log(values), 0.0)
        jacobian = jnp.sum(jnp.where(self.moves, slopes, 0.0))
        return there, self.weight * (there - self.mean), jnp.where(inside, jacobian, -jnp.inf)


def valley_of(parameters: Parameters, shared: Sequence[str]) -> Valley:
    """The valley of a campaign's own fit.

    Args:
        parameters: its parameters at the fit, with standard errors and correlations.
        shared: names of the shared ones.
    """
    names = parameters.layout().free
    entries = [parameters[name] for name in names]
    slope = _slope(parameters, names, shared)
    moves = np.any(slope != 0.0, axis=1)
    positive = np.array([entry.min >= 0.0 and entry.value > 0.0 for entry in entries])
    power = moves & positive & np.all((slope == 0.0) | positive[None, :], axis=1)
    value = np.array([entry.value for entry in entries], float)
    relative = slope * value[None, :] / np.where(power, value, 1.0)[:, None]
    priors = [entry.prior if moving else None for entry, moving in zip(entries, moves, strict=True)]
    return Valley(
        fitted=jnp.asarray(value),
        slope=jnp.asarray(np.where(power[:, None], relative, slope)),
        power=jnp.asarray(power),
        moves=jnp.asarray(moves),
        logarithmic=jnp.asarray([entry.scale == "log" for entry in entries]),
        lower=jnp.asarray([entry.min for entry in entries], float),
        upper=jnp.asarray([entry.max for entry in entries], float),
        mean=jnp.asarray([0.0 if prior is None else prior.mean for prior in priors], float),
        weight=jnp.asarray([0.0 if prior is None else 1.0 / prior.sd for prior in priors], float),
    )


def _slope(parameters: Parameters, names: Sequence[str], shared: Sequence[str]) -> np.ndarray:
    """Change of each parameter with each shared one by the covariance of the fit, shape (n, n)."""
    known = [name for name in names if parameters[name].standard_error]
    drivers, own = [n for n in known if n in shared], [n for n in known if n not in shared]
    slope = np.zeros((len(names), len(names)))
    if not drivers or not own:
        return slope

    def correlation(a: str, b: str) -> float:
        return 1.0 if a == b else parameters[a].correlations.get(b, 0.0)

    among = np.array([[correlation(a, b) for b in drivers] for a in drivers])
    across = np.array([[correlation(a, b) for b in drivers] for a in own])
    sd = {name: float(parameters[name].standard_error) for name in known}
    found = across @ np.linalg.pinv(among, NEGLIGIBLE, hermitian=True)
    for i, a in enumerate(own):
        for j, b in enumerate(drivers):
            slope[names.index(a), names.index(b)] = found[i, j] * sd[a] / sd[b]
    return slope
