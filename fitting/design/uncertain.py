"""Draws of what is uncertain, and how a spread of results becomes one number.

The draws of a search are the same for every design (common random numbers). So designs differ by their
dimensions and not by luck. The final probability of failure comes from draws that the search has not seen.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.calibration.records import Prior
from pneusma_jax.late import Late

from .bodies import Plan, alloy_of, material_of
from .posterior_file import SPRINGS, posterior_draws
from .study import Study, Tolerance, Uncertainty

stats = Late("scipy.stats")

KERNEL = 1.06
"""Width of the kernel of a smooth share of failures, by Silverman's rule [1]. It is in standard deviations of
the draws' largest violations, times the number of draws to the power -1/5."""
LEAST_SPREAD = 1e-6
"""Least standard deviation of violations that the rule takes [1]; draws that are all alike have none."""
CONFIDENCE = 0.95
"""Probability of intervals of probabilities [1]."""


@dataclass(frozen=True)
class Draws:
    """Draws of what is uncertain; all arrays of shape (draws,).

    Attributes:
        count: number of draws.
        added: deviations of dimensions from what was ordered [SI].
        alloy: constants of the alloy [SI].
        stiffness: factor on the silicone's stress [1], or None.
    """

    count: int
    added: Mapping[str, np.ndarray]
    alloy: Mapping[str, np.ndarray]
    stiffness: np.ndarray | None

    def tree(self) -> dict:
        """The draws as a tree of arrays with a leading axis of draws."""
        found = {"added": dict(self.added), "alloy": dict(self.alloy), "weight": np.ones(self.count)}
        return found if self.stiffness is None else found | {"stiffness": self.stiffness}


NOMINAL = Draws(1, {}, {}, None)
"""The one draw of a study without uncertainty."""


class Sampler:
    """Draws of an uncertainty.

    Args:
        given: the uncertainty.
        alloy, silicone: tables whose priors may count; None where there is none.
        dimensions: nominal dimensions of the design [SI], by name.

    Attributes:
        left_out: parameters of the posterior that are none of the design.

    Raises:
        InputError: if a posterior cannot be read, or has nothing that the model knows.
    """

    def __init__(
        self,
        given: Uncertainty,
        alloy: Calibration | None,
        silicone: Calibration,
        dimensions: Mapping[str, float],
    ):
        self.given, self.dimensions = given, dimensions
        self.alloy: dict[str, Prior] = {}
        self.stiffness: Prior | None = None
        if "alloy" in given.priors and alloy is not None:
            self.alloy = {n: q.prior for n, q in alloy.quantities.items() if q.prior and n in SPRINGS}
        if "silicone" in given.priors:
            found = silicone.quantities.get("silicone_stiffness")
            self.stiffness = found.prior if found else None
        self.posterior, self.left_out = {}, ()
        if given.posterior:
            self.posterior, self.left_out = posterior_draws(given.posterior, given.specimen)

    @property
    def names(self) -> list[str]:
        """Names of the uncertain inputs."""
        stiff = (
            ["silicone_stiffness"] if self.stiffness and "silicone_stiffness" not in self.posterior else []
        )
        drawn = [t.name for t in self.given.tolerances]
        return [*drawn, *self.posterior, *(n for n in self.alloy if n not in self.posterior), *stiff]

    def draw(self, count: int, seed: int, spread_out: bool) -> Draws:
        """So many draws.

        Args:
            count: number of draws.
            seed: seed of the random numbers.
            spread_out: take a scrambled Sobol sequence, which covers evenly, instead of independent draws.
        """
        random = np.random.default_rng(seed)
        priors = {n: p for n, p in self.alloy.items() if n not in self.posterior}
        own = self.stiffness is not None and "silicone_stiffness" not in self.posterior
        wide = len(self.given.tolerances) + len(priors) + own
        if spread_out and wide:
            even = stats.qmc.Sobol(wide, seed=random).random(2 ** math.ceil(math.log2(count)))[:count]
        else:
            even = random.random((count, wide))
        columns = iter(np.clip(even, 1e-12, 1.0 - 1e-12).T)
        added = {t.name: _spread(t, next(columns)) for t in self.given.tolerances}
        alloy = {name: _from_prior(prior, next(columns)) for name, prior in priors.items()}
        stiffness = _from_prior(self.stiffness, next(columns)) if own else None
        if self.posterior:
            size = len(next(iter(self.posterior.values())))
            chosen = random.choice(size, count, replace=count > size)
            for name, values in self.posterior.items():
                if name in QUANTITIES["alloy"]:
                    alloy[name] = values[chosen]
                elif name == "silicone_stiffness":
                    stiffness = values[chosen]
                else:
                    added[name] = added.get(name, 0.0) + values[chosen] - np.mean(values)
        return Draws(count, added, alloy, stiffness)


