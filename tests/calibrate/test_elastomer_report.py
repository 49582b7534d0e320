"""The pipeline as a whole, on the shipped campaign, whose truth is known."""

import csv
import dataclasses
import io
import json
import re
import tomllib

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from fitting.characterise import characterise
from fitting.report.elastomer.figures import MOST_MARKS, drift_figure, fit_figure
from fitting.report.elastomer.text import verdict
from fitting.report.figures import style
from fitting.synthesise.elastomer import TRUTH, true_law, write_example
from pneusma_jax.calibration import load_calibration
from pneusma_jax.silicone import load_silicone


@pytest.fixture(scope="module")
def files(stiffening, tmp_path_factory):
    folder = tmp_path_factory.mktemp("result") / "made"
    stiffening.save(folder)
    return folder


@pytest.fixture(scope="module")
def report(files):
    return json.loads((files / "report.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)


def test_the_law_that_made_the_data_is_taken_and_its_constants_found(stiffening):
    assert stiffening.whole.choice.chosen == "ogden_2"
    truth = np.ravel(list(zip(TRUTH["mu"], TRUTH["alpha"], strict=True)))
    np.testing.assert_array_less(np.abs(stiffening.best.values - truth), 3.0 * stiffening.best.sd)
    assert not any(entry.drifts for entry in stiffening.whole.drifts["ogden_2"])


def test_report_keeps_the_contract(report):
    assert report["schema"] == "pneusma-characterisation/1"
    assert set(report["parameters"]) == {"mu_1", "alpha_1", "mu_2", "alpha_2"}
    for entry in report["parameters"].values():
        assert set(entry) == {"value", "sd", "unit", "at_bound"}
    assert report["parameters"]["mu_1"]["unit"] == "kPa"
    assert report["parameters"]["mu_1"]["value"] == pytest.approx(45.0, abs=3.0 * report["parameters"]["mu_1"]["sd"])
    assert {"mae_MPa", "rmse_MPa", "rpd", "rpd_signed"} <= set(report["metrics"])
    assert report["metrics"]["rmse_MPa"] == pytest.approx(1.0e-3, rel=0.15)  # the noise, 1 kPa
    assert abs(report["metrics"]["rpd_signed"]) <= report["metrics"]["rpd"]
    assert isinstance(report["identifiability"], list) and isinstance(report["next_test"], dict)
    assert report["real"] is False


def test_metrics_are_those_of_the_curve_file(files, report):
    rows = list(csv.DictReader(io.StringIO((files / "curve.csv").read_text(encoding="utf-8"))))
    assert len(rows) == 800
    fitted = [row for row in rows if row["role"] == "fit"]
    left = np.array([float(row["stress_kPa"]) - float(row["model_ogden_2_kPa"]) for row in fitted])
    assert report["metrics"]["mae_MPa"] == pytest.approx(np.abs(left).mean() / 1e3, rel=1e-6)
    assert report["metrics"]["rmse_MPa"] == pytest.approx(np.sqrt((left**2).mean()) / 1e3, rel=1e-6)


def test_material_loads_and_gives_the_fitted_stress(files, stiffening):
    table = load_calibration(files / "material.toml", kind="silicone")
    assert all(table.quantities[name].status == "fitted" for name in stiffening.parameters)
    for name, estimate in stiffening.parameters.items():
        assert table.quantities[name].prior.sd > 0.0
        assert estimate.value > 0.0
    strain = np.linspace(0.0, 3.0, 7)
    np.testing.assert_allclose(
        load_silicone(files / "material.toml")(strain), stiffening.best.stress(strain), rtol=1e-8, atol=1e-6
    )
    narrow = load_calibration(files / "material_actuator.toml", kind="silicone")
    assert narrow.values()["strain_max"] <= 1.5
    assert "simulated" in tomllib.loads((files / "material.toml").read_text())["mu_1"]["source"]


def test_words_say_that_one_constant_cannot_do_it(stiffening, report):
    sentence = next(s for s in stiffening.verdict if s.startswith("One constant cannot describe"))
    assert "neo-Hookean" in sentence and sentence in report["verdict"]
    entry = stiffening.whole.drifts["neo_hookean"][0]
    assert entry.drifts and entry.errors > 3.0 and entry.values[-1] > 1.3 * entry.values[0]
    assert entry.reaches == pytest.approx([1.25, 1.5, 2.0, 3.0, 4.0])


def test_a_law_that_leaves_more_than_noise_leads_to_the_diagnosis(stiffening):
    choice = dataclasses.replace(stiffening.whole.choice, chosen="neo_hookean")
    poor = dataclasses.replace(stiffening, whole=dataclasses.replace(stiffening.whole, choice=choice))
    leads = [any("`pneusma diagnose` looks for the cause" in s for s in verdict(one)) for one in (stiffening, poor)]
    assert leads == [False, True]


def test_held_out_errors_are_at_the_noise_for_the_true_law_and_far_above_for_one_constant(stiffening):
    held = stiffening.whole.held
    assert held["ogden_2"].interpolation.rmse == pytest.approx(1e3, rel=0.2)
    assert held["neo_hookean"].interpolation.rmse > 20e3
    assert set(held["ogden_2"].recordings) == {"pull_1", "pull_2", "pull_3"}
    transfer = held["ogden_2"].validation["pull_4"]
    assert transfer.rmse_scaled == pytest.approx(1e3, rel=0.2) and transfer.rmse_scaled < 0.5 * transfer.score.rmse
    for part in held["neo_hookean"].ranges[:-1]:
        assert part.beyond.rmse > part.inside.rmse


def test_validation_is_never_fitted(campaign, stiffening):
    samples = stiffening.samples
    validation = samples.of([curve.role for curve in samples.curves].index("validation"))
    assert validation.sum() == 200
    for fit in stiffening.whole.fits.values():
        assert not np.any(fit.mask & validation)
    assert "C" not in stiffening.best.factors


def test_page_is_self_contained_and_starts_with_the_verdict(files, stiffening):
    page = (files / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"""(src|href)\s*=\s*["'](?!data:)""", page)
    assert page.count("data:image/svg+xml;base64,") == 4
    assert page.index("Recommended law") < page.index("<figure>")
    assert "simulated data, not measured" in page
    assert stiffening.title in page


def test_next_test_is_the_one_that_leaves_least(report):
    test = report["next_test"]
    left = [candidate["stress_error_after_kPa"] for candidate in test["candidates"]]
    assert left == sorted(left) and left[0] < test["stress_error_now_kPa"]
    assert test["name"] == "compression"  # pulls alone cannot tell the laws apart there
    assert all(candidate["information_nats"] > 0.0 for candidate in test["candidates"])


def test_text_report_holds_every_part(stiffening):
    text = " ".join(stiffening.report().split())
    for part in ("Verdict", "Parameters", "Laws", "How it was fitted", "Next test", "SIMULATED"):
        assert part in text
    assert "correlated" in text and "standard errors were multiplied by" in text


def test_the_legend_of_the_drift_hides_no_error_bar(stiffening):
    with style():
        figure = drift_figure(stiffening.whole)
    (axes,), (legend,) = figure.axes, figure.legends
    FigureCanvasAgg(figure).draw()
    assert axes.get_legend() is None
    assert not legend.get_window_extent().overlaps(axes.get_window_extent())


def test_laws_stand_in_the_order_that_the_table_states(stiffening):
    names = [one.name for one in stiffening.whole.choice.ranked]
    over_noise = [np.mean([score.weighted for *_, score in stiffening.whole.held[name].bands]) for name in names]
    assert over_noise == sorted(over_noise)
    said = "Best first, by the mean square error in gaps of the curve over each recording's noise."
    assert said in " ".join(stiffening.report().split())


@pytest.mark.slow
def test_same_seed_same_bytes(campaign):
    first, second = (characterise(campaign, law="neo_hookean", seed=3).documents() for _ in range(2))
    assert first.keys() == second.keys()
    assert all(first[name] == second[name] for name in first)


def test_max_strain_and_relative_weighting_change_what_is_fitted(campaign):
    short = characterise(campaign, law="neo_hookean", max_strain=0.5)
    assert short.whole.strain_max <= 0.5
    long = characterise(campaign, law="neo_hookean", weighting="relative")
    plain = characterise(campaign, law="neo_hookean")
    assert short.best.values[0] < long.best.values[0] < plain.best.values[0]
    assert "5 % of the stress" in " ".join(long.report().split())


def test_shipped_campaign_is_the_one_that_the_generator_writes(tmp_path):
    from importlib import resources

    write_example(tmp_path)
    shipped = resources.files("calibration_data") / "examples" / "elastomer"
    names = {entry.name for entry in shipped.iterdir()}
    assert names == {path.name for path in tmp_path.iterdir()}
    for name in names:
        assert (shipped / name).read_text() == (tmp_path / name).read_text()
    assert true_law()(np.zeros(1))[0] == 0.0


def test_the_figure_of_the_fit_draws_few_marks(stiffening):
    left, right = fit_figure(stiffening).axes
    for axes in (left, right):
        marks = sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() != "None")
        assert 0.5 * MOST_MARKS < marks <= MOST_MARKS


@pytest.mark.parametrize(("role", "said"), [("validation", True), ("fit", False)])
def test_compression_counts_as_fitted_only_in_recordings_that_were(stiffening, role, said):
    samples = stiffening.samples
    squeezed = dataclasses.replace(
        samples,
        curves=(dataclasses.replace(samples.curves[0], role=role), *samples.curves[1:]),
        strain=np.where(samples.of(0), samples.strain - 0.3, samples.strain),
    )
    right = fit_figure(dataclasses.replace(stiffening, samples=squeezed)).axes[1]
    assert ("no compression fitted" in right.get_title()) is said
