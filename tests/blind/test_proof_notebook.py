"""The notebook that tells the blind trial as a story is stripped, keeps the seal shut until the report exists, and runs."""

import json

import pytest

from validation.blind.proof import ledger

NAME = "06_proof_story"


def test_notebook_is_stripped_and_its_code_parses(notebook):
    notebook(NAME).check()


def test_it_opens_the_truth_after_the_report_and_uses_no_scoring_seed(notebook):
    code = "\n".join(notebook(NAME).code())
    assert code.index("report.json") < code.index("truth = open_seals")
    assert 'case_list("development", 3)' in code and "20261121" not in code


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the notebook's server, not ours
def test_notebook_runs(notebook):
    ran = notebook(NAME).run(300)
    shut, changed = "the truth stays sealed: 1 of 1 reports are missing", "does not match its seal"
    assert ran.said.index(shut) < ran.said.index("concealed: strain_stiffening") < ran.said.index(changed)
    line = [line for line in ledger.lines(ledger.LEDGER) if line["plan"] == "full"][-1]
    assert f"{line['cases']:4d} cases" in ran.said and "goals are reached by the rate itself" in ran.said
    assert "covered   True" in ran.said and json.dumps([]) in ran.said.split("wrong     ")[1].split("\n")[0]
    assert ran.pictures == 9
