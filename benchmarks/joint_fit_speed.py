"""Joint fit of a campaign of springs: least squares against a genetic algorithm and SLSQP.

    python benchmarks/joint_fit_speed.py [--budget 300]

Both sides minimise the same objective (chi-square with priors) of the same compiled model. Ours uses least
squares with exact derivatives. The other is SciPy's differential evolution, polished by SLSQP with finite
differences, as characterisation tools for shape memory alloys do it. It stops within `TOLERANCE` of our
minimum's chi-square, or when the budget is spent; then the ratio is a lower bound. Compilation is left out
on both sides: each is run once before the clock starts.
"""

import argparse
import os
import time
from importlib import resources
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

TOLERANCE = 1.0
POPULATION = 8
"""Members for each free parameter, of the genetic algorithm."""


class Reached(Exception):
    """The other side has arrived, or its time is up."""


def main() -> None:
    """Time both sides and print the ratio."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--budget", type=float, default=300.0, help="seconds for the other side")
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args()
    from pneusma_jax import enable_float64

    enable_float64()
    problem = spring_problem()
    problem.fit()
    began = time.perf_counter()
    best = problem.fit()
    ours = time.perf_counter() - began
    objective = objective_of(problem, best.values)
    floor = objective(coordinates(problem, best.values))
    print(
        f"7 tests, {len(problem.parameters)} free: least squares ends at chi-square {floor:.2f} in "
        f"{ours:.2f} s"
    )
    theirs, reached, calls = genetic(problem, objective, floor + TOLERANCE, given.budget, given.seed)
    what = "reached it" if reached < floor + TOLERANCE else f"had reached {reached:.1f}"
    bound = "" if reached < floor + TOLERANCE else "at least "
    print(f"genetic algorithm + SLSQP {what} after {theirs:.1f} s and {calls} evaluations")
    print(f"ratio: {bound}{theirs / ours:.0f} times")


def spring_problem():
    """The shipped campaign as the joint fit sees it, at the values that its recordings state."""
    from fitting.calibrate.spring.search import problem_of
    from fitting.calibrate.spring.stand_tests import classify
    from fitting.data.recordings import read_campaign
    from fitting.specimens import priors
    from fitting.specimens.spring_rows import ALLOY
    from pneusma_jax.nitinol import Alloy

    campaign = read_campaign(Path(str(resources.files("calibration_data"))) / "examples" / "spring")
    quantities, _ = priors.alloy_quantities(campaign, ALLOY)
    alloy = Alloy(**{name: quantity.value for name, quantity in quantities.items()})
    problem = problem_of(campaign, classify(campaign.recordings, None, alloy), None, False, {})
    return problem.with_process_noise({name: entry.value for name, entry in problem.parameters.items()})


def coordinates(problem, values) -> np.ndarray:
    """Values in standard deviations of their priors."""
    entries = problem.parameters.items()
    return np.array([(values[name] - e.prior.mean) / e.prior.sd for name, e in entries])


def objective_of(problem, values):
    """Chi-square with priors over coordinates, decisions as they are at the best values; compiled."""
    import jax
    import jax.numpy as jnp

    from fitting.calibrate.spring.problem import residual
    from fitting.calibrate.spring.residuals import values_of
    from fitting.specimens.spring_trajectory import decided

    data = problem.data()
    data["rows"] = decided(values_of(problem.parameters, values), data["rows"])
    entries = list(problem.parameters.values())
    mean, sd = (jnp.asarray([getattr(e.prior, key) for e in entries]) for key in ("mean", "sd"))
    names = list(problem.parameters)

    @jax.jit
    def chi_square(x, data):
        point = dict(zip(names, mean + sd * x, strict=True))
        return jnp.sum(residual(point, data) ** 2) + jnp.sum(x**2)

    compiled = lambda x: float(chi_square(jnp.asarray(x), data))  # noqa: E731
    compiled(np.zeros(len(names)))
    return compiled


def genetic(problem, objective, target: float, budget: float, seed: int) -> tuple[float, float, int]:
    """Seconds until the target, the best chi-square reached, and evaluations."""
    from scipy.optimize import differential_evolution, minimize

    best, calls, began = np.inf, 0, time.perf_counter()

    def counted(x: np.ndarray) -> float:
        nonlocal best, calls
        value = objective(x)
        best, calls = min(best, value), calls + 1
        if best < target or time.perf_counter() - began > budget:
            raise Reached
        return value

    bounds = [(-4.0, 4.0)] * len(problem.parameters)
    try:
        found = differential_evolution(counted, bounds, popsize=POPULATION, seed=seed, polish=False, tol=1e-6)
        while True:
            found = minimize(counted, found.x, method="SLSQP", bounds=bounds, options={"maxiter": 200})
            if found.nit < 2:
                break
    except Reached:
        pass
    return time.perf_counter() - began, best, calls


if __name__ == "__main__":
    main()
