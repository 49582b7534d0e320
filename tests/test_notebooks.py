"""Every notebook carries no outputs and parses; run from top to bottom it tells the story that it announces."""

import ast
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fitting.data.recordings import recordings_folder
from validation.blind.proof import ledger

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
NAMES = sorted(path.stem for path in FOLDER.glob("*.ipynb"))

runs_notebook = pytest.mark.filterwarnings("default")  # of the notebook's server, not ours


class Notebook:
    """One notebook of the project.

    Attributes:
        path: of the file.
        folder: empty, in which it runs.
        said: what it printed, once it ran.
        pictures: how many figures it showed, once it ran.
    """

    def __init__(self, name: str, folder: Path):
        self.path, self.folder = FOLDER / f"{name}.ipynb", folder
        self.said, self.pictures = "", 0
        self._format = pytest.importorskip("nbformat")

    def cells(self) -> list[Any]:
        """Cells as they are in the file."""
        return self._format.read(self.path, as_version=4).cells

    def code(self) -> list[str]:
        """Text of its code cells."""
        return [cell.source for cell in self.cells() if cell.cell_type == "code"]

    def run(self, timeout: float = 600.0) -> "Notebook":
        """Execute it from top to bottom; an error in a cell is one here."""
        client = pytest.importorskip("nbclient").NotebookClient
        book = self._format.read(self.path, as_version=4)
        client(book, timeout=timeout, resources={"metadata": {"path": str(self.folder)}}).execute()
        outputs = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
        self.said = "".join(output.get("text", "") for output in outputs)
        self.pictures = sum("image/png" in output.get("data", {}) for output in outputs)
        return self


@pytest.fixture
def notebook(tmp_path) -> Callable[[str], Notebook]:
    """`notebook("01_name")` is a notebook by its file's name, to be looked at or run in an empty folder."""
    return lambda name: Notebook(name, tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_is_stripped_and_its_code_parses(notebook, name):
    cells = notebook(name).cells()
    code = [cell for cell in cells if cell.cell_type == "code"]
    assert code and len(code) < len(cells), "a notebook has code and text"
    for cell in code:
        assert not cell.outputs and cell.execution_count is None
        ast.parse(cell.source)


@pytest.mark.parametrize(("name", "cells"), [("01_first_bend_and_a_real_elastomer", 20), ("02_new_alloy", 10)])
def test_a_tutorial_is_complete(notebook, name, cells):
    assert len(notebook(name).cells()) > cells


def test_the_reproduction_is_that_of_the_package(notebook):
    assert any("from validation.reproduction import" in source for source in notebook("03_reproduction").code())


def test_without_recordings_the_custom_model_says_where_they_are(notebook, monkeypatch, capsys):
    import matplotlib

    matplotlib.use("Agg")
    monkeypatch.setattr("fitting.data.recordings.recordings_folder", lambda: None)
    space = {}
    for source in notebook("05_custom_model").code():
        exec(compile(source, "notebook", "exec"), space)
    assert space["result"] is None and "PNEUSMA_RECORDINGS" in capsys.readouterr().out


def test_the_proof_opens_the_truth_after_the_report_and_uses_no_scoring_seed(notebook):
    code = "\n".join(notebook("06_proof_story").code())
    assert code.index("report.json") < code.index("truth = open_seals")
    assert 'case_list("development", 3)' in code and "20261121" not in code


STORIES = {
    "02_new_alloy": (("at_start         gR_slope", "Verdict", "eps_L: 0.0"), range(100)),
    "03_reproduction": (
        ("statements of the source", "3.24-5", "alpha_1 as printed", "2.5-8"),  # the altered alloy is noticed
        [4],
    ),
    "04_concealed_physics": (("mullins_softening", "silicone_stiffness"), range(2, 100)),
    "07_design": (("It is limited by", "The front has"), [4]),
    "08_reach_and_control": (
        ("Only stretching the spring again brings it back", "Curvature is spoilt most by"), [3],
    ),
    "09_uncertainty": (
        (
            "the same bytes: True", "depends on most (total Sobol index, 95 %): G_a", "by subset simulation",
            "by importance sampling",
        ),
        [3],
    ),
}  # fmt: skip
"""By notebook: texts that it prints, and numbers of figures that are right."""


@pytest.mark.slow
@runs_notebook
@pytest.mark.parametrize("name", STORIES)
def test_a_notebook_tells_its_story(notebook, name):
    ran = notebook(name).run(900)
    texts, pictures = STORIES[name]
    for text in texts:
        assert text in ran.said
    assert ran.pictures in pictures
    if name == "02_new_alloy":
        assert (ran.folder / "new_alloy" / "alloy.toml").exists()


@pytest.mark.slow
@runs_notebook
def test_the_first_bend_runs_without_the_real_recording_and_says_so(notebook, tmp_path, monkeypatch):
    monkeypatch.setenv("PNEUSMA_RECORDINGS", str(tmp_path))
    ran = notebook("01_first_bend_and_a_real_elastomer").run()
    assert "One constant cannot describe this material" in ran.said
    assert "The recording is not here" in ran.said


@pytest.mark.slow
@pytest.mark.skipif(recordings_folder() is None, reason="measured recordings are not here (PNEUSMA_RECORDINGS)")
@runs_notebook
def test_the_custom_model_predicts_configurations_that_were_never_fitted(notebook):
    ran = notebook("05_custom_model").run(900)
    before, after = ran.said.split("Never fitted: RMSE of angle ")[1].split("\n")[0].split(" -> ")
    assert "13 never fitted" in ran.said and "The base misses" in ran.said
    assert float(after.rstrip(".")) < 0.8 * float(before)
    assert ran.pictures >= 2


@pytest.mark.slow
@runs_notebook
def test_the_proof_scores_after_it_opened_the_seals(notebook):
    ran = notebook("06_proof_story").run(300)
    shut, changed = "the truth stays sealed: 1 of 1 reports are missing", "does not match its seal"
    assert ran.said.index(shut) < ran.said.index("concealed: strain_stiffening") < ran.said.index(changed)
    line = [line for line in ledger.lines(ledger.LEDGER) if line["plan"] == "full"][-1]
    assert f"{line['cases']:4d} cases" in ran.said and "goals are reached by the rate itself" in ran.said
    assert "covered   True" in ran.said and json.dumps([]) in ran.said.split("wrong     ")[1].split("\n")[0]
    assert ran.pictures == 9