def _spread(tolerance: Tolerance, even: np.ndarray) -> np.ndarray:
    if tolerance.half_width:
        return stats.uniform.ppf(even, -tolerance.half_width, 2.0 * tolerance.half_width)
    return stats.truncnorm.ppf(even, -4.0, 4.0) * tolerance.sd


def _from_prior(prior: Prior, even: np.ndarray) -> np.ndarray:
    low, high = (prior.min - prior.mean) / prior.sd, (prior.max - prior.mean) / prior.sd
    return prior.mean + prior.sd * stats.truncnorm.ppf(even, low, high)


def reduced(values: Array, measure: str, k: float, level: float) -> Array:
    """A spread of results as one number that is to be small.

    Args:
        values: shape (draws, ...).
        measure: `mean`, `mean_plus_sigma` or `cvar`, the mean of the worst `1 - level` of the draws.
        k: sigmas [1].
        level: [1].
    """
    if values.shape[0] == 1:
        return values[0]
    if measure == "mean":
        return jnp.mean(values, axis=0)
    if measure == "mean_plus_sigma":
        return jnp.mean(values, axis=0) + k * jnp.std(values, axis=0, ddof=1)
    worst = jnp.sort(values, axis=0)[::-1]
    tail = (1.0 - level) * values.shape[0]
    weights = np.clip(tail - np.arange(values.shape[0]), 0.0, 1.0) / tail
    return jnp.tensordot(weights, worst, 1)


def soft_failure(margins: Array) -> Array:
    """Smooth share of draws that fail [1].

    Every draw counts by a logistic kernel as wide as Silverman's rule has it. So the share has a derivative,
    and is near to the probability whatever the size of the spread.

    Args:
        margins: largest scaled violation of every draw, positive where it fails, shape (draws,).
    """
    width = KERNEL * jnp.sqrt(jnp.var(margins) + LEAST_SPREAD**2) * margins.size**-0.2
    return jnp.mean(jax.nn.sigmoid(math.pi / math.sqrt(3.0) * margins / width))


def interval(failures: int, draws: int) -> tuple[float, float]:
    """Clopper and Pearson's interval of a probability of which so many draws failed."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = 0.0 if failures == 0 else float(stats.beta.ppf(tail, failures, draws - failures + 1))
    high = 1.0 if failures == draws else float(stats.beta.ppf(1.0 - tail, failures + 1, draws - failures))
    return low, high


def sampler_of(study: Study, plan: Plan, fresh: bool = False) -> Sampler:
    """Draws of a study's uncertainty for a combination of choices.

    Args:
        study: study with an uncertainty.
        plan: tables of the combination.
        fresh: take the posterior of another run of the sampler, where the study names one.
    """
    given = study.uncertainty
    if fresh and given.fresh_posterior is not None:
        given = replace(given, posterior=given.fresh_posterior)
    table = plan.tables[0]
    springs = pj.layout(table).spring_numbers
    alloy = alloy_of(plan, table) if springs else None
    return Sampler(given, alloy, material_of(plan, 0), table.values())
