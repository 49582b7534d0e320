"""Dependencies point one way: the rooms of ARCHITECTURE.md, lower ones first."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOW = ("noise.py", "parameters", "recordings", "least_squares", "simulation", "models")
DIAGNOSIS = ("evaluate", "fit", "grow", "judge", "report")
HIGH = ("characterise", "diagnosis", "own_base", "posterior", "plan", "report", "cli")


def imported(path: Path) -> set[str]:
    """Full names of what a module imports when it is imported: what functions import later is left out."""
    here = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    found = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            stem = ".".join(here.split(".")[: -node.level]) + "." if node.level else ""
            found.add(stem + (node.module or ""))
    return found


def modules(room: str) -> list[Path]:
    place = ROOT / room
    return [place] if place.is_file() else sorted(place.rglob("*.py"))


def test_the_model_knows_nothing_of_fitting():
    for path in modules("pneusma_jax"):
        assert not any(name.split(".")[0] in ("fitting", "tests") for name in imported(path)), path


@pytest.mark.parametrize("room", LOW)
def test_what_pipelines_share_imports_no_pipeline(room):
    paths = modules(f"fitting/{room}")
    assert paths
    for path in paths:
        above = {name for name in imported(path) for high in HIGH if name.startswith(f"fitting.{high}")}
        assert not above, f"{path.relative_to(ROOT)} imports {', '.join(sorted(above))}"


def test_every_module_of_the_diagnosis_is_in_a_room_or_goes_through_them():
    folder = ROOT / "fitting" / "diagnosis"
    assert {path.name for path in folder.glob("*.py")} == {"__init__.py", "check.py", "run.py"}
    assert {path.parent.name for path in folder.glob("*/*.py")} == set(DIAGNOSIS)


@pytest.mark.parametrize("room", DIAGNOSIS)
def test_a_room_of_the_diagnosis_imports_none_that_comes_later(room):
    later = tuple(f"fitting.diagnosis.{name}" for name in DIAGNOSIS[DIAGNOSIS.index(room) + 1 :])
    paths = modules(f"fitting/diagnosis/{room}")
    assert len(paths) > 1
    for path in paths:
        assert not [name for name in imported(path) if later and name.startswith(later)], path
