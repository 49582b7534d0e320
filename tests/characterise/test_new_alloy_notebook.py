"""The notebook from CSV files to a posterior is stripped, parses and runs."""

import ast
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")

NOTEBOOK = Path(__file__).resolve().parents[2] / "notebooks" / "02_new_alloy.ipynb"


def test_notebook_is_stripped_and_its_code_parses():
    cells = nbformat.read(NOTEBOOK, as_version=4).cells
    assert len(cells) > 10
    for cell in cells:
        if cell.cell_type == "code":
            assert not cell.outputs and cell.execution_count is None
            ast.parse(cell.source)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs_from_recordings_to_a_posterior(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    book = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(book, timeout=900, resources={"metadata": {"path": str(tmp_path)}}).execute()
    said = "".join(o.get("text", "") for c in book.cells if c.cell_type == "code" for o in c.outputs)
    assert "at_start         gR_slope" in said and "Verdict" in said and "eps_L: 0.0" in said
    assert (tmp_path / "new_alloy" / "alloy.toml").exists()
