"""Indices against exact values, with and without failed rows, and against SALib."""

import numpy as np
import pytest
from study_texts import ISHIGAMI

from fitting.propagate import propagate

A, B = 7.0, 0.1
V1, V2, V13 = 0.5 * (1 + B * np.pi**4 / 5) ** 2, A**2 / 8, B**2 * np.pi**8 * (1 / 18 - 1 / 50)
V = V1 + V2 + V13
FIRST, TOTAL = np.array([V1, V2, 0.0]) / V, np.array([V1 + V13, V2, V13]) / V
SHAPLEY = np.array([V1 + V13 / 2, V2, V13 / 2]) / V
MARGIN = 1.6
"""Half-widths of 95 % intervals within which all of six indices must lie: 3.1 standard errors."""
SOBOL = '\n[indices]\nkind = "sobol"\n[sampling]\nrows = {rows}\nchunk = 20000\nmethod = "{method}"\nseed = 3\n'


def study(rows, method="monte_carlo", kind="sobol", text=ISHIGAMI):
    return text + SOBOL.format(rows=rows, method=method).replace('"sobol"', f'"{kind}"', 1)


@pytest.mark.parametrize("method", ["monte_carlo", "sobol", "latin_hypercube"])
def test_ishigami_has_its_exact_sobol_indices(write, tmp_path, method):
    sums = propagate(write(study(100_000, method)), tmp_path / "out").summary.indices
    found = sums.estimates()
    for name, exact in (("first", FIRST), ("total", TOTAL)):
        value, half = (x[:, 0] for x in found[name])
        assert np.all(np.abs(value - exact) < MARGIN * half), (name, value, exact, half)
        assert np.all(half < 0.03)


def test_the_g_function_has_its_exact_sobol_indices(write, tmp_path):
    weights = np.array([0.0, 1.0, 4.5, 9.0])
    product = "*".join(f"((abs(4*x{k}-2)+{a})/(1+{a}))" for k, a in enumerate(weights))
    inputs = "\n".join(f"x{k} = {{low = 0.0, high = 1.0}}" for k in range(4))
    text = (
        f'schema = "pneusma-study/1"\n[model]\nthrough = "expression"\noutputs = {{y = "{product}"}}\n[input]\n{inputs}'
    )
    parts = 1.0 / (3.0 * (1.0 + weights) ** 2)
    variance = np.prod(1.0 + parts) - 1.0
    exact = {"first": parts / variance, "total": parts * np.prod(1.0 + parts) / (1.0 + parts) / variance}
    found = propagate(write(study(120_000, text=text)), tmp_path / "out").summary.indices.estimates()
    for name, expected in exact.items():
        value, half = (x[:, 0] for x in found[name])
        assert np.all(np.abs(value - expected) < MARGIN * half), (name, value, expected, half)


def failing(share, rows):
    """Ishigami, with no result in a share of rows that has nothing to do with the value."""
    text = ISHIGAMI.replace(
        "0.1*x3**4*sin(x1)", f"0.1*x3**4*sin(x1) + 0*sqrt({1 - share} - abs(sin(1e6*x1 + 2e6*x2 + 3e6*x3)))"
    )
    return study(rows, text=text)


def test_failed_rows_take_their_block_with_them_and_leave_indices_within_their_intervals(write, tmp_path):
    # |sin| of a phase that is uniform exceeds 0.9969 in 5 % of rows
    result = propagate(write(failing(1.0 - 0.99692, 200_000)), tmp_path / "out")
    sums, failures = result.summary.indices, result.summary.failures
    assert 0.045 < failures.share < 0.055
    assert sums.share_left_out == pytest.approx(1.0 - 0.95**5, abs=0.01)
    bounds = sums.bounds(result.summary.moments.smallest, result.summary.moments.largest)
    for name, exact in (("first", FIRST), ("total", TOTAL)):
        value, half = (x[:, 0] for x in sums.estimates()[name])
        assert np.all(np.abs(value - exact) < MARGIN * half), (name, value, exact, half)
        least, most = (x[:, 0] for x in bounds[name])
        assert np.all((least <= exact + 1e-9) & (exact <= most))


