"""Latent trajectories in the program of an actuator: derivatives, and what does not depend on where one begins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.evaluation import trajectories_of, with_trajectories
from fitting.diagnose.evaluate.program import Program

EXAMPLE = Path(__file__).parents[2] / "calibration_data" / "examples" / "actuator"
STEP = 1e-4


@pytest.fixture(scope="module")
def program():
    """The shipped campaign under the base model alone; its second recording has no resistance."""
    campaign = read_campaign(EXAMPLE)
    second = campaign.recordings[1]
    columns = {name: x for name, x in second.columns.items() if not name.startswith("resistance")}
    recordings = [campaign.recordings[0], replace(second, columns=columns), *campaign.recordings[2:]]
    return Program.of(replace(campaign, recordings=recordings), "actuator", [])


@pytest.fixture(scope="module")
def nominal(program):
    return program.evaluate(program.unknowns.neutral, program.unknowns.base)


@pytest.mark.slow
def test_a_recording_without_resistance_stays_cold_and_takes_nothing_up(program, nominal):
    assert program.trajectory_degrees_of_freedom[1] == 0.0
    assert np.all(nominal.trajectories[1] == 1.0)
    assert np.all(program.trajectory_degrees_of_freedom[[0, 2]] > 1.0)
    assert nominal.projections[1] is None
    assert nominal.projections[0] is not None


@pytest.mark.slow
def test_rows_change_with_their_own_fraction_and_with_the_one_they_remember(program):
    here = program._run(program.unknowns.neutral, program.unknowns.base[:0], program.stacked)
    channels = program.channels[0]
    projection = here.projection(0, channels, program.process_noise[0])
    course = projection.trajectories[0]
    told = np.abs(course.remembered[0]).argmax()
    source = course.source[told]
    assert source < told
    moved = trajectories_of(program.stacked)
    moved[0, course.number, source] -= STEP
    there = program._run(program.unknowns.neutral, program.unknowns.base[:0], with_trajectories(program.stacked, moved))
    step = np.zeros(len(course.fraction))
    step[source] = -STEP
    count = int(np.asarray(program.stacked.mask)[0].sum())
    for j, channel in enumerate(channels):
        real = (there.found[channel.quantity][0] - here.found[channel.quantity][0])[:count]
        expected = course.change(step)[j][:count]
        assert np.abs(expected[told]) > 0.0
        np.testing.assert_allclose(real, expected, atol=0.03 * np.abs(expected).max())


@pytest.mark.slow
def test_the_misfit_does_not_depend_on_where_a_course_begins(program, nominal):
    away = trajectories_of(program.stacked)
    wave = 0.04 * np.sin(np.arange(away.shape[2]) / 5.0)
    for k, course in np.argwhere(program.process_noise > 0.0):
        away[k, course] = np.clip(away[k, course] + wave, 0.02, 1.0)
    other = replace(program, stacked=with_trajectories(program.stacked, away))
    again = other.evaluate(program.unknowns.neutral, program.unknowns.base)
    for one, two in zip(nominal.misfit, again.misfit, strict=True):
        assert np.sum(two**2) == pytest.approx(np.sum(one**2), rel=0.02, abs=0.5)


def _same_rows_are_remembered(one, two):
    pairs = zip(one.trajectories if one else (), two.trajectories if two else (), strict=True)
    return all(np.array_equal(a.source, b.source) for a, b in pairs)


@pytest.mark.slow
def test_derivatives_are_those_of_the_misfit_with_its_courses(program, nominal):
    u = program.unknowns.neutral.copy()
    u[program.unknowns.base[0]] += 0.02
    there, compared = program.evaluate(u, program.unknowns.base, near=nominal), 0
    for k, (one, two) in enumerate(zip(nominal.misfit, there.misfit, strict=True)):
        if _same_rows_are_remembered(nominal.projections[k], there.projections[k]):  # elsewhere it has a kink
            step = 0.02 * nominal.jacobian[k][0]
            assert np.linalg.norm(two - one - step) < 0.1 * np.linalg.norm(step)
            compared += 1
    assert compared >= 3
    np.testing.assert_allclose(there.trajectories, nominal.trajectories_at(u), atol=5e-3)
