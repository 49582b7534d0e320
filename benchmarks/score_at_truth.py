"""What draws the constants of springs away from the truth: the score there, over redrawn noise.

    python benchmarks/score_at_truth.py spring|spring_drift [--campaigns 24] [--draws 12] [--seeds FIRST]

Constants, sizes of zeros and decisions of the memory are the true ones. The hidden martensite fraction is
found as in a fit. A Newton step from there, `-covariance * gradient`, is the error of a fit to first order.
Its mean over draws is the bias, and it splits into parts: by output, by test, by where the fraction is. With
`--draws 0` the recorded noise is taken, so that a fit of the same seed can be compared.
"""

import argparse
import json
import os
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from intervals import Z, wishes_of
from recovery import truths

from fitting.calibrate.spring.problem import Problem
from fitting.calibrate.spring.residuals import values_of
from fitting.calibrate.spring.search import problem_of, readings_of
from fitting.data.recordings import read_campaign
from fitting.specimens import priors
from fitting.specimens import spring_trajectory as spring
from fitting.specimens.spring_rows import ALLOY, OUTPUTS
from fitting.synthesise import synthesise, write_synthetic
from fitting.synthesise.instruments import random_walk
from pneusma_jax import enable_float64
from pneusma_jax.nitinol import Alloy
from pneusma_jax.units import to_si

FIRST_SEED = 39_520
HOT, COLD = 0.05, 0.999
"""True fractions up to which, and from which, a row counts as hot and cold."""


def world(seed: int, what: str, wishes: dict) -> tuple[Problem, dict[str, float], np.ndarray]:
    """A campaign as a problem, its true constants (SI), and its true fractions, shape (tests, rows)."""
    simulated = synthesise(what, seed=seed, **wishes)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made"
        write_synthetic(simulated, made)
        record = json.loads((made / "truth.json").read_text())
        campaign = read_campaign(made)
        quantities, identify = priors.alloy_quantities(campaign, ALLOY, None)
        known = Alloy(**{name: quantity.value for name, quantity in quantities.items()})
        (reading,) = readings_of(campaign.fittable("spring"), None, known, None)
        problem = problem_of(campaign, reading.tests, None, identify, {})
    true = truths(record, list(problem.parameters))
    fractions = np.ones(problem.stacked.mask.shape)
    for k, test in enumerate(problem.tests):
        xi0 = simulated.fractions[test.name]
        fractions[k, : len(xi0)], fractions[k, len(xi0) :] = xi0, xi0[-1]
    return problem, {n: float(to_si(v, problem.parameters[n].unit)) for n, v in true.items()}, fractions


@jax.jit
def true_decisions(values, stacked, fractions):
    """Decisions of the residual strain's rule at the true fractions."""

    def one(rows, xi0):
        return eqx.tree_at(lambda d: d.course, spring.law_of(values, rows).decide(xi0), xi0)

    return jax.vmap(one)(stacked, fractions)


@jax.jit
def clean(values, stacked, fractions):
    """Force and resistance without noise, by output, shape (tests, rows)."""
    found = jax.vmap(lambda rows, xi0: spring.at_phase(values, rows, xi0))(stacked, fractions)
    return {name: getattr(found, name) for name in OUTPUTS}


@jax.jit
def left(values, stacked):
    """Residuals, and their derivatives by the constants in alphabetical order in the last axis."""
    each = lambda v: jax.vmap(lambda rows: spring.residual(v, rows))(stacked)  # noqa: E731
    slopes = jax.jacfwd(each)(values)
    slopes = jnp.stack([slopes[name] for name in sorted(slopes)], axis=-1)
    return each(values), jnp.where(jnp.isfinite(slopes), slopes, 0.0)


