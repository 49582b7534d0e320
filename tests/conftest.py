"""Float64 for every test, where to find data that is not part of the repository, and a limit on compiled code."""

import os
from pathlib import Path

import jax
import pytest

from pneusma_jax.precision import enable_float64

enable_float64()
ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder beside the checkout with check values and recordings of other laboratories."""
    folder = Path(os.environ.get("PNEUSMA_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}: set PNEUSMA_SHARED to run the comparison with independent values")
    return folder


MOST_MAPS = 20_000
"""Memory maps of a process past which its compiled programs are dropped: each keeps several, Linux allows 65530
by default, and a process that reaches the limit crashes inside the compiler."""


@pytest.fixture(autouse=True, scope="module")
def bounded_programs():
    """Drop compiled programs between modules before they crowd the process out of memory maps."""
    yield
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        jax.clear_caches()
