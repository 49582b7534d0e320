"""Levenberg's steps of a diagnosis, on a valley that bends: where a full step makes a fit thousands of times worse."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit.refit import Refitter
from fitting.inference.parallel import FITS, Tally


class Unknowns:
    """Two base constants."""

    base = np.array([0, 1])
    neutral, low, high = np.zeros(2), np.full(2, -4.0), np.full(2, 4.0)
    items = tuple(
        SimpleNamespace(name=name, effect="", start=0.0, shape=False, low=-4.0, high=4.0) for name in "xy"
    )

    def of(self, slugs):
        return np.zeros(0, int)

    def __len__(self):
        return 2


class Valley:
    """Rosenbrock's function, `size` times: a program whose misfit has three values."""

    def __init__(self, size):
        self.unknowns, self.fitted, self.size, self.evaluations = Unknowns(), np.ones(1), size, 0
        self.tally = Tally()

    def count(self, k):
        return 3

    def evaluate(self, u, columns, near=None):
        self.evaluations += 1
        x, y = u
        r = self.size * np.array([10.0 * (y - x**2), 1.0 - x, 0.1 * np.sin(3.0 * x)])
        J = self.size * np.array([[-20.0 * x, 10.0], [-1.0, 0.0], [0.3 * np.cos(3.0 * x), 0.0]])
        return SimpleNamespace(joined=lambda weight: (r, J[:, columns]), u=u)


@pytest.mark.parametrize("start", [(-1.2, 1.0), (-3.0, -3.5), (3.0, -4.0), (0.0, 0.0)])
def test_a_fit_goes_on_where_full_steps_fail(start):
    program = Valley(100.0)
    fit = Refitter(program).fit((), np.array(start), rounds=60)
    assert fit.u == pytest.approx([1.0, 1.0], abs=0.05)
    assert program.evaluations < 60
    assert program.tally[FITS] == 1


def test_what_is_left_out_in_turn_is_no_other_model():
    program = Valley(1.0)
    Refitter(program, np.ones(1)).fit(())
    assert program.tally[FITS] == 0


class Slanted(Valley):
    """Two numbers of which mainly the sum tells: from where they begin, both would leave their bounds."""

    def evaluate(self, u, columns, near=None):
        self.evaluations += 1
        A = np.array([[40.0, 40.4], [1.0, -1.0], [0.2, 0.1]])
        r = A @ (u - np.array([-8.0, 7.9]))
        return SimpleNamespace(joined=lambda weight: (r, A[:, columns]), u=u)


def test_a_step_to_the_bounds_is_the_best_within_them():
    program = Slanted(1.0)
    fit = Refitter(program).fit((), np.array([1.0, 1.0]))
    grid = np.linspace(-4.0, 4.0, 401)
    x, y = (column.ravel() for column in np.meshgrid(grid, grid))
    A, far = np.array([[40.0, 40.4], [1.0, -1.0], [0.2, 0.1]]), np.array([-8.0, 7.9])
    points = np.stack([x, y])
    values = 0.5 * np.sum((A @ (points - far[:, None])) ** 2, axis=0) + 0.5 * np.sum(points**2, axis=0)
    best = points[:, np.argmin(values)]
    assert fit.u == pytest.approx(best, abs=0.02)
    assert fit.objective <= values.min() + 0.1


def test_a_fit_of_few_steps_tells_how_much_lower_its_next_one_leads():
    """To second order, within the bounds; at the end of a fit it promises little more."""
    program = Valley(1.0)
    refitter = Refitter(program)
    begun = refitter.fit((), np.array([-1.2, 1.0]), rounds=0)
    r, J = begun.evaluation.joined(None)
    g, H = J.T @ r + begun.u, J.T @ J + np.eye(2)
    assert refitter.promised(begun) == pytest.approx(begun.objective - 0.5 * g @ np.linalg.solve(H, g))
    ended = refitter.fit((), np.array([-1.2, 1.0]), rounds=60)
    assert 0.0 <= ended.objective - refitter.promised(ended) < 0.5 < begun.objective - refitter.promised(begun)


def test_what_a_step_promises_is_told_where_numbers_are_open():
    """Two strengths of which the misfit shows the sum, and no prior says more: the second derivative is singular."""
    program = Valley(1.0)
    program.unknowns.items = tuple(SimpleNamespace(**{**vars(i), "effect": "e"}) for i in Unknowns.items)
    sums = np.full((3, 2), 1e3 / 3.0)
    program.evaluate = lambda u, columns, near=None: SimpleNamespace(joined=lambda weight: (sums @ u - 1e3, sums), u=u)
    refitter = Refitter(program)
    assert refitter.promised(refitter.fit((), np.zeros(2), rounds=0)) == pytest.approx(0.0, abs=1.0)
