"""The first notebook is stripped and runs without the real recording, which it says it lacks."""

import pytest

NAME = "01_first_bend_and_a_real_elastomer"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    book = notebook(NAME)
    book.check()
    assert len(book.cells()) > 20


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs_and_skips_what_is_not_there(notebook, tmp_path, monkeypatch):
    monkeypatch.setenv("PNEUSMA_RECORDINGS", str(tmp_path))
    ran = notebook(NAME).run()
    assert "One constant cannot describe this material" in ran.said
    assert "The recording is not here" in ran.said
