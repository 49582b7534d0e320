"""Levenberg's steps of a diagnosis, on a valley that bends: where a full step makes a fit thousands of times worse."""

from dataclasses import replace

import numpy as np
import pytest
from linear_world import ANOTHER, SIGMA, World, tubes

from fitting.diagnose.evaluate.evaluation import Raw
from fitting.diagnose.fit.candidates import from_elsewhere
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.settings import DEFAULT
from fitting.inference.parallel import FITS, RUNS

STEPS = DEFAULT.candidates.first_steps + DEFAULT.candidates.second_steps


class Curved(World):
    """A world of two base constants and a few measured values, whose misfit and derivatives a function gives."""

    def __init__(self, misfit, derivative):
        super().__init__(np.zeros((1, len(misfit(np.zeros(2))), 2)))
        object.__setattr__(self, "misfit", misfit)
        object.__setattr__(self, "derivative", derivative)

    def run(self, u, columns, stacked, chosen=None):
        r, J = self.misfit(u[:2]), self.derivative(u[:2])
        full = np.concatenate([J, np.zeros((len(r), len(u) - 2))], axis=1)
        slopes = np.moveaxis(SIGMA * full[None][:, :, columns], 2, 0)
        return Raw(stacked, {"length": SIGMA * r[None]}, {"length": slopes}, {"length": slopes[:0]}, self.drivers)

    def campaign(self):
        return self.program(np.zeros(self.base.shape[:2]))


def valley(size):
    """Rosenbrock's function, `size` times."""
    return Curved(
        lambda u: size * np.array([10.0 * (u[1] - u[0] ** 2), 1.0 - u[0], 0.1 * np.sin(3.0 * u[0])]),
        lambda u: size * np.array([[-20.0 * u[0], 10.0], [-1.0, 0.0], [0.3 * np.cos(3.0 * u[0]), 0.0]]),
    ).campaign()


def slanted(A, far):
    """A linear misfit that is zero at a place."""
    return Curved(lambda u: A @ (u - far), lambda u: A).campaign()


@pytest.mark.parametrize("start", [(-1.2, 1.0), (-3.0, -3.5), (3.0, -4.0), (0.0, 0.0)])
def test_a_fit_goes_on_where_full_steps_fail(start):
    program = valley(100.0)
    fit = Refitter(program).fit((), np.array(start), rounds=60)
    assert fit.u == pytest.approx([1.0, 1.0], abs=0.05)
    assert program.tally[RUNS] < 60
    assert program.tally[FITS] == 1


def test_what_is_left_out_in_turn_is_no_other_model():
    program = valley(1.0)
    Refitter(program, np.ones(1)).fit(())
    assert program.tally[FITS] == 0


def test_a_step_to_the_bounds_is_the_best_within_them():
    """Two numbers of which mainly the sum tells: from where they begin, both would leave their bounds."""
    A, far = np.array([[40.0, 40.4], [1.0, -1.0], [0.2, 0.1]]), np.array([-8.0, 7.9])
    program = slanted(A, far)
    fit = Refitter(program).fit((), np.array([1.0, 1.0]))
    grid = np.linspace(-4.0, 4.0, 401)
    x, y = (column.ravel() for column in np.meshgrid(grid, grid))
    points = np.stack([x, y])
    values = 0.5 * np.sum((A @ (points - far[:, None])) ** 2, axis=0) + 0.5 * np.sum(points**2, axis=0)
    best = points[:, np.argmin(values)]
    assert fit.u == pytest.approx(best, abs=0.02)
    assert fit.objective <= values.min() + 0.1


def test_a_fit_of_few_steps_tells_how_much_lower_its_next_one_leads():
    """To second order, within the bounds; at the end of a fit it promises little more."""
    program = valley(1.0)
    refitter = Refitter(program)
    begun = refitter.fit((), np.array([-1.2, 1.0]), rounds=0)
    r, J = begun.evaluation.joined(np.ones(1))
    g, H = J.T @ r + begun.u, J.T @ J + np.eye(2)
    assert refitter.promised(begun) == pytest.approx(begun.objective - 0.5 * g @ np.linalg.solve(H, g))
    ended = refitter.fit((), np.array([-1.2, 1.0]), rounds=60)
    assert 0.0 <= ended.objective - refitter.promised(ended) < 0.5 < begun.objective - refitter.promised(begun)


def test_what_a_step_promises_is_told_where_numbers_are_open():
    """Two strengths of which the misfit shows the sum, and no prior says more: the second derivative is singular."""
    world = World(np.zeros((1, 3, 1)), {ANOTHER: np.full((1, 3, 2), 1e3 / 3.0)})
    refitter = Refitter(world.program(np.full((1, 3), 1e3)))
    assert refitter.promised(refitter.fit((ANOTHER,), None, rounds=0)) == pytest.approx(0.0, abs=1.0)


def two_valleys():
    """A misfit with a deep minimum at 1 and a shallow one near -1, from whose far side many steps lead."""
    return Curved(
        lambda u: 3.0 * np.tile([u[0] ** 2 - 1.0, 0.2 * (u[0] - 1.0), u[1] ** 3], 100),
        lambda u: 3.0 * np.tile([[2.0 * u[0], 0.0], [0.2, 0.0], [0.0, 3.0 * u[1] ** 2]], (100, 1)),
    ).campaign()


