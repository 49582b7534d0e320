"""Static errors of instruments compete with effects where nobody states the noise."""

import dataclasses

import numpy as np
import pytest
from diagnosis_coupons import SIDECAR, course, curve, put
from linear_world import CONSTANT, DELAY, World, fast

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.candidates import CandidateFit
from fitting.diagnose.fit.evidence import evidence, inflation_of
from fitting.diagnose.fit.instrument_drift import cosines
from fitting.diagnose.fit.misfit import accurate
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.pool import without
from fitting.diagnose.search.steps import Explanation, LeaveOneOutEvidence, Named
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict import accept
from fitting.diagnose.verdict.accept import beyond_instruments
from fitting.diagnose.verdict.discrepancy_evidence import linearised
from fitting.diagnose.verdict.instrument_accuracy import (
    _errors_of_inputs,
    _errors_of_output,
    beyond_accuracy,
    error_gains,
    excused,
    nameless_beyond_accuracy,
)
from fitting.diagnose.verdict.probabilities import like_accuracy


def world(shape=None):
    """A world of large outputs with one effect, which follows a function of the reading if one is given."""
    made = fast(effects=(CONSTANT,), stated=False)
    made = World(200.0 * made.base, made.effects, stated=False)
    if shape is None:
        return made
    return dataclasses.replace(made, effects={CONSTANT: shape(made.base @ np.array([2.0, -1.0]))[..., None]})


def fits(made, strength, further=0.0):
    """The program of a truth with the effect, its base fit, and the fit with the effect; `further` is added."""
    y = made.truth(np.random.default_rng(3), (2.0, -1.0), **{CONSTANT: strength}) + further
    program = made.program(y)
    base = Refitter(program).fit((), program.unknowns.neutral)
    start = base.u.copy()
    start[program.unknowns.of([CONSTANT])] = 0.5 * strength
    return program, base, Refitter(program).fit((CONSTANT,), start)


def bent(reading):
    """A function of the reading that no base constant follows."""
    return np.sin(9.0 * reading / np.ptp(reading))


def test_an_effect_that_no_reading_tells_keeps_nearly_all_of_its_evidence():
    program, base, named = fits(world(), 3.0)
    assert accurate(program, base)
    whole = evidence(program, base, named, inflation_of(program, named))
    assert beyond_accuracy(program, base, named) > max(0.85 * whole, DEFAULT.evidence.minimum_settled)


@pytest.mark.parametrize(("further", "speaks"), [(0.0, True), (0.5, True), (2.0, False)])
def test_an_effect_speaks_only_if_it_leaves_at_most_a_faint_misfit(further, speaks):
    wave = further * np.cos(np.linspace(0.0, 9.0, 60) + np.arange(4.0)[:, None])
    program, base, named = fits(world(), 3.0, wave)
    assert accurate(program, base)
    assert beyond_instruments(Explanation(program, base, Named(named), [], 0.001, True)) is speaks


def test_effects_without_a_prediction_of_a_recording_do_not_speak(monkeypatch):
    program, base, named = fits(world(), 3.0)
    monkeypatch.setattr(accept, "predictive_chi_square", lambda *_: np.nan)
    assert not beyond_instruments(Explanation(program, base, Named(named), [], 0.001, True))


def test_an_effect_that_is_a_function_of_the_reading_has_no_evidence_of_its_own():
    program, base, named = fits(world(bent), 3.0)
    assert accurate(program, base)
    assert evidence(program, base, named, inflation_of(program, named)) > 5.0 * DEFAULT.evidence.minimum_settled
    assert beyond_accuracy(program, base, named) < DEFAULT.evidence.minimum_first


def test_one_effect_of_two_is_tentative_where_static_errors_explain_it():
    made = world()
    lag = bent(made.base @ np.array([2.0, -1.0]))[..., None]
    made = dataclasses.replace(made, effects={**made.effects, DELAY: lag})
    program = made.program(made.truth(np.random.default_rng(3), (2.0, -1.0), **{CONSTANT: 3.0, DELAY: 3.0}))
    base = Refitter(program).fit((), program.unknowns.neutral)
    start = base.u.copy()
    start[program.unknowns.of([CONSTANT, DELAY])] = 1.5
    both = Refitter(program).fit((CONSTANT, DELAY), start)
    explanation = Explanation(program, base, Named(both), [], 0.001, True)
    assert accurate(program, base) and beyond_instruments(explanation)
    for slug, alike in ((DELAY, True), (CONSTANT, False)):
        rest = without(program, both, slug)
        one_out = LeaveOneOutEvidence(slug, rest, [CandidateFit(slug, both, np.nan, np.nan)])
        assert like_accuracy(explanation, one_out) is alike


