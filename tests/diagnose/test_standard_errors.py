"""Standard errors of found strengths and constants beside misfit that is left: they hold the truth."""

from dataclasses import replace

import numpy as np
import pytest
from linear_world import CONSTANT, smooth, tubes

from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.fit.standard_errors import standard_errors, widening
from fitting.diagnose.search.explain import explain
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.discrepancy_evidence import best_discrepancy
from fitting.inference.serial_correlation import correlation_time, swing_time
from fitting.report.diagnosis.model import model_of
from fitting.report.diagnosis.payload import content
from fitting.report.diagnosis.tables import effect_table

WORLDS = 40


def distances(hidden: float) -> np.ndarray:
    """Distance of a constant and a strength from the truth, (worlds, 2 numbers, 2), in errors of the fit and in those told.

    Args:
        hidden: size of a slow misfit that no number explains, in standard deviations of the noise.
    """
    found = []
    for seed in range(WORLDS):
        world, rng = tubes(effects=(CONSTANT,), constants=1, seed=seed), np.random.default_rng(seed + 1000)
        misfit = hidden * smooth(rng, 4, 60, 1)[..., 0]
        program = world.program(world.truth(rng, base=(0.5,), **{CONSTANT: 0.7}) + misfit)
        fit = Refitter(program).fit((CONSTANT,))
        told = standard_errors(program, fit)
        found.append([[abs(fit.u[k] - true) / sd for sd in (fit.sd(k), told[k])] for k, true in ((0, 0.5), (1, 0.7))])
    return np.array(found)


def test_errors_of_a_model_that_leaves_noise_are_those_of_the_fit():
    own, told = np.moveaxis(distances(0.0), 2, 0)
    assert np.median(own / told) == pytest.approx(1.0, abs=0.1)


def test_errors_beside_slow_misfit_hold_the_truth():
    own, told = np.moveaxis(distances(6.0), 2, 0)
    assert np.mean(own < 3.0) < 0.3  # the misfit is no noise
    assert np.mean(told < 3.0) > 0.85 and np.sqrt(np.mean(told**2)) > 0.5  # and they are no wider than need be


def wrong_in_form(size: float) -> np.ndarray:
    """Distances of `distances` beside a smooth function of the driver, which the model lacks; without and with its shift."""
    found = []
    for seed in range(WORLDS):
        world, rng = tubes(effects=(CONSTANT,), constants=1, seed=seed), np.random.default_rng(seed + 1000)
        along = world.drivers["pressure"] / 1e3
        wrong = sum(0.5 * rng.standard_normal() * np.cos(np.pi * k * along) for k in range(1, 6))
        program = world.program(world.truth(rng, base=(0.5,), **{CONSTANT: 0.7}) + size * wrong)
        fit = Refitter(program).fit((CONSTANT,))
        beside = best_discrepancy(program, fit)
        assert (beside.bayes > DEFAULT.evidence.minimum_first) is (size > 0.0)
        moved = beside.moved if size else None
        told = [standard_errors(program, fit, one) for one in (None, moved)]
        found.append([[abs(fit.u[k] - true) / errors[k] for errors in told] for k, true in ((0, 0.5), (1, 0.7))])
    return np.array(found)


def test_errors_beside_a_form_that_is_wrong_count_how_far_it_moves_the_numbers():
    """A tube's law was wrong below 2 % of strain, and an offset of the pressure was 4.6 of its errors off."""
    before, told = np.moveaxis(wrong_in_form(20.0), 2, 0)
    assert np.mean(before < 3.0) < 0.95
    assert np.mean(told < 3.0) > 0.97 and np.sqrt(np.mean(told**2)) > 0.4  # and they are no wider than need be


def test_nothing_moves_numbers_of_a_form_that_is_right():
    before, told = np.moveaxis(wrong_in_form(0.0), 2, 0)
    assert np.all(before == told)


def test_misfit_widens_no_tolerance():
    world, rng = tubes(effects=(CONSTANT,), constants=1), np.random.default_rng(3)
    fit = Refitter(program := world.program(world.truth(rng) + 1e3 * smooth(rng, 4, 60, 1)[..., 0])).fit((CONSTANT,))
    assert widening(program, fit.evaluation) > 1e3
    assert standard_errors(program, fit)[0] <= 1.0


def test_a_number_that_was_not_free_has_no_error():
    world = tubes(effects=(CONSTANT,))
    program = world.program(world.truth(np.random.default_rng(3)))
    assert standard_errors(program, Refitter(program).fit(()))[-1] == 0.0


def test_an_output_without_a_reading_that_counts_widens_nothing():
    world = tubes(effects=(CONSTANT,))
    program = world.program(world.truth(np.random.default_rng(3)))
    (one,), nothing = program.channels[1], np.full(60, np.inf)
    channels = [*program.channels[:1], [replace(one, sigma=nothing)], *program.channels[2:]]
    program = replace(program, channels=channels, bare=channels)
    fit = Refitter(program).fit((CONSTANT,))
    assert np.all(np.isfinite(standard_errors(program, fit))) and 1.0 <= widening(program, fit.evaluation) < 1.5


def test_report_and_augmented_model_tell_the_same_errors():
    world, rng = tubes(effects=(CONSTANT,)), np.random.default_rng(5)
    program = world.program(world.truth(rng, base=(0.5,), **{CONSTANT: 3.0}) + 1.5 * smooth(rng, 4, 60, 1)[..., 0])
    conclusion = conclude(explain(program, np.random.default_rng(1), lambda _: None))
    (effect, *_) = [f for f in conclusion.found if f.slug == CONSTANT]
    program, fit = conclusion.model
    (k,) = program.unknowns.of([CONSTANT])
    item, told = program.unknowns.items[k], standard_errors(program, fit, conclusion.moving.moved)
    assert told[k] > standard_errors(program, fit)[k] > 2.0 * fit.sd(k)
    note = effect_table(conclusion, effect).note
    assert "how far each number moves" in note and "log Bayes factor" in note
    sd = effect.parameters[item.name]["sd"]
    assert sd == pytest.approx(item.spread(fit.u[k], told[k]))
    (added,) = [one for one in model_of(conclusion, "test").added if one.slug == CONSTANT]
    assert added.parameters[item.name].prior.sd == pytest.approx(sd)
    base = content(conclusion)["base_parameters"]["constant_0"]["sd"]
    assert base == pytest.approx(program.unknowns.items[0].spread(fit.u[0], told[0]))


def test_a_misfit_that_swings_counts_once_in_a_swing():
    swings = [np.sin(np.linspace(0.0, 8.0 * np.pi, 240))] * 3
    assert correlation_time(swings) < 8.0 and swing_time(swings) > 40.0
    white = list(np.random.default_rng(2).standard_normal((4, 300)))
    assert swing_time(white) == pytest.approx(1.0, abs=0.05)
