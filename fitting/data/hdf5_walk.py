"""A process that reads everything in an HDF5 file, and so shows whether reading it ends.

    python hdf5_walk.py FILE SECONDS

It prints a line before it begins. Its exit code is 1 if it did not end in time, or a signal's where the HDF5
library ended it. Errors are left to the reader that follows, which says what they are.
"""

import faulthandler
import io
import sys
from contextlib import suppress
from typing import Any

import h5py


def _look(item: Any, seen: set) -> None:
    """Read attributes and numbers of an item, and of all items below it."""
    with suppress(Exception):
        state = h5py.h5o.get_info(item.id)
        place = (state.fileno, state.addr)
        if place in seen:
            return
        seen.add(place)
    with suppress(Exception):
        for name in item.attrs:
            with suppress(Exception):
                item.attrs[name]
    if isinstance(item, h5py.Dataset):
        with suppress(Exception):
            item[()]
        return
    with suppress(Exception):
        for name in item:
            with suppress(Exception):
                _look(item[name], seen)


def main() -> None:
    """Read a file, or standard input for `-`."""
    source, seconds = sys.argv[1], float(sys.argv[2])
    print("ready", flush=True)
    faulthandler.dump_traceback_later(seconds, exit=True)  # by a thread that the library cannot hold up
    content = io.BytesIO(sys.stdin.buffer.read()) if source == "-" else source
    with suppress(Exception), h5py.File(content, "r") as file:
        _look(file, set())


if __name__ == "__main__":
    main()
