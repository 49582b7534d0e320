"""No function uses a global name that its module lacks.

Ruff's rule for this (F821) takes the shapes in annotations, such as `Float[Array, "rows"]`, for names, so it is
off. The symbol table of the compiler does not look into strings.
"""

import builtins
import symtable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
GIVEN = {*dir(builtins), "__file__", "__name__", "__doc__", "__path__"}


def undefined(source: str) -> list[tuple[int, str]]:
    """Line of a function, and the global name that it uses and its module lacks."""
    module = symtable.symtable(source, "module", "exec")
    symbols = module.get_symbols()
    names = {s.get_name() for s in symbols if s.is_assigned() or s.is_imported() or s.is_namespace()} | GIVEN
    found, tables = [], [module]
    while tables:
        table = tables.pop()
        tables += table.get_children()
        used = [s.get_name() for s in table.get_symbols() if s.is_referenced() and s.is_global()]
        found += [(table.get_lineno(), name) for name in used if name not in names]
    return found


@pytest.mark.parametrize("package", ["pneusma_jax", "fitting", "validation", "benchmarks", "tests"])
def test_every_global_name_is_defined(package):
    found = {str(f.relative_to(ROOT)): undefined(f.read_text()) for f in sorted((ROOT / package).rglob("*.py"))}
    assert {name: lines for name, lines in found.items() if lines} == {}


def test_an_undefined_name_is_found():
    assert undefined("def f(x: 'rows'):\n    return g(x)\n") == [(1, "g")]
