"""Physics that no effect of the catalogue describes is called unmodelled, and described by what it goes with."""

import numpy as np
import pytest
from diagnosis_coupons import COURSES, curve, softened, write

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.report.diagnosis.model import model_of
from fitting.report.diagnosis.payload import content
from fitting.simulate import predict
from fitting.specimens.saved_models import load_model, save_model
from pneusma_jax.errors import Distrusted


@pytest.fixture(scope="module")
def strange(tmp_path_factory):
    """A stress that ripples with strain, as no rubber's does."""
    folder = tmp_path_factory.mktemp("strange") / "campaign"
    return diagnose(read_campaign(write(folder, lambda e: 1.02 * curve(e) + 4.0 * np.sin(28.0 * e))), seed=1)


def test_it_is_not_given_a_name(strange):
    assert strange.mismatch
    assert strange.found[0].slug == "unmodelled" and strange.unknown > 0.5
    assert "unmodelled" in strange.explanation_set
    named = [f for f in strange.found if f.slug != "unmodelled"]
    assert all(f.probability < 0.8 for f in named)


def test_it_is_described_by_what_it_goes_with(strange):
    report = content(strange)
    assert report["remainder"]["driver"] == "strain" and report["remainder"]["quantity"] == "stress"
    assert report["fit"]["after"]["reduced_chi2"] < 0.2 * report["fit"]["before"]["reduced_chi2"]
    assert report["fit"]["averaged"]["over"] == {"unmodelled": 1.0}
    assert report["remainder"]["reduced_chi2"]["after"] == report["fit"]["after"]["reduced_chi2"]
    said = " ".join(verdict_sentences(strange))
    assert "smooth function of strain added to stress, which names no cause" in said


def reloaded(conclusion, folder):
    """The model of a diagnosis that explains nothing, from disk, which says so."""
    path = save_model(model_of(conclusion, "a test"), folder / "augmented.toml")
    with pytest.warns(Distrusted, match="The recordings contradict the base model"):
        return load_model(path)


def test_what_is_saved_predicts_what_was_scored(strange, tmp_path):
    """The model from disk, simulated like any other, is the one that the report is about."""
    model = reloaded(strange, tmp_path)
    (rest,) = model.remainders
    assert rest.span == pytest.approx((0.0, 0.8), abs=0.01) and rest.corrections[0].prior.sd > 0.0
    recording = next(r for r in strange.explanation.program.recordings if r.role == "validation")
    found = predict(recording, model=model)
    error = found.outputs["stress_kPa"] - recording.columns["stress_kPa"]
    rmse = float(np.sqrt(np.mean(error**2)))
    assert rmse == pytest.approx(content(strange)["fit"]["after"]["rmse"]["stress_kPa"], rel=1e-6)


@pytest.mark.slow
def test_a_diagnosis_goes_on_from_it_and_keeps_it(strange, tmp_path):
    """With the smooth term there, what it cannot follow is still said, and is not called agreement."""
    model = reloaded(strange, tmp_path)
    campaign = read_campaign(strange.explanation.program.recordings[0].path.parent)
    again = diagnose(campaign, seed=1, model=model)
    # in units: what noise counts for is told anew from what is left
    assert again.before.rmse == pytest.approx(strange.after.rmse, rel=0.01)
    assert again.before.reduced_chi2 > 4.0 and again.mismatch
    assert content(again)["p_value"] < 0.01
    kept = model_of(again, "a second test", model).remainders
    assert kept[0] == model.remainders[0]


def test_a_doubtful_effect_stays_only_where_left_out_recordings_need_it(strange):
    assert [f.slug for f in strange.found] == ["unmodelled"] and strange.model[1] is strange.explanation.base


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """Softening, and a ripple on top of it."""
    folder = tmp_path_factory.mktemp("half") / "campaign"
    return diagnose(read_campaign(write(folder, lambda e: softened(e, 0.2) + 3.0 * np.sin(28.0 * e))), seed=1)


@pytest.mark.slow
def test_what_is_doubtful_and_what_is_unexplained_are_in_the_model_that_was_scored(half, tmp_path):
    assert half.mismatch and half.found[0].slug == "unmodelled"
    assert [f.slug for f in half.found[1:]] == ["mullins_softening"] and half.found[1].probability < 0.5
    assert half.after.reduced_chi2 < 0.5 * half.before.reduced_chi2
    model = reloaded(half, tmp_path)
    assert [added.slug for added in model.added] == ["mullins_softening", "unmodelled"]
    recording = next(r for r in half.explanation.program.recordings if r.role == "validation")
    error = predict(recording, model=model).outputs["stress_kPa"] - recording.columns["stress_kPa"]
    scored = content(half)["fit"]["after"]["rmse"]["stress_kPa"]
    assert float(np.sqrt(np.mean(error**2))) == pytest.approx(scored, rel=1e-6)
    said = " ".join(verdict_sentences(half))
    assert "With mullins_softening, which is doubtful, and a smooth function of" in said


def test_what_only_validation_recordings_contradict_is_said(tmp_path):
    """The fitted pulls agree with the base model. The last one goes further, and ripples there."""
    courses = [*([0.5, 0.5], [0.3, 0.6], [0.6, 0.6]), [1.1, 1.1]]
    assert len(courses) == len(COURSES)

    def law(strain):
        return curve(strain) + 3.0 * np.where(strain > 0.65, np.sin(28.0 * (strain - 0.65)), 0.0)

    found = diagnose(read_campaign(write(tmp_path / "campaign", law, courses=courses)), seed=1)
    assert found.mismatch and found.explanation.together
    assert found.found[0].slug == "unmodelled" and "unmodelled" in found.explanation_set
    assert any(note.startswith("The validation recordings were fitted like all others") for note in found.notes)
