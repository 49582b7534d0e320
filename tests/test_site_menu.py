"""Every page and every notebook is in the menu of the site, and the README stays short."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_every_page_and_every_notebook_is_in_the_menu():
    menu = set(re.findall(r"[\w/]+\.md", (ROOT / "mkdocs.yml").read_text().split("\nnav:")[1]))
    pages = {path.name for path in (ROOT / "docs").glob("*.md")}
    tutorials = {f"tutorials/{path.stem}.md" for path in (ROOT / "notebooks").glob("*.ipynb")}
    assert pages | tutorials <= menu
    made = {"architecture.md", "changelog.md", "contributing.md", "benchmarks.md", "api.md"}
    assert menu <= pages | tutorials | made


def test_the_readme_is_short_and_its_links_lead_somewhere():
    text = (ROOT / "README.md").read_text()
    assert text.count("\n") <= 120
    for link in re.findall(r"\]\(([^)#]+)\)", text):
        assert (ROOT / link).exists(), link
