"""A study of a chain: poses of the tip against heat, as a front."""

import itertools

import numpy as np
import pytest
from study_files import CHAIN, write_study

import fitting.report.results  # noqa: F401  results know how they look
from fitting.design import read_study, run_study
from fitting.design.bodies import plan_of
from fitting.design.pareto import hypervolume
from fitting.design.program import Model
from fitting.report.results import save, text

TURNED = CHAIN + 'angle = {value = 90.0, unit = "deg", status = "assumed", source = "test"}\n'
PAIR = """
schema = "pneusma-study/1"
name = "pair"
design = "two.toml"
starts = 2
front_points = 4

[free]
wall_thickness = {made = "steps", from = 0.8, to = 1.6, step = 0.1, unit = "mm"}
connector = {made = "continuous", from = 2, to = 8, unit = "mm"}

[state.near]
pressure = {from = 5, to = 45, unit = "kPa"}
segment_1 = {xi0_2 = {from = 0.3, to = 1.0}}
segment_2 = {xi0_2 = {from = 0.3, to = 1.0}}

[state.rest]
pressure = {value = 5, unit = "kPa"}

[objective.miss]
quantity = "tip_miss"
poses = [
  {state = "near", target = {value = [25, 60, 80], unit = "mm"}},
  {state = "rest", target = {value = [0, 0, 120], unit = "mm"}, direction = [0, 0, 2]},
]
[objective.power]
quantity = "heating_power"
goal = "minimise"
states = ["near", "rest"]

[constraint.shear]
quantity = "shear_strain"
at_most = "tested"
"""


def pair_in(folder):
    (folder / "two.toml").write_text(TURNED)
    return read_study(write_study(folder, PAIR))


def test_the_shipped_study_of_a_chain_asks_for_poses_against_heat():
    study = read_study("reaching_chain")
    miss, power = study.objectives
    assert plan_of(*study.designs).chain is not None and len(miss.poses) >= 2
    assert {p.state for p in miss.poses} == set(power.states) == set(study.states)


def test_poses_are_read_with_unit_directions_and_their_states(tmp_path):
    miss, power = pair_in(tmp_path).objectives
    assert miss.states == ("near", "rest") == power.states
    assert miss.poses[0].direction is None and miss.poses[1].direction == (0.0, 0.0, 1.0)
    assert miss.poses[0].tip == pytest.approx((0.025, 0.06, 0.08)) and miss.unit == "mm"


@pytest.mark.slow
def test_a_chain_has_a_front_of_poses_against_heat(tmp_path):
    study = pair_in(tmp_path)
    result = run_study(study)
    values = np.array([d.objectives for d in result.front.designs])
    assert len(values) >= 3 and result.front.made
    for one, other in itertools.permutations(values, 2):
        assert np.any(one < other)  # none is as good in both
    assert all(d.violation <= 1e-6 for d in result.front.designs)
    # the hypervolume is that of the values, as a share of the box up to the reference
    reference, best = np.array(result.front.reference), values.min(axis=0)
    assert result.front.hypervolume == pytest.approx(
        hypervolume(values, reference) / np.prod(reference - best)
    )
    # no design of a coarse random search is better in both objectives
    model = Model(study, plan_of(*study.designs))
    random = np.random.default_rng(1).random((96, len(model.space)))
    found = model.values(random, 96)
    found = found[np.all(np.isfinite(found), axis=1) & (found[:, 2:].max(axis=1) <= 0.0)]
    assert len(found) > 10
    front = np.array([d.evaluation.values[:2] for d in result.front.designs])
    knee = result.made.evaluation.values[:2]
    assert not np.any(np.all(found[:, :2] < knee - 1e-9, axis=1)), (found[:, :2].min(axis=0), front)
    assert front[:, 0].min() < found[:, 0].min() and front[:, 1].min() < found[:, 1].min() + 1e-9
    files = {path.name for path in save(result, tmp_path / "out")}
    assert {"front.csv", "front.png", "shapes.png", "design.toml", "segment_2.toml"} <= files
    assert "dominates" in text(result)