def test_a_fit_from_elsewhere_goes_on_where_it_promises_a_better_end():
    """It has not arrived after its first steps."""
    program = two_valleys()
    shallow = Refitter(program).fit((), np.array([-1.5, 0.0]))
    assert shallow.u[0] == pytest.approx(-1.0, abs=0.05)
    begun = Refitter(program).fit((), np.array([3.9, 3.9]), STEPS)
    assert abs(begun.u[1]) > 0.3
    before = program.tally[FITS]
    found = from_elsewhere(program, shallow, np.array([3.9, 3.9]))
    assert program.tally[FITS] - before == 2
    assert found.u[0] == pytest.approx(1.0, abs=1e-3)
    assert abs(found.u[1]) < 0.8 * abs(begun.u[1])


def test_a_fit_from_elsewhere_ends_early_where_it_promises_no_more():
    program = two_valleys()
    deep = Refitter(program).fit((), np.array([1.5, 0.0]))
    before = program.tally[FITS]
    assert from_elsewhere(program, deep, np.array([-3.5, 1.0])) is deep
    assert program.tally[FITS] - before == 1


def test_a_fit_runs_recordings_that_do_not_count_at_its_end_alone():
    """The world gives them numbers of no meaning where nobody asks for them."""
    world = tubes(roles=("fit", "fit", "validation", "fit"))
    truth = world.truth(np.random.default_rng(0), (0.5, -0.3), **{ANOTHER: (0.8, -0.6)})
    program = world.program(truth)
    fit = Refitter(program).fit((ANOTHER,))
    whole = program.evaluate(fit.u, fit.free)
    for k in range(4):
        np.testing.assert_allclose(fit.evaluation.misfit[k], whole.misfit[k], atol=1e-9)
        np.testing.assert_allclose(fit.evaluation.jacobian[k], whole.jacobian[k], atol=1e-9)
    part = program.evaluate(fit.u, fit.free, chosen=program.fitted)
    assert not np.any(part.misfit[2])
    assert np.any(whole.misfit[2])
    np.testing.assert_allclose(part.misfit[3], whole.misfit[3], atol=1e-9)


def test_a_fit_goes_on_without_computing_again_where_another_ended():
    """Of the same model and recordings; a program with other noise has another misfit."""
    program = valley(1.0)
    refitter = Refitter(program)
    begun = refitter.fit((), np.array([-1.2, 1.0]), rounds=3)
    before = program.tally[RUNS]
    again = refitter.fit((), begun, rounds=0)
    assert program.tally[RUNS] == before
    assert again.objective == begun.objective and again.evaluation is begun.evaluation
    noisier = replace(program, channels=[[replace(c, sigma=2.0 * c.sigma) for c in one] for one in program.channels])
    other = Refitter(noisier).fit((), begun, rounds=0)
    assert program.tally[RUNS] == before + 1
    np.testing.assert_allclose(other.evaluation.misfit[0], 0.5 * begun.evaluation.misfit[0])
    assert np.all(np.isfinite(Refitter(program).fit((), other, rounds=0).evaluation.misfit[0]))
    assert program.tally[RUNS] == before + 2


def test_only_what_is_left_out_is_predicted_beside_a_partial_fit():
    """Of three recordings one is left out; the one for validation is not asked for."""
    J = np.random.default_rng(2).normal(size=(3, 20, 2))
    program = World(J, roles=("fit", "fit", "validation")).program(np.ones((3, 20)))
    whole = Refitter(program).fit(())
    assert whole.evaluation.asked.tolist() == [True, True, True]
    size = len(whole.evaluation.misfit[0])
    part = Refitter(program, [np.ones(size), np.zeros(size), np.zeros(size)]).fit((), whole)
    assert part.evaluation.asked.tolist() == [True, True, False]
    assert np.any(part.evaluation.misfit[1] != whole.evaluation.misfit[1])
    with pytest.raises(ValueError, match=r"recordings \[2\] were not evaluated"):
        part.evaluation.chi2(np.ones(3))
    with pytest.raises(ValueError, match="not evaluated"):
        part.evaluation.joined(np.ones(3))


def test_an_evaluation_takes_the_place_of_another_only_where_nothing_has_changed():
    J = np.random.default_rng(2).normal(size=(3, 20, 2))
    program = World(J, roles=("fit", "fit", "validation")).program(np.ones((3, 20)))
    fit = Refitter(program).fit(())
    here, u, free, all_of_them = fit.evaluation, fit.u, fit.free, np.ones(3, bool)
    assert program.holds(here, u, free, all_of_them)
    for changed in (
        replace(program, process_noise=program.process_noise.copy()),
        replace(program, stacked=replace(program.stacked)),
        replace(program, channels=[list(one) for one in program.channels]),
        replace(program, failed=99.0),
    ):
        assert not changed.holds(here, u, free, all_of_them)
    assert not program.holds(here, u + 1e-9, free, all_of_them)
    assert not program.holds(here, u, free[:1], all_of_them)
    part = program.evaluate(u, free, chosen=np.array([True, False, True]))
    assert program.holds(part, u, free, np.array([True, False, True]))
    assert not program.holds(part, u, free, all_of_them)
    assert not program.holds(program.evaluate(u, free, stacked=program.stacked), u, free, all_of_them)