@pytest.mark.parametrize(("form", "enough"), [("pressure", False), ("reading", True), ("slow drift", True), ("none", True)])
def test_instruments_excuse_what_they_could_do_and_nothing_else(form, enough):
    """A misfit of four standard deviations, 0.4 % of the range, without a name."""
    made = world()
    reading, pressure = made.base @ np.array([2.0, -1.0]), made.drivers["pressure"]
    t = np.linspace(0.0, 1.0, pressure.shape[1])
    added = {
        "pressure": np.sin(0.012 * pressure),
        "reading": bent(reading),
        "slow drift": np.cos(np.pi * t + np.arange(4.0)[:, None]),
        "none": 0.0 * reading,
    }[form]
    program, base, _ = fits(made, 0.0, 4.0 * added)
    assert accurate(program, base)
    assert excused(program, base) is enough
    assert (nameless_beyond_accuracy(program, base) > 3.0 * DEFAULT.evidence.minimum_settled) is not enough


def test_nothing_is_excused_that_is_larger_than_instruments_err():
    program, base, _ = fits(world(), 40.0)
    assert not accurate(program, base) and not excused(program, base)


def test_gains_are_those_of_the_whole_gaussian_model():
    """The closed form against marginal likelihoods of all values, constants and static errors integrated out."""
    program, base, _ = fits(world(bent), 3.0)
    nominal, A, *_ = linearised(program, base, base.evaluation)
    sizes = np.array(DEFAULT.discrepancy.sizes) / DEFAULT.discrepancy.sizes[-1]
    errors = _errors_of_output(program, base, "length")

    def likelihood(size, D):
        V = np.eye(len(nominal)) + A @ A.T + size**2 * D @ D.T
        return -0.5 * (nominal @ np.linalg.solve(V, nominal) + np.linalg.slogdet(V)[1])

    expected = [[likelihood(size, D) - likelihood(0.0, D) for size in sizes] for D in errors]
    assert np.max(expected) > 100.0
    assert error_gains(program, base, errors) == pytest.approx(np.array(expected), rel=1e-5, abs=1e-3)


def test_an_output_of_which_no_reading_counts_has_no_static_errors():
    program, base, _ = fits(world(), 3.0)
    assert all(not errors.any() for errors in _errors_of_output(program, base, "force"))


def test_errors_of_an_input_are_a_zero_of_each_recording_a_gain_and_a_bow(tmp_path):
    """A zero of the strain by 1 % of its range moves the stress by the slope of the curve."""
    for k in range(2):
        put(tmp_path / "c", f"pull_{k}", course([0.6]), curve(course([0.6])), SIDECAR.format(role="fit", noise=1.0))
    program, base = base_fit(Program.of(read_campaign(tmp_path / "c"), "elastomer", []))
    (errors,) = _errors_of_inputs(program, base)
    half = len(errors) // 2
    first, second = errors[:half, 0], errors[half:, 1]
    assert errors.shape == (2 * half, 4) and not errors[half:, 0].any() and not errors[:half, 1].any()
    strain, channel = np.asarray(program.stacked.inputs["strain"])[0], program.channels[0][0]
    there = np.isfinite(channel.sigma)
    by = [1e3 * np.where(there, curve(strain + 0.006 * (strain / 0.3 - 1.0) ** k) - curve(strain), 0.0) for k in range(3)]
    assert second == pytest.approx(first)
    (drifting,) = _errors_of_inputs(program, base, drifting=True)
    assert drifting.shape == (2 * half, 2 * DEFAULT.score_test.slow_cosines)
    held = 1e3 * np.where(there, curve(strain + 0.006 * cosines(there)[0]) - curve(strain), 0.0)
    assert drifting[:half, 0] == pytest.approx(channel.whitened(held), rel=0.1, abs=0.5)
    assert not drifting[half:, ::2].any()
    for column, change in zip((first, errors[:half, 2], errors[:half, 3]), by, strict=True):
        assert column == pytest.approx(channel.whitened(change), rel=0.1, abs=0.5)
