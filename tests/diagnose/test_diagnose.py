"""A concealed effect is named, modelled and proven; nothing is found where nothing is."""

import dataclasses
import json

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli import main
from fitting.diagnose.fit.evidence import evidence
from fitting.diagnose.fit.refit import absent
from fitting.diagnose.verdict import misfit_text, text
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.inference.channels import Channel, block_noise
from fitting.report.diagnosis.model import model_of
from fitting.report.diagnosis.payload import content
from fitting.specimens.saved_models import load_model
from pneusma_jax.effects import CATALOGUE


def test_the_concealed_effect_is_named(soft):
    assert soft.mismatch
    assert soft.found[0].slug == "mullins_softening"
    assert soft.found[0].probability > 0.5
    assert soft.component == "elastomer"


def test_the_fit_improves_on_recordings_that_were_not_fitted(soft):
    assert soft.before.on == ["pull_4"] and soft.before.how == "validation"
    assert soft.before.reduced_chi2 > 20.0
    assert (soft.after.reduced_chi2 - 1.0) < 0.05 * (soft.before.reduced_chi2 - 1.0)


def test_the_base_comes_home(soft):
    """The stiffness was three per cent above nominal, of a tolerance of five."""
    u = soft.explanation.final.u[soft.explanation.program.unknowns.base]
    assert np.all(np.abs(u - 0.6) < 0.5)


def test_nothing_is_found_where_nothing_is(null):
    assert not null.mismatch and not null.found
    assert null.explanation.p_value > 0.01
    assert null.before.reduced_chi2 == pytest.approx(null.after.reduced_chi2)
    assert 0.7 < null.after.reduced_chi2 < 1.3


@pytest.mark.parametrize(
    ("left", "less", "said"),
    [
        (1.3, 1.3, ""), (9.0, 1.1, "does not contradict the model: its constants are uncertain, and other values within their errors leave 1.1 there"),
        (9.0, 4.0, "A part of it follows from constants that are uncertain: other values within their errors leave 4 there"),
        (9.0, 8.0, "Constants that are uncertain do not explain it: other values within their errors leave 8 there"),
    ],
)  # fmt: skip
def test_an_agreement_says_what_it_is_worth_on_recordings_not_fitted(null, monkeypatch, left, less, said):
    monkeypatch.setattr(misfit_text, "predictive_chi_square", lambda *_: less)
    monkeypatch.setattr(misfit_text, "missed_beyond_drift", lambda *_: less > 5.0)
    missed = dataclasses.replace(null, before=dataclasses.replace(null.before, reduced_chi2=left))
    sentence = " ".join(text.verdict_sentences(missed)[2:])
    assert said in sentence if said else not sentence
    assert not said or "missed by 3 times their noise (reduced chi-square 9, where noise alone would leave 1)" in sentence


@pytest.mark.parametrize("which", ["soft", "null"])
def test_probabilities_add_up(which, request):
    report = content(request.getfixturevalue(which))
    total = sum(c["probability"] for c in report["candidates"])
    assert total + report["unknown_probability"] + report["no_effect_probability"] == pytest.approx(
        1.0, abs=1e-9
    )
    kind = [slug for slug, effect in CATALOGUE.items() if "E" in effect.kinds]
    assert sorted(c["name"] for c in report["candidates"]) == sorted(kind)


@pytest.mark.parametrize("which", ["soft", "null"])
def test_the_report_keeps_its_schema(which, request, shared):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads((shared / "contract" / "diagnosis.schema.json").read_text())
    jsonschema.validate(json.loads(json.dumps(content(request.getfixturevalue(which)))), schema)


def test_the_report_tells_the_noise_that_it_judges_by(soft):
    found = {one["recording"]: one for one in content(soft)["noise"]}
    program = soft.explanation.program
    assert list(found) == [recording.name for recording in program.recordings]
    for recording, channels in zip(program.recordings, program.channels, strict=True):
        told = found[recording.name]
        assert (told["column"], told["unit"], told["stated"]) == ("stress_kPa", "kPa", recording.noise["stress_kPa"])
        assert told["sd"] == pytest.approx(float(np.median(channels[0].sigma)) / 1e3)
        assert told["sd"] == pytest.approx(told["stated"] / told["readings"] ** 0.5, rel=0.5)


def test_the_augmented_model_reads_back(soft, tmp_path):
    from fitting.specimens.saved_models import save_model

    loaded = load_model(save_model(model_of(soft, "a test"), tmp_path / "augmented.toml"))
    (effect,) = loaded.effects
    assert effect.slug == "mullins_softening"
    (made,) = soft.explanation.program.unknowns.effects(soft.explanation.final.u, ["mullins_softening"])
    assert float(effect.depth) == pytest.approx(float(made.depth), rel=1e-9)


