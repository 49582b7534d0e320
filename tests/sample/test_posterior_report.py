"""From a campaign to files: figures, page, tables, draws for ArviZ; the command and what it refuses."""

import csv
import json

import h5py
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from fitting.calibrate.elastomer.material import material
from fitting.characterise import characterise
from fitting.cli import main
from fitting.data.publish import RECORD
from fitting.data.recordings import read_campaign
from fitting.report.posterior import figures
from fitting.report.posterior.figures import in_lines
from fitting.report.posterior.netcdf import prior_draws
from fitting.report.posterior.tables import disagreement_table
from fitting.sample.comparison import compare
from pneusma_jax.calibration import write_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.units import to_si

FILES = {
    "summary.csv", "posterior.nc", "corner.png", "predictive.png", "prior.png", "trace.png", "report.html",
    "report.json",
}  # fmt: skip


def test_large_disagreements_have_no_power_of_ten():
    first, second = compare(47540.0, 29953.0, 0.0, 21.0, 12.0).reasons
    assert first == "its mean lies 4000 sd above the fit" and second.startswith("its error is 2500 times the fit's")


@pytest.mark.parametrize(("text", "lines"), [
    ("mu [kPa]", ["mu [kPa]"]),
    ("viscoelastic_relaxation_tau_1 [s]", ["viscoelastic_", "relaxation_tau_1", "[s]"]),
    ("transformationhysteresis_b [K]", ["transformationhysteresis_", "b [K]"]),
])  # fmt: skip
def test_long_names_in_a_corner_do_not_run_into_their_neighbours(text, lines):
    assert in_lines(text).split("\n") == lines and in_lines(text).replace("\n", "").replace(" ", "") == text.replace(" ", "")


@pytest.fixture(scope="module")
def fit(example):
    """Of every fifth row of the campaign: its posterior is sampled in a fifth of the time."""
    campaign = read_campaign(example)
    for recording in campaign.recordings:
        recording.columns.update({name: values[::5] for name, values in recording.columns.items()})
    return characterise(campaign, law="yeoh")


@pytest.fixture(scope="module")
def result(fit):
    return fit.posterior(seed=1, progress=False, max_steps=4000)


@pytest.fixture(scope="module")
def saved(result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("posterior") / "out"
    assert {file.name for file in result.save(folder)} == FILES
    return folder


@pytest.mark.parametrize("name", ["mu [kPa]", "viscoelastic_relaxation_tau_1 [s]"])
def test_labels_of_a_corner_lie_apart_and_within_the_figure(result, monkeypatch, name):
    monkeypatch.setattr(figures, "label", lambda result, parameter: name)
    figure = figures.corner_figure(result)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    for axis in ("xaxis", "yaxis"):
        shown = [getattr(axes, axis).label for axes in figure.axes]
        boxes = [text.get_window_extent(canvas.get_renderer()) for text in shown if text.get_text() and text.get_visible()]
        assert boxes and all(figure.bbox.x0 <= box.x0 and figure.bbox.y0 <= box.y0 for box in boxes)
        assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])


def test_the_campaign_is_sampled_by_the_likelihood_of_its_fit(fit, result):
    posterior, problem = result.posterior, result.problem
    assert result.converged
    assert set(posterior.names) == {"c_10", "c_20", "c_30", "stiffness_1", "stiffness_2"}
    for name, estimate in fit.parameters.items():
        assert float(problem.shown(name, posterior.laplace.value[name])) == pytest.approx(
            estimate.value, rel=1e-5
        )
        assert float(problem.shown(name, posterior.laplace.sd[name])) == pytest.approx(estimate.sd, rel=1e-2)
        assert float(problem.shown(name, posterior.summary[name].mean)) == pytest.approx(
            estimate.value, abs=0.3 * estimate.sd
        )


def test_predicted_bands_hold_the_measured_values(result):
    inside = []
    for curve, predicted in zip(result.problem.curves, result.predictive, strict=True):
        assert predicted.shape[1] == len(curve.x)
        spread = np.sqrt(predicted.var(axis=0) + curve.sigma**2)
        inside.append(np.mean(np.abs(curve.measured - np.median(predicted, axis=0)) < 1.645 * spread))
    assert 0.8 < np.mean(inside) < 1.0


def test_everything_is_written(result, saved):
    report = json.loads((saved / "report.json").read_text())
    assert report["schema"] == "pneusma-posterior/1" and report["converged"] and report["real"] is False
    entry = report["parameters"]["c_10"]
    assert entry["unit"] == "kPa" and entry["q05"] < entry["median"] < entry["q95"] and entry["r_hat"] < 1.01
    rows = list(csv.DictReader((saved / "summary.csv").read_text().splitlines()))
    assert [row["parameter"] for row in rows] == list(report["parameters"])
    assert float(rows[0]["mean"]) == pytest.approx(entry["mean"])
    page = (saved / "report.html").read_text()
    assert page.count("<figure>") == 4 and "simulated data, not measured" in page
    assert "http" not in page.replace("http://www.w3.org", "")
    with pytest.raises(InputError, match="results are here already"):
        result.save(saved)


