"""The notebook from CSV files to a posterior is stripped, parses and runs."""

import pytest

NAME = "02_new_alloy"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    book = notebook(NAME)
    book.check()
    assert len(book.cells()) > 10


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs_from_recordings_to_a_posterior(notebook):
    ran = notebook(NAME).run(900)
    assert "at_start         gR_slope" in ran.said and "Verdict" in ran.said and "eps_L: 0.0" in ran.said
    assert (ran.folder / "new_alloy" / "alloy.toml").exists()
