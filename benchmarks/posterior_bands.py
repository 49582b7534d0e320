"""How often the 90 % band of a propagated posterior holds a fresh recording.

    python benchmarks/posterior_bands.py [--campaigns 200] [--minutes 8] [--file tube_bands.jsonl]

Each campaign is a simulated tube, inflated twice, to 20 and 40 kPa. Its wall and its silicone are drawn from
the tolerances that the fit is told. The fit's Gaussian gives draws; `pneusma propagate` takes them through
the inputs of a third recording, which inflates the tube to 50 kPa and which nothing was fitted to. The band
is that of readings, noise included. Readings of a band are not independent: they share the posterior. So the
interval of the mean counts campaigns. Finished campaigns stay in the file, so an interrupted run goes on.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import h5py
import numpy as np

FIRST_SEED = 5000
DRAWS, ROWS = 4000, 2000
NOISE = 0.05
"""1-sigma of a simulated length [mm], as `pneusma synthesise tube` has it."""
STUDY = """
schema = "pneusma-study/1"
[model]
through = "recording"
recording = "{recording}"
points = 1000
[vary]
posterior = "posterior.nc"
[[output]]
name = "length_mm"
noise = {noise}
[sampling]
rows = {rows}
"""


def write_gaussian(fit, path, seed):
    """Draws of a fit's Gaussian approximation, as `pneusma posterior` would leave them."""
    names = [name for name, p in fit.fitted.items() if p.standard_error]
    mean = np.array([fit.fitted[name].value for name in names])
    sd = np.array([fit.fitted[name].standard_error for name in names])
    correlation = np.array(
        [[1.0 if a == b else fit.fitted[a].correlations.get(b, 0.0) for b in names] for a in names]
    )
    draws = np.random.default_rng(seed).multivariate_normal(mean, correlation * np.outer(sd, sd), DRAWS)
    units = {name: fit.fitted[name].unit for name in names}
    from pneusma_jax.units import from_si

    with h5py.File(path, "w") as file:
        group = file.create_group("posterior")
        for name, column in zip(names, draws.T, strict=True):
            values = from_si(column, units[name], units[name] == "K")
            group.create_dataset(name, data=np.reshape(values, (4, -1))).attrs["unit"] = units[name]


def one_campaign(seed):
    """Share of a fresh recording's readings that the band holds, and the band's width over the noise's."""
    from fitting.characterise import characterise
    from fitting.data.recordings import read_campaign
    from fitting.propagate import propagate
    from fitting.synthesise import synthesise, write_synthetic

    with tempfile.TemporaryDirectory() as place:
        folder, fitted = Path(place) / "made", Path(place) / "fitted"
        write_synthetic(synthesise("tube", seed=seed, tests=2), folder)
        fitted.mkdir()
        fresh = next(r for r in read_campaign(folder).recordings if r.role == "validation")
        for path in [p for p in folder.iterdir() if p.stem != fresh.path.stem and p.name != "truth.json"]:
            (fitted / path.name).write_bytes(path.read_bytes())
        write_gaussian(characterise(fitted, starts=1), Path(place) / "posterior.nc", seed)
        study = Path(place) / "study.toml"
        study.write_text(STUDY.format(recording=fresh.path, noise=NOISE, rows=ROWS))
        result = propagate(study, Path(place) / "out")
        low, high = result.quantiles([0.05, 0.95])
    seen = fresh.columns["length_mm"]
    assert len(seen) == len(low), "every reading has a column"
    return {
        "seed": seed,
        "held": float(np.mean((low <= seen) & (seen <= high))),
        "width": float(np.mean(high - low) / (2.0 * 1.644854 * NOISE)),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no campaign after these")
    parser.add_argument("--file", type=Path, default=Path("tube_bands.jsonl"))
    given = parser.parse_args()
    import pneusma_jax as pj

    pj.enable_float64()
    done = [json.loads(line) for line in given.file.read_text().splitlines()] if given.file.exists() else []
    known, began = {entry["seed"] for entry in done}, time.monotonic()
    for seed in range(FIRST_SEED, FIRST_SEED + given.campaigns):
        if seed not in known and time.monotonic() - began < 60.0 * given.minutes:
            done.append(one_campaign(seed))
            with given.file.open("a") as stream:
                stream.write(json.dumps(done[-1]) + "\n")
    held = np.array([entry["held"] for entry in done])
    half = 1.96 * held.std(ddof=1) / np.sqrt(len(held))
    widths = np.mean([entry["width"] for entry in done])
    print(
        f"{len(held)} campaigns: 90 % bands hold {100 * held.mean():.1f} +/- {100 * half:.1f} % of fresh "
        f"readings (95 %); the band is {widths:.2f} times as wide as noise alone; "
        f"{(time.monotonic() - began) / max(len(held) - len(known), 1):.1f} s a campaign"
    )


if __name__ == "__main__":
    main()
