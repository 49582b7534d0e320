"""Profiles and their intervals on problems whose answer is known: a parabola, a banana, nothing told, a bound."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from fitting.calibrate.profile_likelihood import RISES, WIDTH_90, Profile
from fitting.calibrate.profile_points import FITS, LONGER
from fitting.calibrate.profile_search import BEYOND, CROSSED, MOST, profile_likelihoods
from fitting.calibrate.profiled_fits import RENEWALS, lowest_point, to_the_end
from fitting.calibrate.quoted import estimate, merely_prior
from fitting.inference.least_squares import Status
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameters, Prior
from fitting.report import profile_likelihood as report


class Problem:
    """Chi-square of x and y, of which y is profiled exactly; the recordings' own part may be less than all."""

    def __init__(self, chi_square, sd=1.0, told=None, low=-50.0, high=50.0, x=0.0, prior=10.0, stuck=lambda x: False):
        self.chi_square, self.told, self.stuck, self.calls = chi_square, told or chi_square, stuck, 0
        self.looked = 0
        self.parameters = Parameters()
        self.parameters.add("x", x, min=low, max=high, prior=Prior(0.0, prior, low, high))
        self.parameters.add("y", 0.0, prior=Prior(0.0, 10.0))
        self.parameters["x"].set(standard_error=sd)
        self.values = {"x": x, "y": 0.0}

    def fit(self, values, held):
        self.calls += 1
        x = held.get("x", values["x"])
        y = minimize_scalar(lambda y: self.chi_square(x, y), bracket=(-1.0, 1.0)).x
        found = self.chi_square(x, y) + (30.0 if self.stuck(x) and held else 0.0)
        told = self.told(x, y)
        return SimpleNamespace(
            chi_square=found, success=not self.stuck(x), values={"x": x, "y": y}, residual=np.sqrt([max(told, 0.0)])
        )

    def misfit(self, values):
        self.looked += 1
        return self.chi_square(values["x"], values["y"])

    def profile(self, again=None, rises_per_sd=None, looks=False):
        sd = self.parameters["x"].standard_error
        errors = Uncertainty({}, ("x",), np.array([[sd**2]]), np.eye(1), ()) if sd else Uncertainty.none(["x"])
        across = {"misfit": self.misfit} if looks else {}
        known = self.parameters, self.values, errors, self.fit
        return profile_likelihoods(["x"], *known, again, rises_per_sd, **across)["x"]


def test_a_parabola_takes_two_fits_on_each_side():
    """One confirms the end of the 90 % interval, one that nothing wide lies low beyond."""
    problem = Problem(lambda x, y: 7.0 + (x / 2.0) ** 2 + (y - x) ** 2, sd=2.0)
    found = problem.profile()
    assert problem.calls <= 1 + 2 * 2 and not found.curved
    for percent, rise in RISES.items():
        np.testing.assert_allclose(found.quoted(percent), np.array([-2.0, 2.0]) * rise**0.5, rtol=1e-6)
    assert found.brackets() == (True, True)


def banana(x, y):
    """Along y = 1 - exp(-x / 4) nothing but y is measured: towards larger x less and less is told."""
    return ((1.0 - np.exp(-x / 4.0)) / 0.3) ** 2 + (x / 10.0) ** 2 + (y - x) ** 2


def known_interval(profile, percent, low=-50.0, high=50.0):
    """Where a rise is less than the one that leaves 10 % of the density exp(-rise / 2) outside; from a grid."""
    grid = np.linspace(low, high, 1000001)
    rise = np.sort(profile(grid))
    held = np.cumsum(np.exp(-0.5 * rise)) / np.exp(-0.5 * rise).sum()
    limit = max(rise[np.searchsorted(held, chi2.cdf(RISES[percent], 1))], RISES[percent])
    inside = grid[profile(grid) <= limit]
    return inside.min(), inside.max()


@pytest.mark.parametrize("percent", RISES)
def test_of_a_banana_the_interval_is_the_known_one(percent):
    """The Gaussian bar is 1.2 to either side; the truth is asymmetric by a factor of eight."""
    wanted = known_interval(lambda x: banana(x, x), percent)
    problem = Problem(banana, sd=(1.0 / 1.2**2 + 0.01) ** -0.5, told=lambda x, y: banana(x, y) - (x / 10.0) ** 2)
    found = problem.profile()
    assert found.curved and problem.calls < 2 * (MOST + BEYOND + 2)
    np.testing.assert_allclose(found.quoted(percent), wanted, rtol=0.08)
    if percent == 90:
        assert found.brackets() == (True, True)
        quoted = estimate(problem.parameters["x"], found)
        assert quoted.curved and quoted.sd == pytest.approx(np.ptp(wanted) / 2.0 / WIDTH_90, rel=0.08)


