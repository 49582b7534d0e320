"""How often 90 % intervals hold the truth: Laplace and emcee, over simulated elastomer campaigns.

    python benchmarks/posterior_coverage.py [--campaigns 100] [--file coverage.jsonl]

Each campaign is two specimens of a Yeoh rubber with batch spread and serially correlated noise (the generator
of
`pneusma synthesise`), fitted and sampled as `pneusma posterior` does it. Finished campaigns are kept in the
file, so an interrupted run goes on; the count is reported with its own 95 % interval, however partial it is.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

TRUTH = {"c_10": 20.0e3, "c_20": 1.0e3, "c_30": 60.0}
LEVEL = 0.9


def one_campaign(seed: int) -> dict:
    """Simulate, fit and sample one campaign; for each constant, the truth's place in both posteriors."""
    from scipy.stats import norm

    from fitting.characterise import characterise
    from fitting.data.recordings import write_recording
    from fitting.synthesise.elastomer import Pull, simulate_pulls
    from pneusma_jax.silicone import Yeoh

    pulls = (Pull("A", 3.0, 0.1), Pull("B", 2.5, 0.1), Pull("C", 3.0, 0.1))
    law = Yeoh(*(np.asarray(value) for value in TRUTH.values()))
    recordings, _ = simulate_pulls(law, pulls, seed=seed, samples=80)
    with tempfile.TemporaryDirectory() as folder:
        for recording in recordings:
            write_recording(recording, folder)
        fit = characterise(folder, law="yeoh")
        result = fit.posterior(seed=seed, ensembles=2, max_steps=6000, progress=False)
    found = {"seed": seed, "converged": result.converged, "laplace": {}, "emcee": {}}
    for name, truth in TRUTH.items():
        laplace = result.posterior.laplace
        found["laplace"][name] = float(norm.cdf((truth - laplace.value[name]) / laplace.sd[name]))
        found["emcee"][name] = float(np.mean(result.posterior.draws[name] < truth))
    return found


def clopper_pearson(hits: int, count: int) -> tuple[float, float]:
    """Exact 95 % interval of a proportion (C. Clopper and E. Pearson, Biometrika 26 (1934) 404)."""
    from scipy.stats import beta

    low = float(beta.ppf(0.025, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, count - hits)) if hits < count else 1.0
    return low, high


def report(done: list[dict]) -> None:
    """Print coverage of each constant by each method."""
    usable = [entry for entry in done if entry["converged"]]
    print(f"{len(done)} campaigns, {len(usable)} converged; 90 % intervals hold the truth:")
    for method in ("laplace", "emcee"):
        for name in TRUTH:
            inside = sum(abs(entry[method][name] - 0.5) < 0.5 * LEVEL for entry in usable)
            low, high = clopper_pearson(inside, len(usable))
            print(
                f"  {method:8s} {name}: {100 * inside / len(usable):.0f} % ({inside} of {len(usable)}; "
                f"{100 * low:.0f} to {100 * high:.0f} %)"
            )


def main() -> None:
    """Run what is missing, then report."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--campaigns", type=int, default=100)
    arguments.add_argument(
        "--file", type=Path, default=Path("posterior_coverage.jsonl"), help="results so far"
    )
    given = arguments.parse_args()
    from pneusma_jax import enable_float64

    enable_float64()
    done = [json.loads(line) for line in given.file.read_text().splitlines()] if given.file.exists() else []
    known = {entry["seed"] for entry in done}
    for seed in range(given.campaigns):
        if seed not in known:
            done.append(one_campaign(seed))
            with given.file.open("a") as stream:
                stream.write(json.dumps(done[-1]) + "\n")
    report(done)


if __name__ == "__main__":
    main()
