"""The page of the layers names modules that exist, and every module that reads raw files."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "layers.md").read_text(encoding="utf-8")
RAW_FILE = PAGE[PAGE.index("## A raw file") : PAGE.index("## One `Specimen`")]


@pytest.mark.parametrize("page", ["docs/layers.md", "ARCHITECTURE.md", "CONTRIBUTING.md"])
def test_modules_that_a_page_names_exist(page):
    named = re.findall(r"`([\w/]+\.py)`", (ROOT / page).read_text(encoding="utf-8"))
    known = [path.as_posix() for path in ROOT.glob("*/**/*.py") if ".venv" not in path.parts]
    assert not [name for name in named if not any(f"/{path}".endswith(f"/{name}") for path in known)]


def test_every_module_of_the_importers_has_its_stage():
    """Of known formats the table says only that there is a module for each."""
    named = set(re.findall(r"`(?:\w+/)*(\w+)(?:\.py)?`", RAW_FILE))
    modules = [path for path in (ROOT / "fitting/data/importers").glob("*.py") if path.stem != "__init__"]
    formats = {path.stem for path in modules if re.search("^FORMAT = ", path.read_text(encoding="utf-8"), re.MULTILINE)}
    assert {path.stem for path in modules} - formats <= named


def test_the_way_of_a_recording_has_at_most_ten_steps_whose_modules_define_what_is_named():
    """A module without a folder stands beside the one before it in its row."""
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \|.*\| (.*) \|$", page, re.MULTILINE)
    assert [int(number) for number, _ in rows] == list(range(1, len(rows) + 1)) and len(rows) <= 10
    for _, where in rows:
        folder = None
        for path, names in re.findall(r"`([\w/]+\.py)`(?: \(([^)]*)\))?", where):
            folder = ROOT / "fitting" / Path(path).parent if "/" in path else folder
            tree = ast.parse((folder / Path(path).name).read_text(encoding="utf-8"))
            defined = {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
            assert names and set(re.findall(r"`(\w+)`", names)) <= defined, (path, names)
