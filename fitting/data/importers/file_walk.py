"""A process that reads a file from standard input, and so shows whether reading it ends.

    python file_walk.py matlab|workbook SECONDS

It prints a line before it begins. Its exit code is 1 if it did not end in time, or ran out of memory. A
library may also end the process where memory runs out. Other errors are left to the reader that follows,
which says what they are.
"""

import faulthandler
import importlib
import io
import sys
from contextlib import suppress
from typing import Any

LIBRARIES = {"matlab": "scipy.io", "workbook": "python_calamine"}
MOST_MEMORY = {"matlab": 4 * 2**30, "workbook": 2 * 2**30}
"""Maximum memory of this process [B]. A file of MATLAB of 500 MB needs as much, a full sheet of ten columns
0.6 GB."""


def _read(what: str, library: Any, content: bytes) -> None:
    """Read all numbers of a file."""
    if what == "matlab":
        library.loadmat(io.BytesIO(content), struct_as_record=False)
        return
    book = library.CalamineWorkbook.from_filelike(io.BytesIO(content))
    for name in book.sheet_names:
        book.get_sheet_by_name(name).to_python(skip_empty_area=False)


def main() -> None:
    """Read standard input."""
    what, seconds = sys.argv[1], float(sys.argv[2])
    library, content = importlib.import_module(LIBRARIES[what]), sys.stdin.buffer.read()
    with suppress(ImportError, OSError, ValueError):
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY[what], MOST_MEMORY[what]))
    print("ready", flush=True)
    faulthandler.dump_traceback_later(seconds, exit=True)
    try:
        _read(what, library, content)
    except MemoryError:
        sys.exit(1)
    except Exception:
        return


if __name__ == "__main__":
    main()
