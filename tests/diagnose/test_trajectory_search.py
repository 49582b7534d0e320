"""The search for latent trajectories: it ends at the best one where full steps would go round in circles."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.diagnose.evaluate.evaluation import (
    TRAJECTORY,
    Raw,
    row_count,
    trajectories_of,
    with_trajectories,
)
from fitting.diagnose.evaluate.trajectory_search import Search
from fitting.diagnose.settings import DEFAULT
from fitting.inference.channels import Channel
from fitting.specimens.rows import Rows

ROWS = 6
SIGMA = 0.01
TIME = np.arange(float(ROWS))


def _run(stacked, laws):
    """What a program would say: recording k follows `laws[k]`, which gives a reading and its slope."""
    courses = trajectories_of(stacked)[:, 0]
    found, slope = (np.stack(x) for x in zip(*(law(x) for law, x in zip(laws, courses, strict=True)), strict=True))
    drivers = {"xi0_2": courses}
    along = np.stack([slope, np.zeros_like(slope)])
    return Raw(stacked, {"resistance_2": found}, {"resistance_2": np.zeros((0, *found.shape))}, {"resistance_2": along}, drivers)


def _rows(start):
    count = len(start)
    none = jnp.zeros(count)
    return Rows(
        mask=jnp.ones((count, ROWS), bool),
        time=jnp.asarray(np.tile(TIME, (count, 1))),
        inputs={},
        measured={},
        weight={},
        base={},
        extra={TRAJECTORY: (jnp.asarray(np.tile(np.asarray(start)[:, None], (1, ROWS))),)},
        specimen=none,
    )


def _searched(laws, measured, start):
    channels = [[Channel("resistance_2", np.full(ROWS, y), np.full(ROWS, SIGMA), 0.0)] for y in measured]
    stacked, search, runs = _rows(start), Search(channels, np.full((len(laws), 1), 1e-2), 30.0), 1
    search.add(_run(stacked, laws))
    while not search.finished and runs < DEFAULT.trajectories.runs:
        search.add(_run(with_trajectories(stacked, search.proposal), laws))
        runs += 1
    return search, runs


def _smooth(x):
    return x**2, 2.0 * x


def _switching(x):
    """Jumps where a row switches between two laws."""
    return x + np.where(x > 0.5, 0.2, 0.0), np.ones_like(x)


def test_a_smooth_law_takes_a_few_full_steps():
    search, runs = _searched([_smooth], [0.36], [0.75])
    assert search.finished and runs <= 4 and not search.overshot[0]
    np.testing.assert_allclose(trajectories_of(search.best.stacked)[0, 0], 0.6, atol=0.01)


def test_a_law_that_switches_ends_at_its_best_and_says_that_its_steps_are_not_to_be_believed():
    search, runs = _searched([_switching], [0.6], [0.6])  # full steps lead from 0.6 to 0.4 and back
    assert runs <= DEFAULT.trajectories.runs
    misfit = np.abs(search.best.found["resistance_2"][0] - 0.6)
    assert np.all(misfit < 0.15)
    assert search.overshot[0] or search.finished


def test_every_recording_is_searched_on_its_own():
    search, _ = _searched([_smooth, _switching, _smooth], [0.36, 0.6, 0.25], [0.75, 0.6, 0.5])
    found = trajectories_of(search.best.stacked)[:, 0, 0]
    assert found[0] == pytest.approx(0.6, abs=0.01) and found[2] == pytest.approx(0.5, abs=0.01)
    assert abs(search.best.found["resistance_2"][1, 0] - 0.6) < 0.15
    np.testing.assert_array_equal(search.best.drivers["xi0_2"][:, 0], found)


def test_a_course_that_is_held_asks_for_nothing():
    channels = [[Channel("resistance_2", np.zeros(ROWS), np.full(ROWS, SIGMA), 0.0)]]
    search = Search(channels, np.zeros((1, 1)), 30.0)
    search.add(_run(_rows([0.5]), [_smooth]))
    assert search.finished and search.projections == [None]


def test_a_run_takes_chosen_recordings_from_another():
    one, two = (_run(_rows(start), [_smooth, _smooth]) for start in ([0.1, 0.2], [0.3, 0.4]))
    mixed = one.taking(two, np.array([False, True]))
    np.testing.assert_allclose(trajectories_of(mixed.stacked)[:, 0, 0], [0.1, 0.4])
    np.testing.assert_allclose(mixed.found["resistance_2"][:, 0], [0.01, 0.16])
    np.testing.assert_allclose(mixed.along["resistance_2"][0, :, 0], [0.2, 0.8])
    assert one.taking(two, np.array([False, False])) is one
    assert replace(one).taking(two, np.array([True, True])) is two


def test_padding_is_at_the_end_alone():
    rows = _rows([0.5, 0.5, 0.5])
    mask = np.array([[True] * 4 + [False] * 2, [True, False, True, True, True, False], [False] * ROWS])
    rows = replace(rows, mask=jnp.asarray(mask))
    assert [row_count(rows, k) for k in range(3)] == [4, 5, 0]
