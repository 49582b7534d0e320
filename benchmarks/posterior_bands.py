"""How often the 90 % band of a propagated posterior holds a fresh recording.

    python benchmarks/posterior_bands.py [--campaigns 200] [--minutes 8] [--workers 2]

Each campaign is a simulated tube, inflated twice, to 20 and 40 kPa. Its wall and its silicone are drawn from
the tolerances that the fit is told. The fit's Gaussian gives draws; `pneusma propagate` takes them through
the inputs of a third recording, which inflates the tube to 50 kPa and which nothing was fitted to. The band
is that of readings: it has the noise of the length and that of the pressure, which moves the length, too.

Most of that band is noise. So the same draws without noise give a second band, of the curve alone, and how
much of the curve of the true tube lies in it. `--no-input-noise` leaves the noise of the pressure out of the
first band, to show what that does. Readings of a band are not independent: they share the posterior. So the
interval of the mean counts campaigns. Each campaign is a file in `tube_bands`, so an interrupted run goes on.
"""

import argparse
import os
import tempfile
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import h5py
import numpy as np
from campaigns import add_arguments, campaigns_done

FIRST_SEED = 5000
DRAWS, ROWS = 4000, 2000
NOISE = 0.05
"""1-sigma of a simulated length [mm], as `pneusma synthesise tube` has it; and that of the pressure [kPa]."""
STUDY = """
schema = "pneusma-study/1"
[model]
through = "recording"
recording = "{recording}"
points = 1000
[vary]
posterior = "posterior.nc"
{input_noise}[[output]]
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
    from pneusma_jax.units import constant_from_si

    with h5py.File(path, "w") as file:
        group = file.create_group("posterior")
        for name, column in zip(names, draws.T, strict=True):
            values = constant_from_si(column, units[name])
            group.create_dataset(name, data=np.reshape(values, (4, -1))).attrs["unit"] = units[name]


def of_the_curve(problem, truth):
    """Share of the true curve that the 90 % band of curves holds, and the band's mean width [mm]."""
    names, draws = problem.inputs.value_names, problem.inputs.draws
    quiet = {"noise": np.full(ROWS, -1.0), **dict(zip(draws.names, draws.table[:ROWS].T, strict=True))}
    curves = problem.evaluator(np.stack([quiet[name] for name in names], axis=1))[0]
    low, high = np.quantile(curves, [0.05, 0.95], axis=0)
    own = truth["specimens"]["A"]
    wall = 1e-3 * own["geometry"]["wall_thickness_mm"]["value"]
    true = {
        "noise": -1.0,
        "wall_thickness": wall,
        "silicone_stiffness": own["silicone_stiffness"]["value"],
    }
    exact = problem.evaluator(np.array([[true[name] for name in names]]))[0][0]
    return float(np.mean((low <= exact) & (exact <= high))), float(np.mean(high - low))


def one_campaign(seed, input_noise=True):
    """Shares of a fresh recording's readings, and of the true curve, that the bands hold, and their widths.

    Widths are over that of the band of the length's noise alone.
    """
    from fitting.characterise import characterise
    from fitting.data.recordings import read_campaign
    from fitting.propagate import propagate
    from fitting.synthesise import synthesise, write_synthetic

    with tempfile.TemporaryDirectory() as place:
        folder, fitted = Path(place) / "made", Path(place) / "fitted"
        made = synthesise("tube", seed=seed, tests=2)
        write_synthetic(made, folder)
        fitted.mkdir()
        fresh = next(r for r in read_campaign(folder).recordings if r.role == "validation")
        for path in [p for p in folder.iterdir() if p.stem != fresh.path.stem and p.name != "truth.json"]:
            (fitted / path.name).write_bytes(path.read_bytes())
        write_gaussian(characterise(fitted, starts=1), Path(place) / "posterior.nc", seed)
        study = Path(place) / "study.toml"
        noise = f"[noise]\npressure_kPa = {NOISE}\n" if input_noise else ""
        study.write_text(STUDY.format(recording=fresh.path, noise=NOISE, rows=ROWS, input_noise=noise))
        result = propagate(study, Path(place) / "out")
        low, high = result.quantiles([0.05, 0.95])
        seen = fresh.columns["length_mm"]
        curve, curve_width = of_the_curve(result.problem, made.truth)
    assert len(seen) == len(low), "every reading has a column"
    noise_alone = 2.0 * 1.644854 * NOISE
    return {
        "seed": seed,
        "held": float(np.mean((low <= seen) & (seen <= high))),
        "width": float(np.mean(high - low) / noise_alone),
        "curve_held": curve,
        "curve_width": curve_width / noise_alone,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_arguments(parser, 200)
    parser.add_argument("--no-input-noise", action="store_true", help="leave out the noise of the pressure")
    given = parser.parse_args()
    campaign = partial(one_campaign, input_noise=not given.no_input_noise)
    seeds = range(FIRST_SEED, FIRST_SEED + given.campaigns)
    usual = "tube_bands_without_input_noise" if given.no_input_noise else "tube_bands"
    done, new, spent = campaigns_done(campaign, seeds, given, usual)
    print(f"{len(done)} campaigns, {new} of them new, {spent / max(new, 1):.1f} s each")
    print("widths are over that of a band of length noise alone")
    for words, name in (("fresh readings", ""), ("the true curve", "curve_")):
        held = np.array([entry[f"{name}held"] for entry in done])
        half = 1.96 * held.std(ddof=1) / np.sqrt(len(held))
        width = np.mean([entry[f"{name}width"] for entry in done])
        print(
            f"90 % bands hold {100 * held.mean():.1f} +/- {100 * half:.1f} % (95 %) of {words}; "
            f"width {width:.2f}"
        )


if __name__ == "__main__":
    main()
