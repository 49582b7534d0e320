"""Rates in the README and on the page of the blind trial are those of the ledger."""

import re
from pathlib import Path

import pytest

from validation.blind.proof import ledger

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def stated():
    """Date from which on the page of the trial adds runs, and the table that stands there."""
    page = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8")
    return re.search(r"<!-- rates since (\S+) -->\n(.*?)\n<!-- /rates -->", page, re.DOTALL).groups()


def test_the_page_of_the_trial_states_what_the_ledger_adds_up_to(stated):
    since, table = stated
    found = ledger.table_of_several([line for line in ledger.lines(ledger.LEDGER) if line["date"] >= since])
    assert table == found, "run `python -m validation.blind.proof table --since` and replace the table"


def test_the_readme_states_the_same_counts(stated):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    section = readme.split("## Is the diagnosis to be trusted?")[1].split("\n## ")[0]
    counts = re.findall(r"^\| [^|]+ \| (\d+/\d+) \|", section, re.MULTILINE)
    known = set(re.findall(r"\d+/\d+", stated[1]))
    assert len(counts) == 8 and set(counts) <= known
