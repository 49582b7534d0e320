"""The notebook on a concealed effect carries no outputs, and tells the story that it announces."""

import ast
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")

NOTEBOOK = Path(__file__).resolve().parents[2] / "notebooks" / "04_concealed_physics.ipynb"


def test_notebook_is_stripped_and_its_code_parses():
    for cell in nbformat.read(NOTEBOOK, as_version=4).cells:
        if cell.cell_type == "code":
            assert not cell.outputs and cell.execution_count is None
            ast.parse(cell.source)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    book = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(book, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [o for c in book.cells if c.cell_type == "code" for o in c.outputs]
    said = "".join(o.get("text", "") for o in outputs)
    assert "mullins_softening" in said and "silicone_stiffness" in said
    assert sum("image/png" in o.get("data", {}) for o in outputs) >= 2
