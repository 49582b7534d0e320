"""Imports of the packages as a graph, read from the source.

Imports inside functions and those for types alone (`if TYPE_CHECKING:`) are counted, too.

    python tests/structure/import_graph.py            counts of what the laws forbid
    python tests/structure/import_graph.py --prune    remove from the allow-list what exists no more
"""

import argparse
import ast
import tomllib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("pneusma_jax", "fitting", "validation")
ALLOWED = Path(__file__).with_name("allowed_imports.toml")
LAWS = ("upward", "report", "inside_functions", "circles")

LAYERS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "model.base",
        (
            "pneusma_jax.errors", "pneusma_jax.precision", "pneusma_jax.units", "pneusma_jax.documents",
            "pneusma_jax.files", "pneusma_jax.late", "pneusma_jax.numerics", "pneusma_jax.pipeline",
            "pneusma_jax.program_cache", "pneusma_jax.implausible",
            "pneusma_jax.model_discrepancy",
        ),
    ),
    ("model.calibration", ("pneusma_jax.calibration",)),
    ("model.laws", ("pneusma_jax.nitinol", "pneusma_jax.silicone")),
    ("model.section", ("pneusma_jax.section",)),
    ("model.actuator", ("pneusma_jax.actuator",)),
    ("model.effects", ("pneusma_jax.effects",)),
    ("model.simulate", ("pneusma_jax.simulate",)),
    ("model.serial_chain", ("pneusma_jax.serial_chain",)),
    ("model", ("pneusma_jax",)),
    ("data", ("fitting.data",)),
    ("inference", ("fitting.inference",)),
    ("engine", ("fitting.engine",)),
    ("specimens", ("fitting.specimens",)),
    ("simulate", ("fitting.simulate",)),
    ("calibrate", ("fitting.calibrate",)),
    ("diagnose.settings", ("fitting.diagnose.settings",)),
    ("diagnose.evaluate", ("fitting.diagnose.evaluate",)),
    ("diagnose.fit", ("fitting.diagnose.fit",)),
    ("diagnose.search", ("fitting.diagnose.search",)),
    ("diagnose.verdict", ("fitting.diagnose.verdict",)),
    ("diagnose", ("fitting.diagnose",)),
    ("sample", ("fitting.sample",)),
    ("synthesise", ("fitting.synthesise",)),
    ("plan", ("fitting.plan",)),
    ("design", ("fitting.design",)),
    ("invert", ("fitting.invert",)),
    ("control", ("fitting.control",)),
    ("wiring", ("fitting.wiring",)),
    ("propagate", ("fitting.propagate",)),
    ("report", ("fitting.report",)),
    ("validation", ("validation",)),
    ("cli", ("fitting.cli",)),
    (
        "entry",
        (
            "fitting.characterise", "fitting.diagnosis", "fitting.own_base", "fitting.parameters",
            "fitting.recordings", "fitting.augmented",
        ),
    ),
)  # fmt: skip
"""Layers, lower ones first: their name and the modules and packages in them; the longest name decides."""

MAY_REPORT = ("report", "validation", "cli", "entry")
"""Layers that may import the layer `report`: results are data and do not know how they look. The documented entry
`fitting.characterise` puts both together."""


@dataclass(frozen=True)
class Import:
    """One import statement between modules of the packages.

    Attributes:
        source: module that imports.
        target: module or package imported.
        inside: it stands inside a function.
    """

    source: str
    target: str
    inside: bool

    def __str__(self) -> str:
        return f"{self.source} -> {self.target}"


