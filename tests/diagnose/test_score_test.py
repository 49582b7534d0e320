"""The score of an effect is what the linearised model with it gains, priors and latent trajectories counted."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from linear_world import CONSTANT, SWELLING, tubes

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.evaluate.unknowns import Unknowns
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.fit.score_test import (
    Score,
    _interleaved,
    _whole_effects,
    about_nominal,
    score_effects,
)
from fitting.diagnose.fit.sensitivities import Projector, constants_at_bound
from fitting.diagnose.settings import DEFAULT
from fitting.inference.parameters import Parameters

EXAMPLE = Path(__file__).parents[2] / "calibration_data" / "examples" / "actuator"
SLUGS = ["radial_expansion", "wall_eccentricity", "inactive_coils"]


@pytest.fixture(scope="module")
def refitted():
    """The shipped campaign of an actuator, whose springs have latent trajectories, and its base model."""
    program, base = base_fit(Program.of(read_campaign(EXAMPLE), "actuator", SLUGS))
    return program, base, score_effects(Refitter(program), base, SLUGS, np.random.default_rng(1))


def left_to_first_order(program, fit, columns):
    """Smallest chi-square, with that of the priors, that these unknowns allow near a fit."""
    refitter = Refitter(program)
    here = program.evaluate(fit.u, columns, near=fit.evaluation)
    r, J = here.joined(refitter.weight)
    departure, sd = refitter._prior(fit.u, columns)
    rows = np.concatenate([r, np.where(np.isfinite(sd), departure / sd, 0.0)])
    slopes = np.concatenate([J, np.diag(1.0 / sd)])
    step = np.linalg.lstsq(slopes, -rows, rcond=None)[0]
    return float(np.sum((rows + slopes @ step) ** 2)), step[-1]


@pytest.mark.slow
@pytest.mark.parametrize("slug", SLUGS)
def test_a_score_is_what_the_effect_would_gain_with_all_constants_free(refitted, slug):
    program, base, found = refitted
    own = program.unknowns.amplitudes(slug)
    without, _ = left_to_first_order(program, base, base.free)
    with_it, step = left_to_first_order(program, base, np.concatenate([base.free, own]))
    score = next((score for score in found.scores if score.slug == slug), None)
    if score is None:  # it would have to be negative
        assert step < 0.0 <= program.unknowns.low[own[0]]
        return
    assert score.gain * found.scale**2 == pytest.approx(without - with_it, rel=0.02, abs=0.05)


@pytest.mark.slow
def test_effects_are_scored_about_nominal_where_constants_went_far(refitted):
    """There by their slopes, as those of a fit that ended at nominal, and by what they do as a whole."""
    program, base, found = refitted
    assert np.max(np.abs(base.u[program.unknowns.base])) < DEFAULT.chance.deviations and not about_nominal(Refitter(program), base, found)
    refitter, far = Refitter(program), base.u.copy()
    far[program.unknowns.base[0]] = -1.1 * DEFAULT.chance.deviations
    astray = dataclasses.replace(base, u=far)
    told = about_nominal(refitter, astray, score_effects(refitter, astray, SLUGS, np.random.default_rng(1)))
    nominal = dataclasses.replace(base, u=program.unknowns.neutral)
    there = {s.slug: s for s in score_effects(refitter, nominal, SLUGS, np.random.default_rng(1)).scores}
    by_slope = [s for s in told if np.isfinite(s.strength)]
    assert by_slope[0].slug == next(iter(there)) == told[0].slug
    assert all(s.gain == pytest.approx(there[s.slug].gain, rel=0.05) for s in by_slope)
    assert len({s.slug for s in told}) == len(told)
    assert not any(np.any(s.start[program.unknowns.base]) for s in told)


def linear():
    """A campaign of tubes, linear in all numbers, of which two effects are true."""
    world = tubes()
    program = world.program(world.truth(np.random.default_rng(1), **{CONSTANT: 2.0, SWELLING: 1.0}))
    return program, Refitter(program).fit(()), tuple(world.effects)


def actuator(request):
    program, base, _ = request.getfixturevalue("refitted")
    return program, base, SLUGS


@pytest.mark.parametrize("campaign", ["linear", pytest.param("actuator", marks=pytest.mark.slow)])
def test_an_effect_that_is_put_in_gains_what_it_takes_away(campaign, request):
    program, base, slugs = linear() if campaign == "linear" else actuator(request)
    refitter = Refitter(program)
    nominal = dataclasses.replace(base, u=program.unknowns.neutral)
    scores, everything = _whole_effects(refitter, nominal, slugs, 2.0), program.fitted.astype(float)
    square = lambda u: program.evaluate(u, base.free[:0], near=base.evaluation).chi2(everything)  # noqa: E731
    assert scores and [s.gain for s in scores] == sorted((s.gain for s in scores), reverse=True)
    for score in scores:
        assert 4.0 * score.gain == pytest.approx(square(nominal.u) - square(score.start), rel=1e-6)
        other = np.setdiff1d(np.arange(len(score.start)), program.unknowns.amplitudes(score.slug))
        assert np.all(score.start[other] == nominal.u[other])


def test_lists_of_scores_are_gone_through_in_turn():
    a, b, c = (Score(name, 1.0, 1, 0.5, np.zeros(1), 1.0) for name in "abc")
    assert [s.slug for s in _interleaved([a, b], [b, a, c])] == ["a", "b", "c"]


def test_numbers_that_recordings_do_not_tell_apart_are_freed_once():
    """A strength without effect and two alike, all of flat priors, of large and of small size."""
    rng = np.random.default_rng(0)
    column = 1e6 * rng.standard_normal((30, 1))
    project = Projector(np.concatenate([column, 0.0 * column, 2.0 * column], axis=1), np.full(3, np.inf))
    other = rng.standard_normal((30, 1))
    freed = project(np.concatenate([column, other], axis=1))[:30]
    np.testing.assert_allclose(freed[:, 0], 0.0, atol=1e-6)
    q = column / np.linalg.norm(column)
    np.testing.assert_allclose(freed[:, 1:], other - q * (q.T @ other), atol=1e-12)


def test_base_constants_at_a_bound_absorb_nothing():
    world = tubes(constants=3)
    program = world.program(world.truth(None))
    unknowns, fit = program.unknowns, Refitter(program).fit(())
    u = fit.u.copy()
    u[:3] = unknowns.low[0], 0.7, unknowns.high[2]
    assert list(constants_at_bound(unknowns, dataclasses.replace(fit, u=u))) == [0, 2]


def test_an_effect_is_present_where_it_acts_or_is_asked_for():
    unknowns = Unknowns(Parameters(), ["mullins_softening", "viscoelastic_relaxation", "permanent_set"], "E")
    u = unknowns.neutral.copy()
    assert not unknowns.present(u).any()
    shapes = unknowns.shapes("mullins_softening")
    u[shapes] += 0.3
    assert not unknowns.present(u).any()  # shapes of what is absent change nothing
    assert unknowns.present(u, shapes[:1]).tolist() == [True, False, False]
    u[unknowns.amplitudes("permanent_set")[0]] = 0.1
    assert unknowns.present(u).tolist() == [False, False, True]