def test_a_group_has_the_index_of_its_members_together(write, tmp_path):
    text = study(60_000) + '\n[indices.groups]\npair = ["x1", "x3"]\n'
    result = propagate(write(text), tmp_path / "out")
    assert list(result.problem.groups) == ["pair", "x2"] and result.problem.design.block == 4
    value, half = (x[:, 0] for x in result.summary.indices.estimates()["first"])
    exact = np.array([V1 + V13, V2]) / V
    assert np.all(np.abs(value - exact) < MARGIN * half)


def test_shapley_effects_of_independent_inputs_share_interactions_evenly(write, tmp_path):
    sums = propagate(write(study(120_000, kind="shapley")), tmp_path / "out").summary.indices
    value, half = (x[:, 0] for x in sums.estimates()["shapley"])
    assert np.all(np.abs(value - SHAPLEY) < MARGIN * half), (value, SHAPLEY, half)
    assert value.sum() == pytest.approx(1.0, abs=1e-12)


def test_shapley_effects_of_correlated_inputs_are_those_of_a_linear_gaussian_model(write, tmp_path):
    # Owen & Prieur 2017, two inputs and a third that correlates with the second
    rho, slopes, sds = 0.7, np.array([1.0, 1.0, 2.0]), np.array([1.0, 1.0, 1.0])
    text = """
schema = "pneusma-study/1"
[model]
through = "expression"
outputs = {y = "a + b + 2*c"}
[input]
a = {mean = 0.0, sd = 1.0}
b = {mean = 0.0, sd = 1.0}
c = {mean = 0.0, sd = 1.0}
[[correlation]]
between = ["b", "c"]
value = 0.7
"""
    variance = 1.0 + 1.0 + 4.0 + 2.0 * rho * 2.0
    only_b, only_c = (1.0 + 2.0 * rho) ** 2, (2.0 + rho) ** 2
    both = variance - 1.0
    exact = np.array([1.0, 0.5 * (only_b + both - only_c), 0.5 * (only_c + both - only_b)]) / variance
    assert slopes @ slopes == 6.0 and np.all(sds == 1.0)
    sums = propagate(write(study(120_000, kind="shapley", text=text)), tmp_path / "out").summary.indices
    value, half = (x[:, 0] for x in sums.estimates()["shapley"])
    assert np.all(np.abs(value - exact) < MARGIN * half), (value, exact, half)


@pytest.mark.slow
def test_intervals_hold_the_exact_index_as_often_as_they_say(write, tmp_path):
    held = []
    for seed in range(40):
        text = study(5_000).replace("seed = 3", f"seed = {seed}")
        sums = propagate(write(text), tmp_path / str(seed)).summary.indices
        for name, exact in (("first", FIRST), ("total", TOTAL)):
            value, half = (x[:, 0] for x in sums.estimates()[name])
            held += list(np.abs(value - exact) <= half)
    assert 0.88 <= np.mean(held) <= 0.99


def test_salib_finds_the_same_of_the_same_rows(write, tmp_path):
    sobol = pytest.importorskip("SALib.analyze.sobol")
    import h5py

    result = propagate(write(study(40_000, "sobol")), tmp_path / "out")
    parts = []
    for task in result.problem.tasks:
        with h5py.File(tmp_path / "out" / "chunks" / task.name) as file:
            parts.append(file["outputs"][:, 0].reshape(-1, 5))
    y = np.concatenate(parts)
    y = np.concatenate([y[:, :1], y[:, 2:], y[:, 1:2]], axis=1).ravel()  # SALib has B last
    problem = {"num_vars": 3, "names": ["x1", "x2", "x3"], "bounds": [[-np.pi, np.pi]] * 3}
    theirs = sobol.analyze(problem, y, calc_second_order=False, seed=1)
    ours = result.summary.indices.estimates()
    np.testing.assert_allclose(ours["first"][0][:, 0], theirs["S1"], atol=2e-3)
    np.testing.assert_allclose(ours["total"][0][:, 0], theirs["ST"], atol=2e-3)
    np.testing.assert_allclose(ours["first"][1][:, 0], theirs["S1_conf"], rtol=0.35)
    y[7] = np.nan
    with np.errstate(all="ignore"):
        spoilt = sobol.analyze(problem, y, calc_second_order=False, seed=1)["S1"]
    assert not np.any(np.abs(spoilt[:2] - theirs["S1"][:2]) < 0.1), "one failed row ruins all of SALib's indices"
