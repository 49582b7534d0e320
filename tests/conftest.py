"""Float64 for every test, and where to find data that is not part of the repository."""

import os
from pathlib import Path

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
