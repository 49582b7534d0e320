"""Reports in which no explanation leaves only noise: one scale of evidence, constants at bounds, the next experiment."""

import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_world import ANOTHER, CONSTANT, DELAY, SWELLING, tubes

import fitting.report.diagnosis.report
from fitting.diagnose.fit.base_fit import at_bound, told_at_bound
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.search.explain import explain
from fitting.diagnose.search.steps import LeaveOneOutEvidence
from fitting.diagnose.verdict.conclude import _unmodelled, conclude
from fitting.diagnose.verdict.left import Left
from fitting.diagnose.verdict.locate import drivers_of
from fitting.diagnose.verdict.probabilities import Found
from fitting.diagnose.verdict.proposal import leading_pair
from fitting.report.diagnosis import text
from fitting.report.diagnosis.figures import outputs_not_drawn
from fitting.report.diagnosis.report import recordings_caption
from fitting.report.diagnosis.tables import base_table, candidate_table, score_table, shown_knots
from fitting.specimens.spring import MARGIN


def concluded(base=(0.3, -0.2), ripple=6.0, **strengths):
    world = tubes(effects=(CONSTANT, DELAY), rows=120)
    wave = ripple * np.sin(0.6 * np.arange(120)) * (world.drivers["pressure"] > 800.0)
    y = world.truth(np.random.default_rng(3), base, **strengths) + wave
    return conclude(explain(world.program(y), np.random.default_rng(1)))


@pytest.fixture(scope="module")
def refuted():
    """An effect explains most of a misfit; a ripple of another kind is left."""
    found = concluded(**{CONSTANT: 4.0})
    assert found.found[0].slug == "unmodelled" and found.explanation.inflation > 1.5
    return found


def test_something_unmodelled_has_evidence_on_the_scale_of_the_candidates(refuted):
    x = refuted.explanation
    excess = reduced(x.program, x.base, x.program.fitted) - 1.0
    whole = 0.5 * excess * x.program.observations(x.program.fitted)
    assert refuted.found[0].bayes == pytest.approx(whole / x.inflation, rel=1e-12)
    assert max(t.bayes for t in x.leading.candidates) < refuted.found[0].bayes < 0.7 * whole
    said = text.effect(refuted.found[0])
    assert "what the misfit beyond noise is worth. An effect may have more" in said
    assert f"log Bayes factor {refuted.found[0].bayes:#.3g}." in said
    assert "do not tell it from" not in said  # after `which leaves too much`
    assert f"In every log Bayes factor of this page misfit counts 1/{x.inflation:.2g} of" in candidate_table(refuted).note


@pytest.mark.parametrize("confusable", [[], [CONSTANT]])
def test_evidence_of_something_unmodelled_is_not_called_a_bound(confusable):
    """A candidate of 27 stood beside an `unmodelled` of `at most 6`, and one of 54 beside a name."""
    said = text.effect(Found("unmodelled", 0.7, 5.52, {}, confusable, "Some text."))
    assert said == "Some text. Probability 0.70, log Bayes factor 5.52."


def test_a_candidate_may_have_more_evidence_than_something_unmodelled():
    """It brings constants back to nominal, too, which the base model's misfit does not count."""
    x = concluded(ripple=0.0, base=(-3.0, 3.0), **{CONSTANT: 4.0}).explanation
    paid = x.base.objective - 0.5 * x.base.evaluation.chi2(x.program.fitted.astype(float))
    assert paid > 10.0
    assert x.first.bayes > _unmodelled(0.5, [], x).bayes


def test_a_scale_that_changes_nothing_is_not_told():
    found = concluded(ripple=0.0, **{CONSTANT: 4.0})
    assert [f.slug for f in found.found] == [CONSTANT]
    assert "Misfit counts" not in candidate_table(found).note


def test_the_next_experiment_separates_what_the_report_names_first(refuted):
    """Not the likeliest effect from another one that nobody believes."""
    told = refuted.next_experiment
    assert told["separates"] == [CONSTANT, "unmodelled"]
    assert told["text"].count(CONSTANT) >= 1 and DELAY not in told["text"]
    assert f"whether {CONSTANT} acts" in told["text"] or told["text"].startswith(f"To confirm {CONSTANT}")


def evidence_of(slug, *rivals):
    """Leave-one-effect-out evidence whose fits are their own names."""
    candidates = [SimpleNamespace(slug=s, fit=f"fit of {s}") for s in (slug, *rivals)]
    return LeaveOneOutEvidence(slug, f"model without {slug}", candidates)


def searched(*evidence):
    """A search that named the effects of some leave-one-out evidence."""
    slugs = tuple(one.slug for one in evidence)
    named = SimpleNamespace(leave_one_out={one.slug: one for one in evidence})
    return SimpleNamespace(named=named, final=SimpleNamespace(slugs=slugs))


def told(slug, *confusable, **instead):
    return SimpleNamespace(slug=slug, confusable=list(confusable), instead=instead)


def test_effects_that_the_recordings_do_not_tell_apart_are_separated_first():
    sure, open_one = evidence_of(CONSTANT, ANOTHER), evidence_of(DELAY, ANOTHER, SWELLING)
    found = [told(CONSTANT), told(DELAY, SWELLING)]
    pair = leading_pair(searched(sure, open_one), found)
    assert pair == ((DELAY, f"fit of {DELAY}"), (SWELLING, f"fit of {SWELLING}"))


