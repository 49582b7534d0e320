"""Room for compiled programs in a process that does many tasks."""

import ctypes
import gc
import os
from pathlib import Path

import jax

MOST_MAPS = 20_000
"""Maximum number of memory maps of this process before compiled programs are dropped. Linux allows 65,530;
a single diagnosis adds some thousands."""
MOST_GIB = 4.0
"""Maximum resident memory of this process before compiled programs are dropped [GiB]. A single diagnosis
takes one or two; two processes of this size leave half of a machine of 16 GiB."""


def make_room(most_gib: float = MOST_GIB) -> None:
    """Drop compiled programs where they fill this process's memory maps or its memory; on Linux only.

    Args:
        most_gib: maximum resident memory before programs are dropped [GiB].
    """
    maps = Path("/proc/self/maps")
    if not maps.exists():
        return
    if maps.read_bytes().count(b"\n") > MOST_MAPS or resident_gib() > most_gib:
        jax.clear_caches()
        gc.collect()
        _return_freed()


def resident_gib() -> float:
    """Resident memory of this process [GiB]; 0 where the system does not tell."""
    place = Path("/proc/self/statm")
    if not place.exists():
        return 0.0
    return int(place.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**30


def _return_freed() -> None:
    """Return freed memory to the system: the allocator of glibc keeps it otherwise (500 of 800 MB)."""
    try:
        ctypes.CDLL("libc.so.6").malloc_trim(0)
    except (OSError, AttributeError):  # another C library
        return
