"""Recovery over many simulated campaigns: bias, coverage of 90 % intervals, simulation-based calibration.

    python benchmarks/recovery.py spring|spring_open|tube|wire|actuator [--campaigns 100] [--minutes 15]
                                  [--posterior [--steps 20000]] [--seeds FIRST] [--dir FOLDER] [--workers 2]

`spring_open` leaves the whole alloy open (`alloy = "fit"`), its truth drawn from the priors of a nitinol that
nobody has characterised.

Every campaign's truth is drawn from the very priors that its fit uses, the tolerances in its sidecars. Those
of wires are only tolerances of the simulation, narrower than the table's priors. So the ranks of the truths
in the posteriors are uniform if all is right (Talts et al., arXiv:1804.06788). With `--posterior` emcee runs
too; without it ranks and intervals are those of the fit's Gaussian (Laplace). Fewer `--steps` than a quotable
posterior needs serve here, where a chain only places the truth: chains count from 400 effective samples and
R-hat below 1.05. Each campaign is a file in a folder, so an interrupted run goes on; a partial count is
reported with its own 95 % interval.
"""

import argparse
import json
import os
import tempfile
import time
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from campaigns import add_arguments, campaigns_done
from posterior_coverage import LEVEL, clopper_pearson

BINS = 10
FIRST_SEED = 1000
FEWEST, MOST_R_HAT = 400, 1.05
"""Effective samples, and R-hat, from and to which a chain counts."""
HARDLY = 0.95
"""Error over that of the prior, median over campaigns, from which the data do not inform a parameter."""
WISHES = {
    "spring": {"interval_s": 2.0},
    "spring_open": {"interval_s": 2.0, "spread": "prior"},
    "tube": {"tolerance": {"wall_thickness_mm": 0.03, "silicone_stiffness": 0.05}},
    "wire": {"spread": "prior"},
    "actuator": {},
}
KINDS = {"spring_open": "spring"}
OPTIONS = {
    "spring": {"starts": 1, "profile": 0},
    "spring_open": {"starts": 1, "profile": 0},
    "tube": {"starts": 1},
}


def truths(record: dict, names: list[str]) -> dict[str, float]:
    """True values of fitted parameters, in the units of files."""
    specimens = list(record.get("specimens", {"": record}).values())
    found = {}
    for name in names:
        stem, _, number = name.partition("__")
        own = specimens[int(number or 1) - 1]
        if stem in record.get("parameters", {}):
            found[name] = record["parameters"][stem]["value"]
        elif stem in own:
            found[name] = own[stem]["value"]
        elif f"{stem}_mm" in own.get("geometry", {}):
            found[name] = own["geometry"][f"{stem}_mm"]["value"]
    return found


def one_campaign(kind: str, seed: int, steps: int, noise: dict | None = None) -> dict:
    """Simulate and fit one campaign; for each parameter its error and the truth's place in the posterior.

    With `steps` of emcee at most; with none there is only the fit. `noise` says how noise lasts.
    """
    from scipy.stats import norm

    from fitting.characterise import characterise
    from fitting.synthesise import synthesise, write_synthetic

    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        made = synthesise(KINDS.get(kind, kind), seed=seed, **WISHES[kind], **(noise or {}))
        write_synthetic(made, Path(folder) / "made")
        record = json.loads((Path(folder) / "made" / "truth.json").read_text())
        fit = characterise(Path(folder) / "made", **OPTIONS.get(kind, {}))
    entry = {"seed": seed, "z": {}, "laplace": {}, "emcee": {}, "seconds": 0.0}
    entry["ended"] = bool((fit.joint if KINDS.get(kind, kind) == "spring" else fit.fit).result.success)
    entry["of_prior"] = {
        name: float(p.standard_error / p.prior.sd)
        for name, p in fit.fitted.items()
        if p.prior is not None and p.standard_error is not None
    }
    real = truths(record, list(fit.parameters))
    for name, truth in real.items():
        e = fit.parameters[name]
        entry["z"][name] = float((e.value - truth) / e.sd)
        entry["laplace"][name] = float(norm.cdf((truth - e.value) / e.sd))
    if steps:
        from pneusma_jax.units import constant_to_si

        sampled = fit.posterior(seed=seed, ensembles=2, max_steps=steps, progress=False)
        state = sampled.posterior.convergence
        entry["converged"] = bool(sampled.converged)
        entry["effective"], entry["r_hat"] = float(np.min(state.effective)), float(np.max(state.r_hat))
        for name, truth in real.items():
            unit = fit.parameters[name].unit
            draws = np.asarray(sampled.posterior.draws[name])
            entry["emcee"][name] = float(np.mean(draws < constant_to_si(truth, unit)))
    entry["seconds"] = time.perf_counter() - began
    return entry


