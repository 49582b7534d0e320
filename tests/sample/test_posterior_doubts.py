"""A posterior of a law that does not fit begins as the report of the fit does, and quotes no error as holding."""

import json
from dataclasses import replace
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.characterise import characterise
from fitting.cli import main
from fitting.data.hdf5 import UNCOUNTED
from fitting.data.recordings import read_campaign
from fitting.design.posterior_file import posterior_caution
from fitting.inference.lasting_noise import Lasting
from fitting.propagate import build_problem, read_study
from fitting.propagate.inputs_of import read_draws
from fitting.report.general.report import report_of
from fitting.report.posterior import beside_fit
from fitting.report.posterior.hierarchy import verdict as verdict_together
from fitting.report.posterior.text import HOLD, verdict
from fitting.sample.campaign import posterior_of
from pneusma_jax.calibration import load_calibration
from pneusma_jax.errors import DISTRUSTED, Distrusted

TUBE = Path(str(resources.files("calibration_data"))) / "examples" / "tube"
STUDY = """schema = "pneusma-study/1"
name = "band"
[model]
through = "state"
design = "pneuflex_s"
pressure_kPa = 20.0
[vary]
posterior = "posterior.nc"
posterior_specimen = 1
[[output]]
name = "angle"
of = "bend_angle_deg"
[sampling]
rows = 100
"""
CREEP = 0.15
"""Swing of the length [mm] during a test that the law of a tube does not know; its noise is 0.06 mm."""


@pytest.fixture(scope="module")
def crept():
    """Tubes whose length swings while they are tested, of every second row."""
    campaign = read_campaign(TUBE)
    for recording in campaign.recordings:
        time, length = recording.columns["time_s"], recording.columns["length_mm"]
        recording.columns["length_mm"] = length + CREEP * np.sin(3.4 * np.pi * time / time[-1])
        recording.columns.update({name: values[::2] for name, values in recording.columns.items()})
    return characterise(campaign, starts=1)


def judged(fit, converged=True):
    """A posterior that agrees with its fit on everything, as the sentences need it."""
    posterior = SimpleNamespace(verdict=["Converged: 4 ensembles agree."], disagreements={}, names=())
    return SimpleNamespace(posterior=posterior, converged=converged, problem=SimpleNamespace(fit=fit))


@pytest.mark.slow
def test_a_posterior_of_a_misfit_begins_with_the_first_sentence_of_its_fit(crept, tmp_path):
    """Draws agreed with the fit 98 standard deviations from the truth, and the report said that errors hold."""
    sampled = posterior_of(crept, seed=1, progress=False, sampler="emcee", ensembles=2, max_steps=40)
    first = crept.verdict[0]
    assert "does not fit these recordings" in first
    assert sampled.verdict[0] == first and HOLD not in " ".join(sampled.verdict)
    documents = sampled.documents()
    report = json.loads(documents["report.json"])
    assert report["notices"][0] == report["verdict"][0] == first
    assert any("`pneusma diagnose" in notice for notice in report["notices"])
    assert "does not fit these recordings" in documents["report.html"]
    (tmp_path / "posterior.nc").write_bytes(documents["posterior.nc"])
    said = read_draws(tmp_path).caution
    assert said.startswith(first) and "`pneusma diagnose" in said
    assert posterior_caution(tmp_path / "posterior.nc") == said
    study = tmp_path / "study.toml"
    study.write_text(STUDY)
    notice = build_problem(read_study(study)).notices[0]
    assert notice.startswith(f"{tmp_path / 'posterior.nc'}: {UNCOUNTED}. {first}")


