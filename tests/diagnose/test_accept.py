"""Effects that predict worse what was not fitted are taken back; what is said of before and after follows from numbers."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.fit.evidence import evidence
from fitting.diagnose.fit.refit import absent
from fitting.diagnose.search.steps import Explanation, Named
from fitting.diagnose.verdict import accept, text
from fitting.diagnose.verdict.accept import accepted
from fitting.diagnose.verdict.text import verdict_sentences, went


@pytest.mark.parametrize(("before", "after", "said"), [
    (113.0, 359.0, "rises from a reduced chi-square of 113 to 359"),
    (359.0, 113.0, "falls from a reduced chi-square of 359 to 113"),
    (1.0, 1.004, "stays at a reduced chi-square of 1"),
    (1.0, 0.0, "falls from a reduced chi-square of 1 to 0"),
    (0.98, 1.02, "rises from a reduced chi-square of 0.98 to 1.02"),
    (2.0, 2.0, "stays at a reduced chi-square of 2"),
    (1e5, 1.2e5, "rises from a reduced chi-square of 1e+05 to 1.2e+05"),
])  # fmt: skip
def test_what_became_of_a_misfit_is_said_from_its_numbers(before, after, said):
    assert went(before, after) == said


@pytest.mark.parametrize("how", ["validation", "left out in turn", "within-recording"])
@pytest.mark.parametrize(("after", "word"), [(9.0, "rises"), (1.0, "falls"), (4.0, "stays")])
def test_the_verdict_says_the_same_of_every_kind_of_held_out_data(soft, how, after, word):
    scores = [dataclasses.replace(soft.before, how=how, reduced_chi2=x) for x in (4.0, after)]
    said = " ".join(verdict_sentences(dataclasses.replace(soft, before=scores[0], after=scores[1])))
    assert f" {word} " in said
    assert not [other for other in ("rises", "falls", "stays") if other != word and f" {other} " in said]


def explained(monkeypatch, chi2):
    """An explanation by effects whose every subset leaves so much of held-out data; fits are their slugs."""
    made = lambda slugs: SimpleNamespace(slugs=slugs, objective=100.0 - 10.0 * len(slugs) - ("b" in slugs))  # noqa: E731
    base = made(())
    explanation = Explanation(SimpleNamespace(), base, Named(made(("a", "b")), 1.0), [], 0.001, True)
    explanation.scores = SimpleNamespace(gained=lambda base, fit: 1.0)
    explanation.stood = lambda whole, fit, left, stages: Named(fit, left, {slug: None for slug in fit.slugs})
    monkeypatch.setattr(accept, "without", lambda program, fit, slug: made(tuple(s for s in fit.slugs if s != slug)))

    def held_out(x):
        left = chi2[x.final.slugs]
        return [SimpleNamespace(how="validation", reduced_chi2=value) for value in (chi2[()], left)]

    return accepted(explanation, SimpleNamespace(held_out=held_out))


def test_a_set_that_predicts_worse_is_taken_back_altogether(monkeypatch):
    found, said = explained(monkeypatch, {(): 113.0, ("a", "b"): 359.0, ("b",): 120.0})
    assert found.final.slugs == () and len(said) == 2
    assert "a and b would fit" in said[0] and "rises from a reduced chi-square of 113 to 359" in said[0]
    assert "with it the misfit of recordings kept for validation rises" in said[1]


def test_the_part_of_it_that_predicts_better_stays(monkeypatch):
    found, said = explained(monkeypatch, {(): 113.0, ("a", "b"): 359.0, ("b",): 90.0})
    assert found.final.slugs == ("b",) and list(found.named.standings) == ["b"] and len(said) == 1


@pytest.mark.parametrize("left", [113.0, 112.0, 1.0])
def test_a_set_that_predicts_no_worse_stays(monkeypatch, left):
    found, said = explained(monkeypatch, {(): 113.0, ("a", "b"): left})
    assert found.final.slugs == ("a", "b") and not said


def test_an_effect_at_its_neutral_value_has_no_evidence_whatever_its_fit_gains(soft, monkeypatch):
    explanation = soft.explanation
    program, base, fit = explanation.program, explanation.base, explanation.final
    (slug,) = fit.slugs
    assert evidence(program, base, fit, 1.0) > 100.0 and not absent(program.unknowns, fit, slug)
    u = fit.u.copy()
    own = program.unknowns.of([slug])
    u[own] = program.unknowns.neutral[own]
    nothing = dataclasses.replace(fit, u=u)  # the base's constants, and what they explain, as they are
    assert absent(program.unknowns, nothing, slug)
    assert evidence(program, base, nothing, 1.0) <= 0.0


def test_the_base_is_named_where_it_is_another_than_the_published_one(soft, null):
    from fitting.diagnose.evaluate.start import Start

    for conclusion, sentence in ((soft, "leaves out mullins_softening"), (null, "agree with the base model")):
        assert "(" not in text.base_named(conclusion)
        own = dataclasses.replace(conclusion, start=Start("a law fitted to these recordings: Gent"))
        first = verdict_sentences(own)[0]
        assert "base model (a law fitted to these recordings: Gent)" in first
        assert sentence in verdict_sentences(conclusion)[0]
    assert np.isfinite(soft.before.reduced_chi2)
