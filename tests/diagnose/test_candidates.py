"""Which candidates are fitted to the end: the best so far, what the screen ranks first, what promises most; what is said of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, SWELLING, tubes

from fitting.diagnose.check import answers
from fitting.diagnose.fit import candidates
from fitting.diagnose.fit.candidates import candidate_fits
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.explain import explain
from fitting.diagnose.search.set_search import scored
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.conclude import conclude

SLUGS = tuple(f"quick_{k}" for k in range(9))


class Fits:
    """Every candidate ends at once, but `slow`, whose first steps hardly lead anywhere."""

    def __init__(self, promises):
        self.promises, self.ended = promises, set()

    def fit(self, slugs, start, rounds=0, near=None, complete=True):
        slug = slugs[-1]
        if rounds == DEFAULT.optimiser.maximum_steps:
            self.ended.add(slug)
        slow = 295.0 if rounds < DEFAULT.optimiser.maximum_steps else 100.0
        objective = slow if slug == "slow" else 200.0 + 10.0 * SLUGS.index(slug)
        return SimpleNamespace(slugs=slugs, objective=objective, u=np.zeros(1), evaluation=None, at_bound=())

    def completed(self, fit):
        return fit

    def variance(self, objective):
        return 1.0

    def promised(self, fit):
        return self.promises.get(fit.slugs[-1], fit.objective)


def _score(slug, p_value=0.001, gain=100.0):
    return SimpleNamespace(slug=slug, p_value=p_value, gain=gain, start=np.zeros(1))


def _directions(monkeypatch, fits, screen, values=1):
    """Trials of a campaign of so many values; the base model's objective is 300."""
    monkeypatch.setattr(candidates, "Refitter", lambda program: fits)
    monkeypatch.setattr(candidates, "about_nominal", lambda refitter, fit, found: found.about_nominal)
    monkeypatch.setattr(candidates, "weigh", lambda program, current, found: None)
    monkeypatch.setattr(candidates, "starts_of", lambda unknowns, added, at: (np.zeros(1), np.zeros(1)))
    unknowns = SimpleNamespace(base=np.zeros(0, int))
    program = SimpleNamespace(unknowns=unknowns, hidden=True, fitted=None, observations=lambda mask: values)
    current = SimpleNamespace(slugs=(), objective=300.0, u=np.zeros(1), evaluation=None)
    return candidate_fits(program, current, screen, lambda _: None, 1)


@pytest.mark.parametrize(("promise", "first"), [(150.0, True), (215.0, True), (225.0, False)])
def test_a_candidate_stays_whose_next_step_promises_more_than_others_have(monkeypatch, promise, first):
    """The third of those that are fitted to the end is at 220."""
    fits = Fits({"slow": promise})
    screen = SimpleNamespace(scores=[_score(s) for s in (*SLUGS, "slow")], about_nominal=())
    found = _directions(monkeypatch, fits, screen)
    assert fits.ended == {"quick_0", "quick_1", "quick_2"} | ({"slow"} if first else set())
    assert (found[0].slug == "slow") is first and len(found) == 10


def test_a_candidate_is_fitted_that_scores_about_nominal_constants_alone(monkeypatch):
    """Where the base model ended, `slow` seems to act the wrong way and has no score."""
    about = (_score("quick_0"), _score("slow", gain=40.0), _score("by_chance", 0.2), _score("quick_8", gain=15.0))
    screen = SimpleNamespace(scores=[_score(s) for s in SLUGS[:4]], about_nominal=about)
    found = _directions(monkeypatch, Fits({}), screen)
    assert {candidate.slug for candidate in found} == {*SLUGS[:4], "slow"}


@pytest.mark.parametrize(("values", "ended"), [(100, {"quick_0", "quick_1", "quick_2"}), (320, {"quick_0", "quick_2"})])
def test_beside_one_that_leaves_noise_none_is_fitted_on_that_promises_far_more(monkeypatch, values, ended):
    """The best is at 200: reduced chi-square 4 of a hundred values, 1.25 of 320."""
    fits = Fits({"quick_1": 601.0, "quick_2": 599.0})
    screen = SimpleNamespace(scores=[_score(s) for s in SLUGS], about_nominal=())
    found = _directions(monkeypatch, fits, screen, values)
    assert fits.ended == ended and len(found) == 9


def test_recordings_for_validation_run_where_fits_have_ended():
    """A fit that goes on leaves them; each set that is handed on has them, as a fit of its own would."""
    rng = np.random.default_rng(4)
    world = tubes(roles=("fit", "fit", "fit", "validation"))
    program = world.program(world.truth(rng, [0.4, -0.3], **{CONSTANT: 8.0}))
    refitter = Refitter(program)
    part = refitter.fit((CONSTANT,), complete=False)
    np.testing.assert_array_equal(part.evaluation.asked, [True, True, True, False])
    with pytest.raises(ValueError, match="not evaluated"):
        part.evaluation.chi2(program.unseen.astype(float))
    whole = refitter.fit((CONSTANT,))
    for fit in (whole, refitter.completed(part)):
        np.testing.assert_allclose(fit.u, whole.u)
        np.testing.assert_allclose(fit.evaluation.misfit[3], whole.evaluation.misfit[3])
    base = refitter.fit(())
    handed_on = candidate_fits(program, base, scored(program, base, rng), lambda _: None, 1)
    assert handed_on
    assert all(candidate.fit.evaluation.asked.all() for candidate in handed_on)


def test_what_is_said_of_an_effect_that_was_asked_for():
    """One was found, one was tried, one has no score, one has no sensitivity, one is no candidate."""
    rng = np.random.default_rng(3)
    world = tubes(effects=(CONSTANT, ANOTHER, DELAY, SWELLING), rows=80)
    world.effects[DELAY][:] = 0.0
    world.effects[SWELLING][:] = rng.standard_normal(world.effects[SWELLING].shape)
    shared = world.effects[CONSTANT] + 0.3 * world.effects[ANOTHER][:, :, :1]
    world.effects[ANOTHER][:, :, :1] = shared
    conclusion = conclude(explain(world.program(world.truth(rng, **{CONSTANT: 1.5})), rng))
    slugs = (CONSTANT, ANOTHER, SWELLING, DELAY, "gravity")
    said = [entry["text"] for entry in answers(slugs, conclusion)]
    for text, part in zip(said, ("was found", "was tried", "did not stand out", "cannot be tested", "part of the model"), strict=True):
        assert part in text
