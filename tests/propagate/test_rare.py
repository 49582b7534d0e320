"""Small probabilities against exact ones, and an end in every case."""

import h5py
import numpy as np
import pytest
from scipy import stats
from study_texts import PLAIN

from fitting.propagate import build_problem, read_study
from fitting.propagate.quantities import Limit
from fitting.propagate.rare import estimate_rare
from fitting.propagate.rare.subset import subset_simulation

SPREAD = np.sqrt(0.25 + 4.0)
"""Standard deviation of a + 2 b of the plain study, whose mean is 1."""


def found(write, limit, text=PLAIN, more=""):
    study = read_study(write(text + f"\n[[limit]]\non = 'y'\nabove = {limit}\n[rare]\n{more}"))
    problem = build_problem(study)
    return estimate_rare(problem, problem.study.limits[0])


@pytest.mark.parametrize("probability", [1e-2, 1e-4, 1e-6])
def test_a_linear_gaussian_probability_is_met_by_both(write, probability):
    limit = 1.0 + SPREAD * stats.norm.isf(probability)
    result = found(write, limit)
    assert result.form.by_form == pytest.approx(probability, rel=1e-6)
    assert result.form.probability == pytest.approx(probability, rel=0.1)
    low, high = result.form.interval
    assert low <= probability * 1.03 and high >= probability * 0.97, (low, high)
    assert result.subset.probability == pytest.approx(probability, rel=0.5)
    assert result.agree and result.without_result == 0 and result.rows < 200_000


@pytest.mark.slow
def test_intervals_hold_the_exact_probability_as_often_as_they_say(write):
    exact = 1e-4
    limit = 1.0 + SPREAD * stats.norm.isf(exact)
    held = []
    for seed in range(30):
        text = PLAIN + f"\n[sampling]\nseed = {seed}\n"
        result = found(write, limit, text, "samples = 300\n")
        held.append([low <= exact <= high for low, high in (result.subset.interval, result.form.interval)])
    assert np.all(np.mean(held, axis=0) >= 0.83)


def test_correlated_inputs_have_their_own_design_point(write):
    text = PLAIN + '\n[[correlation]]\nbetween = ["a", "b"]\nvalue = 0.8\n'
    spread = np.sqrt(0.25 + 4.0 + 2 * 0.8)
    limit = 1.0 + spread * 4.0
    assert found(write, limit, text).form.betas[0] == pytest.approx(4.0, rel=1e-4)


def test_two_design_points_are_both_found(write):
    text = PLAIN.replace("a + 2*b", "abs(b) + 0*a")
    exact = 2.0 * stats.norm.sf(4.0)
    result = found(write, 4.0, text)
    assert len(result.form.betas) == 2 and result.form.by_form == pytest.approx(exact, rel=1e-3)
    assert result.form.probability == pytest.approx(exact, rel=0.1) and result.agree


def test_what_cannot_fail_ends_with_an_upper_limit(write):
    result = found(write, 2.0, PLAIN.replace("a + 2*b", "sin(a + 2*b)"))
    assert result.subset.probability == 0.0 and result.form.probability == 0.0
    assert result.subset.stalled == len(result.subset.each)
    assert 0.0 < result.form.interval[1] < 1e-2 and result.agree


def test_what_always_fails_ends_with_a_lower_limit(write):
    result = found(write, -2.0, PLAIN.replace("a + 2*b", "sin(a + 2*b)"))
    assert result.subset.probability == 1.0 and result.subset.interval[0] > 0.999
    assert result.form.probability == pytest.approx(1.0, abs=1e-3) and result.agree


def test_a_limit_that_jumps_ends_with_what_was_counted(write):
    text = PLAIN.replace("a + 2*b", "where(b > 2.5, 1.0, 0.0) + 0*a")
    exact = stats.norm.sf(2.5)
    result = found(write, 0.5, text, "samples = 5000\n")
    assert result.subset.probability == pytest.approx(exact, rel=0.2)
    assert result.subset.stalled == len(result.subset.each), "the margin has no slope to follow"
    assert not len(result.form.betas) and result.form.probability == pytest.approx(exact, rel=0.3)
    assert result.agree


def test_rows_without_a_result_count_as_not_failed_and_are_counted(write):
    text = PLAIN.replace("a + 2*b", "a + 2*b + 0*sqrt(2 - a)")
    result = found(write, 9.0, text)
    assert result.without_result > 0 and 0.0 < result.form.probability < stats.norm.sf(8.0 / SPREAD)


def test_a_limit_from_below_and_one_of_a_band_are_margins_too(write):
    study = read_study(write(PLAIN + "\n[[limit]]\non = 'y'\nbelow = -7.0\nabove = 30.0\n[rare]\n"))
    problem = build_problem(study)
    assert problem.study.limits == (Limit("y", 30.0, -7.0),)
    result = estimate_rare(problem, problem.study.limits[0])
    assert result.form.probability == pytest.approx(stats.norm.sf(8.0 / SPREAD), rel=0.1)


def test_draws_of_a_posterior_have_design_points_where_their_marginals_are_joined(write, tmp_path):
    random = np.random.default_rng(2)
    a = random.normal(size=4000)
    table = {"a": 1.0 + 0.5 * a, "b": 0.6 * a + 0.8 * random.normal(size=4000)}
    with h5py.File(tmp_path / "posterior.nc", "w") as file:
        for name, values in table.items():
            file.create_dataset(f"posterior/{name}", data=values.reshape(4, -1))
    text = PLAIN[: PLAIN.index("[input]")] + '[vary]\nposterior = "posterior.nc"\nposterior_as = "copula"\n'
    problem = build_problem(read_study(write(text)))
    plain = problem.inputs.values(random.normal(size=(400_000, 2)) @ problem.inputs.lower.T)
    exact = np.mean(plain @ [1.0, 2.0] > 6.5)
    result = found(write, 6.5, text)
    assert 1e-3 < exact < 2e-2 and len(result.form.betas) and result.agree
    assert result.form.probability == pytest.approx(exact, rel=0.15)


def test_the_bound_of_nothing_seen_is_that_of_the_run_that_came_least_far():
    runs, samples = 2, 100
    asked = []

    def margins(points):
        out = 10.0 + points[:, 0]
        if not asked:  # nothing tells the first run where to go
            out[:samples] = np.inf
        asked.append(len(points))
        return out

    result = subset_simulation(margins, 1, samples, runs, np.random.default_rng(0))
    assert result.stalled and not result.each.any() and result.reached == 1.0
    assert result.interval == (0.0, pytest.approx(3.0 / (samples * runs)))
