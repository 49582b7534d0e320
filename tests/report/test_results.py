"""A new type of result needs a function that makes its report, and nothing else."""

import json
from dataclasses import dataclass

import pytest
from matplotlib.figure import Figure

from fitting.data.csv_text import csv_rows
from fitting.inference.results import Result, register_presenter
from fitting.report.cells import number
from fitting.report.report import Picture, Points, Report, Section
from fitting.report.results import presenter, save, text
from fitting.report.table import Table
from pneusma_jax.errors import InputError


@dataclass(frozen=True)
class Pull(Result):
    title: str
    errors: dict[str, float]


def curve(result):
    figure = Figure(figsize=(2.0, 1.0))
    figure.subplots().bar(list(result.errors), list(result.errors.values()))
    return figure


def report_of(result):
    table = Table(["law", "error"], [[law, number(error)] for law, error in result.errors.items()])
    return Report(
        title=result.title, subtitle="Two laws compared", verdict=["Yeoh follows the curve."],
        sections=[
            Section("Laws", [Picture("curve", "Stress over strain.", lambda: curve(result)), table]),
            Section("Notices", [Points([])]),
        ],
        content=lambda: {"schema": "pneusma-pull/1", "errors": result.errors},
        files=lambda: {"errors.csv": csv_rows(["law", "error"], result.errors.items())},
    )  # fmt: skip


@pytest.fixture(scope="module")
def pull():
    register_presenter(Pull, presenter(report_of))
    return Pull("Pull of <A>", {"yeoh": 0.5, "gent": float("nan")})


def test_a_notebook_draws_a_figure_without_pyplot(pull):
    assert pull.plot()["curve"]._repr_png_().startswith(b"\x89PNG")


def test_it_has_text_figures_and_files(pull, tmp_path):
    assert pull.verdict == ["Yeoh follows the curve."] and set(pull.plot()) == {"curve"}
    assert text(pull).startswith("Pull of <A>\nTwo laws compared\n\nVerdict") and "gent    n/a" in text(pull)
    files = save(pull, tmp_path / "out")
    assert {path.name for path in files} == {"report.json", "report.html", "curve.png", "errors.csv"}
    assert json.loads((tmp_path / "out" / "report.json").read_text())["errors"] == {"yeoh": 0.5, "gent": None}
    assert (tmp_path / "out" / "errors.csv").read_text() == "law,error\nyeoh,0.5\ngent,\n"
    assert "Pull of &lt;A&gt;" in (tmp_path / "out" / "report.html").read_text()
    with pytest.raises(InputError, match="results are here already"):
        save(pull, tmp_path / "out")


def test_the_same_result_gives_the_same_bytes(pull):
    assert pull.documents() == pull.documents()
