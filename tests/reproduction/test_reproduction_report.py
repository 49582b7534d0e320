"""The files of a reproduction: complete, consistent with each other, nothing to fetch, nothing half-written."""

import csv
import html
import io
import json
import re
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from fitting.cli import main
from pneusma_jax import tube_length
from pneusma_jax.errors import InputError
from validation.reproduction import ENTRIES, reproduce
from validation.reproduction.isoresistive import controlled, phase_fractions, setpoints
from validation.reproduction.loading import isoresistive_stress
from validation.reproduction.silicone_laws import PRESSURES, tube_lengths

QUICK = tuple(entry for entry in ENTRIES if entry.number in ("2.5", "2.10", "3.4"))


@pytest.fixture(scope="module")
def small(bench):
    return reproduce(bench, QUICK)


@pytest.fixture(scope="module")
def documents(small, every_png):
    return small.documents()


def test_the_files_are_complete(small, documents):
    assert set(documents) == {
        "report.html", "statements.csv", "report.json", "figure_2_5.png", "figure_2_10.png", "figure_3_4.png",
    }  # fmt: skip
    assert all(
        documents[e.file_name].startswith(b"\x89PNG") and len(documents[e.file_name]) > 10_000 for e in QUICK
    )


def test_csv_and_json_say_the_same(small, documents):
    report = json.loads(documents["report.json"])
    rows = list(csv.DictReader(io.StringIO(documents["statements.csv"])))
    assert report["schema"] == "pneusma-reproduction/1"
    assert [r["number"] for r in rows] == [s["number"] for s in report["statements"]]
    assert [float(r["ours"]) for r in rows] == [s["ours"] for s in report["statements"]]
    assert [r["verdict"] for r in rows] == [s["verdict"] for s in report["statements"]]
    named = [number for figure in report["figures"] for number in figure["statements"]]
    assert named == [r["number"] for r in rows]
    assert sum(report["counts"].values()) == sum(r["stated"] == "true" for r in rows)
    assert report["counts"]["disagrees"] == sum(r["verdict"] == "disagrees" for r in rows) == 3


def test_the_page_gives_the_verdict_first_and_fetches_nothing(small, documents):
    page = documents["report.html"]
    assert page.index('class="verdict"') < page.index("<table") < page.index("<figure>")
    assert not re.search(r'(src|href)="(?!data:)', page)
    for judged in small.judged:
        assert f"<td>{judged.statement.number}</td>" in page
        assert judged.statement.says in html.unescape(page)
    assert page.count("<figure>") == len(QUICK)
    assert all(entry.lost in page for entry in QUICK)


def test_figures_name_their_axes_with_units(small):
    for figure in small.figures.values():
        for axes in figure.axes:
            assert re.search(r"\[.+\]", axes.get_xlabel() + axes.get_ylabel())


def test_results_are_not_overwritten_unasked(small, tmp_path):
    written = small.save(tmp_path / "out")
    assert all(path.exists() for path in written)
    with pytest.raises(InputError, match="--force"):
        small.save(tmp_path / "out")
    assert small.save(tmp_path / "out", force=True) == written


def test_the_command_refuses_a_taken_folder_before_it_computes(tmp_path):
    (tmp_path / "report.json").write_text("{}")
    result = CliRunner().invoke(main, ["reproduce", "--out", str(tmp_path)])
    assert result.exit_code == 2 and "--force" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


@pytest.mark.slow
def test_the_command_writes_every_figure(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "fitting.cli", "reproduce", "--out", str(tmp_path / "out")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "out").glob("*.png")} == {entry.file_name for entry in ENTRIES}
    assert re.search(r"Of \d+ statements", done.stdout)
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("<figure>") == len(ENTRIES) and "Where we disagree" in page


def test_a_controller_keeps_its_setpoint_where_the_phases_allow(bench):
    alloy = bench.alloys["krl45"]
    gamma = np.linspace(0.0, 0.19, 40)
    for setpoint in setpoints(alloy):
        rho, xi0 = controlled(alloy, setpoint, gamma)
        np.testing.assert_allclose(np.asarray(alloy.resistivity(xi0, gamma)), rho, atol=1e-6)
        cold = np.asarray(alloy.rho_m(gamma))
        np.testing.assert_array_equal(
            rho, np.where(cold < setpoint, cold, setpoint) if setpoint < cold[0] else cold
        )
        assert all(np.all((0.0 <= f) & (f <= 1.0)) for f in phase_fractions(alloy, xi0, gamma).values())


def test_isoresistive_curves_end_at_the_bounding_curves(bench):
    alloy = bench.alloys["krl35"]
    gamma = np.linspace(0.0, 0.18, 50)
    for setpoint in setpoints(alloy)[1:-1]:
        possible = (np.asarray(alloy.rho_a(gamma)) <= setpoint) & (setpoint <= np.asarray(alloy.rho_m(gamma)))
        np.testing.assert_array_equal(np.isfinite(isoresistive_stress(alloy, setpoint, gamma)), possible)


def test_tube_lengths_read_backwards_are_those_of_the_root_find(bench):
    law = bench.silicone
    for k in (5, 15, 25):
        exact = 1e3 * float(tube_length(PRESSURES[k], 56e-3, 10e-3, 1e-3, law))
        assert tube_lengths(law)[k] == pytest.approx(exact, abs=1e-3)