def steps(kind: str, seed: int, draws: int) -> list[tuple[dict[str, np.ndarray], float]]:
    """Newton steps of a campaign in standard errors, by part, and chi-square at the truth above the least."""
    what, wishes = wishes_of(kind)
    drift = wishes.get("drift", 0.0)
    problem, truth, fractions = world(seed, what, wishes)
    names = sorted(truth)
    if drift:
        problem = problem.beside({name: (drift, 0.0, 1.0) for name in OUTPUTS})
    problem, point = problem.with_process_noise(truth), values_of(problem.parameters, truth)
    rows = problem.data()["rows"]
    decisions = true_decisions(point, rows, jnp.asarray(fractions))
    rows = eqx.tree_at(lambda r: r.extra, rows, {**rows.extra, "decisions": decisions})
    exact = {name: np.asarray(x) for name, x in clean(point, rows, jnp.asarray(fractions)).items()}
    weight = {name: np.asarray(w) for name, w in rows.weight.items()}
    sd = np.array([problem.parameters[name].prior.sd for name in names])
    away = np.array([problem.parameters[name].prior.mean - truth[name] for name in names]) / sd
    random, found = np.random.default_rng([seed, 7]), []
    for _ in range(max(draws, 1)):
        drawn = rows
        if draws:
            away = random.standard_normal(len(names))
            read = {n: _noisy(random, x, weight[n], np.asarray(rows.time), drift) for n, x in exact.items()}
            drawn = eqx.tree_at(lambda r: r.measured, rows, read)
        misfit, slopes = (np.asarray(x)[problem.fitted] for x in left(point, drawn))
        information = np.einsum("kmi,kmj->ij", slopes, slopes) + np.diag(sd**-2)
        covariance = np.linalg.inv(information)
        error = np.sqrt(np.diag(covariance))
        each = -np.einsum("ij,kmj,km->kmi", covariance, slopes, misfit) / error
        prior = covariance @ (away / sd) / error
        total = each.sum((0, 1)) + prior
        tests = [problem.tests[k].name for k in problem.fitted]
        part = {"total": total, "prior": prior, **_parts(each, fractions[problem.fitted], tests)}
        found.append((part, float((total * error) @ information @ (total * error))))
    return found


def _noisy(random, exact: np.ndarray, weight: np.ndarray, time: np.ndarray, drift: float) -> np.ndarray:
    noise = random.standard_normal(exact.shape)
    for one, held, clock in zip(noise, weight > 0.0, time, strict=True):
        if drift and held.any():
            one[held] += drift * random_walk(random, clock[held])
    return np.where(weight > 0.0, exact + noise / np.where(weight > 0.0, weight, 1.0), 0.0)


def _parts(each: np.ndarray, fractions: np.ndarray, tests: list[str]) -> dict[str, np.ndarray]:
    """Parts of the step by output and fraction, by prior of the trajectory, and by test."""
    size = fractions.shape[1]
    force, resistance, walk, beyond = np.split(each, [size, 2 * size, 3 * size], axis=1)
    found = {}
    for word, rows in (
        ("hot", fractions < HOT),
        ("between", (fractions >= HOT) & (fractions <= COLD)),
        ("cold", fractions > COLD),
    ):
        found[f"force, {word}"] = force[rows].sum(axis=0)
        found[f"resistance, {word}"] = resistance[rows].sum(axis=0)
    found |= {"walk": walk.sum((0, 1)), "beyond 0 and 1": beyond.sum((0, 1))}
    return found | {name: one.sum(axis=0) for name, one in zip(tests, each, strict=True)}


def main() -> None:
    """Print mean, spread and coverage by constant, and the mean of each part."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("kind", choices=["spring", "spring_drift"])
    arguments.add_argument("--campaigns", type=int, default=24)
    arguments.add_argument("--draws", type=int, default=12, help="of the noise of each; 0 as recorded")
    arguments.add_argument("--seeds", type=int, default=FIRST_SEED, help="first seed")
    given = arguments.parse_args()
    enable_float64()
    seeds = range(given.seeds, given.seeds + given.campaigns)
    found = [one for seed in seeds for one in steps(given.kind, seed, given.draws)]
    names = sorted(world(given.seeds, *wishes_of(given.kind))[1])
    total, rise = np.array([part["total"] for part, _ in found]), np.mean([rise for _, rise in found])
    print(f"{len(found)} draws; chi-square at the truth less the least {rise:.1f} for {len(names)} constants")
    rows = {
        "root mean square": np.sqrt(np.mean(total**2, axis=0)),
        "90 % hold": 100.0 * np.mean(np.abs(total) < Z[90], axis=0),
        "error of a mean": np.std(total, axis=0) / np.sqrt(len(total)),
    }
    rows |= {name: np.mean([part[name] for part, _ in found], axis=0) for name in found[0][0]}
    print(" " * 22, " ".join(f"{name:>8s}" for name in names))
    for name, values in rows.items():
        print(f"{name:22s}", " ".join(f"{value:8.2f}" for value in values))


if __name__ == "__main__":
    main()
