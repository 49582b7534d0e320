"""Public names of the package are loaded when they are first used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import pneusma_jax as pj

SOURCE = Path(pj.__file__)


def typed() -> dict[str, set[str]]:
    """Public names by module, and packages by an empty one, as type checkers and the reference read them."""
    block = next(node for node in ast.parse(SOURCE.read_text()).body if isinstance(node, ast.If))
    found: dict[str, set[str]] = {}
    for node in block.body:
        assert isinstance(node, ast.ImportFrom)
        found.setdefault(node.module or "", set()).update(one.name for one in node.names)
    return found


def test_names_are_loaded_from_where_type_checkers_find_them():
    found = typed()
    assert found.pop("") == set(pj._PACKAGES)
    assert {module: set(names.split()) for module, names in pj._NAMES.items()} == found
    assert set(pj.__all__) == set().union(*found.values())


def test_type_checkers_refuse_a_misspelt_name():
    """They take a module with `__getattr__` for one that has every name."""
    seen = [node.name for node in ast.parse(SOURCE.read_text()).body if isinstance(node, ast.FunctionDef)]
    assert hasattr(pj, "__getattr__") and "__getattr__" not in seen


@pytest.mark.parametrize("name", [*pj.__all__, *pj._PACKAGES])
def test_every_name_is_there(name):
    assert getattr(pj, name) is getattr(pj, name)
    assert name in dir(pj)


def test_no_helper_is_listed_beside_the_public_names():
    listed = {name for name in dir(pj) if not name.startswith("__")}
    assert listed == {*pj.__all__, *pj._PACKAGES}


def test_an_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="pneusma_jax.*no attribute 'solves'"):
        _ = pj.solves


def test_units_and_tables_do_not_load_jax():
    code = (
        "import sys, pneusma_jax as pj; pj.units; pj.load_calibration('krl35'); assert 'jax' not in sys.modules;"
        "pj.solve; assert 'jax' in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
