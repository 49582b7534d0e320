"""Wires of laboratories: a superelastic pull and return at one temperature, and cycles under a weight."""

import numpy as np
import pytest

from fitting.data.recordings import Campaign, Recording
from fitting.diagnose import diagnose
from fitting.diagnose.verdict.probabilities import Found, explanation_sets
from fitting.report.diagnosis.figures import drawn_outputs
from fitting.specimens.wire import set_apart


def recorded(columns, name="W", role="fit"):
    time = np.arange(len(columns["strain"])) * 0.5
    return Recording(
        name, None, "wire", role=role, specimen="W", real=False, geometry={"alloy": "fit"}, columns={"time_s": time} | columns
    )


def campaign(*recordings, path="W"):
    return Campaign("W", list(recordings), path)


def flag(largest, up=450.0, down=230.0, modulus=55e3, hardening=1500.0, rows=70):
    """Strain [1] and stress [MPa] of a superelastic pull and return: two plateaus, elastic between them."""
    soft = lambda a, b: -12.0 * np.logaddexp(-a / 12.0, -b / 12.0)  # noqa: E731  the lesser, with a round corner
    there, back = np.linspace(0.0, largest, rows), np.linspace(largest, 0.0, rows)
    loading = soft(modulus * there, up + hardening * there)
    lower = soft(modulus * back, down + hardening * back)
    elastic = loading[-1] - 0.6 * modulus * (largest - back)
    returning = np.minimum(12.0 * np.logaddexp(elastic / 12.0, lower / 12.0), soft(modulus * back, up + hardening * back))
    return np.r_[there, back[1:]], np.r_[loading, returning[1:]]


@pytest.mark.slow
def test_a_superelastic_return_along_a_lower_branch_is_a_hysteresis(tmp_path):
    """At one temperature and one rate: heat that is lost in time is told from it by its size alone."""
    rng = np.random.default_rng(2)
    strain, stress = flag(0.06)
    pull = recorded({
        "strain": strain, "stress_MPa": stress + 1.5 * rng.standard_normal(len(stress)), "temperature_degC": np.full(len(stress), 22.0),
    })  # fmt: skip
    found = diagnose(campaign(pull, path=tmp_path), seed=1)
    assert "transformation_hysteresis" in found.explanation_set
    assert found.explanation_set != ["self_heating_rate"]
    named = {f.slug: f for f in found.found}
    if "transformation_hysteresis" in named:  # the branches are 220 MPa apart
        gaps = [named["transformation_hysteresis"].parameters[n]["value"] for n in ("gap_m", "gap_a")]
        assert 150e6 < max(gaps) < 350e6


@pytest.mark.slow
def test_cycles_whose_first_heating_differs_show_their_hysteresis(tmp_path):
    """A wire that transforms far above what tables assume, drawn by its weight in the first cycle only."""
    rng = np.random.default_rng(3)
    corners = [25.0, 140.0, 25.0, 140.0, 25.0, 140.0, 25.0]
    T = np.interp(np.arange(300), np.linspace(0, 299, len(corners)), corners)
    rising = np.gradient(T) > 0.0
    strain = 0.004 + 0.033 / (1.0 + np.exp((T - np.where(rising, 101.0, 87.0)) / 2.5))
    strain[: 300 // 6] = 0.004
    cycles = recorded({
        "strain": strain + 5e-5 * rng.standard_normal(300), "stress_MPa": np.full(300, 250.0), "temperature_degC": T,
    })  # fmt: skip
    assert set_apart(cycles) is not None
    found = diagnose(campaign(cycles, path=tmp_path), seed=1)
    assert "transformation_hysteresis" in found.explanation_set
    assert any("first heating" in note for note in found.notes)
    assert found.after.reduced_chi2 < found.before.reduced_chi2


def test_names_that_recordings_do_not_tell_apart_are_all_in_the_set():
    candidates = {"channel_lag": (0.96, 100.0), "transformation_hysteresis": (0.03, 92.0), "r_phase": (0.01, 0.0)}
    lag = Found("channel_lag", 0.96, 100.0, {}, ["transformation_hysteresis"], "")
    assert explanation_sets(candidates, 0.0, [lag]) == [["channel_lag", "transformation_hysteresis"]]
    assert explanation_sets(candidates, 0.0) == [["channel_lag"]]
    other = Found("r_phase", 0.01, 0.0, {}, ["channel_lag"], "")
    assert explanation_sets(candidates, 0.0, [other]) == [["channel_lag"]]


def test_of_two_effects_each_has_a_set_of_its_own():
    candidates = {"channel_lag": (0.86, 100.0), "transformation_hysteresis": (0.13, 92.0), "r_phase": (0.0, 99.0)}
    lag = Found("channel_lag", 0.86, 100.0, {}, ["transformation_hysteresis"], "", {"channel_lag": 0.86})
    sure = Found("r_phase", 0.99, 99.0, {}, [], "", {"r_phase": 0.99, "inactive_coils": 0.01})
    both = [["channel_lag", "transformation_hysteresis"], ["r_phase"]]
    assert explanation_sets(candidates, 0.01, [lag, sure]) == both
    open_one = Found("r_phase", 0.7, 99.0, {}, [], "", {"r_phase": 0.7, "inactive_coils": 0.3})
    assert explanation_sets(candidates, 0.01, [open_one, lag])[1] == ["r_phase", "inactive_coils"]
    assert "unmodelled" in explanation_sets(candidates, 0.5, [lag, sure])[0]


def test_the_figure_says_which_of_strain_and_stress_is_drawn_and_which_drives():
    """A column had been drawn without a word on why it is not the other one."""
    strain, stress = flag(0.06)
    pull = recorded({"strain": strain, "stress_MPa": stress, "temperature_degC": np.full(len(stress), 22.0)}, name="pull")
    held = recorded({"strain": strain, "stress_MPa": np.full(len(stress), 250.0), "temperature_degC": 22.0 + stress / 5.0}, name="held")
    said = drawn_outputs([pull, held])
    assert "stress of pull, driven by strain; strain of held, driven by stress." in said
    assert "Stress drives it where it varies less than 50 % as much as strain" in said
    assert drawn_outputs([Recording("T", None, "tube", columns={"pressure_kPa": strain, "length_mm": strain})]) == ""
