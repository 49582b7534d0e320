"""The page of the layers names modules that exist, and every module that reads raw files."""

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