def test_the_command_writes_everything_or_nothing(soft_campaign, tmp_path):
    out = tmp_path / "out"
    run = CliRunner().invoke(main, ["diagnose", str(soft_campaign), "--out", str(out), "--seed", "1"])
    assert run.exit_code == 0, run.output
    assert {"report.json", "report.html", "augmented.toml", "recordings.png"} <= {
        p.name for p in out.iterdir()
    }
    report = json.loads((out / "report.json").read_text())
    assert report["effects"][0]["name"] == "mullins_softening" and report["verdict"] == "mismatch"
    (table,) = report["base_tables"]
    assert table["name"] == "dragon_skin_10_fast" and not table["stated"] and "Allen" in table["citation"]
    page = (out / "report.html").read_text()
    assumed = "The silicone has the constants of dragon_skin_10_fast: Smooth-On"
    assert page.index("<h2>Base model</h2>") < page.index(assumed) < page.index("Recordings and models")
    assert assumed in run.stdout
    assert page.index("mullins_softening") < page.index("<img") and "http://" not in page.replace(
        "http://www.w3.org", ""
    )


def test_recordings_without_variation_are_refused(null_campaign, tmp_path):
    lines = (null_campaign / "pull_1.csv").read_text().splitlines()
    still = tmp_path / "still.csv"
    still.write_text("\n".join([lines[0], *(f"{k},0.1,3.0" for k in range(40))]) + "\n")
    still.with_suffix(".toml").write_text((null_campaign / "pull_1.toml").read_text())
    run = CliRunner().invoke(main, ["diagnose", str(still), "--out", str(tmp_path / "out")])
    assert run.exit_code == 2 and "still.csv" in run.output and not (tmp_path / "out").exists()


def test_whitening_leaves_independent_errors():
    rng = np.random.default_rng(0)
    rho, sigma, e = 0.7, 2.0, np.zeros(4000)
    for k in range(1, e.size):
        e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * rng.standard_normal()
    white = Channel("stress", np.zeros(e.size), np.full(e.size, sigma), rho).whitened(sigma * e)
    assert np.std(white) == pytest.approx(1.0, abs=0.05)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.05


@pytest.mark.parametrize(("rho", "block"), [(0.0, 2), (0.5, 2), (0.8, 5)])
def test_noise_of_block_means(rho, block):
    rng = np.random.default_rng(1)
    e = np.zeros(200_000)
    shocks = np.sqrt(1 - rho**2) * rng.standard_normal(e.size)
    for k in range(1, e.size):
        e[k] = rho * e[k - 1] + shocks[k]
    means = e.reshape(-1, block).mean(axis=1)
    sigma, correlation = block_noise(1.0, rho, block)
    assert sigma == pytest.approx(np.std(means), rel=0.02)
    assert correlation == pytest.approx(np.corrcoef(means[1:], means[:-1])[0, 1], abs=0.02)


@pytest.mark.parametrize("how", ["validation", "left out in turn", "within-recording"])
@pytest.mark.parametrize(("after", "word"), [(5.5, "rises"), (1.0, "falls"), (4.0, "stays")])
def test_the_verdict_says_the_same_of_every_kind_of_held_out_data(soft, how, after, word):
    scores = [dataclasses.replace(soft.before, how=how, reduced_chi2=x) for x in (4.0, after)]
    said = " ".join(verdict_sentences(dataclasses.replace(soft, before=scores[0], after=scores[1])))
    assert f" {word} " in said
    assert not [other for other in ("rises", "falls", "stays") if other != word and f" {other} " in said]


@pytest.mark.parametrize(("after", "excused"), [(4.4, True), (4.001, False), (1.0, False)])
def test_only_a_rise_that_is_shown_is_excused(soft, after, excused):
    scores = [dataclasses.replace(soft.before, reduced_chi2=x) for x in (4.0, after)]
    said = " ".join(verdict_sentences(dataclasses.replace(soft, before=scores[0], after=scores[1])))
    assert ("no more than chance" in said) is excused


def test_a_large_rise_is_excused_by_parts_of_recordings_alone(soft):
    """A name that holds between what was recorded, and fails beyond it."""
    scores = [dataclasses.replace(soft.before, reduced_chi2=x) for x in (4.0, 40.0)]
    alone, named = soft.explanation.left_out
    assert alone > named
    said = " ".join(verdict_sentences(dataclasses.replace(soft, before=scores[0], after=scores[1])))
    assert "no more than chance" not in said and "it predicts better between what was recorded, and worse beyond it" in said


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
