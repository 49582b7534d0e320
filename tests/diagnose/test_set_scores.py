"""Sets of effects are scored from one Gram matrix as closed forms say: what they leave, their price, their bounds."""

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, SWELLING, World, fast, tubes
from scipy.special import comb

from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.evidence import log_sets
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.fit.score_test import simulated
from fitting.diagnose.fit.sensitivities import sensitivities_about
from fitting.diagnose.fit.set_scores import Gram, best_sets

SLUGS = (CONSTANT, ANOTHER, DELAY, SWELLING)


def scored(world, measured, most=20):
    program, base = base_fit(world.program(measured))
    look = sensitivities_about(Refitter(program), base, program.unknowns.slugs)
    return program, base, look, best_sets(look, program, program.unknowns.neutral, most)


def test_what_a_set_promises_is_what_its_fit_leaves():
    """Every pair and the triples that extend them, strengths of one sign and those of two together."""
    rng = np.random.default_rng(3)
    world = tubes()
    y = world.truth(rng, (0.5, -0.3), **{CONSTANT: 1.0, DELAY: 1.5})
    program, base, _, found = scored(world, y)
    assert {frozenset(s.slugs) for s in found if len(s.slugs) == 2} >= {frozenset((CONSTANT, DELAY))}
    assert any(len(s.slugs) == 3 for s in found)
    checked = 0
    for score in found:
        fit = Refitter(program).fit(score.slugs, score.start)
        own = program.unknowns.of(score.slugs)
        if np.all(np.abs(fit.u[own]) > 1e-3):  # inside its bounds, where the linear world is exact
            assert score.promised == pytest.approx(fit.objective, abs=0.2)
            checked += 1
    assert checked >= 3


def test_the_true_pair_leads_although_its_members_hide_each_other():
    """Two sensitivities that nearly cancel: alone each explains a hundredth of what both explain together."""
    world = masked()
    y = world.truth(np.random.default_rng(4), **{CONSTANT: 4.0, DELAY: 4.0})
    program, _, look, found = scored(world, y)
    assert set(found[0].slugs) == {CONSTANT, DELAY}
    gram = Gram(look, program.unknowns)
    alone = gram.solve(np.arange(len(gram.blocks))[:, None])[1]
    nothing = 0.5 * look.scale**2 * float(look.left @ look.left)
    place = {block.slug: k for k, block in enumerate(gram.blocks)}
    for slug in (CONSTANT, DELAY):
        assert nothing - alone[place[slug]] < 0.1 * (nothing - found[0].promised)


def masked(rows=60):
    """A world in which the sum of two sensitivities is a tenth of each, in a direction of its own."""
    rng = np.random.default_rng(0)
    base = fast(rows=rows)
    v, w, other = (rng.standard_normal((4, rows, 1)) for _ in range(3))
    return World(base.base, {CONSTANT: 5.0 * v, DELAY: -5.0 * v + 0.5 * w, SWELLING: other})


def test_a_strength_that_would_have_the_wrong_sign_is_left_out():
    """Neither a delay nor swelling is negative: a pair with one that would be explains nothing."""
    rng = np.random.default_rng(5)
    world = fast(effects=(CONSTANT, DELAY, SWELLING))
    y = world.truth(rng, **{CONSTANT: 2.0, SWELLING: -3.0})
    program, _, look, _ = scored(world, y)
    gram = Gram(look, program.unknowns)
    place = {block.slug: k for k, block in enumerate(gram.blocks)}
    strengths, left, _ = gram.solve(np.array([[place[CONSTANT], place[SWELLING]]]))
    assert strengths[0, 1, 0] == 0.0
    assert left[0] == pytest.approx(0.5 * look.scale**2 * float(look.left @ look.left))


def test_a_strength_ends_at_its_bound():
    world = fast(effects=(CONSTANT, DELAY))
    y = world.truth(None, **{CONSTANT: 40.0, DELAY: 1.0})
    program, _, look, _ = scored(world, y)
    gram = Gram(look, program.unknowns)
    strengths, _, _ = gram.solve(np.array([[0, 1]]))
    own = program.unknowns.of([gram.blocks[0].slug])
    assert strengths[0, 0, 0] == pytest.approx(program.unknowns.high[own[0]])


@pytest.mark.parametrize(("effects", "size"), [(25, 1), (25, 2), (25, 3), (9, 2)])
def test_the_price_of_a_set_is_the_number_of_sets_of_its_size(effects, size):
    assert log_sets(effects, size) == pytest.approx(np.log(comb(effects, size)))


def test_a_set_costs_its_misfit_its_priors_and_its_price():
    rng = np.random.default_rng(6)
    world = fast(effects=(CONSTANT, DELAY))
    program, _, look, found = scored(world, world.truth(rng, **{CONSTANT: 1.0, DELAY: 2.0}))
    (score,) = found
    gram = Gram(look, program.unknowns)
    own = program.unknowns.of([b.slug for b in gram.blocks])
    P = np.concatenate([b.columns for b in gram.blocks], axis=1)
    variances = (program.unknowns.high[own] - program.unknowns.low[own]) ** 2 / 12.0
    inflation = max(1.0, 2.0 * score.promised / program.observations(program.fitted))
    known = np.eye(2) + P.T @ P * variances / inflation
    expected = score.promised / inflation + 0.5 * np.linalg.slogdet(known)[1] + log_sets(2, 2)
    assert score.cost == pytest.approx(expected)


def test_products_with_simulated_errors_are_those_of_errors_drawn_row_by_row():
    """Directions that depend on each other, and rows that do not count."""
    rng = np.random.default_rng(0)
    X = rng.standard_normal((30, 4)) @ rng.standard_normal((4, 6))
    left = np.where(np.arange(30) < 25, 1.0, 0.0)
    drawn = np.concatenate([simulated(X, left, rng) for _ in range(40)], axis=1)
    expected = X[:25].T @ X[:25]
    assert np.allclose(np.cov(drawn), expected, atol=0.05 * np.abs(expected).max())
    assert np.abs(drawn.mean(axis=1)).max() < 0.05 * np.sqrt(np.abs(expected).max())


def test_products_of_a_short_direction_are_as_long_as_it():
    """Beside one that is 1e9 times as long."""
    rng = np.random.default_rng(2)
    X = rng.standard_normal((50, 3)) * np.array([1e6, 1.0, 1e-3])
    drawn = np.concatenate([simulated(X, np.ones(50), rng) for _ in range(10)], axis=1)
    assert np.std(drawn, axis=1) == pytest.approx(np.linalg.norm(X, axis=0), rel=0.05)
