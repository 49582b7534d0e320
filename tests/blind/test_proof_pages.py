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


def seeds_of(cell):
    """Seeds of a cell such as "1 to 3, 7"."""
    ends = [[int(end) for end in part.split(" to ")] for part in cell.split(", ")]
    return {seed for part in ends for seed in range(part[0], part[-1] + 1)}


RESULTS = {"named_first": "named first", "outside_unmodelled": "outside", "false_alarms": "false alarms"}
"""Rates by which a run is told, the first that any of its cases counts for."""


def test_every_line_of_the_ledger_belongs_to_a_run_of_the_table():
    page = (ROOT / "docs" / "proof_runs.md").read_text(encoding="utf-8")
    table = re.search(r"<!-- runs -->\n(.*?)\n<!-- /runs -->", page, re.DOTALL)[1]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]
    left = [line for line in ledger.lines(ledger.LEDGER) if not line["label"]]
    for number, (run, date, seeds, cases, _, result, wrong) in enumerate(reversed(rows), 1):
        lines = [left.pop(0)]
        while sum(line["cases"] for line in lines) < int(cases):
            lines.append(left.pop(0))

        def counts(rate, lines=lines):
            found = [line["rates"][rate] for line in lines]
            return f"{sum(one['k'] for one in found)}/{sum(one['n'] for one in found)}"

        rate = next(rate for rate in RESULTS if not counts(rate).endswith("/0"))
        assert run.startswith(f"[{number}]("), run
        assert sum(line["cases"] for line in lines) == int(cases), run
        assert {line["seed"] for line in lines} == seeds_of(seeds), run
        assert {line["date"][:10] for line in lines} == {date}, run
        assert result == f"{RESULTS[rate]} {counts(rate)}", run
        assert wrong == counts("confident_wrong_all"), run
    assert left == []
