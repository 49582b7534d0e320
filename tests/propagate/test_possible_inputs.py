"""Distributions of inputs that no specimen has are refused; names that do not vary cannot be left out."""

from importlib import resources

import numpy as np
import pytest
from study_texts import ONE_STATE

import pneusma_jax as pj
from fitting.propagate import build_problem, read_study
from pneusma_jax.errors import InputError

pj.enable_float64()
WIDE = '[input.G_m]\nmean = 3.0\nsd = 1.0\nunit = "GPa"\n'


def problem_of(write, more):
    return build_problem(read_study(write(ONE_STATE + more)))


@pytest.mark.parametrize(("more", "said"), [
    (WIDE, "[input.G_m]: the distribution reaches -1.75 GPa, but G_m must be positive; state min in [input.G_m]"),
    ('[input.length]\nlow = -1.0\nhigh = 60.0\nunit = "mm"\n', "[input.length]: the distribution reaches -1 mm"),
    ("[vary]\ntolerance = {length = 0.3}\n", "[vary] tolerance of length: the distribution reaches -11."),
    ('[input.wire_diameter]\nlow = 0.3\nhigh = 0.5\nunit = "m"\n', "the median: 400 mm cannot be"),
    ('[vary]\nleave_out = ["G_m"]\ntolerance = {length = 0.02}\n', "leave_out has 'G_m', which does not vary: drop it"),
    ('[vary]\npriors = ["actuator"]\nleave_out = ["G_m"]\n', "leave_out has 'G_m', which does not vary: drop it"),
])  # fmt: skip
def test_what_no_specimen_has_is_refused(write, more, said):
    """Rows with negative lengths or moduli had results, and counted."""
    with pytest.raises(InputError) as refused:
        problem_of(write, more)
    assert said in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("more", [
    f"{WIDE}min = 0.5\n",
    '[input.G_m]\ndistribution = "lognorm"\ns = 0.5\nscale = 3.0\n',
    '[input.prestrain]\nmean = 0.0\nsd = 0.1\n',
    '[vary]\npriors = true\nleave_out = ["poisson_ratio"]\n',
    '[input.G_m]\nmean = 3.0\nsd = 0.6\nunit = "GPa"\n',
])  # fmt: skip
def test_what_a_specimen_may_have_is_drawn(write, more):
    problem = problem_of(write, more)
    ends = [marginal.at(np.array([-4.5, 6.0])) for name, marginal in problem.inputs.marginals.items() if name == "G_m"]
    assert problem.inputs.marginals and all(end[0] > 0.0 for end in ends)


def test_a_search_far_out_meets_numbers_that_no_row_does(write):
    far = '[[limit]]\non = "curvature_1pm"\nabove = 50.0\n[rare]\n'
    with pytest.raises(InputError, match="the distribution reaches -0.8"):
        problem_of(write, '[input.G_m]\nmean = 3.0\nsd = 0.6\nunit = "GPa"\n' + far)


def test_a_median_far_from_usual_is_asked_about(write):
    (asked,) = problem_of(write, '[input.G_m]\nmean = 3e9\nsd = 3e8\nunit = "GPa"\n').notices
    assert asked.startswith("[input.G_m]: the median: 3e+09 GPa is unusual")
    assert not problem_of(write, '[input.G_m]\nmean = 3.0\nsd = 0.3\nunit = "GPa"\n').notices


def test_a_prior_of_a_table_that_reaches_zero_is_told(write, tmp_path):
    shipped = (resources.files("calibration_data") / "krl35.toml").read_text()
    (tmp_path / "alloy.toml").write_text(shipped.replace("{mean = 3.0, sd = 0.9, min = 0.5, max = 6.6}", "{mean = 3.0, sd = 1.2}"))
    study = ONE_STATE.replace("design =", 'alloy = "alloy.toml"\ndesign =') + '[vary]\npriors = ["alloy"]\n'
    (told,) = [one for one in build_problem(read_study(write(study))).notices if "the prior of" in one]
    assert told.startswith("the prior of G_m reaches -2.") and "but G_m must be positive" in told
    narrower = '[input.G_m]\nmean = 3.0\nsd = 0.3\nunit = "GPa"\n'
    assert not any("the prior of" in one for one in build_problem(read_study(write(study + narrower))).notices)
