"""The notebook calls the package, carries no outputs, and runs."""

import pytest

NAME = "03_reproduction"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    book = notebook(NAME)
    book.check()
    assert any("from validation.reproduction import" in source for source in book.code())


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(notebook):
    ran = notebook(NAME).run()
    assert "statements of the source" in ran.said and "3.24-5" in ran.said
    assert "alpha_1 as printed" in ran.said and "2.5-8" in ran.said  # the altered alloy is noticed
    assert ran.pictures == 4
