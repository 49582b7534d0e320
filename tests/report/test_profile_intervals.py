"""One interval of a constant at every place of a report: table, sentence, figure and numbers of its profile."""

from dataclasses import replace

import numpy as np
import pytest

from fitting.calibrate.information import Information
from fitting.calibrate.open_constants import open_constants
from fitting.calibrate.profile_likelihood import Profile
from fitting.calibrate.profiled_fits import with_intervals
from fitting.calibrate.quoted import estimate
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report import profile_likelihood as shown
from fitting.report.characterisation import estimate_text, interval_text
from fitting.report.open_constants import grouped_warnings

SIDES = {50: (1.0, 1.5), 68: (1.0, 1.5), 90: (1.0, 2.0)}
"""Factors on the rise at both ends, as of an instrument's zero that draws a constant to one side."""


class Result:
    """A result with one constant in GPa, whose profile is a parabola with a plateau above."""

    def __init__(self):
        value = 1e9 * np.array([2.0, 2.4, 3.0, 3.8, 4.6, 5.4])
        rise = np.array([9.0, 2.25, 0.0, 2.0, 3.5, 9.0])
        profile = Profile("G_m", value, rise, np.zeros(6, bool), 4e8, bounds=(0.0, 9e9))
        entry = Parameter("G_m", 3e9, 0.0, 9e9, unit="GPa", prior=Prior(3e9, 1e9))
        entry.set(standard_error=4e8)
        self.profiles = {"G_m": profile}
        self.parameters = {"G_m": estimate(entry, profile, 1.0, SIDES)}


@pytest.fixture
def result():
    return Result()


def test_the_figure_and_the_numbers_have_the_intervals_of_the_table(result):
    """Upright lines were those of the profile alone, without what zeros of instruments add to either side."""
    ends = result.parameters["G_m"].interval[90]
    (panel,) = shown.figure(result).axes
    upright = [line.get_xdata()[0] for line in panel.lines if line.get_linestyle() == "-" and len(set(line.get_xdata())) == 1]
    np.testing.assert_allclose(sorted(upright), ends)
    document = shown.document(result)["G_m"]
    for percent in (68, 90):
        quoted = 1e9 * np.array(result.parameters["G_m"].interval[percent])
        np.testing.assert_allclose(document[f"interval_{percent}_SI"], quoted)
    assert interval_text(result.parameters["G_m"]) == shown.interval(result, "G_m").removesuffix(" GPa")
    assert ends[1] > 1e-9 * result.profiles["G_m"].quoted(90)[1] + 0.05  # the sides do differ here


def test_a_point_far_above_does_not_flatten_its_panel(result):
    far = result.profiles["G_m"]
    result.profiles["G_m"] = replace(far, rise=np.where(far.rise == 3.5, 6000.0, far.rise))
    (panel,) = shown.figure(result).axes
    assert 9.0 < panel.get_ylim()[1] < 30.0


def bound_at(points):
    """Estimate of a constant at its upper bound, and the sentence on it, from so many points of its profile."""
    entry = Parameter("alpha_1", 2.0, 0.0, 2.0, unit="1", prior=Prior(1.5, 0.5))
    value = np.array([1.5, 1.9, 2.0])[-points:]
    rise = np.array([9.0, 1.0, 0.0])[-points:]
    profile = Profile("alpha_1", value, rise, np.zeros(points, bool), np.nan, bounds=(0.0, 2.0))
    parameters = Parameters()
    parameters.add(entry)
    fisher = Information(("alpha_1",), np.eye(1), np.array([0.5]), np.array([4.0]), np.array([True]))
    start, own = {"alpha_1": 1.5}, with_intervals({"alpha_1": profile})
    (said,) = open_constants(fisher, parameters, start, profiled=own)
    return estimate(entry, profile), said


@pytest.mark.parametrize("points", [1, 3])
def test_a_constant_at_its_bound_has_an_error_everywhere_or_nowhere(points):
    """A warning said that it has no error, and the table had one to one side."""
    found, said = bound_at(points)
    assert found.at_bound and said["kind"] == "at_bound"
    has = "(-" in estimate_text(found) and "+0)" in estimate_text(found)
    assert has == (points > 1) and has != ("has no error" in said["text"])
    assert has == ("has one side only" in said["text"])
    several = grouped_warnings([said, {**said, "parameters": ["alpha_2"]}])
    assert len(several) == 1 and several[0].startswith("alpha_1 and alpha_2 stopped at their bounds")
    assert has == ("have one side only" in several[0]) and has != ("have no errors" in several[0])
    mixed = grouped_warnings([said, {**said, "one_sided": not has, "parameters": ["alpha_2"]}])
    assert len(mixed) == 2