def test_a_table_of_a_law_that_does_not_fit_says_so_wherever_it_is_used(crept, tmp_path):
    path = tmp_path / "material.toml"
    path.write_text(report_of(crept).files()["material.toml"])
    with pytest.warns(Distrusted, match=DISTRUSTED) as told:
        table = load_calibration(path)
    assert crept.verdict[0] in str(told[0].message) and str(path) in str(told[0].message)
    fits = replace(crept, fit=replace(crept.fit, reduced_chi_square=1.0), lasting=None)
    assert "caution" not in report_of(fits).files()["material.toml"] and "caution" in table.text
    result = CliRunner().invoke(main, ["simulate", "--design", "pneuflex_s", "--pressure-kPa", "20", "--material", str(path)])
    assert result.exit_code == 0, result.output
    notes = [line for line in result.stderr.splitlines() if DISTRUSTED in line]
    assert len(notes) == 1 and notes[0].startswith(f"note: {path}: ") and crept.verdict[0] in notes[0]


def test_draws_that_agree_with_a_fit_that_misses_do_not_say_that_its_errors_hold(crept):
    said = verdict(judged(crept))
    assert said[:2] == crept.verdict[:2] and HOLD not in " ".join(said)
    assert said[-1].endswith("so that this confirms neither.")
    short = verdict(judged(crept, converged=False))
    assert short[0] == said[0] and "not judged" in short[-1]


@pytest.mark.parametrize(
    ("inflation", "beside", "noise"),
    [
        (1.0, False, "take the noise as stated or estimated as all"),
        (2.5, False, "take noise that is 2.5 times the one stated or estimated, as in the fit, as all"),
        (1.0, True, "take the noise as stated or estimated and zeros of instruments that drift, as in the fit, as all"),
    ],
)
def test_the_noise_of_the_draws_is_named(crept, inflation, beside, noise):
    zeros = Lasting(np.array([1.0]), {"length": 0.1}, {"length": 0.9}, fitted_beside_zeros=beside)
    fit = replace(crept, fit=replace(crept.fit, inflation=inflation), lasting=zeros)
    assert noise in " ".join(beside_fit.opening(fit))


def test_zeros_that_only_the_fit_counts_are_told_with_their_factor(crept):
    fitting = replace(crept.fit, reduced_chi_square=1.0, inflation=1.0)
    told = {"steady": 0.01, "steady_by_output": {"length": 0.01}}
    zeros = lambda grown: Lasting(np.array([1.0, grown**2]), {"length": 0.1}, {"length": 0.9}, **told)  # noqa: E731
    wider, white = (replace(crept, fit=fitting, lasting=zeros(grown)) for grown in (3.0, 1.0))
    said = " ".join(verdict(judged(wider)))
    assert "multiplied by up to 3 for zeros of instruments" in said and HOLD not in said
    assert "wider by up to that factor" in said and "the noise as stated or estimated as all there is" in said
    assert not beside_fit.opening(white) and HOLD in verdict(judged(white))[-1]


def test_nothing_is_said_of_a_density_without_a_fit():
    assert beside_fit.opening(None) == [] and HOLD in verdict(judged(None))[-1]


def test_specimens_together_name_the_campaign_that_is_missed(crept):
    shared = {"x": SimpleNamespace(pooling=0.5)}
    posterior = SimpleNamespace(verdict=["Converged."])
    result = SimpleNamespace(names=("A", "B"), fits=(None, crept), shared=shared, posterior=posterior)
    said = verdict_together(result)
    assert said[0] == f"B: {crept.verdict[0]}" and not any(x.startswith("A:") for x in said)


def test_an_elastomers_law_that_leaves_more_than_noise_is_named_first(example):
    campaign = read_campaign(example)
    for recording in campaign.recordings:
        recording.columns.update({name: values[::5] for name, values in recording.columns.items()})
    stiff = characterise(campaign, law="neo_hookean")
    first, *_, last = verdict(judged(stiff))
    assert first.startswith("Neo-Hookean leaves ") and first.endswith("times the noise. `pneusma diagnose` looks for the cause.")
    assert first.removeprefix("Neo-Hookean") in " ".join(stiff.verdict) and HOLD not in last
    assert HOLD in verdict(judged(characterise(campaign, law="yeoh")))[-1]
