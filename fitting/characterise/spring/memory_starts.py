"""Where to start the constants of the residual strain: the best of many trials, each with its own decisions.

The residual strain is the smaller of two curves and is renewed at turning points, so that where the other
curve is the smaller one, or a memory of the wrong row is kept, its constants have no slope at all: a fit
leaves them where they began. Trials need no slope.
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree
from scipy.stats import norm, qmc

from fitting.models import residual_of
from fitting.models.spring import decided, undecided

from .problem import Problem, values_of
from .stages import UNLOADING

TRIALS = 64
KEPT = 2
"""Best trials that are fitted."""
APART = 0.5
"""Distance between two of them, in prior 1-sigmas."""


@jax.jit
def _misfit(values: Mapping[str, Array], rows: PyTree) -> Array:
    return jnp.sum(residual_of("spring")(values, decided(values, rows)) ** 2)


def memory_starts(problem: Problem, values: Mapping[str, float], seed: int) -> dict[str, dict[str, float]]:
    """Further starts by name: the best constants of the residual strain among draws from their priors.

    Args:
        problem: what is fitted.
        values: of all free parameters; those of the residual strain are drawn anew.
        seed: of the draws.
    """
    free = problem.parameters.layout().free
    names = [n for n in UNLOADING if n in free and problem.parameters[n].prior is not None]
    if not names:
        return {}
    rows, entries = undecided(problem.data()["rows"]), [problem.parameters[n] for n in names]
    points = qmc.Sobol(len(names), rng=np.random.default_rng(seed)).random(TRIALS)
    spread = np.array([e.prior.mean + e.prior.sd * norm.ppf(p) for e, p in zip(entries, points.T, strict=True)])
    drawn = np.clip(spread.T, [[e.min for e in entries]], [[e.max for e in entries]])
    scale = np.array([e.prior.sd for e in entries])
    means = np.array([e.prior.mean for e in entries])
    base = values_of(problem.parameters, values)
    cost = []
    for point in drawn:
        moved = {**base, **{n: jnp.asarray(x) for n, x in zip(names, point, strict=True)}}
        cost.append(float(_misfit(moved, rows)) + float(np.sum(((point - means) / scale) ** 2)))
    chosen: list[np.ndarray] = []
    for k in np.argsort(np.nan_to_num(cost, nan=np.inf)):
        if all(np.max(np.abs(drawn[k] - other) / scale) > APART for other in chosen):
            chosen.append(drawn[k])
        if len(chosen) == KEPT:
            break
    return {
        f"trial {k} of the residual strain": {n: float(x) for n, x in zip(names, point, strict=True)}
        for k, point in enumerate(chosen, 1)
    }
