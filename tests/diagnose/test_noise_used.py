"""Estimated noise stands beside the fast scatter of the readings, and a note warns where it is far larger."""

import numpy as np
import pytest
from diagnosis_coupons import NOISE, SIDECAR, course, curve, put

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.evaluate.noise_used import noise_used, slow_as_noise
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.report.diagnosis.tables import NOISE as HEADER
from fitting.report.diagnosis.tables import noise_table

UNSTATED = SIDECAR.replace("[noise]\nstress_kPa = {noise}\n", "")


def waved(folder, size, sidecar=UNSTATED):
    """Three pulls with white noise, and a wave of 14 rows that no law draws, of a size over that noise."""
    random = np.random.default_rng(4)
    for k in range(3):
        strain = course([0.6])
        wave = size * NOISE * np.sin(2.0 * np.pi * np.arange(strain.size) / 14.0 + k)
        stress = curve(strain) + wave + NOISE * random.standard_normal(strain.size)
        put(folder, f"pull_{k}", strain, stress, sidecar.format(role="fit", noise=NOISE))
    return read_campaign(folder)


def judged(campaign):
    """The program with its noise."""
    return base_fit(Program.of(campaign, "elastomer"))[0]


def test_white_noise_is_told_as_its_fast_scatter(tmp_path):
    program = judged(waved(tmp_path / "c", 0.0))
    for one in noise_used(program):
        assert one.fast_scatter == pytest.approx(NOISE, rel=0.3) and one.over_fast == pytest.approx(1.0, abs=0.3)
    assert slow_as_noise(program) == []


def test_slow_misfit_that_passes_for_noise_is_warned_of(tmp_path):
    campaign = waved(tmp_path / "c", 10.0)
    program = judged(campaign)
    (note,) = slow_as_noise(program)
    assert "not stated" in note and "Slow misfit may have been taken for noise" in note and "campaign.toml" in note
    one = max(noise_used(program), key=lambda n: n.over_fast)
    assert one.sd > 3.0 * one.fast_scatter and f"correlation of {one.correlation:.2f}" in note
    conclusion = diagnose(campaign)
    assert note in conclusion.notes
    rows = noise_table(conclusion).rows
    place = HEADER.index("fast scatter")
    assert len(rows[0]) == len(HEADER) and float(rows[0][place]) < 0.5 * float(rows[0][place - 2])


def test_a_stated_noise_needs_no_scatter(tmp_path):
    program = judged(waved(tmp_path / "c", 10.0, SIDECAR))
    assert {(one.fast_scatter, one.over_fast) for one in noise_used(program)} == {(None, None)}
    assert slow_as_noise(program) == []
