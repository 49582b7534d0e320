"""A process that reads everything in a file, and so shows whether reading it ends.

    python file_walk.py hdf5|matlab|workbook FILE SECONDS BYTES

It reads standard input for `-`. It prints a line before it begins. Its exit code is 1 if it did not end in
time, or ran out of memory, and that of a signal where a library ended it. Other errors are left to the reader
that follows, which says what they are.
"""

import faulthandler
import importlib
import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

LIBRARIES = {"hdf5": "h5py", "matlab": "scipy.io", "workbook": "python_calamine"}


@contextmanager
def _errors_left() -> Iterator[None]:
    """Leave any error but one of memory to the reader that follows."""
    try:
        yield
    except MemoryError:
        raise
    except Exception:
        return


def _hdf5(h5py: Any, source: Any) -> None:
    """Read all attributes and numbers of a file."""

    def look(item: Any, seen: set) -> None:
        with _errors_left():
            state = h5py.h5o.get_info(item.id)
            place = (state.fileno, state.addr)
            if place in seen:
                return
            seen.add(place)
        with _errors_left():
            for name in item.attrs:
                with _errors_left():
                    item.attrs[name]
        if isinstance(item, h5py.Dataset):
            with _errors_left():
                item[()]
            return
        with _errors_left():
            for name in item:
                with _errors_left():
                    look(item[name], seen)

    with h5py.File(source, "r") as file:
        look(file, set())


def _matlab(scipy_io: Any, source: Any) -> None:
    """Read all variables of a file."""
    scipy_io.loadmat(source, struct_as_record=False)


def _workbook(calamine: Any, source: Any) -> None:
    """Read all cells of a file."""
    book = calamine.CalamineWorkbook.from_filelike(source)
    for name in book.sheet_names:
        book.get_sheet_by_name(name).to_python(skip_empty_area=False)


READERS = {"hdf5": _hdf5, "matlab": _matlab, "workbook": _workbook}


def main() -> None:
    """Read a file, or standard input for `-`."""
    kind, place, seconds, memory = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4])
    library = importlib.import_module(LIBRARIES[kind])
    source = io.BytesIO(sys.stdin.buffer.read()) if place == "-" else place
    with suppress(ImportError, OSError, ValueError):
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    print("ready", flush=True)
    faulthandler.dump_traceback_later(seconds, exit=True)  # by a thread that no library can hold up
    try:
        with _errors_left():
            READERS[kind](library, source)
    except MemoryError:
        sys.exit(1)


if __name__ == "__main__":
    main()
