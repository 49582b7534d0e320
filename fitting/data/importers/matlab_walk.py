"""A process that reads a file of MATLAB from standard input, and so shows whether reading it ends.

    python matlab_walk.py SECONDS

It prints a line before it begins. Its exit code is 1 if it did not end in time, or ran out of memory. Other
errors are left to the reader that follows, which says what they are.
"""

import faulthandler
import io
import sys
from contextlib import suppress

import scipy.io

MOST_MEMORY = 4 * 2**30
"""Maximum memory of this process [B]. A file of 500 MB needs as much."""


def main() -> None:
    """Read standard input."""
    content = sys.stdin.buffer.read()
    with suppress(ImportError, OSError, ValueError):
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    print("ready", flush=True)
    faulthandler.dump_traceback_later(float(sys.argv[1]), exit=True)
    try:
        scipy.io.loadmat(io.BytesIO(content), struct_as_record=False)
    except MemoryError:
        sys.exit(1)
    except Exception:
        return


if __name__ == "__main__":
    main()
