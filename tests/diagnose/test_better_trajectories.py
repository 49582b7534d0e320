"""Latent trajectories that a fit found are not lost where the next search begins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.evaluation import Evaluation
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.refit import Refitter

EXAMPLE = Path(__file__).parents[2] / "calibration_data" / "examples" / "spring"


def evaluation(misfits, level):
    count = len(misfits)
    own = [np.full(3, m) for m in misfits]
    return Evaluation(
        misfit=own,
        jacobian=[np.full((1, 3), level)] * count,
        predicted=[[np.full(3, level)]] * count,
        drivers={"xi0": np.full((count + 1, 3), level)},
        u=np.zeros(1),
        columns=np.zeros(1, int),
        trajectories=np.full((count + 1, 1, 3), level),
        trajectory_slopes=np.full((1, count + 1, 1, 3), level),
        projections=[level] * count,
        asked=np.ones(count, bool),
    )


def test_each_recording_is_taken_from_where_it_fits_better():
    found = evaluation([1.0, 2.0], 0.1).bettered(evaluation([2.0, 1.0], 0.9))
    assert [m[0] for m in found.misfit] == [1.0, 1.0]
    assert found.projections == [0.1, 0.9]
    levels = [0.1, 0.9]
    assert found.drivers["xi0"][:2, 0].tolist() == levels and found.trajectories[:2, 0, 0].tolist() == levels
    assert found.trajectory_slopes[0, :2, 0, 0].tolist() == levels
    assert [j[0, 0] for j in found.jacobian] == levels and [p[0][0] for p in found.predicted] == levels
    assert found.drivers["xi0"][2, 0] == 0.1  # padding has no misfit to go by


@pytest.mark.slow
def test_a_search_that_begins_badly_is_begun_where_a_fit_was():
    """From half-way fractions the search of two recordings ends in a false optimum; what a fit had found before
    is kept."""
    program = Program.of(read_campaign(EXAMPLE), "spring", [])
    fit = Refitter(program).fit(())
    u, nothing, everything = fit.u, program.unknowns.base[:0], np.ones(len(program.channels))
    program = program.prepared(u, fit.evaluation)
    good = program.evaluate(u, nothing)
    half = replace(good, drivers=good.drivers | {"xi0": np.full_like(good.drivers["xi0"], 0.3)})
    astray = replace(program, stacked=program.begun(program.stacked, half, u))
    lost, kept = (astray.prepared(u, near).evaluate(u, nothing) for near in (None, good))
    assert lost.chi2(everything) > good.chi2(everything) + 6.0
    assert kept.chi2(everything) < lost.chi2(everything) - 4.0
