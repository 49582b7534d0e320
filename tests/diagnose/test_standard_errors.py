"""Standard errors of found strengths and constants beside misfit that is left: they hold the truth."""

from dataclasses import replace

import numpy as np
import pytest
from linear_world import CONSTANT, smooth, tubes

from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.fit.standard_errors import standard_errors, widening
from fitting.diagnose.search.explain import explain
from fitting.diagnose.verdict.conclude import conclude
from fitting.inference.noise import correlation_time, swing_time
from fitting.report.diagnosis.model import model_of
from fitting.report.diagnosis.payload import content

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
    item, told = program.unknowns.items[k], standard_errors(program, fit)
    assert told[k] > 2.0 * fit.sd(k)
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
