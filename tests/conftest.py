"""Float64 for every test, data that is not part of the repository, a limit on compiled code."""

import gc
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fitting.data.recordings import recordings_folder
from fitting.engine.memory import make_room
from pneusma_jax.precision import enable_float64

enable_float64()
gc.set_threshold(200_000, 20, 50)  # tracing makes many objects and few cycles
MOST_GIB = 1.9  # of a process that tests, between modules
ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder beside the checkout with check values and recordings of other laboratories."""
    folder = Path(os.environ.get("PNEUSMA_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}: set PNEUSMA_SHARED to run the comparison with independent values")
    return folder


@pytest.fixture
def measured() -> Callable[[str], Path]:
    """Finds a raw file of the measured recordings, or skips."""

    def find(name: str) -> Path:
        folder = recordings_folder()
        if folder is None or not (folder / name).exists():
            pytest.skip(f"measured recordings are not here: {name} (PNEUSMA_RECORDINGS, or ../shared/recordings)")
        return folder / name

    return find


@pytest.fixture(autouse=True, scope="module")
def bounded_programs() -> Iterator[None]:
    """Drop compiled programs between modules before they crowd the process out of memory maps."""
    yield
    make_room(MOST_GIB)
