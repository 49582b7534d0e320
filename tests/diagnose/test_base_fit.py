"""The fit of a base model that a diagnosis begins with: not shut in on one side of nominal."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit import base_fit
from fitting.diagnose.settings import DEFAULT

FALSE, TRUE = 1.5, -0.8


@pytest.fixture
def two_optima(monkeypatch):
    """A search goes down to the optimum on its side of nominal, the false one from nominal itself; how much
    each leaves is up to a test. Starts that were tried are kept."""
    left, starts = {FALSE: 900.0, TRUE: 100.0}, []

    class Refitter:
        def __init__(self, program):
            pass

        def fit(self, slugs, start, rounds=0, near=None):
            starts.append(0.0 if start is None else float(start[0]))
            end = TRUE if starts[-1] < 0.0 else FALSE
            return SimpleNamespace(u=np.array([end]), objective=left[end])

    monkeypatch.setattr(base_fit, "Refitter", Refitter)
    monkeypatch.setattr(base_fit, "settle", lambda program, fit: (program, fit))
    monkeypatch.setattr(base_fit, "reduced", lambda program, fit, chosen: fit.objective / 100.0)
    monkeypatch.setattr(base_fit, "inflation_of", lambda program, fit: 2.0)
    return left, starts


def coupons(hidden=False, bound=4.0):
    """A campaign of one base constant."""
    unknowns = SimpleNamespace(
        base=np.array([0]), neutral=np.zeros(1), low=np.array([-bound]), high=np.array([bound]), items=[SimpleNamespace(name="G_m")]
    )
    return SimpleNamespace(fitted=None, hidden=hidden, unknowns=unknowns)


def test_beside_hidden_courses_the_fit_begins_in_further_places(two_optima):
    left, starts = two_optima
    left[FALSE], left[TRUE] = 900.0, 895.0
    base_fit.base_fit(coupons(hidden=True))
    assert len(starts) == 2 + DEFAULT.base_fit.scattered_starts and len(set(starts)) == len(starts)


def test_a_false_optimum_is_left_from_the_other_side(two_optima):
    _, fit = base_fit.base_fit(coupons())
    assert fit.u[0] == TRUE


def test_one_that_does_no_better_is_not_taken(two_optima):
    left, starts = two_optima
    left[TRUE] = left[FALSE] - 8.0  # 4 once deflated
    _, fit = base_fit.base_fit(coupons())
    assert fit.u[0] == FALSE and starts == [0.0, -FALSE]


def test_a_model_that_leaves_nothing_is_not_fitted_again(two_optima):
    left, starts = two_optima
    left[FALSE] = 100.0
    base_fit.base_fit(coupons())
    assert starts == [0.0]


def test_a_fit_that_did_not_move_is_made_again_from_places_all_about(two_optima, monkeypatch):
    """Where nothing that was tried had a slope: the misfit is as large everywhere about the start."""
    left, starts = two_optima
    left[0.0] = 900.0
    monkeypatch.setattr(base_fit, "Refitter", lambda program: Still(left, starts))
    _, fit = base_fit.base_fit(coupons())
    assert len(starts) == 2 + DEFAULT.base_fit.scattered_starts and fit.u[0] == TRUE


def test_a_fit_at_a_bound_is_made_again_although_it_leaves_nothing(two_optima):
    left, starts = two_optima
    left[FALSE] = 100.0
    base_fit.base_fit(coupons(bound=FALSE))
    assert len(starts) == 2 + DEFAULT.base_fit.scattered_starts


def test_a_base_model_is_at_least_as_good_as_what_is_known_of_it_from_elsewhere(two_optima):
    """`characterise` found an optimum that no other start leads to; it is asked only where much is left."""
    left, starts = two_optima
    asked = []

    def further():
        asked.append(len(starts))
        return [np.array([TRUE])]

    left[TRUE] = 20.0
    _, fit = base_fit.base_fit(coupons(), further=further)
    assert fit.u[0] == TRUE and asked == [1]
    left[FALSE] = 100.0
    base_fit.base_fit(coupons(), further=further)
    assert asked == [1]


class Still:
    """Fits that stay where they begin, but for those that begin far on the other side."""

    def __init__(self, left, starts):
        self.left, self.starts = left, starts

    def fit(self, slugs, start, rounds=0, near=None):
        self.starts.append(0.0 if start is None else float(start[0]))
        end = TRUE if self.starts[-1] < -0.5 else 0.0
        return SimpleNamespace(u=np.array([end]), objective=self.left[end])