def second_valley(x):
    """A parabola up to 1.9 below the best value; further down the rise stays at 3.6, up to a wall at -8."""
    return np.where(x > -1.897, x**2, 3.6 + np.maximum(-8.0 - x, 0.0) ** 2)


def test_what_stays_low_beyond_the_interval_belongs_to_it():
    """At 1.64 errors the rise is a parabola's, so that the 90 % interval seemed known; a fifth lies beyond."""
    problem = Problem(lambda x, y: float(second_valley(x)) + (y - x) ** 2)
    found = problem.profile()
    wanted = known_interval(second_valley, 90)
    assert wanted[0] < -5.0 and found.interval(RISES[90])[0] == pytest.approx(-WIDTH_90, rel=0.05)
    np.testing.assert_allclose(found.quoted(90), wanted, rtol=0.3)  # three points tell of the far side
    quoted = estimate(problem.parameters["x"], found)
    assert quoted.curved and -8.0 > quoted.value - 5.0 * quoted.sd


class TwoValleys(Problem):
    """Of y there are two valleys, the other one higher by 4.4. Far from the fit every start ends in that one."""

    def fit(self, values, held):
        self.calls += 1
        x = held.get("x", values["x"])
        y = 0.0 if values["y"] < 5.0 and abs(x) < 1.4 else 10.0
        rise = x**2 + 0.44 * y
        return SimpleNamespace(chi_square=rise, success=True, values={"x": x, "y": y}, residual=np.sqrt([rise]))


def test_a_point_in_another_valley_does_not_draw_those_inside_it_along():
    """The profile of `beta_2` jumped by 4.4 beside the fit: each point had begun at its outer neighbour."""
    found = TwoValleys(None).profile()
    near = np.abs(found.value) < 1.4
    np.testing.assert_allclose(found.rise[near], found.value[near] ** 2)
    assert np.sum(near) >= 5 and np.abs(found.interval(RISES[90])).min() > 1.2


def high_plateau(x):
    """A parabola up to 2.5 above the best value; beyond it the rise is 6 and what a prior adds."""
    return np.where(x < 0.0, x**2, np.minimum(x**2, 6.0 + (x / 8.0) ** 2))


def test_a_plateau_above_the_rise_of_99_per_cent_counts_if_it_is_wide():
    """The rise at 99 % is 6.6, within tolerance of the plateau's; a fifth of the density lies beyond."""
    problem = Problem(lambda x, y: float(high_plateau(x)) + (y - x) ** 2)
    found = problem.profile()
    wanted = known_interval(high_plateau, 90)
    assert wanted[1] > 2.5 * WIDTH_90 and found.interval(RISES[90])[1] == pytest.approx(WIDTH_90, rel=0.05)
    np.testing.assert_allclose(found.quoted(90), wanted, rtol=0.25)  # a few points tell of the far side


def behind_a_hump(x, side=1.0):
    """A notch of width 1 at 0, a hump of 40 at 6, and from 8 on a plateau that lies 3 higher and only the prior
    ends."""
    x = side * np.asarray(x)
    return np.minimum(x**2, np.where(x > 8.0, 3.0, 40.0)) + (x / 10.0) ** 2


@pytest.mark.parametrize("side", (-1.0, 1.0))
def test_a_plateau_behind_a_hump_is_seen_by_a_line_and_belongs_to_the_interval(side):
    """It holds two thirds of the density. A search that ends at the hump quotes a tenth of the interval."""
    problem = Problem(lambda x, y: float(behind_a_hump(x, side)) + (y - 0.1 * x) ** 2, low=-30.0, high=30.0)
    ends = np.sort(np.abs(problem.profile().quoted(90)))
    np.testing.assert_allclose(ends, WIDTH_90, rtol=0.1)
    found = problem.profile(looks=True)
    wanted = known_interval(lambda x: behind_a_hump(x, side), 90, -30.0, 30.0)
    far = max(side * np.array(wanted))
    assert far > 10.0 and found.curved
    assert max(side * np.array(found.quoted(90))) == pytest.approx(far, rel=0.15)


def test_lines_that_see_nothing_lower_cost_no_fit():
    parabola = {"chi_square": lambda x, y: 7.0 + (x / 2.0) ** 2 + (y - x) ** 2, "sd": 2.0}
    without, looking = Problem(**parabola), Problem(**parabola)
    assert without.profile().quoted(90) == looking.profile(looks=True).quoted(90)
    assert looking.calls == without.calls and 0 < looking.looked < 20


