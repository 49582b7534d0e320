"""A front of two objectives, and a design that is made for what is not known."""

import numpy as np
import pytest
from study_files import SMALL, changed, write_study

from fitting.design import read_study, run_study
from fitting.report.results import text

POWER = (
    '[objective.power]\nquantity = "heating_power"\ngoal = "minimise"\nstate = "hot"\n\n[constraint.length]'
)
TRADE = changed("[constraint.length]", POWER, changed("starts = 3", "starts = 3\nfront_points = 5")).replace(
    "xi0_2 = 0.3", "xi0_2 = {from = 0.2, to = 0.9}"
)
UNSURE = (
    SMALL
    + """
[uncertainty]
priors = ["alloy", "silicone"]
constraints = "cvar"
level = 0.9
draws = 16
fresh_draws = 400
[uncertainty.tolerance]
wall_thickness = {sd = 0.03, unit = "mm"}
"""
)


@pytest.mark.slow
def test_no_design_of_a_front_beats_another(tmp_path):
    result = run_study(read_study(write_study(tmp_path, TRADE)))
    values = np.array([d.objectives for d in result.front.designs]) * [-1.0, 1.0]
    assert len(values) >= 3 and result.front.made
    for k, one in enumerate(values):
        others = np.delete(values, k, axis=0)
        assert not np.any(np.all(others <= one, axis=1) & np.any(others < one, axis=1))
    assert all(d.violation <= 1e-6 for d in result.front.designs)
    assert 0.0 < result.front.hypervolume < 1.0
    assert "front.csv" in result.documents() and "The front has" in text(result)


@pytest.mark.slow
def test_a_robust_design_fails_less_often_than_the_nominal_one(tmp_path):
    result = run_study(read_study(write_study(tmp_path, UNSURE)))
    robust, nominal = (result.chances[name] for name in ("robust design", "nominal design"))
    assert robust.draws == 400 and robust.interval[1] < nominal.interval[0]
    assert 0.3 < nominal.probability < 0.7  # at its limit, as likely beyond it as within
    assert robust.probability < 0.25
    assert "fails in" in text(result) and "chances.png" in result.documents()
