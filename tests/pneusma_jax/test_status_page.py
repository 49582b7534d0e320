"""The page on equilibria lists every status of a row, each with what it means."""

import re
from pathlib import Path

import pneusma_jax as pj

PAGE = Path(__file__).resolve().parents[2] / "docs" / "equilibria.md"


def test_every_status_has_a_row_of_its_own_and_no_other_does():
    section = re.search(r"^## What the status says\n(.*?)^## ", PAGE.read_text(), flags=re.S | re.M)[1]
    rows = re.findall(r"^\| `(\w+)` \| (.+) \|$", section, flags=re.M)
    assert [name for name, _ in rows] == [status.name for status in pj.Status]
    assert all(len(meaning.split()) >= 3 for _, meaning in rows)
