"""Noise that nobody states: neighbouring readings say nothing about the accuracy of an instrument."""

import numpy as np
import pytest
from diagnosis_coupons import NOISE, SIDECAR, course, curve, put, softened

from fitting.calibrate import characterise
from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.misfit import accurate, range_of, relative_error
from fitting.diagnose.verdict.text import place_text, verdict_sentences
from fitting.report.diagnosis.text import next_experiment
from fitting.report.elastomer.text import verdict

QUIET = 0.02
"""Noise of the readings [kPa]."""
UNSTATED = SIDECAR.replace("[noise]\nstress_kPa = {noise}\n", "")


def pulls(folder, bend, sidecar):
    """Three pulls whose stress bends away from the law by up to `bend` [kPa], smoothly."""
    random = np.random.default_rng(4)
    for k in range(3):
        strain = course([0.6])
        stress = curve(strain) + bend * np.sin(9.0 * strain) + QUIET * random.standard_normal(strain.size)
        put(folder, f"pull_{k}", strain, stress, sidecar.format(role="fit", noise=QUIET))
    return read_campaign(folder)


def test_the_sidecar_states_no_noise():
    assert "noise" not in UNSTATED and NOISE != QUIET


@pytest.mark.parametrize(("bend", "sidecar", "agrees"), [(0.5, UNSTATED, True), (0.5, SIDECAR, False), (5.0, UNSTATED, False)])
def test_a_small_misfit_is_accurate_only_where_nobody_states_the_noise(tmp_path, bend, sidecar, agrees):
    program, base = base_fit(Program.of(pulls(tmp_path / "c", bend, sidecar), "elastomer"))
    assert accurate(program, base) is agrees
    assert relative_error(program, base) == pytest.approx(bend / 2.0**0.5 / 100.0, rel=0.7)


def test_a_long_recording_does_not_hide_what_a_short_one_shows(tmp_path):
    """The short one, for validation, is missed by a tenth of its stress."""
    pulls(tmp_path / "c", 0.1, UNSTATED)
    strain = course([0.1])[::6]
    put(tmp_path / "c", "short", strain, 1.1 * curve(strain), UNSTATED.format(role="validation"))
    program, base = base_fit(Program.of(read_campaign(tmp_path / "c"), "elastomer"))
    assert relative_error(program, base) > 0.02 and not accurate(program, base)


def test_a_range_holds_no_rows_that_fill_up_shorter_recordings(tmp_path):
    for k, rows in enumerate((40, 90)):
        strain = np.linspace(0.3, 0.6, rows)
        put(tmp_path / "c", f"pull_{k}", strain, curve(strain), UNSTATED.format(role="fit"))
    program, _ = base_fit(Program.of(read_campaign(tmp_path / "c"), "elastomer", []))  # no effect compiles sooner
    expected = 1e3 * np.ptp(curve(np.array([0.3, 0.6])))
    assert range_of(program, "stress") == pytest.approx(expected, rel=1e-3)


def test_a_diagnosis_says_how_far_it_agrees_and_what_to_state(tmp_path):
    found = diagnose(pulls(tmp_path / "c", 0.5, UNSTATED))
    assert not found.mismatch and not found.found and found.unknown < 0.1
    said = " ".join(verdict_sentences(found))
    assert "it misses no output by more than 0." in said and "State it, under [noise]" in said
    assert next_experiment(found).startswith("State the noise")
    own, wide = found.explanation.base.sd(0), found.sd(0)
    assert 5.0 * own < wide <= 1.0  # as uncertain as the forgiven misfit is large and lasting


def with_validation(folder, stress_of):
    """Two pulls to be fitted and three cycles for validation, of a stress [kPa] by a course of strain."""
    random, strain = np.random.default_rng(4), np.linspace(0.0, 0.6, 90)
    for k, levels in enumerate([[], [], [0.6, 0.6]]):
        pulled = course(levels) if levels else strain
        stress = stress_of(pulled) + QUIET * random.standard_normal(90)
        role = "validation" if levels else "fit"
        put(folder, f"pull_{k}", pulled, stress, UNSTATED.format(role=role))
    return read_campaign(folder)