def test_the_text_has_every_parameter_and_says_how_noise_enters(result):
    text = " ".join(result.report().split())
    assert "Converged" in text and "count as" in text and "prior 1 ± 0.05" in text
    assert all(name in text for name in result.posterior.names)


def test_draws_are_netcdf_with_the_groups_of_arviz(result, saved):
    with h5py.File(saved / "posterior.nc") as file:
        assert set(file) == {"posterior", "sample_stats", "prior", "observed_data"}
        draws = file["posterior/c_10"]
        assert [dimension[0].name.rsplit("/")[-1] for dimension in draws.dims] == ["chain", "draw"]
        assert draws.shape == tuple(len(dimension[0]) for dimension in draws.dims)
        assert draws.shape[0] == 4 * 32 and draws.attrs["unit"] == "kPa"
        assert np.mean(to_si(draws[...], "kPa")) == pytest.approx(result.posterior.draws["c_10"].mean())
        assert set(file["prior"]) >= {"stiffness_1", "stiffness_2"}
        assert "c_20" not in file["prior"]  # flat without end
        ids = [d.attrs["_Netcdf4Dimid"] for group in file.values() for d in group.values() if d.is_scale]
        assert len(ids) == len(set(ids))


def test_arviz_opens_the_draws(result, saved):
    arviz = pytest.importorskip("arviz", reason="ArviZ is not installed")
    data = arviz.from_netcdf(str(saved / "posterior.nc"))
    assert float(data.posterior["c_10"].mean()) == pytest.approx(
        float(result.problem.shown("c_10", result.posterior.draws["c_10"].mean()))
    )


def test_prior_draws_are_those_of_the_cut_gaussian(result):
    values = prior_draws(result)["stiffness_1"]
    assert values.mean() == pytest.approx(1.0, abs=0.005) and values.std() == pytest.approx(0.05, rel=0.1)
    assert values.min() >= 0.8 and values.max() <= 1.2


def call(*arguments):
    with pytest.raises(SystemExit) as left:
        main([str(a) for a in arguments])
    return left.value.code or 0


@pytest.mark.slow
def test_the_command_says_that_it_has_not_converged_and_resumes(example, tmp_path, capsys):
    out = tmp_path / "out"
    arguments = ("posterior", example, "--out", out, "--law", "neo_hookean")
    assert call(*arguments, "--max-steps", 20) == 0
    assert "NOT CONVERGED after 20 steps" in capsys.readouterr().out
    assert json.loads((out / "report.json").read_text())["converged"] is False
    assert "Not converged" in (out / "report.html").read_text()
    assert call(*arguments) == 2
    assert "chains are here already" in capsys.readouterr().err
    assert call(*arguments, "--max-steps", 3000, "--resume") == 0
    said = capsys.readouterr()
    assert "Converged: 4 independent ensembles" in said.out and "sampling" not in said.err
    assert {file.name for file in out.iterdir()} == FILES | {"chain.h5", RECORD}
    assert call(*arguments, "--resume", "--seed", 5) == 2
    assert "run with seed = 0, not 5" in capsys.readouterr().err


@pytest.mark.slow
def test_a_table_of_constants_gives_priors(example, fit, tmp_path, capsys):
    table = tmp_path / "material.toml"
    write_calibration(material(fit.whole, fit.samples, fit.title), table)
    assert call("posterior", example, "--out", tmp_path / "out", "--model", table, "--max-steps", 20) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    estimate = fit.parameters["c_10"]
    assert report["parameters"]["c_10"]["prior_mean"] == pytest.approx(estimate.value)
    assert report["parameters"]["c_10"]["prior_sd"] == pytest.approx(estimate.sd)
    assert call("posterior", example, "--out", tmp_path / "no", "--model", table, "--law", "gent") == 2
    assert "holds law 'yeoh', but --law asks for 'gent'" in capsys.readouterr().err
    assert not (tmp_path / "no").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--resume",), "there is no chain to resume"),
        (("--law", "yeeoh"), "did you mean 'yeoh'"),
        (("--law", "neo_hookean", "--walkers", "5"), "walkers = 5 must be even"),
    ],
)
def test_unusable_options_are_one_line(example, tmp_path, capsys, options, message):
    assert call("posterior", example, "--out", tmp_path / "out", *options) == 2
    said = capsys.readouterr().err
    assert message in said and said.strip().splitlines()[-1].startswith("pneusma: ")
    assert not (tmp_path / "out").exists()


def test_what_cannot_be_sampled_says_so(fit):
    with pytest.raises(
        InputError, match="there is no setting 'walker' of a posterior, did you mean 'walkers'"
    ):
        fit.posterior(walker=3)


@pytest.mark.slow
def test_chains_that_have_not_converged_judge_no_error_bar(fit):
    short = fit.posterior(seed=1, progress=False, max_steps=60)
    assert not short.converged
    assert "is not judged" in " ".join(short.verdict) and "agrees" not in " ".join(short.verdict)
    entries = json.loads(short.documents()["report.json"])["parameters"]
    assert {entry["laplace_misleads"] for entry in entries.values()} == {None}
    assert {row[-1] for row in disagreement_table(short).rows} == {"not judged (not converged)"}
