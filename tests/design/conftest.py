"""One small study, solved once."""

import pytest
from study_files import write_study

import fitting.characterise  # noqa: F401  results know how they look
import fitting.report.results  # noqa: F401
from fitting.design import read_study, run_study


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """The small study and its result."""
    folder = tmp_path_factory.mktemp("small")
    study = read_study(write_study(folder))
    return run_study(study, folder / "evaluations.jsonl"), folder
