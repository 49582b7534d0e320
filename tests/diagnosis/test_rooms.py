"""Rooms of the diagnosis: each imports those before it only."""

import ast
from pathlib import Path

import pytest

import fitting.diagnosis

FOLDER = Path(fitting.diagnosis.__file__).parent
ROOMS = ("evaluate", "fit", "grow", "judge", "report")


def _rooms_imported(file: Path) -> set[str]:
    """Rooms that a module imports from, by relative or absolute names."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom):
            name = f"fitting.diagnosis.{node.module}" if node.level == 2 else node.module or ""
            parts = name.split(".")
            if parts[:2] == ["fitting", "diagnosis"] and node.level in (0, 2):
                found.add(parts[2])
    return found


def test_every_module_is_in_a_room_or_uses_them() -> None:
    assert {f.name for f in FOLDER.glob("*.py")} == {"__init__.py", "check.py", "run.py"}
    assert {f.name for f in FOLDER.iterdir() if f.is_dir() and not f.name.startswith("_")} == set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_none_that_comes_later(room: str) -> None:
    earlier = set(ROOMS[: ROOMS.index(room)])
    used = {f.name: _rooms_imported(f) for f in (FOLDER / room).glob("*.py")}
    assert len(used) > 1
    assert all(rooms <= earlier for rooms in used.values()), used
