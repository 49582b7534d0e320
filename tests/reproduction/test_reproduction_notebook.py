"""The notebook calls the package, carries no outputs, and runs."""

import ast
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")

NOTEBOOK = Path(__file__).resolve().parents[2] / "notebooks" / "03_reproduction.ipynb"


def test_notebook_is_stripped_and_its_code_parses():
    cells = nbformat.read(NOTEBOOK, as_version=4).cells
    for cell in cells:
        if cell.cell_type == "code":
            assert not cell.outputs and cell.execution_count is None
            ast.parse(cell.source)
    assert any("from fitting.reproduction import" in cell.source for cell in cells)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    book = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(book, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [o for c in book.cells if c.cell_type == "code" for o in c.outputs]
    said = "".join(o.get("text", "") for o in outputs)
    assert "statements of the source" in said and "3.24-5" in said
    assert "alpha_1 as printed" in said and "2.5-8" in said  # the altered alloy is noticed
    assert sum("image/png" in o.get("data", {}) for o in outputs) == 4
