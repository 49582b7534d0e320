"""Campaigns of the package."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def example() -> Path:
    """The simulated elastomer campaign of the package."""
    return Path(__file__).resolve().parents[2] / "calibration_data" / "examples" / "elastomer"
