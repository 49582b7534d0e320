"""Every page and every notebook is in the menu of the site, and the README stays short."""

import importlib.util
import posixpath
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SPEC = importlib.util.spec_from_file_location("links_of_the_site", ROOT / "docs" / "_links.py")
links = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(links)
TUTORIALS = {f"tutorials/{path.stem}.md" for path in (ROOT / "notebooks").glob("*.ipynb")}
PAGES = {path.name for path in (ROOT / "docs").glob("*.md")} | TUTORIALS | set(links.COPIED) | {"api.md"}
FIGURES = {f"figures/{path.name}" for path in (ROOT / "docs" / "figures").iterdir()}
SHOWN = {f"{links.SHOWN}/{path.name}" for path in (ROOT / links.SHOWN).iterdir()}


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


@pytest.mark.parametrize("page", sorted(PAGES - {"api.md"}))
def test_every_link_of_a_page_leads_to_a_page_of_the_site(page):
    text = links.moved((ROOT / links.source_of(page)).read_text(), page)
    for link in re.findall(r"\]\(([^)\s#]+)(?:#[^)\s]*)?\)", text):
        if "://" not in link:
            assert posixpath.normpath(posixpath.join(posixpath.dirname(page), link)) in PAGES | FIGURES | SHOWN, link


def test_links_between_files_become_links_between_pages():
    moved = links.moved("[a](../docs/design.md#jumps) [b](runs/core_speed.png) [c](https://x.org)", "benchmarks.md")
    assert moved == "[a](design.md#jumps) [b](benchmarks/runs/core_speed.png) [c](https://x.org)"
    assert links.moved("[a](../docs/proof.md)", "tutorials/06_proof_story.md") == "[a](../proof.md)"
    assert links.moved("[a](../benchmarks/README.md#x)", "diagnosis.md") == "[a](benchmarks.md#x)"