def test_a_fit_that_ends_higher_than_its_line_is_tried_a_few_times_only():
    problem = Problem(lambda x, y: float(behind_a_hump(x)) + (y - 0.1 * x) ** 2, stuck=lambda x: x > 7.0)
    found = problem.profile(looks=True)
    assert problem.calls <= 2 + 2 * (MOST + BEYOND) + CROSSED * (1 + BEYOND) and np.isfinite(found.rise).all()


def test_a_direction_that_nothing_tells_is_the_prior_and_is_said_to_be():
    """The Gaussian bar of the fit is a fiftieth of the prior; the recordings tell x + y alone."""
    problem = Problem(
        lambda x, y: (x / 10.0) ** 2 + 100.0 * (x + y) ** 2, sd=0.2, told=lambda x, y: 100.0 * (x + y) ** 2
    )
    found = problem.profile()
    np.testing.assert_allclose(found.quoted(90), [-10.0 * WIDTH_90, 10.0 * WIDTH_90], rtol=1e-3)
    quoted = estimate(problem.parameters["x"], found)
    assert quoted.determined == (False, False) and merely_prior(quoted) and quoted.curved
    assert quoted.of_prior == pytest.approx(1.0, rel=1e-3) and quoted.sd == pytest.approx(10.0, rel=1e-3)


def test_a_constant_that_is_bounded_from_one_side_says_so():
    """Where x is large the recordings are blind to it; its bound is near."""
    flat = lambda x, y: (np.exp(-x) - 1.0) ** 2 / 0.25 + (y - x) ** 2  # noqa: E731  ends at 4 for large x
    problem = Problem(lambda x, y: flat(x, y) * 0.5, sd=0.7, low=-5.0, high=8.0)
    found = problem.profile()
    low, high = found.quoted(90)
    assert low == pytest.approx(-np.log(1.0 + (RISES[90] * 0.5) ** 0.5), rel=0.05) and high == 8.0
    assert found.brackets() == (True, False)
    assert found.interval(RISES[90])[1] == np.inf


def test_a_constant_at_its_bound_has_a_one_sided_interval():
    problem = Problem(lambda x, y: (x + 1.0) ** 2 + (y - x) ** 2, sd=None, low=0.0, high=9.0)
    found = problem.profile()
    low, high = found.quoted(90)
    assert low == 0.0 and high == pytest.approx(1.147, rel=0.03)  # a truncated Gaussian has 10 % beyond
    assert found.interval(RISES[90])[1] == pytest.approx((1.0 + RISES[90]) ** 0.5 - 1.0, rel=0.05)
    quoted = estimate(problem.parameters["x"], found)
    assert quoted.at_bound and quoted.interval[90] == (low, high) and quoted.determined == (False, True)


def test_noise_that_lasts_widens_the_interval():
    problem = Problem(lambda x, y: x**2 + (y - x) ** 2)
    np.testing.assert_allclose(problem.profile(rises_per_sd={"x": 4.0}).quoted(90), [-2.0 * WIDTH_90, 2.0 * WIDTH_90], rtol=1e-6)


def test_where_a_fit_gets_stuck_it_is_tried_again_and_an_upper_limit_counts_for_less():
    stuck = Problem(lambda x, y: x**2 + (y - x) ** 2, stuck=lambda x: x > 0.0)
    freed = Problem(lambda x, y: x**2 + (y - x) ** 2)
    np.testing.assert_allclose(stuck.profile(again=freed.fit).quoted(90), [-WIDTH_90, WIDTH_90], rtol=0.05)


def test_fits_that_all_stop_early_do_not_narrow_the_interval_of_the_standard_error():
    """Each of their rises is an upper limit: 30 too high here, which alone would end the interval near the fit."""
    stuck = Problem(lambda x, y: x**2 + (y - x) ** 2, stuck=lambda x: x != 0.0)
    for percent, rise in RISES.items():
        np.testing.assert_allclose(stuck.profile().quoted(percent), [-(rise**0.5), rise**0.5], rtol=1e-3)


def test_a_stopped_fit_far_out_changes_nothing_where_a_converged_one_has_ended_the_interval():
    """A side that is 2.5 times steeper than its error: the interval ends with it, and no tail begins there."""
    steep = Problem(lambda x, y: (2.5 * x if x > 0.0 else x) ** 2 + (y - x) ** 2, stuck=lambda x: x > 1.0)
    low, high = steep.profile().quoted(90)
    assert low == pytest.approx(-WIDTH_90, rel=0.05) and high == pytest.approx(WIDTH_90 / 2.5, rel=0.1)
    points = np.array([-1.645, -0.9, 0.0, 0.9, 1.645])
    outer = Profile("x", points, np.array([9.0, 2.75, 0.0, 2.75, 9.0]), np.abs(points) > 1.0, 1.0, bounds=(-50.0, 50.0))
    np.testing.assert_allclose(outer.quoted(90), [-0.9, 0.9], rtol=0.05)


