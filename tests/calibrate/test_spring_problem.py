"""The problem of a spring campaign, whose arrays are padded to few numbers of recordings."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.profile_likelihood import ALIKE
from fitting.calibrate.spring import problem as problems
from fitting.calibrate.spring.joint import alike
from fitting.calibrate.spring.misfit import missed
from fitting.calibrate.spring.problem import Problem, solve
from fitting.calibrate.spring.residuals import residuals_and_freedom, values_of
from fitting.calibrate.spring.scores import scores
from fitting.calibrate.spring.search import problem_of, readings_of
from fitting.calibrate.spring.stand_tests import level_at_rest
from fitting.data.recordings import read_campaign
from fitting.inference.latent_trajectory import smoother
from fitting.inference.least_squares import Status
from fitting.report.spring.text import not_fitted
from fitting.specimens.rows import Rows, numbers, stack
from fitting.specimens.spring_rows import OUTPUTS, spring_of
from fitting.specimens.spring_trajectory import law_of, trajectory
from pneusma_jax.nitinol import load_alloy
from pneusma_jax.units import to_si


@pytest.mark.parametrize("count", [2, 5, 7])
def test_a_margin_is_that_of_every_recording_and_of_the_padding(count):
    ones = np.ones(32)
    one = Rows(
        mask=ones > 0.0, time=ones, inputs={}, measured={}, weight={}, base={},
        extra={"margin": np.asarray(0.0)}, specimen=np.asarray(1),
    )  # fmt: skip
    rows = [one] * count
    stacked = stack(rows)
    problem = Problem((None,) * count, tuple(rows), stacked, None).with_turning_margin(0.25)
    assert problem.stacked.extra["margin"].shape == stacked.mask.shape[:1]
    assert eqx.tree_equal(problem.stacked.extra["margin"], jnp.full(stacked.mask.shape[:1], 0.25))


def test_a_test_of_a_known_alloy_is_held_at_the_phase_that_is_stated_for_it():
    campaign = read_campaign("calibration_data/examples/spring")
    reading = readings_of(campaign.recordings, {"hot": "hot", "cold": "cold"}, load_alloy("krl35"), None)[0]
    rows = problem_of(campaign, reading.tests, None, False, {}).rows
    held = {t.name: (float(r.extra["level"]), float(r.extra["level_sd"])) for t, r in zip(reading.tests, rows, strict=True)}
    assert held.pop("hot") == (0.0, 0.0) and held.pop("cold") == (1.0, 0.0)
    assert held and all(sd > 0.0 for _, sd in held.values())


def test_a_test_that_a_fit_holds_at_full_heat_is_a_hot_one():
    """It was told as intermediate, by a fraction of 0.55 that the table's constants read, and no test was hot."""
    campaign = read_campaign("calibration_data/examples/spring")
    tests = readings_of(campaign.recordings, {"hot": "intermediate"}, load_alloy("krl35"), None)[0].tests
    tests = [replace(test, reason="the alloy's law reads 0.55") for test in tests]
    number = next(k for k, test in enumerate(tests) if test.name == "hot")
    problem = problem_of(campaign, tests, None, False, {}).with_phases({number: 0.0})
    assert problem.tests[number].phase == "hot" and "before the fit the alloy's law reads 0.55" in problem.tests[number].reason
    assert all(test is tests[k] for k, test in enumerate(problem.tests) if k != number)
    assert problem.with_phases({number: 0.0}).tests == problem.tests


def test_full_heat_is_told_with_the_fitted_dimensions_too():
    """A wire of 0.268 mm that was stated as 0.25 mm is longer: a hot test was then read at a fraction of 0.75."""
    campaign = read_campaign("calibration_data/examples/spring")
    truth = json.loads(Path("calibration_data/examples/spring/truth.json").read_text())["parameters"]
    hot = next(t for t in readings_of(campaign.recordings, None, load_alloy("krl35"), None)[0].tests if t.name == "hot")
    problem = problem_of(campaign, [hot], None, False, {})
    values = {name: to_si(truth[name]["value"], truth[name]["unit"]) for name in problem.parameters}
    spring = spring_of(numbers(values, problem.rows[0]))
    assert level_at_rest(spring, hot) == 0.0
    longer = eqx.tree_at(lambda s: s.geometry.mandrel_diameter, spring, spring.geometry.mandrel_diameter * 1.02)
    ratio = float(longer.geometry.wire_length / spring.geometry.wire_length)
    seen = replace(hot, resistivity=ratio * hot.resistivity)  # by the stated length
    assert level_at_rest(longer, seen) == 0.0 and level_at_rest(spring, seen) is None


@pytest.fixture(scope="module")
def held():
    """The shipped campaign with its hot and its cold test held at their phases."""
    campaign = read_campaign("calibration_data/examples/spring")
    reading = readings_of(campaign.recordings, {"hot": "hot", "cold": "cold"}, load_alloy("krl35"), None)[0]
    return problem_of(campaign, reading.tests, None, False, {})


def test_a_fit_computes_no_recording_that_it_does_not_count(held, monkeypatch):
    asked = []
    monkeypatch.setattr(problems, "fit_least_squares", lambda *_, **options: asked.append(options["data"]["rows"]))
    solve(held.parameters, held.data())
    (rows,) = asked
    left_out = [k for k, test in enumerate(held.tests) if not test.fitted]
    assert left_out and len(rows.mask) == len(held.tests) - len(left_out)
    for k, measured in zip(held.fitted, np.asarray(rows.measured["force"]), strict=True):
        assert np.array_equal(measured, held.stacked.measured["force"][k])


