"""The notebook on uncertainty is stripped, and does what it says."""

import pytest

NAME = "09_uncertainty"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    notebook(NAME).check()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(notebook):
    ran = notebook(NAME).run(500)
    assert "the same bytes: True" in ran.said and "depends on most (total Sobol index, 95 %): G_a" in ran.said
    assert "by subset simulation" in ran.said and "by importance sampling" in ran.said
    assert ran.pictures == 3