def test_a_lower_minimum_is_reported_with_its_place():
    problem = Problem(lambda x, y: min(x**2, (x - 3.0) ** 2 - 5.0) + (y - x) ** 2)
    found = problem.profile()
    name, place = lowest_point({"x": found})
    assert name == "x" and place["x"] > 1.0


class Slow(Problem):
    """Every fit makes all steps that are allowed, and each that goes on gains again."""

    def fit(self, values, held):
        result = super().fit(values, held)
        result.chi_square += 8.0 - 0.15 * self.calls if held else 0.0
        result.success, result.status = False, Status.MAX_STEPS
        return result


def test_no_profile_takes_more_fits_than_are_allowed_and_says_so():
    slow = Slow(lambda x, y: np.log1p(x**2) + (y - x) ** 2)
    found = slow.profile()
    assert found.cut and FITS <= slow.calls <= FITS + LONGER + 3
    said = report.warnings(SimpleNamespace(profiles={"x": found}, parameters={"x": estimate(slow.parameters["x"], found)}))
    assert [line for line in said if line.startswith("The profile ends early: x needed more than")]
    easy = Problem(lambda x, y: x**2 + (y - x) ** 2)
    assert not easy.profile().cut


class Ending(Problem):
    """Every fit ends with a status."""

    status = Status.CONVERGED

    def fit(self, values, held):
        result = super().fit(values, held)
        result.success, result.status = self.status is Status.CONVERGED, self.status
        return result


@pytest.mark.parametrize(("status", "more"), [(Status.LINGERING, False), (Status.STALLED, True)])
def test_a_fit_that_ends_because_it_gains_too_little_is_not_made_from_another_start(status, more):
    """A law that misses its tests ends so at every point, and each was fitted a second time."""
    calls = []
    for end in (Status.CONVERGED, status):
        problem = Ending(lambda x, y: x**2 + (y - x) ** 2)
        problem.status = end
        problem.profile()
        calls.append(problem.calls)
    assert (calls[1] > calls[0]) is more


def test_all_profiles_are_made_of_the_fit_that_none_falls_below_alone():
    """The first that falls ends a turn; the last turn makes all of them, whatever they find."""
    asked, falls = [], Profile("x", np.zeros(1), np.zeros(1), np.zeros(1, bool), 1.0, below=5.0, lowest={"x": 1.0})
    flat = Profile("x", np.zeros(1), np.zeros(1), np.zeros(1, bool), 1.0)

    def run(lowest, better=True):
        asked.clear()

        def profiled(fit, leave):
            asked.append((fit, leave))
            return ({"x": flat if fit >= lowest else falls},)

        return to_the_end(0, profiled, lambda fit, name, lower: (fit + better, better))[0]

    assert run(2) == 2 and asked == [(0, True), (1, True), (2, True)]
    assert run(99) == RENEWALS and asked[-1] == (RENEWALS, False) and len(asked) == RENEWALS + 1
    assert run(99, better=False) == 0 and asked == [(0, True), (0, False)]


def test_other_fits_that_are_as_good_belong_to_the_interval():
    value = np.array([-2.0, 0.0, 2.0])
    alone = Profile("x", value, value**2, np.zeros(3, bool), 1.0, bounds=(-20.0, 20.0))
    both = alone.joined([(6.0, 1.0), (-9.0, 50.0)])
    low, high = both.quoted(90)
    assert -2.0 < low <= -WIDTH_90 and 6.0 < high < 9.0
    assert alone.joined([(6.0, 50.0)]) is alone


@pytest.mark.parametrize("low", (-4.0, 0.0))
def test_ends_that_hold_a_share_of_a_gaussian_are_its_own(low):
    """Also of half a Gaussian, which begins at a bound."""
    value = np.arange(low, 4.01, 0.25)
    whole = Profile("x", value, value**2, np.zeros(len(value), bool), 1.0, bounds=(low if low == 0.0 else -20.0, 20.0))
    for percent, width in ((50, 0.674490), (68, 1.0), (90, 1.644854)):
        below, above = whole._ends_by_density(percent)
        np.testing.assert_allclose([below, above], [width * np.sign(low), width], atol=2e-5)
