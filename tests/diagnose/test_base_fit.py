"""The fit of a base model that a diagnosis begins with: not shut in on one side of nominal."""

import numpy as np
import pytest
from linear_world import SIGMA, World

from fitting.diagnose.evaluate.evaluation import Raw
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.settings import DEFAULT
from fitting.inference.parallel import FITS

FALSE, TRUE, ROWS = 0.8, -1.5, 200
SCATTERED = DEFAULT.base_fit.scattered_starts
FIRST = 1 + DEFAULT.base_fit.noise_rounds
"""Fits of a base model that is fitted once."""


class TwoOptima(World):
    """One base constant with an optimum on either side of nominal; a fit from nominal ends in the false one.

    Args:
        worse: chi-square that the false optimum leaves more than the other one.
        wall: size of what is between both, in standard deviations.
    """

    def __init__(self, worse, wall=20.0):
        super().__init__(np.zeros((1, ROWS, 1)))
        object.__setattr__(self, "_slope", np.sqrt(worse / (ROWS / 2)) / (FALSE - TRUE))
        object.__setattr__(self, "_wall", wall)

    def run(self, u, columns, stacked, chosen=None):
        x, half = u[0], np.arange(ROWS) % 2 == 0
        r = np.where(half, self._slope * (x - TRUE), self._wall * (x - TRUE) * (x - FALSE))
        slope = np.where(half, self._slope, self._wall * (2.0 * x - TRUE - FALSE))
        slopes = np.zeros((len(columns), 1, ROWS))
        slopes[np.asarray(columns) == 0] = SIGMA * slope
        return Raw(stacked, {"length": SIGMA * r[None]}, {"length": slopes}, {"length": slopes[:0]}, self.drivers)

    def fitted(self, further=lambda _: ()):
        noise = np.random.default_rng(3).standard_normal((1, ROWS))
        return base_fit(self.program(noise), further=further)


def test_a_false_optimum_is_left_from_the_other_side():
    program, fit = TwoOptima(worse=400.0).fitted()
    assert fit.u[0] == pytest.approx(TRUE, abs=0.1)
    assert program.tally[FITS] > FIRST


def test_one_that_does_little_better_is_not_taken():
    """A log-likelihood of 40 is one of 1 once the misfit that is left deflates it."""

    class Missed(TwoOptima):
        def fitted(self):
            noise = np.random.default_rng(3).standard_normal((1, ROWS))
            return base_fit(self.program(noise + 30.0 * np.sin(np.arange(ROWS) / 2.0)))

    _, fit = Missed(worse=80.0).fitted()
    assert fit.u[0] == pytest.approx(FALSE, abs=0.2)


def test_a_model_that_leaves_nothing_is_not_fitted_again():
    program, fit = TwoOptima(worse=1.0).fitted()
    assert fit.u[0] == pytest.approx(FALSE, abs=0.1)
    assert program.tally[FITS] == FIRST


def test_a_base_model_is_at_least_as_good_as_what_is_known_of_it_from_elsewhere(monkeypatch):
    """`characterise` found an optimum. It is asked only where all other starts leave much, for the program that is fitted."""
    asked = []

    def further(program):
        asked.append(program.unknowns)
        return [np.array([TRUE])]

    TwoOptima(worse=1.0).fitted(further)
    _, fit = TwoOptima(worse=400.0).fitted(further)
    assert fit.u[0] == pytest.approx(TRUE, abs=0.1) and not asked  # the other side found it
    monkeypatch.setattr("fitting.diagnose.fit.base_fit._elsewhere", lambda program, fit, stuck: [fit.u])
    _, fit = TwoOptima(worse=400.0).fitted(further)
    assert fit.u[0] == pytest.approx(TRUE, abs=0.1) and len(asked) == 1


def test_a_fit_at_a_bound_is_made_again_from_places_all_about_although_it_leaves_nothing():
    noise = np.random.default_rng(3).standard_normal((1, ROWS))
    program, fit = base_fit(World(np.full((1, ROWS, 1), 0.2)).program(noise + 4.8 * 0.2))
    assert fit.u[0] == program.unknowns.high[0] and reduced(program, fit, program.fitted) < 1.0 + DEFAULT.excess.little
    assert program.tally[FITS] == FIRST + 1 + SCATTERED


def test_a_fit_that_did_not_move_is_made_again_from_places_all_about():
    """Where nothing that was tried has a slope, the misfit is as large everywhere about the start."""
    noise = np.random.default_rng(3).standard_normal((1, ROWS))
    program, fit = base_fit(World(np.zeros((1, ROWS, 1))).program(noise + 3.0))
    assert fit.u[0] == 0.0
    assert program.tally[FITS] == FIRST + 1 + SCATTERED
