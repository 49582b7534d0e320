"""A first reading of a file by a process of its own, where a library may not end, or end the process."""

import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

READER = Path(__file__).with_name("file_walk.py")
"""Script that reads a file. It prints a line before it begins."""
START_S = 120.0
"""Maximum time in which that process starts [s]. It takes 0.5 s here, and minutes on a slow shared disk."""
READ_S = 5.0
"""Maximum time to read a small file [s]. Files of this project take 0.01 s, 10 MB of MATLAB 0.2 s."""


class Limits(NamedTuple):
    """Limits within which a file of one kind is read.

    Attributes:
        bytes_per_s: minimum speed at which a large file is read [B/s].
        memory: maximum memory of the process that reads it [B].
        if_ended: fault of a file whose library ends that process. Some do so where memory runs out.
    """

    bytes_per_s: float
    memory: int
    if_ended: str


TOO_MUCH = "reading it takes too long or too much memory"
LIMITS = {
    "hdf5": Limits(10e6, 4 * 2**30, "reading it ends the process that does"),
    "matlab": Limits(5e6, 4 * 2**30, TOO_MUCH),
    "workbook": Limits(1e6, 2 * 2**30, TOO_MUCH),
}
"""Limits by kind of file. A file of MATLAB of 500 MB needs that memory, a full sheet of ten columns 0.6 GB.
A packed workbook of 1 MB takes 0.3 s."""


def fault_of_reading(kind: str, source: Path | bytes) -> str:
    """Reason why a library does not read a file in bounded time and memory; empty if it does.

    It is empty, too, where no process can start here, so that none has found a fault.

    Args:
        kind: kind of file, a key of `LIMITS`.
        source: path of the file, or its bytes.
    """
    limits = LIMITS[kind]
    inside = isinstance(source, bytes)
    size = len(source) if inside else source.stat().st_size
    seconds = READ_S + size / limits.bytes_per_s
    arguments = [kind, "-" if inside else str(source), f"{seconds:g}", str(limits.memory)]
    words = [sys.executable, "-P", str(READER), *arguments]
    content = source if inside else b""
    try:
        done = subprocess.run(words, input=content, capture_output=True, timeout=START_S + seconds)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    if not done.stdout or not done.returncode:
        return ""
    return TOO_MUCH if done.returncode > 0 else limits.if_ended
