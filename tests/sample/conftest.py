"""Campaigns of the package."""

from pathlib import Path

import pytest

import fitting.characterise  # noqa: F401  results know how they look


@pytest.fixture(scope="session")
def example() -> Path:
    """The simulated elastomer campaign of the package."""
    return Path(__file__).resolve().parents[2] / "calibration_data" / "examples" / "elastomer"
