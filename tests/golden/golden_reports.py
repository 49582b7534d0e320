"""Golden reports: the essential numbers of `report.json` for the shipped examples and 24 sealed cases.

    python tests/golden/golden_reports.py run --out out/golden               reports of this checkout, resumable
    python tests/golden/golden_reports.py run --out out/golden --write       the same, and keep their numbers here
    python tests/golden/golden_reports.py compare OLD NEW                    two versions; each a folder of `run`

`run` makes 34 reports one after another, each by a command in a process of its own: a characterisation and a
diagnosis of the five shipped examples, and diagnoses of 24 sealed cases. A report that is in `--out` already is only
read, so an interrupted run goes on; after a change of the code, give another folder. `run diagnose/wire ...` makes the
named reports alone. `--write` replaces the numbers of `golden_reports.json` that the tests compare with: those of all
reports, or of the named ones while the others stay. A coupon's or a wire's characterisation takes 30 to 35 s of
processor time; 24 sealed cases took 17 minutes in a run of `make proof`. Expect about an hour on one core. Say in the commit which numbers moved, by how much and why.

`--tree FOLDER` runs the code of another checkout. To compare two versions on the same campaigns, give the same
`--campaigns FOLDER` to both. The sealed cases are those of plan `fixed` with a development seed: nobody scores them.
"""

import argparse
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
KEPT = Path(__file__).with_name("golden_reports.json")
KINDS = ("elastomer", "spring", "wire", "tube", "actuator")
SEED = 37
"""Seed of the sealed cases."""
DIAGNOSIS_SEED = "1"
DIGITS = 6
"""Number of significant digits that are kept."""
CANDIDATES = 3
"""Number of candidates of a diagnosis that are kept, the most likely first."""
RELATIVE = 1e-3
"""Maximum relative difference of two numbers that count as equal: processors differ in last digits, which a fit's
stopping rule turns into differences of a fraction of its tolerance."""
OF_AN_ERROR = 0.02
"""Maximum difference of two estimates that count as equal, in standard errors."""
PROBABILITY = 0.01
"""Maximum difference of two probabilities that count as equal."""
LOG_BAYES_FACTOR = 0.1
"""Maximum absolute difference of two log Bayes factors that count as equal."""


def names() -> list[str]:
    """Every golden report: `characterise/KIND` and `diagnose/KIND` of shipped examples, `diagnose/cNNNN` of cases."""
    examples = [f"{command}/{kind}" for command in ("characterise", "diagnose") for kind in KINDS]
    return examples + [f"diagnose/c{number:04d}" for number in range(24)]


def campaign_of(name: str, campaigns: Path) -> Path:
    """Folder of a report's campaign; a sealed case is written there if it is missing."""
    case = name.partition("/")[2]
    if case in KINDS:
        return ROOT / "calibration_data" / "examples" / case
    folder = campaigns / case
    if not folder.exists():
        sys.path.insert(0, str(ROOT))
        from validation.blind.cases import case_list, write_case

        found = next(known for known in case_list("fixed", SEED) if known.name == case)
        write_case(found, folder.with_suffix(".part"))
        folder.with_suffix(".part").rename(folder)
    return folder


