"""Recordings that `fitting.specimens` predicts: one problem for any kind, whatever its model is."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.cli import main
from fitting.data.recordings import Recording, kinds, read_campaign, write_recording
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.sample import command
from fitting.sample.campaign import sample_problem
from fitting.sample.models import model_problem
from fitting.sample.target import LogDensity
from fitting.specimens import FITTED, SPECIMENS, Specimen, specimen_of
from fitting.specimens.rows import Rows, numbers
from fitting.specimens.saved_models import AugmentedModel, save_model
from pneusma_jax.errors import InputError

SIGMA, COMPLIANCE = 0.1e-3, 0.2e-6  # m, m/Pa


class Stretched(Specimen):
    """A tube that stretches in proportion to pressure."""

    recording, outputs, letter, noun, law, element = kinds.TUBE, ("length",), "T", "tube", "a line", "actuator"
    options = ("material",)

    def drivers(self, recording):
        return ("pressure",)

    def rows_for(self, campaign, options=FITTED, **tables):
        return [
            Rows(
                mask=np.ones(len(r), bool),
                time=r.si("time"),
                inputs={"pressure": r.si("pressure")},
                measured={"length": r.si("length")},
                weight={"length": np.full(len(r), 1.0 / SIGMA)},
                base={"compliance": np.asarray(COMPLIANCE)},
                extra={},
                specimen=np.asarray(1),
            )
            for r in campaign.recordings
        ]

    def parameters_for(self, campaign, **tables):
        return Parameters(Parameter("compliance", COMPLIANCE, prior=Prior(COMPLIANCE, 1e-7, 0.0, 1e-6)))

    def answer(self, values, rows, effects=()):
        return {"length": 56e-3 + numbers(values, rows)["compliance"] * rows.inputs["pressure"]}, {}


@pytest.fixture
def campaign(tmp_path, monkeypatch):
    """Two tubes, one of them for validation, and a model that stretches in proportion to pressure."""
    monkeypatch.setitem(SPECIMENS, "tube", Stretched())
    random = np.random.default_rng(0)
    for name, role, rows in (("first", "fit", 40), ("second", "validation", 25)):
        pressure = np.linspace(0.0, 30.0, rows)
        length = 56.0 + 0.25 * pressure + 0.1 * random.standard_normal(rows)
        columns = {"time_s": np.arange(rows) * 1.0, "pressure_kPa": pressure, "length_mm": length}
        write_recording(
            Recording(
                name=name, path=None, kind="tube", role=role, specimen="A", real=False, columns=columns
            ),
            tmp_path / "campaign",
        )
    return read_campaign(tmp_path / "campaign")


@pytest.fixture
def problem(campaign):
    rows, parameters = (getattr(SPECIMENS["tube"], name)(campaign) for name in ("rows_for", "parameters_for"))
    return model_problem(campaign.title, campaign.recordings, rows, parameters)


def test_only_priors_of_what_is_drawn_are_told(campaign):
    """A held factor on a law with constants of its own had been listed with the constants that are drawn."""
    rows, parameters = (getattr(SPECIMENS["tube"], name)(campaign) for name in ("rows_for", "parameters_for"))
    parameters.add("held", 1.0, vary=False, prior=Prior(1.0, 0.05))
    for row in rows:
        row.base["held"] = np.asarray(1.0)
    made = model_problem(campaign.title, campaign.recordings, rows, parameters)
    assert "Gaussian priors, cut at their bounds, on compliance." in made.notes


def test_a_campaign_is_sampled_by_its_models_residual(campaign, problem):
    result = sample_problem(problem, ensembles=2, max_steps=2000, progress=False)
    pressure = campaign.recordings[0].si("pressure")
    precision = np.sum(pressure**2) / SIGMA**2 + 1e14
    pull = pressure @ (campaign.recordings[0].si("length") - 56e-3) / SIGMA**2 + COMPLIANCE * 1e14
    found = result.posterior.summary["compliance"]
    assert result.converged
    assert abs(found.mean - pull / precision) < 4.0 * found.mcse
    assert found.sd == pytest.approx(precision**-0.5, rel=0.1)
    assert result.posterior.laplace.sd["compliance"] == pytest.approx(precision**-0.5)


def test_validation_is_predicted_and_not_fitted(problem):
    assert [(c.recording, c.role, c.x_column, c.y_column) for c in problem.curves] == [
        ("first", "fit", "pressure_kPa", "length_mm"), ("second", "validation", "pressure_kPa", "length_mm"),
    ]  # fmt: skip
    first, second = problem.predictions(np.array([[0.25e-6], [0.3e-6]]))
    assert first.shape == (2, 40) and second.shape == (2, 25)
    np.testing.assert_allclose(second[0], 56.0 + 0.25 * problem.curves[1].x)
    assert problem.curves[0].sigma == pytest.approx(np.full(40, 0.1))
    (fitted,), both = problem.target.data.measured["length"], problem.data.measured["length"]  # of no other: it costs time
    assert np.array_equal(fitted, both[0]) and not np.array_equal(fitted, both[1])
    assert problem.target.data.weight["length"].sum() > 0.0


def test_points_are_evaluated_in_turn_where_each_has_a_search_and_give_the_same(campaign, problem, monkeypatch):
    monkeypatch.setattr(Stretched, "latent", SimpleNamespace(inside=True))
    rows, parameters = (getattr(SPECIMENS["tube"], name)(campaign) for name in ("rows_for", "parameters_for"))
    searched = model_problem(campaign.title, campaign.recordings, rows, parameters)
    assert searched.target.in_turn and not problem.target.in_turn and specimen_of("spring").latent.inside
    points = np.linspace(0.2e-6, 0.3e-6, 5)[:, None]
    found = [LogDensity(one.target, 3)(points) for one in (searched, problem)]
    np.testing.assert_allclose(*found, rtol=1e-12)


def test_the_command_samples_it_too(campaign, tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        main(["posterior", str(campaign.path), "--out", str(tmp_path / "out"), "--max-steps", "20"])
    assert not left.value.code
    said = capsys.readouterr().out
    assert "compliance" in said and "Gaussian priors, cut at their bounds, on compliance" in said
    with pytest.raises(SystemExit) as left:
        main(["posterior", str(campaign.path), "--out", str(tmp_path / "no"), "--law", "yeoh"])
    assert left.value.code == 2 and "--law is about elastomers" in capsys.readouterr().err


@pytest.mark.parametrize(("table", "option"), [("dragon_skin_10_fast", "material"), ("krl35", "base")])
def test_a_table_of_constants_starts_the_fit_by_its_kind(monkeypatch, table, option):
    monkeypatch.setattr(command, "kind_of", lambda campaign: "actuator")
    monkeypatch.setattr(command, "characterise", lambda campaign, **options: options)
    monkeypatch.setattr(command, "sampling_problem", lambda fit: fit)
    found = command.problem_for(None, table, None, 3)
    found.pop("progress")
    assert found == {"seed": 3, option: table}


@pytest.mark.parametrize(
    ("kind", "model", "law"),
    [
        ("actuator", None, None), ("actuator", "krl35", None), ("actuator", "saved", None),
        ("elastomer", None, None), ("elastomer", None, "yeoh"), ("elastomer", "dragon_skin_10_fast", None),
        ("elastomer", "saved", None),
    ],
)  # fmt: skip
def test_the_fit_before_a_posterior_says_its_steps(monkeypatch, tmp_path, kind, model, law):
    """Its minutes are not silent, whatever is fitted."""
    monkeypatch.setattr(command, "kind_of", lambda campaign: kind)
    monkeypatch.setattr(command, "sampling_problem", lambda fit, table=None: fit)

    def characterise(campaign, progress=lambda word: None, **options):
        progress("step")
        return options

    monkeypatch.setattr(command, "characterise", characterise)
    if model == "saved":
        model = str(save_model(AugmentedModel(), tmp_path / "model.toml"))
    said = []
    found = command.problem_for(None, model, law, 3, said.append)
    assert said == ["step"] and found["seed"] == 3


def test_a_table_of_what_a_tube_does_not_have_is_refused(campaign):
    with pytest.raises(
        InputError, match="kind is 'alloy', but recordings of kind tube start from .* 'silicone'"
    ):
        command.problem_for(campaign, "krl35", None, 0)
