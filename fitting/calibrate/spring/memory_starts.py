"""Starts of the constants of the residual strain: the best of many trials.

Each trial decides by itself which rows renew the memory of a spring.

The residual strain is the smaller of two curves and is renewed at turning points. Where the other curve is
the smaller one, or the memory of the wrong row is kept, its constants have no slope at all. A fit leaves them
where they began; trials need no slope.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence

import jax.numpy as jnp
import numpy as np

from fitting.specimens.spring_trajectory import decided, undecided
from pneusma_jax.late import Late

from .problem import Problem
from .residuals import residuals_and_freedom, values_of
from .stages import COLD, UNLOADING

stats = Late("scipy.stats")

TRIALS = 64
"""Number of draws from the priors; a power of two, as Sobol points need."""
BEST = 2
"""Number of trials, the best first, that become starts."""
APART = 0.5
"""Minimum distance of two of these in one constant [sd of its prior]."""
HEALING = "gR_decay"
"""Constant by which heat heals the residual strain. Cold tests do not show it."""
DECAYS = 16
"""Number of trials of this constant alone, over three standard deviations of its prior to both sides."""


def memory_starts(
    problem: Problem,
    values: Mapping[str, float],
    seed: int,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, dict[str, float]]:
    """Further starts by name: the best constants of the residual strain among draws from their priors.

    Some are the best draws by all tests. Others are fits of the cold tests alone from several draws. The
    martensite fraction of these is known, so that no error of it falsifies the constants. The constant of
    healing is then chosen by all tests.

    Args:
        problem: problem to be fitted.
        values: values of all free parameters; those of the residual strain are drawn anew.
        seed: seed of the draws.
        progress: called with a word for each step that begins.

    Returns:
        Values of all free parameters, SI, by the name of the start; empty where no such constant is free.
    """
    free = problem.parameters.layout().free
    names = [n for n in UNLOADING if n in free and problem.parameters[n].prior is not None]
    if not names:
        return {}
    progress("trials of the residual strain")
    points = _draws(problem, names, seed)
    kept = _best(problem, values, names, points, problem.fitted, BEST)
    starts = {f"trial {k} of the residual strain": {**values, **start} for k, start in enumerate(kept, 1)}
    cold = [k for k in problem.fitted if problem.tests[k].phase == "cold" and problem.tests[k].unloads]
    if cold and len(cold) < len(problem.fitted):
        progress("cold tests alone")
        for k, trial in enumerate(_best(problem, values, names, points, cold, BEST), 1):
            starts[f"cold tests alone, trial {k}"] = _from_cold(problem, {**values, **trial}, names, cold)
    return starts


def _from_cold(
    problem: Problem, values: Mapping[str, float], names: Sequence[str], cold: Sequence[int]
) -> dict[str, float]:
    """All values: fitted to the cold tests alone, but the constant of healing, which all tests choose.

    A hot test shows the residual strain too, reduced by its healing. If it were fitted together with the
    constant of healing held at a draw, the other constants would give way to that draw.
    """
    start = problem.at(values)
    seen = {*COLD, *names} - {HEALING}
    unseen = [n for n in problem.parameters.layout().free if n not in seen]
    found = start.fit(tests=cold, constraints=start.held(unseen))
    if HEALING not in names:
        return found.values
    entry = problem.parameters[HEALING]
    low, high = max(entry.min, entry.prior.mean - 3 * entry.prior.sd), entry.prior.mean + 3 * entry.prior.sd
    decays = np.linspace(low, min(high, entry.max), DECAYS)[:, None]
    (last,) = _best(problem, found.values, [HEALING], decays, problem.fitted, 1)
    return {**found.values, **last}


def _draws(problem: Problem, names: Sequence[str], seed: int) -> np.ndarray:
    """Trials from the priors, shape (trials, names)."""
    entries = [problem.parameters[n] for n in names]
    shares = stats.qmc.Sobol(len(names), rng=np.random.default_rng(seed)).random(TRIALS)
    mean, sd = (np.array([getattr(e.prior, key) for e in entries]) for key in ("mean", "sd"))
    drawn = mean + sd * stats.norm.ppf(shares)
    return np.clip(drawn, [e.min for e in entries], [e.max for e in entries])


def _best(
    problem: Problem,
    values: Mapping[str, float],
    names: Sequence[str],
    points: np.ndarray,
    tests: Iterable[int],
    count: int,
) -> list[dict[str, float]]:
    """The best few trials that differ from each other, by chi-square of some tests with the priors.

    Args:
        problem: problem to be fitted.
        values: values of the other parameters, SI.
        names: parameters that are tried.
        points: their values, SI, shape (trials, names).
        tests: indices of the tests that count.
        count: number of trials to return.
    """
    rows, base = undecided(problem.data(tests=tests)["rows"]), values_of(problem.parameters, values)
    scale = np.array([problem.parameters[n].prior.sd for n in names])
    mean = np.array([problem.parameters[n].prior.mean for n in names])
    cost = []
    for point in points:
        moved = {**base, **{n: jnp.asarray(float(x)) for n, x in zip(names, point, strict=True)}}
        prior = float(np.sum(((point - mean) / scale) ** 2))
        left, _ = residuals_and_freedom(moved, decided(moved, rows))
        cost.append(float(np.sum(left**2)) + prior)
    chosen: list[np.ndarray] = []
    for k in np.argsort(np.nan_to_num(cost, nan=np.inf)):
        if all(np.max(np.abs(points[k] - other) / scale) > APART for other in chosen):
            chosen.append(points[k])
        if len(chosen) == count:
            break
    return [{n: float(x) for n, x in zip(names, point, strict=True)} for point in chosen]
