"""Noise that nobody states is what named effects leave, and something unknown beside names that hold replaces none."""

from dataclasses import replace

import numpy as np
import pytest
from linear_world import CONSTANT, DELAY, SIGMA, World, smooth, tubes

from fitting.diagnose.fit.base_fit import base_fit, quieter_beside
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.explain import explain
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.unknown import Signs


def strong(**more):
    """A world whose effects leave slow misfit of many standard deviations."""
    world = tubes(effects=(CONSTANT, DELAY), **more)
    return replace(world, effects={slug: 15.0 * slope for slug, slope in world.effects.items()})


def size(program):
    """Median 1-sigma of the first recording, over the true one."""
    return float(np.median(program.bare[0][0].sigma)) / SIGMA


def test_slow_misfit_that_a_named_effect_explains_is_no_noise():
    """One command judged a tube by 0.19 mm and the other by 0.035 mm: the first took friction for noise."""
    world = strong(stated=False)
    measured = world.truth(np.random.default_rng(1), **{CONSTANT: 3.0})
    program, base = base_fit(world.program(measured))
    quieter = quieter_beside(program, Refitter(program).fit((CONSTANT,)))
    assert size(program) > 5.0 and size(quieter) == pytest.approx(1.0, abs=0.15)
    assert quieter_beside(program, base) is None  # nothing is named
    found = explain(world.program(measured), np.random.default_rng(2))
    assert found.final.slugs == (CONSTANT,) and size(found.program) == pytest.approx(1.0, abs=0.15)


def test_one_noisy_recording_hides_no_misfit_in_the_others():
    """An effect of 1.5 sd in three quiet recordings, beside one of five times the noise."""
    world, rng = tubes(effects=(CONSTANT, DELAY), stated=False), np.random.default_rng(3)
    measured = world.truth(rng, **{CONSTANT: 1.5})
    measured[0] += np.sqrt(24.0) * rng.standard_normal(60)
    found = explain(world.program(measured), rng)
    sizes = [float(np.median(row[0].sigma)) / SIGMA for row in found.program.bare]
    assert sizes == pytest.approx([5.0, 1.0, 1.0, 1.0], rel=0.3) and found.final.slugs == (CONSTANT,)


def test_fast_misfit_of_one_recording_is_no_noise_of_its_own():
    """Six rows for each wave, of 8 sd. It had passed for noise of that recording, and nothing was named."""
    world, rng = tubes(effects=(CONSTANT, DELAY), stated=False), np.random.default_rng(0)
    waves = np.zeros_like(world.effects[CONSTANT])
    waves[0, :, 0] = np.sqrt(2.0) * np.cos(20.0 * np.pi * np.linspace(0.0, 1.0, waves.shape[1]))
    world = World(world.base, world.effects | {CONSTANT: waves}, stated=False)
    assert explain(world.program(world.truth(rng, **{CONSTANT: 8.0})), rng).final.slugs == (CONSTANT,)


def test_a_stated_noise_stays():
    world = strong()
    program, _ = base_fit(world.program(world.truth(np.random.default_rng(1), **{CONSTANT: 3.0})))
    assert quieter_beside(program, Refitter(program).fit((CONSTANT,))) is None


def test_what_is_left_of_a_large_misfit_acts_beside_the_name_and_not_instead():
    """A stated noise had turned a right name into something unknown: the name left 4 % of a misfit of 300 variances."""
    world, rng = strong(), np.random.default_rng(4)
    over_time = np.repeat(smooth(rng, 1, 60, 1), 4, axis=0)
    nature = world.effects | {CONSTANT: world.effects[CONSTANT] + 0.2 * 15.0 * over_time}
    measured = World(world.base, nature).truth(rng, **{CONSTANT: 3.0})
    conclusion = conclude(explain(world.program(measured), rng))
    first, beside = conclusion.found
    assert conclusion.signs.only_beside and conclusion.signs.beside > 5.0
    assert (first.slug, beside.slug) == (CONSTANT, "unmodelled") and conclusion.unknown <= DEFAULT.probability.beside
    assert conclusion.unknown <= beside.probability <= DEFAULT.probability.doubtful


@pytest.mark.parametrize(("kept", "outdone", "beside"), [(0.04, 0.0, True), (0.1, 0.0, False), (0.04, 0.3, False)])
def test_names_that_leave_much_or_that_a_function_outdoes_may_be_replaced(kept, outdone, beside):
    assert Signs(kept, outdone, 40.0).only_beside is beside