@pytest.mark.parametrize(("reduced", "rounds"), [(400.0, 2), (1.0, problems.MOST_ROUNDS)])
def test_rounds_end_by_chi_square_in_the_unit_of_the_noise_as_found(held, monkeypatch, reduced, rounds):
    """A fit fell by 10 of 400,000 in each of its rounds, and made all of them, where the law misses the tests."""
    asked, per_row = [], np.random.default_rng(0)
    size = len(held.fitted) * len(OUTPUTS) * held.stacked.mask.shape[1] + len(held.parameters.layout().free)

    def solved(parameters, data, most=problems.MAX_STEPS, least=0.0):
        asked.append(least)
        return SimpleNamespace(
            chi_square=1000.0 * reduced - 10.0 * len(asked), reduced_chi_square=reduced, success=not least,
            status=Status.LINGERING if least else Status.CONVERGED, values=parameters.valuesdict(),
            residual=np.sqrt(reduced) * per_row.standard_normal(size),
        )  # fmt: skip

    monkeypatch.setattr(problems, "solve", solved)
    _, problem = held.fitted_with()
    assert len(asked) == rounds and asked[0] == 0.0
    unit = problem.unit
    assert np.isclose(unit, reduced, rtol=0.3) if reduced > 1.0 else unit == 1.0
    assert np.allclose(asked[1:], problems.SAME * unit if reduced > 1.0 else 0.0, rtol=0.3)
    taken = problem.inflated(problem.found)
    assert taken.unit == 1.0 and taken.least == (problems.SAME if reduced > 1.0 else 0.0)
    assert np.isclose(alike(problem), ALIKE * problem.found**2)


def test_a_held_fraction_is_not_searched_and_its_test_counts(held, monkeypatch):
    """Without a walk its search would take all rounds, and every other recording of a stack would wait."""
    weights, search = [], smoother.profile

    def watched(outputs, model, measured, weight, *rest):
        weights.append(weight)
        return search(outputs, model, measured, weight, *rest)

    @jax.jit  # the many operations of a search take seconds to compile one by one
    def searched(values, rows):
        return trajectory(values, rows).xi0, weights.pop()

    monkeypatch.setattr(smoother, "profile", watched)
    numbers = {test.name: k for k, test in enumerate(held.tests)}
    for name in ("cold", "isoresistive_1"):
        xi0, weight = map(np.asarray, searched(values_of(held.parameters), held.rows[numbers[name]]))
        assert (np.ptp(xi0) == 0.0) == (name == "cold") == (not weight.any())
    monkeypatch.undo()
    data = held.data(tests=[numbers["cold"]])
    assert np.sum(residuals_and_freedom(values_of(held.parameters), data["rows"])[0] ** 2) > 10.0


@pytest.mark.parametrize("name", ["isoresistive_1", "hot"])
def test_a_row_remembers_what_the_row_before_does_or_that_row_itself(held, name):
    """The elimination of rows relies on it, for the rule's decisions and for those that explain the force best."""
    rows = held.rows[[test.name for test in held.tests].index(name)]
    random = np.random.default_rng(4)
    course = jnp.asarray(np.clip(rows.extra["level"] + 0.2 * random.standard_normal(len(rows.mask)), 0.0, 1.0))

    @jax.jit
    def decided(values, rows, course, slack):
        law, force = law_of(values, rows), (rows.measured["force"], rows.weight["force"])
        return law.decide(course, slack).hottest, law.likeliest(course, slack, jnp.asarray(0.1), *force, 4).hottest

    first, several = decided(values_of(held.parameters), rows, course, jnp.full(course.shape, 0.05))
    renewals = 0
    for hottest in (first, *several):
        before, after, row = np.asarray(hottest)[:-1], np.asarray(hottest)[1:], np.arange(len(course) - 1)
        assert np.all((after == before) | (after == row))
        renewals += np.sum(after == row)
    assert renewals > 5


def with_more_ohms(ohms):
    """The shipped springs behind leads, at their true constants, as `not_fitted` takes a result."""
    campaign = read_campaign("calibration_data/examples/spring")
    for recording in campaign.recordings:
        recording.columns["resistance_ohm"] = recording.columns["resistance_ohm"] + ohms
    tests = readings_of(campaign.recordings, None, load_alloy("krl35"), None)[0].tests
    problem = problem_of(campaign, tests, None, False, {})
    truth = json.loads(Path("calibration_data/examples/spring/truth.json").read_text())["parameters"]
    values = {name: to_si(truth[name]["value"], truth[name]["unit"]) for name in problem.parameters}
    problem = problem.with_process_noise(values)
    joint = SimpleNamespace(problem=problem, values=values, reduced_chi_square=7660.0)
    return SimpleNamespace(joint=joint, scores=scores(problem, values), path=Path("my campaign"))


def test_a_law_that_does_not_fit_is_said_with_its_place_and_the_next_command():
    """Leads of 0.2 ohm ended in a fraction of 4 and in `leaves more than noise`."""
    found = with_more_ohms(0.2)
    (worst, output), rms = max(missed(found.joint.problem, found.joint.values).items(), key=lambda one: one[1])
    first, fractions, last = not_fitted(found)
    assert first.startswith("The law does not fit these tests: the reduced chi-square is 7660")
    assert f"misses most in {worst}, where the {output} is off by" in first and rms > 50.0
    assert "cold" in fractions and "outside 0 to 1" in fractions
    assert last == "The numbers are only the nearest fit. `pneusma diagnose 'my campaign'` looks for the cause."


def test_fractions_of_springs_without_leads_are_possible():
    found = with_more_ohms(0.0)
    assert all(score.impossible < 0.01 for score in found.scores)
    assert len(not_fitted(found)) == 2