def test_the_first_name_is_separated_from_its_best_rival_that_is_not_named_too():
    first, second = evidence_of(CONSTANT, DELAY, ANOTHER), evidence_of(DELAY)
    pair = leading_pair(searched(first, second), [told(CONSTANT, **{ANOTHER: 0.2}), told(DELAY)])
    assert [name for name, _ in pair] == [CONSTANT, ANOTHER]
    hopeless = leading_pair(searched(first, second), [told(CONSTANT, **{ANOTHER: 1e-5}), told(DELAY)])
    assert hopeless[1] == ("unmodelled", f"model without {CONSTANT}"), "a rival without a chance is not told apart"
    alone = leading_pair(searched(evidence_of(DELAY)), [told(DELAY)])
    assert alone[1] == ("unmodelled", f"model without {DELAY}")


@pytest.mark.parametrize(("bayes", "pair"), [(30.0, ((CONSTANT, "fit"), ("unmodelled", "base"))), (-5.0, None)])
def test_a_candidate_is_separated_from_something_unmodelled_if_it_has_any_evidence(bayes, pair):
    search = searched()
    search.first, search.leading = SimpleNamespace(slug=CONSTANT, fit="fit", bayes=bayes), SimpleNamespace(base="base")
    assert leading_pair(search, [told("unmodelled")]) == pair


def test_nothing_is_separated_where_nothing_was_found():
    assert leading_pair(searched(), []) is None


def test_a_knot_that_is_rounding_is_shown_as_zero():
    rest = SimpleNamespace(knots=np.array([6.054e-18, 0.006247, 0.1508]))
    assert [f"{x:.4g}" for x in shown_knots(rest)] == ["0", "0.006247", "0.1508"]


def test_constants_at_their_bounds_are_marked_in_the_table():
    found = concluded(base=(9.0, 0.2), ripple=0.0)
    (name,) = at_bound(found.explanation.program.unknowns, found.explanation.base)
    marked = [row[0] for row in base_table(found).rows if "at its bound" in row[2]]
    assert marked == [name]


def test_a_constant_of_one_of_several_specimens_has_one_name_in_notes_and_tables():
    items = [SimpleNamespace(name=f"wall_thickness__{k}") for k in (1, 2)]
    unknowns = SimpleNamespace(items=items, base=[0, 1], low=np.full(2, -4.0), high=np.full(2, 4.0))
    recordings = [SimpleNamespace(specimen=name) for name in ("A", "A", "B")]
    program = SimpleNamespace(unknowns=unknowns, recordings=recordings)
    assert told_at_bound(program, SimpleNamespace(u=np.array([0.0, -4.0]))) == ["wall_thickness of B"]


def test_what_changes_nothing_has_no_column_and_no_row_of_its_own():
    """Where nothing was found, a second column and row would repeat the first as `what was found`."""
    null, one = concluded(ripple=0.0), concluded(ripple=0.0, **{CONSTANT: 4.0})
    assert not null.found and not null.changed and one.changed
    assert "refitted with what was found" not in base_table(null).header
    assert "refitted with what was found" in base_table(one).header
    assert [row[0] for row in score_table(null).rows] == ["base model, refitted"]
    assert [row[0] for row in score_table(one).rows][:2] == ["base model, refitted", "with what was found"]


def test_a_caption_says_what_is_drawn_and_what_a_spring_s_spikes_are(refuted):
    said = recordings_caption(refuted)
    assert "the model with what was found" in said and "amber" in said and "remembers" not in said
    null = recordings_caption(concluded(ripple=0.0))
    assert "what was found" not in null and "amber" not in null
    base = refuted.explanation.base
    evaluation = replace(base.evaluation, drivers={**base.evaluation.drivers, "memory_row": np.zeros((4, 120))})
    explanation = copy.copy(refuted.explanation)
    explanation.base = replace(base, evaluation=evaluation)
    assert "the row that a spring remembers" in recordings_caption(replace(refuted, explanation=explanation))


def test_a_caption_names_the_outputs_that_are_not_drawn(refuted, monkeypatch):
    """Of two springs only the resistance that was missed more was drawn, and nothing said so."""
    names, missed = ("curvature", "resistance_1", "resistance_2"), (5.0, 3.0, 1.0)
    channels = [[SimpleNamespace(quantity=name, measured=np.zeros(4), sigma=np.ones(4)) for name in names]]
    base = SimpleNamespace(evaluation=SimpleNamespace(predicted=[[np.full(4, value) for value in missed]]))
    two_springs = SimpleNamespace(explanation=SimpleNamespace(program=SimpleNamespace(channels=channels), base=base))
    assert outputs_not_drawn(two_springs) == ["resistance 2"]
    assert "Not drawn" not in recordings_caption(refuted)
    monkeypatch.setattr(fitting.report.diagnosis.report, "outputs_not_drawn", lambda conclusion: ["resistance 2"])
    assert recordings_caption(refuted).endswith(" Not drawn, since the base model misses it less: resistance 2.")


@pytest.mark.parametrize(("noise", "said"), [
    (1.0, ", where noise alone would leave 1."),
    (2.6, ", where noise alone would leave 2.6. Neighbouring rows differ by more than the noise that they are judged by."),
])  # fmt: skip
def test_what_noise_leaves_is_explained(noise, said):
    assert Left(20.0, noise, False, (), None).text.endswith(said)


def test_what_a_search_decides_with_is_no_driver_of_a_report():
    """A spring's margin of renewal is a number of the search; misfit does not go with it."""
    values = np.zeros((1, 5))
    evaluation = SimpleNamespace(drivers={"strain": values, "memory_row": values, MARGIN: values})
    program = SimpleNamespace(recordings=[None], stacked=SimpleNamespace(time=values))
    assert sorted(drivers_of(program, SimpleNamespace(evaluation=evaluation))) == ["max_strain", "strain", "time"]