def test_an_agreement_neither_doubts_itself_nor_blames_recordings_for_validation(tmp_path):
    """A cell that errs by a function of its reading."""
    recordings = with_validation(tmp_path / "c", lambda strain: curve(strain) + 0.4 * np.sin(9.0 * strain))
    found = diagnose(recordings, asked=["force_calibration"])
    said = " ".join([*verdict_sentences(found), place_text(found), *found.notes])
    assert not found.mismatch and "it misses no output by more than 0." in said
    assert "rely on this" not in said and "contradict" not in said and "more than its noise" not in said
    assert "State the noise" in found.asked[0]["text"]


def test_what_depends_on_the_past_and_leaves_only_noise_is_no_inaccuracy_of_instruments(tmp_path):
    found = diagnose(with_validation(tmp_path / "c", lambda strain: softened(strain, 0.03) / 1.03))
    assert accurate(found.explanation.program, found.explanation.base)
    assert found.mismatch and [f.slug for f in found.found] == ["mullins_softening"]
    said = " ".join(verdict_sentences(found))
    assert "it misses no output" not in said and "The base model misses no output by more than 0." in said
    assert "no error that depends on a reading, and no slow drift, explains as much as it" in said


def test_a_discrepancy_that_no_instrument_makes_is_said_to_be_none(tmp_path):
    """A stress that depends on the direction of the strain alone, by 0.3 % of its range; no effect is asked for."""
    back = lambda strain: 0.5 * (np.gradient(strain) < 0.0) * np.sin(8.0 * strain)  # noqa: E731
    made = [course([0.6, 0.3, 0.6])] * 2
    for k, strain in enumerate(made):
        stress = curve(strain) + back(strain) + QUIET * np.random.default_rng(k).standard_normal(len(strain))
        put(tmp_path / "c", f"pull_{k}", strain, stress, UNSTATED.format(role="fit"))
    found = diagnose(read_campaign(tmp_path / "c"), asked=[])
    assert accurate(found.explanation.program, found.explanation.base)
    said = " ".join(verdict_sentences(found))
    assert found.mismatch and found.found[0].slug == "unmodelled"
    assert "errors that depend on readings, and slow drifts, do not explain what it misses" in said


def test_the_same_misfit_is_judged_where_the_noise_is_stated(tmp_path):
    assert diagnose(pulls(tmp_path / "c", 0.5, SIDECAR)).mismatch


@pytest.mark.parametrize(("sidecar", "leads"), [(UNSTATED, False), (SIDECAR, True)])
def test_a_characterisation_leads_to_a_diagnosis_where_that_may_find_something(tmp_path, sidecar, leads):
    found = characterise(pulls(tmp_path / "c", 0.5, sidecar), law="yeoh")
    (said,) = [text for text in verdict(found) if "times the noise" in text]
    assert ("pneusma diagnose" in said) is leads and ("Nobody states the noise" in said) is not leads


def test_a_misfit_that_is_forgiven_is_not_said_to_be_chance(tmp_path):
    """Drift within the noise would explain its size. Its shape is one that chance does not make."""
    random = np.random.default_rng(4)
    for k in range(3):
        strain = course([0.6])
        stress = curve(strain) + 0.08 * np.sin(9.0 * strain) + 0.1 * random.standard_normal(strain.size)
        put(tmp_path / "c", f"pull_{k}", strain, stress, UNSTATED.format(role="fit"))
    found = diagnose(read_campaign(tmp_path / "c"))
    said = " ".join(verdict_sentences(found))
    assert not found.mismatch and found.explanation.p_value < 0.01
    assert "it misses no output by more than 0." in said and "by chance" not in said
