"""Sobol indices of `pneusma propagate`: against exact values, against SALib, and with rows that fail.

    python benchmarks/sobol_indices.py [--rows 200000] [--only known|actuator]

1. Ishigami and g-function, whose indices are known: how far each index lies from the exact one, in
   half-widths of its 95 % interval. Without failed rows, and with 5 % of rows made to fail.
2. PneuSMA2 over all its priors in groups: SALib on the very same rows; the same study with 5 % of rows made
   to fail, against the study without; and what SALib says of such rows.

Rows are made to fail by a uniform phase, which has nothing to do with any digit of the value that counts.
"""

import argparse
import os
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import h5py
import numpy as np

SHARE = 0.05
"""Share of rows that are made to fail."""
FAILING = "+ 0*sqrt(0.99692 - abs(sin({phase})))"
"""Not a number where |sin| of a uniform phase exceeds 0.99692, which it does in 5 % of rows."""
EXPRESSION = """
schema = "pneusma-study/1"
[model]
through = "expression"
outputs = {{y = "{expression}"}}
[input]
{inputs}
[sampling]
method = "{method}"
rows = {rows}
chunk = 20000
seed = 3
[indices]
"""
ACTUATOR = """
schema = "pneusma-study/1"
[model]
through = "state"
design = "pneusma2"
pressure_kPa = 30.0
xi0_2 = 0.4
[vary]
priors = true
{outputs}
[sampling]
rows = {rows}
chunk = 20000
[indices]
[indices.groups]
tube = ["outer_diameter", "wall_thickness", "length"]
spring_sizes = ["wire_diameter", "mandrel_diameter", "initial_pitch", "active_coils"]
residual_strain = ["gR_amplitude", "gR_slope", "gR_shift", "gR_decay"]
no_matter = ["rho_mean", "rho_span", "alpha_1", "alpha_2", "a", "b", "gamma_max", "poisson_ratio", "T_mid",
             "T_width", "alloy.density", "silicone.density", "heat_capacity", "convection", "mu"]
"""
COLUMNS = ("curvature_1pm", "bend_angle_deg", "length_mm", "force_1_N", "force_2_N", "resistance_2_ohm")


def ishigami():
    """Expression, inputs, exact first-order and total indices."""
    a, b = 7.0, 0.1
    v1, v2 = 0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8
    v13 = b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    inputs = "\n".join(f"x{k} = {{low = -3.141592653589793, high = 3.141592653589793}}" for k in (1, 2, 3))
    first, total = np.array([v1, v2, 0.0]), np.array([v1 + v13, v2, v13])
    words = "sin(x1) + 7*sin(x2)**2 + 0.1*x3**4*sin(x1)"
    return words, inputs, first / (v1 + v2 + v13), total / (v1 + v2 + v13)


def g_function():
    """Expression, inputs, exact first-order and total indices."""
    weights = np.array([0.0, 1.0, 4.5, 9.0])
    words = "*".join(f"((abs(4*x{k + 1}-2)+{a})/(1+{a}))" for k, a in enumerate(weights))
    inputs = "\n".join(f"x{k} = {{low = 0.0, high = 1.0}}" for k in (1, 2, 3, 4))
    parts = 1.0 / (3.0 * (1.0 + weights) ** 2)
    variance = np.prod(1.0 + parts) - 1.0
    return words, inputs, parts / variance, parts * np.prod(1.0 + parts) / (1.0 + parts) / variance


def propagated(text, place):
    from fitting.propagate import propagate

    place.mkdir()
    (place / "study.toml").write_text(text)
    return propagate(place / "study.toml", place / "out")


def distances(found, exact):
    """Distance of each index from the exact one, in half-widths of its interval; indices on columns flat."""
    value, half = found
    return np.abs(value - exact).ravel() / half.ravel()


def told(name, away, widest, failures, left_out):
    print(
        f"{name}: {failures:.1%} of rows failed, {left_out:.0%} of blocks left out; "
        f"{np.mean(away <= 1.0):.0%} of {away.size} indices within their 95 % interval, farthest "
        f"{away.max():.2f} half-widths; widest interval +/- {widest:.4f}"
    )


