"""The first notebook is stripped and runs, with the real recording and without it."""

import ast
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")

NOTEBOOK = Path(__file__).resolve().parents[2] / "notebooks" / "01_first_bend_and_a_real_elastomer.ipynb"


def test_notebook_is_stripped_and_its_code_parses():
    cells = nbformat.read(NOTEBOOK, as_version=4).cells
    assert len(cells) > 20
    for cell in cells:
        if cell.cell_type == "code":
            assert not cell.outputs and cell.execution_count is None
            ast.parse(cell.source)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs_and_skips_what_is_not_there(tmp_path, monkeypatch):
    nbclient = pytest.importorskip("nbclient")
    monkeypatch.setenv("PNEUSMA_RECORDINGS", str(tmp_path))
    book = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(book, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    said = "".join(o.get("text", "") for c in book.cells if c.cell_type == "code" for o in c.outputs)
    assert "One constant cannot describe this material" in said
    assert "The recording is not here" in said
