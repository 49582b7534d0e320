"""Room for compiled programs in a process that does many tasks."""

from pathlib import Path

import jax

MOST_MAPS = 20_000
"""Maximum number of memory maps of this process before compiled programs are dropped. Linux allows 65,530;
a single diagnosis adds some thousands."""


def make_room() -> None:
    """Drop compiled programs where they fill this process's memory maps; on Linux only."""
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        jax.clear_caches()
