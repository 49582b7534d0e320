"""Valleys of an open alloy: fits that end in them, their minus_two_log_evidence, and intervals that hold those that count."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate import profile_likelihood as likelihood
from fitting.calibrate.information import Information
from fitting.calibrate.profile_likelihood import RISES, WIDTH_90, OtherValley, Profile
from fitting.calibrate.spring import valleys as finding
from fitting.calibrate.spring.joint import Joint, Start
from fitting.calibrate.spring.valleys import ASIDE, fits_aside, minus_two_log_evidence, valleys, with_valleys
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameters

NAME = "gR_decay"
SD = 0.02


@dataclass(frozen=True)
class Valleys:
    """Problem of one constant whose fits end in the valley that they begin nearest to.

    Attributes:
        ends: place, least chi-square and standard error of each valley.
        begun: where a fit begins; inflation: factor on the noise.
    """

    ends: tuple
    begun: float = 0.0
    inflation: float = 1.0
    fits: list = field(default_factory=list)

    def at(self, values):
        return Valleys(self.ends, values[NAME], self.inflation, self.fits)

    def inflated(self, factor):
        return Valleys(self.ends, self.begun, factor, self.fits)

    def undecided(self):
        return self

    def fitted_with(self):
        self.fits.append(self.begun)
        return ended(*min(self.ends, key=lambda end: abs(end[0] - self.begun))), self


def ended(place, chi_square, sd):
    parameters = Parameters()
    parameters.add(NAME, place, min=-10.0, max=10.0)
    parameters[NAME].set(standard_error=sd)
    errors = Uncertainty({NAME: sd}, (NAME,), np.array([[sd**2]]), np.eye(1), ())
    return SimpleNamespace(
        values={NAME: place}, chi_square=chi_square, success=True, uncertainty=errors, parameters=parameters
    )


@pytest.fixture(autouse=True)
def known(monkeypatch):
    def information(problem, parameters):
        told = np.array([[parameters[NAME].standard_error ** -2]])
        return Information((NAME,), told, np.array([0.1]), np.zeros(1), np.zeros(1, bool))

    monkeypatch.setattr(finding, "information", information)


def fit_in(*ends):
    """The fit in the first of these valleys."""
    result, problem = ended(*ends[0]), Valleys(ends)
    return Joint(problem, result, (Start("the stages", result, problem),), 1.0, 1.0)


def test_fits_begin_on_both_sides_of_the_fit_and_end_in_other_valleys():
    joint = fit_in((4.8, 1018.0, SD), (4.65, 1014.0, SD))
    ends = fits_aside(joint)
    assert joint.problem.fits == pytest.approx([4.8 + away * SD for away in ASIDE])
    assert {end.result.values[NAME] for end in ends} == {4.8, 4.65}


def test_a_valley_that_is_lower_but_narrow_does_not_count():
    """As in seed 38114: chi-square fell by 5.7, and the volume by a factor of 500,000."""
    joint = fit_in((0.0, 1022.7, SD), (0.06, 1017.0, SD / 5e5))
    ends = fits_aside(joint)
    end = next(end for end in ends if end.result.values[NAME] == 0.06)
    assert valleys(joint, ends) == ()
    assert minus_two_log_evidence(joint, end) - minus_two_log_evidence(joint, joint.starts[0]) == pytest.approx(2.0 * np.log(5e5) - 5.7)


def test_intervals_of_the_residual_strain_alone_hold_other_valleys():
    joint = fit_in((0.0, 1000.0, SD), (0.06, 998.0, SD))
    found = valleys(joint, fits_aside(joint))
    both = with_valleys({NAME: parabola(), "G_m": parabola()}, found)
    assert both[NAME].quoted(90)[1] > 0.06 + WIDTH_90 * SD * 0.9
    assert both["G_m"].quoted(90) == parabola().quoted(90)


def test_a_valley_of_as_much_evidence_belongs_to_the_interval_and_a_poor_one_does_not():
    near, poor = (0.06, 1000.5, SD), (-0.16, 1020.0, SD)
    joint = fit_in((0.0, 1000.0, SD), near, poor)
    (counted,) = valleys(joint, fits_aside(joint))
    assert counted.lost == pytest.approx(0.5) and counted.sd[NAME] == pytest.approx(SD)
    low, high = with_valleys({NAME: parabola()}, (counted,))[NAME].quoted(90)
    assert high == pytest.approx(0.06 + SD * np.sqrt(RISES[90] - 0.5), rel=0.1)
    assert low == pytest.approx(-WIDTH_90 * SD, rel=0.2)


def test_evidence_counts_misfit_over_the_noise_as_found():
    joint = fit_in((0.0, 1000.0, SD), (0.1, 1008.0, SD))
    noisy = Joint(joint.problem.inflated(2.0), joint.result, joint.starts, 4.0, 1.0)
    other = Start("other", ended(0.1, 1008.0, SD), joint.problem)
    gaps = [minus_two_log_evidence(one, other) - minus_two_log_evidence(one, one.starts[0]) for one in (joint, noisy)]
    assert gaps == pytest.approx([8.0, 2.0])


def test_a_constant_at_its_bound_has_its_volume():
    """Held there it would have none, and a valley with one would lose all its evidence."""
    told = np.diag([100.0, 4.0])
    free, held = (
        Information(("x", "y"), told, np.ones(2), np.zeros(2), np.array([False, fixed])) for fixed in (False, True)
    )
    assert free.log_volume(("x", "y")) == pytest.approx(-np.log(400.0))
    assert held.log_volume(("x", "y")) == pytest.approx(free.log_volume(("x", "y")))
    assert free.log_volume(("y",)) == pytest.approx(-np.log(4.0))


def parabola(sd=SD, unit=1.0):
    value = np.linspace(-3.0, 3.0, 7) * sd
    return Profile(NAME, value, (value / sd) ** 2, np.zeros(7, bool), sd, bounds=(-10.0, 10.0), rise_per_sd=unit)


def test_a_profile_beside_no_valley_is_itself():
    alone = parabola()
    assert alone.with_valleys(()) is alone
    assert alone.with_valleys([OtherValley(0.0, SD, 0.0)]).quoted(90) == pytest.approx(alone.quoted(90), rel=1e-6)


@pytest.mark.parametrize(("sd", "lost", "held"), [(SD, 1.0, True), (SD, 9.0, False), (50 * SD, 2.0, False)])
def test_a_valley_begins_at_what_it_lost_and_at_its_width(sd, lost, held):
    """A share of evidence that lies over fifty times the width is fifty times lower."""
    beside = parabola().with_valleys([OtherValley(0.2, sd, lost)])
    wide = 2.0 * np.log(max(sd / SD, 1.0))
    assert np.min(beside.rise[beside.value > 0.1]) == pytest.approx(lost + wide, rel=0.01)
    assert (beside.interval(RISES[90])[1] > 0.2) == held
    assert beside.value[np.argmin(beside.rise)] == 0.0


def test_a_valley_of_the_same_evidence_leaves_the_best_value_where_the_fit_is():
    beside = parabola().with_valleys([OtherValley(-0.2, SD, 0.0)])
    assert beside.value[np.argmin(beside.rise)] == 0.0
    assert beside.quoted(90)[0] < -0.2 < likelihood.WIDTH_90 * SD <= beside.quoted(90)[1] * 1.01


@pytest.mark.parametrize("lost", [-3.0, 0.0, 2.0, 8.0])
def test_no_valley_narrows_an_interval(lost):
    asked = [(percent, level) for percent in (50, 68, 90) for level in ((1.0, 1.0), (4.0, 1.0), (1.0, 4.0))]
    alone = {one: parabola().quoted(*one) for one in asked}
    for place in np.array([-8.0, -2.0, 0.0, 1.0, 4.0]) * SD:
        for sd in (0.01 * SD, SD, 7.0 * SD):
            beside = parabola().with_valleys([OtherValley(place, sd, lost)])
            for one, own in alone.items():
                below, above = beside.quoted(*one)
                assert below <= own[0] and above >= own[1], (place, sd, one)
