"""The notebook on a concealed effect carries no outputs, and tells the story that it announces."""

import pytest

NAME = "04_concealed_physics"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    notebook(NAME).check()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(notebook):
    ran = notebook(NAME).run()
    assert "mullins_softening" in ran.said and "silicone_stiffness" in ran.said
    assert ran.pictures >= 2
