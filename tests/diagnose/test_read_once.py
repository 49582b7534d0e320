"""Sentences and tables that a new user had to read twice: what they say now, and what they agree with."""

import copy
import dataclasses

import numpy as np
import pytest
from linear_world import CONSTANT, tubes

from fitting.diagnose.search.explain import explain
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.report.diagnosis import text
from fitting.report.diagnosis.model import model_of
from fitting.report.diagnosis.tables import base_table, discrepancy_table, effect_table
from fitting.report.open_constants import open_sentences
from fitting.specimens.saved_models import DIAGNOSIS


def entry(kind, name, said):
    return {"kind": kind, "parameters": [name], "text": said}


def test_parameters_of_the_same_status_are_told_in_one_sentence():
    entries = [
        entry("end_of_range", "scale", "scale is at 10, an end of its range."), entry("loose_direction", "a", "a and b are loose."),
        entry("end_of_range", "energy", "energy is at 0, an end of its range."), entry("absent", "c", "c is absent."),
        entry("absent", "d", "d is absent."),
    ]  # fmt: skip
    first, loose, *absent = open_sentences(entries)
    assert first.startswith("scale and energy are at ends of their ranges") and "`pneusma diagnose` leaves them open" in first
    assert loose == "a and b are loose." and absent == ["c is absent.", "d is absent."]
    assert open_sentences(entries[:1]) == ["scale is at 10, an end of its range."]


@pytest.fixture(scope="module")
def concluded():
    """A named effect beside a ripple, so that a discrepancy stays."""
    world, rng = tubes(effects=(CONSTANT,), rows=120), np.random.default_rng(5)
    ripple = 1.5 * np.sin(6.0 * np.pi * world.drivers["pressure"] / 1e3)
    program = world.program(world.truth(rng, base=(0.5,), **{CONSTANT: 3.0}) + ripple)
    return conclude(explain(program, np.random.default_rng(1), lambda _: None))


def test_a_table_of_an_effect_has_the_names_that_the_verdict_has(concluded):
    (found, *_) = [f for f in concluded.reported if f.slug == CONSTANT]
    names = [row[0].partition(":")[0] for row in effect_table(concluded, found).rows]
    assert names == list(found.parameters) and found.strength in names
    (value,) = [row[1] for row in effect_table(concluded, found).rows if row[0].startswith(f"{found.strength}:")]
    assert f"{found.strength} = {value}" in verdict_sentences(concluded)[0]  # 377 in one, 380 in the other


def test_a_discrepancy_is_told_in_the_units_of_the_recordings(concluded):
    """It was in m beside lengths in mm."""
    assert concluded.remainder is not None
    table = discrepancy_table(concluded)
    assert table.header[1:] == ["correction of length [mm]", "sd [mm]"]
    shown = [float(row[1]) for row in table.rows]
    np.testing.assert_allclose(shown, 1e3 * concluded.remainder.values, rtol=1e-3, atol=1e-9)
    if concluded.remainder.driver == "pressure":
        assert table.header[0] == "pressure [kPa]" and "kPa" in text.discrepancy(concluded)


def test_scores_that_go_opposite_ways_say_why(concluded):
    """The misfit fell from 1.45 to 1.27, and the error rose from 0.253 to 0.258, without a word."""
    before, after = concluded.before, concluded.after
    worse = {name: 1.1 * error for name, error in before.rmse.items()}
    opposed = dataclasses.replace(concluded, after=dataclasses.replace(after, rmse=worse))
    assert after.reduced_chi2 < before.reduced_chi2
    assert any("go opposite ways" in sentence for sentence in verdict_sentences(opposed))
    assert not any("go opposite ways" in sentence for sentence in verdict_sentences(concluded))


def test_the_model_of_recordings_that_nothing_explains_is_not_to_be_trusted(concluded):
    assert model_of(concluded, f"{DIAGNOSIS} tubes, seed 1").caution == ""
    nobody = dataclasses.replace(concluded, found=[f for f in concluded.found if f.slug == "unmodelled"] or [])
    if nobody.found:
        assert model_of(nobody, f"{DIAGNOSIS} tubes, seed 1").caution == verdict_sentences(nobody)[0]


def test_a_constant_of_a_specimen_that_was_not_fitted_is_as_stated(concluded):
    """It was shown as refitted, at exactly its nominal value."""
    recordings = [dataclasses.replace(r, specimen="B", role="validation") if k == 1 else r for k, r in enumerate(concluded.explanation.program.recordings)]
    unknowns = concluded.explanation.program.unknowns
    named = copy.copy(unknowns)
    named.items = tuple(dataclasses.replace(i, name=f"length__{k + 1}") if not i.effect else i for k, i in enumerate(unknowns.items))
    program = dataclasses.replace(concluded.explanation.program, recordings=recordings, unknowns=named)
    table = base_table(dataclasses.replace(concluded, explanation=dataclasses.replace(concluded.explanation, program=program)))
    first, second = table.rows
    assert first[0] == "length of T" and "sd)" in first[2]
    assert second[0] == "length of B" and set(second[2:-1]) == {"as stated"}
