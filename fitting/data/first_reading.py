"""A first reading of a file by a process of its own, where a library may not end, or end the process."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

START_S = 120.0
"""Maximum time in which that process starts [s]. It takes 0.5 s here, and minutes on a slow shared disk."""


def status_of_reading(reader: Path, arguments: Sequence[str], seconds: float, content: bytes) -> int:
    """Exit status of a reader; 0 where no process can start here, so that none has found a fault.

    Args:
        reader: script that prints a line before it begins. Its last argument is the time that it has [s].
        arguments: those before it.
        seconds: that time.
        content: what it reads from standard input.
    """
    words = [sys.executable, "-P", str(reader), *arguments, f"{seconds:g}"]
    try:
        done = subprocess.run(words, input=content, capture_output=True, timeout=START_S + seconds)
    except (OSError, subprocess.TimeoutExpired):
        return 0
    return done.returncode if done.stdout else 0