def _enough(entry: dict) -> bool:
    """Whether a chain can place the truth."""
    return entry["effective"] >= FEWEST and entry["r_hat"] < MOST_R_HAT


def _held(places: list[float]) -> float:
    """Percentage of truths within the intervals."""
    return 100.0 * float(np.mean(np.abs(np.array(places) - 0.5) < 0.5 * LEVEL))


def report(kind: str, done: list[dict]) -> None:
    """Print bias, coverage and calibration of each parameter."""
    from scipy.stats import chisquare

    names = list(done[0]["z"])
    seconds = np.median([entry["seconds"] for entry in done])
    print(f"{kind}: {len(done)} campaigns, {seconds:.1f} s each (median)")
    stalled = [entry["seed"] for entry in done if not entry.get("ended", True)]
    if stalled:
        print(f"  {len(stalled)} fits say that they did not end well, seeds {stalled}")
    uninformed = [
        name
        for name in names
        if np.median([entry.get("of_prior", {}).get(name, 0.0) for entry in done]) > HARDLY
    ]
    for method in ("laplace", "emcee"):
        usable = [e for e in done if e[method] and (method == "laplace" or _enough(e))]
        if not usable:
            continue
        print(f"  {method}, {len(usable)} campaigns")
        if method == "emcee":
            tried, asked = sum(bool(e[method]) for e in done), sum(e["converged"] for e in usable)
            effective = np.median([e["effective"] for e in usable])
            print(
                f"    (of {tried}; {asked} converged as the command asks, median {effective:.0f} effective "
                "samples)"
            )
        every, informed = [], []
        for name in names:
            told = [e for e in usable if np.isfinite(e[method].get(name, np.nan))]  # not those at a bound
            if len(told) < 2:
                continue
            z = np.array([e["z"][name] for e in told])
            place = np.array([e[method][name] for e in told])
            every += list(place)
            informed += [] if name in uninformed else list(place)
            inside = int(np.sum(np.abs(place - 0.5) < 0.5 * LEVEL))
            low, high = clopper_pearson(inside, len(told))
            counts = np.histogram(place, bins=BINS, range=(0.0, 1.0))[0]
            p = chisquare(counts).pvalue if len(told) >= 5 * BINS else float("nan")
            print(
                f"    {name:22s} bias {z.mean():+.2f} +/- {z.std(ddof=1) / len(z) ** 0.5:.2f} sd, 90 % "
                "intervals hold "
                f"{100 * inside / len(told):.0f} % ({100 * low:.0f} to {100 * high:.0f} %), ranks "
                f"uniform p = {p:.3f}"
            )
        print(f"    all parameters together: 90 % intervals hold {_held(every):.1f} %")
        if uninformed:
            print(f"    those that the data inform: {_held(informed):.1f} % (not {', '.join(uninformed)})")


def main() -> None:
    """Run what is missing, then report."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("kind", choices=list(WISHES))
    add_arguments(arguments, 100)
    arguments.add_argument("--posterior", action="store_true", help="sample by emcee, too")
    arguments.add_argument("--steps", type=int, default=20000, help="of emcee at most")
    arguments.add_argument("--seeds", type=int, default=FIRST_SEED, help="first seed")
    arguments.add_argument("--drift", type=float, default=0.0, help="of zeros, in units of noise")
    arguments.add_argument("--noise-time", type=float, default=0.0, help="over which noise is correlated [s]")
    given = arguments.parse_args()
    campaign = partial(
        one_campaign,
        given.kind,
        steps=given.steps if given.posterior else 0,
        noise={"drift": given.drift, "noise_time_s": given.noise_time},
    )
    seeds = range(given.seeds, given.seeds + given.campaigns)
    options = {"posterior": given.posterior, "drift": given.drift, "noise_time": given.noise_time}
    usual = "_".join([given.kind, "recovery", *(f"{name}{x:g}" for name, x in options.items() if x)])
    done, _, _ = campaigns_done(campaign, seeds, given, usual)
    report(given.kind, done)


if __name__ == "__main__":
    main()
