"""Execute a notebook in an empty folder, for the site: python docs/_execute.py NOTEBOOK OUT.

A notebook that needs recordings of other laboratories, which are not here, stays as it is. Its page then has
no outputs, and this says so.
"""

import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

LIMIT_S = 1800


def main(notebook: Path, out: Path) -> None:
    """Execute and write, or write as it is."""
    book = nbformat.read(notebook, as_version=4)
    plain = nbformat.read(notebook, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        try:
            NotebookClient(book, timeout=LIMIT_S, resources={"metadata": {"path": folder}}).execute()
        except CellExecutionError as error:
            print(f"{notebook.name} was not executed: {str(error).strip().splitlines()[-1]}", file=sys.stderr)
            book = plain
    out.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(book, out)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
