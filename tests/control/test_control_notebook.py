"""The notebook about reach and control is stripped and runs."""

import pytest

NAME = "08_reach_and_control"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    notebook(NAME).check()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(notebook):
    ran = notebook(NAME).run()
    assert "only stretching the spring again brings it back" in ran.said
    assert "Curvature is spoilt most by" in ran.said
    assert ran.pictures == 3
