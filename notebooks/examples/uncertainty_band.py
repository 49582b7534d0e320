"""Uncertainty: how well is the curvature known before anything is measured?

Every number of the alloy, the silicone and the geometry that has a prior in its calibration table is drawn
from it. All equilibria are solved in one vmapped program. The figure shows the spread of curvature over
pressure. Numbers are drawn independently of each other; both springs of a specimen share theirs (one batch of
wire).

    python notebooks/examples/uncertainty_band.py --samples 10000 --figure uncertainty_band.png
"""

import argparse
import dataclasses
import time

import jax
import numpy as np
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.report.figures import BLUE, SKY, save_figure, style

PRESSURES = np.linspace(0.0, 50e3, 11)  # Pa
LEVELS = (5, 16, 50, 84, 95)  # %
DESIGN, HOT = "pneusma2", 0.4  # spring 2 heated to this martensite fraction, spring 1 cold


def draw(table, samples, key):
    """Every number of a table that has a prior, by name: Gaussians cut at the prior's ends."""
    priors = {name: q.prior for name, q in pj.load_calibration(table).quantities.items() if q.prior}
    drawn = {}
    for one, (name, p) in zip(jax.random.split(key, len(priors)), priors.items(), strict=True):
        low, high = (p.min - p.mean) / p.sd, (p.max - p.mean) / p.sd
        drawn[name] = p.mean + p.sd * jax.random.truncated_normal(one, low, high, (samples,))
    return drawn


def specimen(wire, tube, sizes):
    """Curvature over pressure of one specimen [1/m], NaN where it has no equilibrium."""
    alloy, silicone = pj.load_alloy("krl35"), pj.load_silicone()
    alloy = dataclasses.replace(alloy, **{name: x for name, x in wire.items() if hasattr(alloy, name)})
    silicone = dataclasses.replace(silicone, stiffness=tube["silicone_stiffness"])
    geometry = pj.design_geometry(DESIGN, **(sizes | {"attached_length": sizes["length"]}))
    body = pj.make_actuator(DESIGN, alloy, silicone, geometry)
    phases, states = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(HOT)), pj.fresh_states(body, geometry)
    return jax.vmap(lambda p: pj.solve(body, p, phases, states, throw=False).curvature)(PRESSURES)


def band_figure(curvature, title):
    """Median and central 68 % and 90 % of the specimens over pressure."""
    low, lower, median, upper, high = np.nanpercentile(curvature, LEVELS, axis=0)
    kPa = PRESSURES / 1e3
    with style():
        figure = Figure(figsize=(6.4, 4.4), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(kPa, low, high, color=SKY, alpha=0.35, linewidth=0, label="5 to 95 %")
        axes.fill_between(kPa, lower, upper, color=SKY, alpha=0.8, linewidth=0, label="16 to 84 %")
        axes.plot(kPa, median, color=BLUE, label="median")
        axes.set(xlabel="gauge pressure [kPa]", ylabel="curvature [1/m]", title=title, xlim=(kPa[0], kPa[-1]))
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="lower left")
    return figure


def main(arguments=None):
    """Run the example; returns the curvatures [1/m], shape (samples, pressures)."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--figure", default="uncertainty_band.png", help="file to write")
    options = parser.parse_args(arguments)
    pj.enable_float64()

    keys = jax.random.split(jax.random.key(options.seed), 3)
    tables = ("krl35", "dragon_skin_10_fast", DESIGN)
    drawn = [draw(table, options.samples, key) for table, key in zip(tables, keys, strict=True)]
    run = jax.jit(lambda drawn: jax.lax.map(lambda one: specimen(*one), drawn, batch_size=200))
    begin = time.perf_counter()
    program = run.lower(drawn).compile()
    compiled = time.perf_counter()
    curvature = np.asarray(program(drawn))
    seconds = time.perf_counter() - compiled

    rows, failed = curvature.size, int(np.isnan(curvature).sum())
    print(f"{rows} equilibria in {seconds:.1f} s after {compiled - begin:.1f} s of compiling")
    print(f"{failed} of them without solution")
    print("pressure [kPa]   curvature [1/m]: 5, 16, 50, 84, 95 %")
    for pressure, levels in zip(PRESSURES / 1e3, np.nanpercentile(curvature, LEVELS, axis=0).T, strict=True):
        print(f"{pressure:14.0f}   " + " ".join(f"{level:6.1f}" for level in levels))
    title = f"PneuSMA2, spring 2 at martensite fraction {HOT:g}: {options.samples} specimens"
    print(f"figure: {save_figure(band_figure(curvature, title), options.figure)}")
    return curvature


if __name__ == "__main__":
    main()
