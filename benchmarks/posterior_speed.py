"""Effective samples per second of a posterior: one compiled, vectorised log-probability against NumPy in a
pool.

    python benchmarks/posterior_speed.py [--runs 5]

Two posteriors: an actuator, with an equilibrium in every likelihood, and a spring, whose law is explicit.
Both sides sample the same density (checked point by point) with the same emcee moves and walkers. So an
effective sample costs the same number of steps on both. That number is measured once, and the ratio does not
depend on it. The other side runs emcee with a pool of two processes over `numpy_models.py`. Wall-clock and
processor time are both given: the first says how long one waits on this machine now, the second does not mind
what else runs there.
"""

import argparse
import multiprocessing
import os
import statistics
import time
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")

import emcee
import numpy as np

PROCESSES = 2
WALKERS = 32
OURS, THEIRS = 60, 3  # steps of a timed run
_JOB: dict = {}


@dataclass(frozen=True)
class Case:
    """A posterior on both sides: names, truth, priors, rows, noise, model of ours by `values, rows`, theirs
    by name."""

    name: str
    names: tuple[str, ...]
    truth: tuple[float, ...]
    prior_sd: tuple[float, ...]
    rows: dict[str, np.ndarray]
    noise: float
    ours: object
    theirs: str


def actuator_case() -> Case:
    """Curvature of PneuSMA2 at 40 pairs of pressure and heat, noise 0.3 1/m."""
    import equinox as eqx
    import jax

    from pneusma_jax import make_actuator
    from pneusma_jax.actuator.equilibrium import solve_batch
    from pneusma_jax.nitinol import SpringState, load_alloy
    from pneusma_jax.nitinol.spring import MartensiteFraction
    from pneusma_jax.silicone import load_silicone

    alloy, silicone = load_alloy("krl35"), load_silicone("dragon_skin_10_fast")

    def ours(values, rows):
        wire = eqx.tree_at(lambda a: (a.G_m, a.G_a), alloy, (values["G_m"], values["G_a"]))
        wall = eqx.tree_at(lambda s: s.stiffness, silicone, values["silicone_stiffness"])
        body = make_actuator("pneusma2", wire, wall, wall_thickness=values["wall_thickness"])
        states = tuple(SpringState.fresh(jax.numpy.full(len(rows["pressure"]), 0.1924)) for _ in body.springs)
        heat = (MartensiteFraction(rows["xi0_1"]), MartensiteFraction(rows["xi0_2"]))
        return solve_batch(body, rows["pressure"], heat, states).curvature

    pressure, xi0 = np.meshgrid(np.linspace(5e3, 45e3, 8), [1.0, 0.8, 0.6, 0.4, 0.2])
    rows = {"pressure": pressure.ravel(), "xi0_1": np.ones(40), "xi0_2": xi0.ravel()}
    names = ("silicone_stiffness", "wall_thickness", "G_m", "G_a")
    truth = (1.04, 1.02e-3, 2.9e9, 8.5e9)
    return Case("actuator", names, truth, (0.05, 3e-5, 0.15e9, 0.41e9), rows, 0.3, ours, "curvatures")


def spring_case() -> Case:
    """Pull of a spring on a stand, cold and hot, 60 rows each, noise 5 mN."""
    import equinox as eqx

    from pneusma_jax import make_actuator
    from pneusma_jax.nitinol import Spring, SpringState
    from pneusma_jax.nitinol.spring import MartensiteFraction

    spring = make_actuator("pneusma2").springs[0]
    names = ("G_m", "G_a", "gamma_L", "beta_1")

    def ours(values, rows):
        alloy = eqx.tree_at(
            lambda a: [getattr(a, name) for name in names], spring.alloy, [values[name] for name in names]
        )
        loose = Spring(spring.geometry, alloy, spring.geometry.free_length)
        state = SpringState.fresh(np.zeros(()))
        elongation = rows["strain"] * spring.geometry.free_length
        return loose.respond(elongation, MartensiteFraction(rows["xi0"]), state).force

    rows = {"strain": np.tile(np.linspace(0.1, 5.5, 60), 2), "xi0": np.repeat([1.0, 0.0], 60)}
    beta = float(spring.alloy.beta_1)
    truth, sd = (2.9e9, 8.4e9, 0.101, beta), (0.9e9, 2.5e9, 0.02, 0.1 * beta)
    return Case("spring", names, truth, sd, rows, 5e-3, ours, "spring_forces")


def _start_worker(name: str, job: dict) -> None:
    import numpy_models

    _JOB.update(job, model=getattr(numpy_models, name))


def their_log_probability(point: np.ndarray) -> tuple[float, float]:
    """Log-probability by the NumPy model, and the processor time that it took."""
    began = time.process_time()
    prior = -0.5 * np.sum(((point - _JOB["truth"]) / _JOB["sd"]) ** 2)
    if np.any(np.abs(point - _JOB["truth"]) > 4.0 * _JOB["sd"]):
        return -np.inf, 0.0
    left = (_JOB["model"](point, _JOB["rows"]) - _JOB["measured"]) / _JOB["noise"]
    value = prior - 0.5 * np.sum(left**2)
    return (value if np.isfinite(value) else -np.inf), time.process_time() - began


