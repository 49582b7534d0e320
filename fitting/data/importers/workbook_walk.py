"""A process that reads a workbook from standard input, and so shows whether reading it ends.

    python workbook_walk.py SECONDS

It prints a line before it begins. Its exit code is 1 if it did not end in time. The library ends the process
where memory runs out. Other errors are left to the reader that follows, which says what they are.
"""

import faulthandler
import io
import sys
from contextlib import suppress

import python_calamine

MOST_MEMORY = 2 * 2**30
"""Maximum memory of this process [B]. A full sheet of ten columns needs 0.6 GB."""


def main() -> None:
    """Read standard input."""
    content = sys.stdin.buffer.read()
    with suppress(ImportError, OSError, ValueError):
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    print("ready", flush=True)
    faulthandler.dump_traceback_later(float(sys.argv[1]), exit=True)
    try:
        book = python_calamine.CalamineWorkbook.from_filelike(io.BytesIO(content))
        for name in book.sheet_names:
            book.get_sheet_by_name(name).to_python(skip_empty_area=False)
    except MemoryError:
        sys.exit(1)
    except Exception:
        return


if __name__ == "__main__":
    main()
