"""Float64 for every test, data that is not part of the repository, the notebooks, a limit on compiled code."""

import ast
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import pytest

from pneusma_jax.precision import enable_float64

enable_float64()
ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder beside the checkout with check values and recordings of other laboratories."""
    folder = Path(os.environ.get("PNEUSMA_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}: set PNEUSMA_SHARED to run the comparison with independent values")
    return folder


class Notebook:
    """One notebook of the project.

    Attributes:
        path: of the file.
        folder: empty, in which it runs.
        said: what it printed, once it ran.
        pictures: how many figures it showed, once it ran.
    """

    def __init__(self, name: str, folder: Path):
        self.path, self.folder = ROOT / "notebooks" / f"{name}.ipynb", folder
        self.said, self.pictures = "", 0
        self._format = pytest.importorskip("nbformat")

    def cells(self) -> list[Any]:
        """Cells as they are in the file."""
        return self._format.read(self.path, as_version=4).cells

    def code(self) -> list[str]:
        """Text of its code cells."""
        return [cell.source for cell in self.cells() if cell.cell_type == "code"]

    def check(self) -> None:
        """It carries no outputs, and its code parses."""
        cells = [cell for cell in self.cells() if cell.cell_type == "code"]
        assert cells and len(cells) < len(self.cells()), "a notebook has code and text"
        for cell in cells:
            assert not cell.outputs and cell.execution_count is None
            ast.parse(cell.source)

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
    """`notebook("01_name")` is a notebook by its file's name, to be checked and run in an empty folder."""
    return lambda name: Notebook(name, tmp_path)


MOST_MAPS = 20_000
"""Memory maps of a process past which its compiled programs are dropped: each keeps several, Linux allows 65530
by default, and a process that reaches the limit crashes inside the compiler."""


@pytest.fixture(autouse=True, scope="module")
def bounded_programs():
    """Drop compiled programs between modules before they crowd the process out of memory maps."""
    yield
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        jax.clear_caches()