def race(case: Case, runs: int, steps: int) -> None:
    """Sample once for the autocorrelation time, check that both sides agree, then time both in turn."""
    from fitting.inference.parameters import Parameter, Parameters, Prior
    from fitting.sample import Settings, Target, sample
    from fitting.sample.settings import moves
    from fitting.sample.target import LogDensity

    truth, sd = np.array(case.truth), np.array(case.prior_sd)
    exact = np.asarray(case.ours(dict(zip(case.names, truth, strict=True)), case.rows))
    measured = exact + case.noise * np.random.default_rng(1).standard_normal(len(exact))
    job = {"truth": truth, "sd": sd, "rows": case.rows, "measured": measured, "noise": case.noise}
    parameters = Parameters(
        *(
            Parameter(n, t, prior=Prior(t, s, t - 4 * s, t + 4 * s))
            for n, t, s in zip(case.names, truth, sd, strict=True)
        )
    )

    def residual(values, data):
        return (case.ours(values, data["rows"]) - data["measured"]) / case.noise

    target = Target.from_residual(residual, parameters, {"rows": case.rows, "measured": measured})
    began = time.perf_counter()
    posterior = sample(
        target, parameters, Settings(walkers=WALKERS, ensembles=2, max_steps=steps), progress=False
    )
    tau = float(posterior.convergence.tau.max())
    evaluator = LogDensity(target, WALKERS // 2)
    points = posterior.flat(WALKERS)
    print(f"\n{case.name}: {len(exact)} rows, free {', '.join(case.names)}")
    print(f"  {posterior.verdict[0]} ({time.perf_counter() - began:.0f} s with compilation)")
    context = multiprocessing.get_context("spawn")
    with context.Pool(PROCESSES, _start_worker, (case.theirs, job)) as pool:
        theirs = np.array([value for value, _ in pool.map(their_log_probability, points)])
        difference = np.ptp(evaluator(points) - theirs)
        assert difference < 1e-3, f"the two sides sample different densities, by {difference:g}"
        print(f"  largest difference of log-probabilities between the two sides: {difference:.1e}")
        ratios = [_once(evaluator, pool, points, moves, tau, k) for k in range(runs)]
    _report(ratios, tau)


def _once(evaluator, pool, points, moves, tau, seed) -> dict[str, float]:
    """Effective samples per second of wall-clock and of processor time, ours and theirs, one after the
    other."""
    dimension = points.shape[1]
    state = np.random.RandomState(seed).get_state()
    ours = emcee.EnsembleSampler(WALKERS, dimension, evaluator, vectorize=True, moves=moves())
    wall, processor = time.perf_counter(), time.process_time()
    ours.run_mcmc(emcee.State(points, random_state=state), OURS, skip_initial_state_check=True)
    our_wall, our_processor = time.perf_counter() - wall, time.process_time() - processor
    theirs = emcee.EnsembleSampler(WALKERS, dimension, their_log_probability, pool=pool, moves=moves())
    wall, processor = time.perf_counter(), time.process_time()
    steps = THEIRS
    last = theirs.run_mcmc(emcee.State(points, random_state=state), steps, skip_initial_state_check=True)
    while time.perf_counter() - wall < 2.0:  # a fast model needs more steps to be timed
        last = theirs.run_mcmc(last, 20)
        steps += 20
    their_wall, own = time.perf_counter() - wall, time.process_time() - processor
    per_point = np.mean([cost for _, cost in pool.map(their_log_probability, points)])
    their_processor = own + per_point * WALKERS * (steps + 1)
    samples = WALKERS / tau
    return {
        "ours_wall": samples * OURS / our_wall,
        "theirs_wall": samples * steps / their_wall,
        "ours_processor": samples * OURS / our_processor,
        "theirs_processor": samples * steps / their_processor,
    }


def _report(runs: list[dict[str, float]], tau: float) -> None:
    def median(key: str) -> float:
        return statistics.median(run[key] for run in runs)

    print(f"  autocorrelation time {tau:.1f} steps; medians of {len(runs)} runs")
    for kind, words in (("wall", "second of wall-clock"), ("processor", "second of processor time")):
        ratios = sorted(run[f"ours_{kind}"] / run[f"theirs_{kind}"] for run in runs)
        print(
            f"  effective samples per {words}: ours {median(f'ours_{kind}'):.3g}, "
            f"NumPy in a pool of {PROCESSES} {median(f'theirs_{kind}'):.3g}; "
            f"ratio {statistics.median(ratios):.1f} ({ratios[0]:.1f} to {ratios[-1]:.1f})"
        )


def main() -> None:
    """Run both races."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--runs", type=int, default=5, help="timed runs of each side")
    arguments.add_argument("--steps", type=int, default=3000, help="budget for the autocorrelation time")
    arguments.add_argument("--case", choices=("actuator", "spring"), help="one of them only")
    given = arguments.parse_args()
    from pneusma_jax import enable_float64

    enable_float64()
    for name, make in (("actuator", actuator_case), ("spring", spring_case)):
        if given.case in (None, name):
            race(make(), given.runs, given.steps)


if __name__ == "__main__":
    main()
