"""The notebook that brings its own base model carries no outputs; with recordings it predicts what was never fitted."""

import ast
from pathlib import Path

import pytest

from fitting.recordings import recordings_folder

nbformat = pytest.importorskip("nbformat")

NOTEBOOK = Path(__file__).resolve().parents[2] / "notebooks" / "05_own_base_model.ipynb"


def code():
    return [c.source for c in nbformat.read(NOTEBOOK, as_version=4).cells if c.cell_type == "code"]


def test_notebook_is_stripped_and_its_code_parses():
    for cell in nbformat.read(NOTEBOOK, as_version=4).cells:
        if cell.cell_type == "code":
            assert not cell.outputs and cell.execution_count is None
            ast.parse(cell.source)


def test_without_recordings_it_says_where_they_are(monkeypatch, capsys):
    import matplotlib

    matplotlib.use("Agg")
    monkeypatch.setattr("fitting.recordings.recordings_folder", lambda: None)
    space = {}
    for source in code():
        exec(compile(source, "notebook", "exec"), space)
    assert space["result"] is None and "PNEUSMA_RECORDINGS" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(recordings_folder() is None, reason="measured recordings are not here (PNEUSMA_RECORDINGS)")
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_predicts_configurations_that_were_never_fitted(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    book = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(book, timeout=900, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [o for c in book.cells if c.cell_type == "code" for o in c.outputs]
    said = "".join(o.get("text", "") for o in outputs)
    before, after = said.split("never fitted: RMSE of angle ")[1].split("\n")[0].split(" -> ")
    assert "13 never fitted" in said and "The base misses" in said
    assert float(after) < 0.8 * float(before)
    assert sum("image/png" in o.get("data", {}) for o in outputs) >= 2
