"""The notebook about a design study is stripped and runs."""

import pytest

NAME = "07_design"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    notebook(NAME).check()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(notebook):
    ran = notebook(NAME).run()
    assert "It is limited by" in ran.said and "The front has" in ran.said
    assert ran.pictures == 4
