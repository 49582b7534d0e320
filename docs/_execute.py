"""Execute a notebook in an empty folder, for the site: python docs/_execute.py NOTEBOOK OUT.

A notebook that needs recordings of other laboratories says so where they are not here, and goes on. Any other
error ends the build: a page without its outputs would look as if it had none.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

LIMIT_S = 1800
FOLDER = "PNEUSMA_RECORDINGS"
"""Environment variable with a folder of recordings, which may be relative to where this is called."""


def main(notebook: Path, out: Path) -> int:
    """Execute and write; 1 if a cell fails, and then nothing is written."""
    if os.environ.get(FOLDER):
        os.environ[FOLDER] = str(Path(os.environ[FOLDER]).resolve())
    book, begun = nbformat.read(notebook, as_version=4), time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        try:
            NotebookClient(book, timeout=LIMIT_S, resources={"metadata": {"path": folder}}).execute()
        except CellExecutionError as error:
            print(f"{notebook.name}: {error}", file=sys.stderr)
            return 1
    out.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(book, out)
    print(f"{notebook.name} executed in {time.monotonic() - begun:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