def known_functions(rows, folder):
    for name, (words, inputs, first, total) in (("Ishigami", ishigami()), ("g-function", g_function())):
        for method in ("monte_carlo", "sobol"):
            for kind, more in (("", ""), (", 5 % fail", FAILING.format(phase="1e6*x1 + 2e6*x2 + 3e6*x3"))):
                text = EXPRESSION.format(expression=words + more, inputs=inputs, method=method, rows=rows)
                result = propagated(text, folder / f"{name}-{method}{kind[2:3]}")
                sums = result.summary.indices
                found = sums.estimates()
                away = np.concatenate(
                    [distances(found[n], x[:, None]) for n, x in (("first", first), ("total", total))]
                )
                widest = max(found[n][1].max() for n in ("first", "total"))
                told(
                    f"{name}, {method}{kind}",
                    away,
                    widest,
                    result.summary.failures.share,
                    sums.share_left_out,
                )


def actuator(rows, folder):
    from SALib.analyze import sobol

    plain = "".join(f'[[output]]\nname = "{name}"\n' for name in COLUMNS)
    whole = propagated(ACTUATOR.format(outputs=plain, rows=rows), folder / "whole")
    groups = list(whole.problem.groups)
    parts = []
    for task in whole.problem.tasks:
        with h5py.File(folder / "whole" / "out" / "chunks" / task.name) as file:
            parts.append(file["outputs"][()].reshape(-1, len(groups) + 2, len(COLUMNS)))
    y = np.concatenate(parts)
    theirs_last = np.concatenate([y[:, :1], y[:, 2:], y[:, 1:2]], axis=1)  # SALib has B last
    described = {"num_vars": len(groups), "names": groups, "bounds": [[0.0, 1.0]] * len(groups)}
    ours, differences = whole.summary.indices.estimates(), []
    for k in range(len(COLUMNS)):
        theirs = sobol.analyze(described, theirs_last[:, :, k].ravel(), calc_second_order=False, seed=1)
        differences += [np.abs(ours["first"][0][:, k] - theirs["S1"]).max()]
        differences += [np.abs(ours["total"][0][:, k] - theirs["ST"]).max()]
    print(
        f"PneuSMA2, {whole.problem.rows:,} rows, {len(groups)} groups, {len(COLUMNS)} columns: "
        f"largest difference from SALib {max(differences):.1e}"
    )
    failing = f'of = "{COLUMNS[0]} {FAILING.format(phase=f"1e7*{COLUMNS[0]}")}"\n'
    spoilt = propagated(
        ACTUATOR.format(outputs=plain.replace('"\n', '"\n' + failing, 1), rows=rows), folder / "spoilt"
    )
    sums = spoilt.summary.indices
    found = sums.estimates()
    away = np.concatenate([distances(found[n], ours[n][0]) for n in ("first", "total")])
    widest = max(found[n][1].max() for n in ("first", "total"))
    told(
        "PneuSMA2, 5 % fail, against none failed", away, widest, spoilt.summary.failures.share,
        sums.share_left_out,
    )  # fmt: skip
    bad = np.where(
        np.random.default_rng(0).random(theirs_last.shape[:2]) < SHARE, np.nan, theirs_last[:, :, 0]
    )
    with np.errstate(all="ignore"):
        theirs = sobol.analyze(described, bad.ravel(), calc_second_order=False, seed=1)
    print("SALib on such rows: S1", np.unique(theirs["S1"]), "ST", np.unique(theirs["ST"]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=["known", "actuator"])
    parser.add_argument("--rows", type=int, default=200_000)
    given = parser.parse_args()
    import pneusma_jax as pj

    pj.enable_float64()
    with tempfile.TemporaryDirectory() as folder:
        if given.only != "actuator":
            known_functions(given.rows, Path(folder))
        if given.only != "known":
            actuator(given.rows, Path(folder))


if __name__ == "__main__":
    main()
