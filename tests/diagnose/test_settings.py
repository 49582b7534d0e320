"""Every threshold of the diagnosis is in one place, says what it means, and is read somewhere."""

import ast
import dataclasses
import re
from pathlib import Path

import pytest

from fitting.diagnose.settings import CATEGORIES, DEFAULT, thresholds_of
from fitting.diagnose.settings.table import BEGIN, END, replaced, table

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "fitting" / "diagnose"
MATHEMATICAL = frozenset({"pi", "e", "inf", "nan"})
"""Names of constants of mathematics, which a module may bind."""
MODULES = [path for path in sorted(PACKAGE.rglob("*.py")) if "settings" not in path.parts]
THRESHOLDS = list(thresholds_of(DEFAULT))


def numeric_constants(source: str) -> list[str]:
    """Names at the level of a module that are bound to numbers, or to collections or expressions of them."""
    found = []
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None and _numeric(node.value):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found += [ast.unparse(target) for target in targets]
    return found


def _numeric(value: ast.expr) -> bool:
    if isinstance(value, ast.Attribute) and value.attr in MATHEMATICAL:
        return False
    numbers = (n.value for n in ast.walk(value) if isinstance(n, ast.Constant))
    return any(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers)


def test_no_module_has_a_number_of_its_own():
    assert {p.name: found for p in MODULES if (found := numeric_constants(p.read_text(encoding="utf-8")))} == {}


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ("A = 3", 1), ("A, B = 0.2, 0.6", 1), ("A: float = 1e-3", 1), ("A = 10.0 ** np.arange(3)", 1),
        ("A = {'x': 1.0}", 1), ("A = math.pi", 0), ("A = DEFAULT.noise", 0), ("A = 'text'", 0),
        ("def f():\n    a = 1", 0),
    ],
)  # fmt: skip
def test_a_number_of_a_module_is_seen(source, count):
    assert len(numeric_constants(source)) == count


@pytest.mark.parametrize("one", THRESHOLDS, ids=lambda one: one.name)
def test_a_threshold_says_what_it_means(one):
    assert one.sentence.startswith(("Minimum ", "Maximum ", "Factor ", "Number of ")) and one.sentence.endswith(".")
    assert len(one.sentence.split()) <= 25 and len(one.basis.split()) <= 25
    assert one.unit and one.basis and "|" not in one.sentence + one.basis


def test_every_threshold_is_read_somewhere():
    """Through the name of its group, as `NOISE = DEFAULT.noise` binds it, or from `DEFAULT` itself."""
    read = set()
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                read.add(f"{node.value.id.lower()}.{node.attr}")
    indirectly = {"drift.sizes"}  # `drift.maximum_explained` is made of it, too
    assert {one.name for one in THRESHOLDS} - read - indirectly == set()


def test_no_threshold_changes_while_a_diagnosis_runs():
    with pytest.raises(dataclasses.FrozenInstanceError):
        DEFAULT.evidence.minimum_first = 0.0
    other = dataclasses.replace(DEFAULT, evidence=dataclasses.replace(DEFAULT.evidence, minimum_first=9.0))
    assert (other.evidence.minimum_first, DEFAULT.evidence.minimum_first) == (9.0, 8.0)


def test_every_group_is_of_one_kind():
    groups = [group for members in CATEGORIES.values() for group in members]
    assert groups == [field.name for field in dataclasses.fields(DEFAULT)]


def test_the_tables_of_the_documentation_are_made_of_the_thresholds():
    text = (ROOT / "docs" / "thresholds.md").read_text(encoding="utf-8")
    assert replaced(text, DEFAULT, CATEGORIES) == text, "run `python -m fitting.diagnose.settings docs/thresholds.md`"
    made = table(DEFAULT, CATEGORIES)
    assert len(re.findall(r"^\| `", made, re.MULTILINE)) == len(THRESHOLDS)
    counts = [int(count) for count in re.findall(r"^### [A-Z][a-z ]+: (\d+)$", made, re.MULTILINE)]
    assert len(counts) == len(CATEGORIES) and sum(counts) == len(THRESHOLDS)
    with pytest.raises(ValueError, match="needs the marks"):
        replaced("text", DEFAULT, CATEGORIES)
    assert replaced(f"a {BEGIN} old {END} b", DEFAULT, CATEGORIES).startswith(f"a {BEGIN}\n### Decisions")


def test_decisions_stay_few():
    """More principles than these would be hard to tell from each other. A new one takes the place of another."""
    assert sum(one.name.partition(".")[0] in CATEGORIES["Decisions"] for one in THRESHOLDS) <= 25
