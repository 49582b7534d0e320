"""Every page and every notebook is in the menu of the site, links lead to headings, and first pages stay short."""

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
    assert set(links.COPIED) <= menu <= pages | tutorials | set(links.COPIED) | {"api.md"}


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


def headings(text: str) -> set[str]:
    """Anchors of a page's headings, as Python-Markdown makes them, and those that are stated."""
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    titles = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title) for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE)]
    plain = [re.sub(r"[^\w\s-]", "", title.replace("`", "")).strip().lower() for title in titles]
    return {re.sub(r"[-\s]+", "-", title) for title in plain} | set(re.findall(r"\{#([\w-]+)\}", text))


@pytest.mark.parametrize("page", sorted(PAGES - {"api.md"} - TUTORIALS))
def test_every_anchor_of_a_page_is_a_heading(page):
    source = links.source_of(page)
    for link, anchor in re.findall(r"\]\(([^)\s#]*)#([^)\s]+)\)", (ROOT / source).read_text()):
        path = posixpath.normpath(posixpath.join(posixpath.dirname(source), link)) if link else source
        made = path == "docs/commands.md" and anchor.startswith("options-")
        if "://" not in link and path.endswith(".md") and not made:
            assert anchor in headings((ROOT / path).read_text()), f"{link}#{anchor}"


def test_an_anchor_is_made_of_a_heading():
    assert headings("# A `b.c`, and d\n```\n# e\n```\n## [F](g.md) {#h}\n") >= {"a-bc-and-d", "h"}
    assert "e" not in headings("# A `b.c`, and d\n```\n# e\n```\n")


def test_the_first_page_of_the_benchmarks_is_short_and_leads_to_all_others():
    folder = ROOT / "benchmarks"
    text = (folder / "README.md").read_text()
    assert text.count("\n") <= 200
    pages = {path.name for path in folder.glob("*.md")} - {"README.md"}
    assert {f"benchmarks/{name}" for name in pages} <= set(links.COPIED)
    for name in pages:
        assert f"]({name})" in text, name
    for script in folder.glob("*.py"):
        if '__name__ == "__main__"' in script.read_text():
            assert script.name in text, script.name


def test_the_manual_of_the_diagnosis_is_short_and_tells_first_what_a_reader_needs():
    text = (ROOT / "docs" / "diagnosis.md").read_text()
    assert text.count("\n") <= 300
    assert re.findall("^## (.*)$", text, re.MULTILINE) == ["How to read a report", "Method", "Where it may be wrong"]
    assert "\n```\npneusma diagnose " in text.split("\n## ")[0]


def test_links_between_files_become_links_between_pages():
    moved = links.moved("[a](../docs/design.md#a-study) [b](runs/core_speed.png) [c](https://x.org)", "benchmarks.md")
    assert moved == "[a](design.md#a-study) [b](benchmarks/runs/core_speed.png) [c](https://x.org)"
    assert links.moved("[a](../docs/proof.md)", "tutorials/06_proof_story.md") == "[a](../proof.md)"
    assert links.moved("[a](../benchmarks/README.md#x)", "diagnosis.md") == "[a](benchmarks.md#x)"
    assert links.moved("[a](README.md#x) [b](../docs/proof.md)", "benchmarks/core.md") == "[a](../benchmarks.md#x) [b](../proof.md)"
    assert links.moved("![a](../docs/figures/x.png)", "benchmarks/design.md") == "![a](../docs/figures/x.png)", "no such file"
    figure = links.moved("![a](../docs/figures/design_search.png)", "benchmarks/design.md")
    assert figure == "![a](../figures/design_search.png)"