def make(name: str, out: Path, campaigns: Path, tree: Path = ROOT) -> dict[str, Any]:
    """The essence of one report, made by the code of `tree` unless it is there already.

    Raises:
        RuntimeError: the command fails; its last line says why.
    """
    path = out / name / "report.json"
    if not path.exists():
        command = [sys.executable, "-m", "fitting.cli", name.partition("/")[0], str(campaign_of(name, campaigns))]
        command += ["--out", str(path.parent), "--force", "--seed", DIAGNOSIS_SEED]
        environment = os.environ | {"PYTHONPATH": str(tree)}
        done = subprocess.run(command, cwd=out, env=environment, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{name}: {' '.join(done.stderr.split())[-300:]}")
    return essence(json.loads(path.read_text(encoding="utf-8")))


def essence(report: dict[str, Any]) -> dict[str, Any]:
    """What a golden report keeps: verdict, effects, probabilities, fits; parameters and metrics."""
    if report["schema"].startswith("pneusma-characterisation"):
        return _rounded({key: report[key] for key in ("parameters", "metrics")})
    found = {
        key: report[key]
        for key in ("verdict", "p_value", "explanation_set", "no_effect_probability", "unknown_probability")
    }
    found["where"] = {key: report["where"][key] for key in ("component", "drivers")}
    found["effects"] = {
        effect["name"]: {key: effect[key] for key in ("probability", "log_bayes_factor", "parameters")}
        for effect in report["effects"]
    }
    found["candidates"] = {
        candidate["name"]: {key: candidate[key] for key in ("probability", "log_bayes_factor")}
        for candidate in report["candidates"][:CANDIDATES]
    }
    found["fit"] = {key: report["fit"][key] for key in ("before", "after")}
    return _rounded(found)


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_rounded(inner) for inner in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def differences(old: Any, new: Any, place: str = "") -> Iterator[str]:
    """A line for everything that differs by more than its tolerance."""
    if isinstance(old, dict) and isinstance(new, dict):
        sd = old.get("sd") if {"value", "sd"} <= old.keys() else None
        for key in sorted(old.keys() | new.keys()):
            where = f"{place}.{key}" if place else key
            if key not in old or key not in new:
                yield f"{where}: only {'before' if key in old else 'after'}"
            elif key == "value" and _number(sd) and _number(new[key]) and abs(new[key] - old[key]) <= OF_AN_ERROR * sd:
                continue
            else:
                yield from differences(old[key], new[key], where)
    elif _numbers(old) and _numbers(new) and len(old) == len(new):  # an interval
        for k, pair in enumerate(zip(old, new, strict=True)):
            yield from differences(*pair, f"{place}[{k}]")
    elif _number(old) and _number(new):
        if not _equal(float(old), float(new), place.rpartition(".")[2]):
            yield f"{place}: {old:.6g} -> {new:.6g}"
    elif old != new:
        yield f"{place}: {old} -> {new}"


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _numbers(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(map(_number, value))


def _equal(old: float, new: float, key: str) -> bool:
    if math.isnan(old) or math.isnan(new):
        return math.isnan(old) and math.isnan(new)
    absolute = PROBABILITY if "probability" in key else LOG_BAYES_FACTOR if key == "log_bayes_factor" else 0.0
    return old == new or abs(new - old) <= max(absolute, RELATIVE * max(abs(old), abs(new)))


def kept() -> dict[str, dict[str, Any]]:
    """The numbers that are kept, by name of the report."""
    return json.loads(KEPT.read_text(encoding="utf-8"))


def run(out: Path, campaigns: Path, tree: Path, chosen: list[str]) -> dict[str, dict[str, Any]]:
    """Make reports one after the other; those that are in `out` already are read."""
    found = {}
    campaigns.mkdir(parents=True, exist_ok=True)
    out.mkdir(parents=True, exist_ok=True)
    for name in chosen:
        found[name] = make(name, out, campaigns, tree)
        print(name, flush=True)
    return found


def made(folder: Path) -> dict[str, dict[str, Any]]:
    """Essences of the reports in a folder of `run`."""
    paths = {name: folder / name / "report.json" for name in names()}
    read = lambda path: json.loads(path.read_text(encoding="utf-8"))  # noqa: E731
    return {name: essence(read(path)) for name, path in paths.items() if path.exists()}


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run", help="make reports")
    running.add_argument("names", nargs="*", help="such as diagnose/wire; all by default")
    running.add_argument("--out", type=Path, required=True)
    running.add_argument("--campaigns", type=Path, help="folder of the sealed cases; OUT/campaigns by default")
    running.add_argument("--tree", type=Path, default=ROOT, help="checkout whose code runs")
    running.add_argument("--write", action="store_true", help="keep the numbers as the golden ones")
    comparing = commands.add_parser("compare", help="print what differs between two folders of `run`")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    options = parser.parse_args()
    if options.command == "run":
        out = options.out.resolve()
        chosen = options.names or names()
        found = run(out, (options.campaigns or out / "campaigns").resolve(), options.tree.resolve(), chosen)
        if options.write:
            everything = (kept() if options.names and KEPT.exists() else {}) | found
            lines = [f" {json.dumps(name)}: {json.dumps(everything[name])}" for name in sorted(everything)]
            KEPT.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
        return
    old, new = made(options.old), made(options.new)
    same = 0
    for name in sorted(old.keys() & new.keys()):
        found = list(differences(old[name], new[name]))
        same += not found
        for line in found:
            print(f"{name}: {line}")
    print(f"{same} of {len(old.keys() & new.keys())} reports agree; {len(old.keys() ^ new.keys())} are in one folder only")


if __name__ == "__main__":
    main()