def modules(root: Path = ROOT) -> dict[str, Path]:
    """Files of all modules by dotted name; a package has the name of its folder."""
    found = {}
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            name = ".".join(path.relative_to(root).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = path
    return found


def imports(files: Mapping[str, Path]) -> list[Import]:
    """Every import between the modules, each pair once for the module's own level and once for functions."""
    found = set()
    for name, path in files.items():
        package = name if path.name == "__init__.py" else name.rpartition(".")[0]
        for node, inside in statements(ast.parse(path.read_text(encoding="utf-8"))):
            for target in _targets(node, package, files):
                if target != name:
                    found.add(Import(name, target, inside))
    return sorted(found, key=lambda found: (found.source, found.target, found.inside))


def statements(tree: ast.AST, inside: bool = False) -> Iterator[tuple[ast.Import | ast.ImportFrom, bool]]:
    """Every import statement of a tree, and whether it stands inside a function."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node, inside
        else:
            function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from statements(node, inside or function)


def _targets(
    node: ast.Import | ast.ImportFrom, package: str, files: Mapping[str, Path]
) -> Iterator[str]:
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    else:
        parts = package.split(".")
        stem = parts[: len(parts) - node.level + 1] if node.level else []
        base = ".".join([*stem, *([node.module] if node.module else [])])
        names = [f"{base}.{alias.name}" for alias in node.names]
    for name in names:
        while name and name not in files:
            name = name.rpartition(".")[0]
        if name:
            yield name


def layer_of(module: str) -> int:
    """Number of a module's layer.

    Raises:
        ValueError: if it is in none.
    """
    fits = [
        (len(prefix), number)
        for number, (_, prefixes) in enumerate(LAYERS)
        for prefix in prefixes
        if module == prefix or module.startswith(prefix + ".")
    ]
    if not fits:
        raise ValueError(f"{module} is in no layer: add it to LAYERS")
    return max(fits)[1]


def circles(edges: Iterable[Import]) -> list[tuple[str, ...]]:
    """Sets of modules of which each reaches every other by imports, each set in alphabetical order."""
    after: dict[str, set[str]] = defaultdict(set)
    for edge in edges:
        after[edge.source].add(edge.target)
    reached = {name: _reached(name, after) for name in list(after)}
    found = {
        tuple(sorted({name, *(other for other in there if name in reached.get(other, ()))}))
        for name, there in reached.items()
        if name in there
    }
    return sorted(found)


def _reached(start: str, after: Mapping[str, set[str]]) -> set[str]:
    found: set[str] = set()
    waiting = list(after[start])
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(after.get(name, ()))
    return found


def violations(found: list[Import]) -> dict[str, list[str]]:
    """What breaks each law of the layers, a line each.

    Args:
        found: every import, see `imports`.

    Returns:
        `upward`: a module imports one of a later layer; `report`: a layer that may not imports the layer
        `report`; `inside_functions`: an import inside a function outside `fitting.cli`; `circles`: modules
        that import each other, directly or through others.
    """
    number = {name: k for k, (name, _) in enumerate(LAYERS)}
    may_report = {k for k, (name, _) in enumerate(LAYERS) if name in MAY_REPORT}
    upward, report = set(), set()
    for edge in found:
        source, target = layer_of(edge.source), layer_of(edge.target)
        if target == number["report"] and source not in may_report:
            report.add(str(edge))
        elif target > source:
            upward.add(str(edge))
    inside = {
        str(edge) for edge in found if edge.inside and LAYERS[layer_of(edge.source)][0] != "cli"
    }
    return {
        "upward": sorted(upward),
        "report": sorted(report),
        "inside_functions": sorted(inside),
        "circles": [", ".join(circle) for circle in circles(found)],
    }


def allowed() -> dict[str, list[str]]:
    """The allow-list: today's violations, which may only become fewer."""
    return {law: [] for law in LAWS} | tomllib.loads(ALLOWED.read_text(encoding="utf-8"))


def written(entries: Mapping[str, Iterable[str]]) -> str:
    """The allow-list as TOML."""
    lines = ["# Imports that break a law of `test_layers.py` today. Remove entries; never add one."]
    for law in LAWS:
        lines += ["", f"{law} = ["] + [f'    "{entry}",' for entry in sorted(entries[law])] + ["]"]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print counts, or shorten the allow-list."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--prune", action="store_true", help="remove entries that exist no more")
    options = parser.parse_args()
    now, listed = violations(imports(modules())), allowed()
    if options.prune:
        left = {law: [entry for entry in listed[law] if entry in now[law]] for law in LAWS}
        ALLOWED.write_text(written(left), encoding="utf-8")
    for law in LAWS:
        print(f"{law:17} {len(now[law]):4}  (allowed {len(listed[law])})")


if __name__ == "__main__":
    main()
