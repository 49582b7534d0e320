"""The notebook that brings its own base model carries no outputs; with recordings it predicts what was never fitted."""

import pytest

from fitting.data.recordings import recordings_folder

NAME = "05_custom_model"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    notebook(NAME).check()


def test_without_recordings_it_says_where_they_are(notebook, monkeypatch, capsys):
    import matplotlib

    matplotlib.use("Agg")
    monkeypatch.setattr("fitting.data.recordings.recordings_folder", lambda: None)
    space = {}
    for source in notebook(NAME).code():
        exec(compile(source, "notebook", "exec"), space)
    assert space["result"] is None and "PNEUSMA_RECORDINGS" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(recordings_folder() is None, reason="measured recordings are not here (PNEUSMA_RECORDINGS)")
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_predicts_configurations_that_were_never_fitted(notebook):
    ran = notebook(NAME).run(900)
    before, after = ran.said.split("never fitted: RMSE of angle ")[1].split("\n")[0].split(" -> ")
    assert "13 never fitted" in ran.said and "The base misses" in ran.said
    assert float(after) < 0.8 * float(before)
    assert ran.pictures >= 2
