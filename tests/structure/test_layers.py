"""Imports go down the layers of ARCHITECTURE.md: read from the whole source, imports inside functions included."""

import ast
import re

import import_graph
import pytest
from import_graph import LAWS, Import, allowed, circles, imports, layer_of, modules, violations, written

REASONS = {
    "upward": "a module may import its own layer and lower ones only",
    "report": "results are data: only the layers report, validation and cli may import the layer report",
    "inside_functions": "imports inside functions hide dependencies; only fitting.cli may have them, to start at once",
    "circles": "modules that import each other cannot be read one after the other",
}


@pytest.fixture(scope="module")
def edges():
    """Every import of the source."""
    return imports(modules())


@pytest.fixture(scope="module")
def now(edges):
    return violations(edges)


@pytest.mark.parametrize("law", LAWS)
def test_no_import_breaks_a_law_that_is_not_on_the_allow_list(now, law):
    new = sorted(set(now[law]) - set(allowed()[law]))
    assert not new, f"{REASONS[law]}: " + "; ".join(new)


@pytest.mark.parametrize("law", LAWS)
def test_the_allow_list_only_shrinks(now, law):
    gone = sorted(set(allowed()[law]) - set(now[law]))
    assert not gone, "run `python tests/structure/import_graph.py --prune`: " + "; ".join(gone)


def test_every_module_has_a_layer():
    for name in modules():
        if name != "fitting":
            layer_of(name)


def test_the_model_knows_nothing_of_fitting(edges):
    found = [edge for edge in edges if edge.source.startswith("pneusma_jax")]
    assert len(found) > 100
    assert not [str(edge) for edge in found if not edge.target.startswith("pneusma_jax")]


def test_nothing_but_commands_imports_a_command(now, edges):
    entries = {*now["upward"], *now["inside_functions"]}
    above = {str(e) for e in edges if e.target.startswith("fitting.cli") and not e.source.startswith("fitting.cli")}
    assert above <= {entry for entry in entries if entry in allowed()["upward"]}


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """`tree(name=text, ...)` are the violations of a tree with these modules; dots stand as `__`."""
    layers = (("low", ("fitting.low",)), ("report", ("fitting.report",)), ("validation", ("validation",)), ("cli", ("fitting.cli",)))
    monkeypatch.setattr(import_graph, "LAYERS", layers)

    def write(**texts):
        for name, text in texts.items():
            path = tmp_path.joinpath(*name.split("__")).with_suffix(".py")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return violations(imports(modules(tmp_path)))

    return write


def test_an_import_inside_a_method_counts(tree):
    found = tree(
        fitting__low__a="class A:\n    def save(self):\n        from ..report import page\n",
        fitting__report__page="from fitting.low.a import A\n",
    )
    pair = "fitting.low.a -> fitting.report.page"
    assert found["report"] == [pair] and found["inside_functions"] == [pair]
    assert found["circles"] == ["fitting.low.a, fitting.report.page"] and found["upward"] == []


def test_an_import_for_types_alone_counts(tree):
    text = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from fitting.report.page import Page\n"
    found = tree(fitting__low__a=text, fitting__report__page="import fitting.low.a\n")
    assert found["report"] == ["fitting.low.a -> fitting.report.page"] and len(found["circles"]) == 1


def test_commands_may_import_late_and_nothing_may_import_them(tree):
    found = tree(
        fitting__cli__run="def run():\n    import fitting.low.a\n",
        fitting__low__a="import fitting.cli.run\n",
    )
    assert found["inside_functions"] == [] and found["upward"] == ["fitting.low.a -> fitting.cli.run"]


def test_functions_outside_commands_import_no_library():
    """What takes long to load is a `Late` module; one library exists on some systems only."""
    found = set()
    for name, path in modules().items():
        text = path.read_text(encoding="utf-8")
        if not name.startswith("fitting.cli") and re.search(r"^ +(import|from) \S+", text, re.MULTILINE):
            found |= {(name, ast.unparse(node)) for node, inside in import_graph.statements(ast.parse(text)) if inside}
    assert found == {("fitting.data.file_walk", "import resource")}


def test_circles_are_found_through_others():
    edges = [Import("a", "b", False), Import("b", "c", True), Import("c", "a", False), Import("c", "d", False)]
    assert circles(edges) == [("a", "b", "c")]


def test_the_allow_list_is_written_as_it_is_read():
    assert import_graph.ALLOWED.read_text(encoding="utf-8") == written(allowed())
