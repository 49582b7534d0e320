"""Time of every command beside its own work: medians, with programs on disk and without.

    python -m benchmarks.command_overhead --repeats 10 --cold 3 --out out/overhead

Each command does its smallest complete job twice in one process. The second call has every module, table
and program in memory: its time is the job's own work. What the process takes beyond two such calls is the
overhead: the interpreter, imports, tracing, and programs that are compiled or loaded. `warm` has the programs
on disk, `cold` an empty cache. Times are those of the processor, with those of the clock in brackets: on a
busy machine the clock says little. There, processor times are too large as well. So each run is followed by
a `from pneusma_jax import solve`, and the median of their ratio is told: multiply it by the time of that
import on a quiet machine. Four rows stand apart: three imports, and `pneusma --help`.
"""

import argparse
import json
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from fitting.cli import COMMANDS

ROOT = Path(__file__).resolve().parents[1]
RAW = "Sample A\nTime (s),Strain (%),Stress (kPa)\n" + "".join(f"{k},{2 * k},{3.0 * k}\n" for k in range(20))
SILICONE = str(ROOT / "calibration_data" / "examples" / "pulled_silicone")
# name of a row -> words; {out} is a fresh folder
JOBS = {
    "import": "import RAW.csv --kind elastomer --preview",
    "synthesise": "synthesise tube --out {out} --seed 1",
    "effects": "effects",
    "simulate, a state": "simulate --design pneusma2 --pressure-kPa 30 --xi0-2 0.4",
    "simulate, a protocol": "simulate --protocol tube_inflation --out {out}",
    "workspace": "workspace --design pneuflex_s --out {out}",
    "characterise": f"characterise {SILICONE} --law neo_hookean --out {{out}}",
    "characterise-batch": f"characterise-batch {SILICONE} --out {{out}}",
    "diagnose": f"diagnose {SILICONE} --out {{out}}",
    "posterior": f"posterior {SILICONE} --law neo_hookean --out {{out}} --max-steps 50",
    "propagate": "propagate band.toml --out {out}",
    "invert": "invert --design pneusma2 --curvature-1pm 40",
    "plan": "plan --out {out}",
    "design": "design study.toml --out {out}",
    "control": "control --out {out}",
    "wiring": "wiring --springs 3 --out {out}",
    "reproduce": "reproduce --out {out}",
    "check": "check",
    "completion": "completion bash",
}
UNIT = "from pneusma_jax import solve"
"""Import that loads the core with JAX; overheads are told in units of its time, too."""
SHORT = {
    "import pneusma_jax": ["-c", "import pneusma_jax"],
    UNIT: ["-c", UNIT],
    "import fitting.cli": ["-c", "import fitting.cli"],
    "pneusma --help": ["-m", "fitting.cli", "--help"],
}
TWICE = """
import json, resource, sys, time
from fitting.cli import main

def now():
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return time.perf_counter(), sum(one.ru_utime + one.ru_stime for one in used)

*calls, place = json.loads(sys.argv[1])
for words in calls:
    begun = now()
    try:
        main(words, standalone_mode=False)
    except SystemExit as ended:  # 1: the answer is no, such as a target out of reach
        if ended.code not in (None, 0, 1):
            raise
    took = [after - before for before, after in zip(begun, now())]
with open(place, "w") as file:
    json.dump(took, file)
"""


class Seconds(NamedTuple):
    """A time of the clock and one of the processor [s]."""

    wall: float
    cpu: float


def process(words: list[str], folder: Path, cache: Path | None = None) -> Seconds:
    """Time of a Python process.

    Raises:
        RuntimeError: if it fails.
    """
    environment = dict(os.environ) | ({"PNEUSMA_CACHE": str(cache)} if cache else {})
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed package has its bytecode
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    words = [sys.executable, *words]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, env=environment)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(f"{words[-1]} ended with {done.returncode}: {done.stderr[-2000:]}")
    return Seconds(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def twice(words: str, folder: Path, empty: bool) -> tuple[Seconds, Seconds]:
    """Overhead of a job, and its own work: each call into a fresh folder, with a fresh cache if `empty`."""
    with tempfile.TemporaryDirectory(dir=folder) as place:
        calls = [words.format(out=Path(place, name)).split() for name in ("first", "second")]
        note = Path(place, "note.json")
        cache = Path(place, "cache") if empty else None
        whole = process(["-c", TWICE, json.dumps([*calls, str(note)])], folder, cache)
        work = Seconds(*json.loads(note.read_text()))
    return Seconds(*(all_ - 2.0 * one for all_, one in zip(whole, work, strict=True))), work


def prepare(folder: Path) -> None:
    """Inputs of the jobs."""
    (folder / "RAW.csv").write_text(RAW)
    band = (ROOT / "calibration_data" / "examples" / "studies" / "pneusma2_band.toml").read_text()
    (folder / "band.toml").write_text(
        band.replace("rows = 20000", "rows = 100").replace("chunk = 10000", "chunk = 100")
    )
    page = (ROOT / "docs" / "design.md").read_text()
    (folder / "study.toml").write_text(re.search(r"```toml\n(.*?)```", page, flags=re.S)[1])


def middle(found: list[Seconds]) -> dict[str, float]:
    """Medians."""
    return {key: statistics.median(getattr(one, key) for one in found) for key in Seconds._fields} | {
        "runs": len(found)
    }


def measured(name: str, folder: Path, repeats: int, cold: int) -> dict[str, dict[str, float]]:
    """Medians of one row of the table."""
    if name in SHORT:
        process(SHORT[name], folder)
        return {"warm": middle([process(SHORT[name], folder) for _ in range(repeats)])}
    help_ = ["-m", "fitting.cli", JOBS[name].split()[0], "--help"]
    row = {"help": middle([process(help_, folder) for _ in range(repeats)])}
    twice(JOBS[name], folder, False)  # compiles what is not on disk
    overhead, work, imports = zip(*(beside(JOBS[name], folder, False) for _ in range(repeats)), strict=True)
    row |= {"warm": middle(overhead), "work": middle(work), "imports": ratio(overhead, imports)}
    if cold:
        overhead, _, imports = zip(*(beside(JOBS[name], folder, True) for _ in range(cold)), strict=True)
        row |= {"cold": middle(overhead), "cold imports": ratio(overhead, imports)}
    return row


def beside(words: str, folder: Path, empty: bool) -> tuple[Seconds, Seconds, Seconds]:
    """What `twice` returns, and the time of `UNIT` right after it."""
    return *twice(words, folder, empty), process(SHORT[UNIT], folder)


def ratio(found: Sequence[Seconds], imports: Sequence[Seconds]) -> dict[str, float]:
    """Median of overheads over the imports beside them, of the processor [1]."""
    return {"cpu": statistics.median(a.cpu / b.cpu for a, b in zip(found, imports, strict=True))}


def main() -> int:
    """Measure what is missing, print the table, write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=10, help="runs of `help` and `warm`")
    parser.add_argument("--cold", type=int, default=3, help="runs with an empty cache; 0 for none")
    parser.add_argument("--only", choices=[*SHORT, *JOBS], action="append")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no job later than this")
    parser.add_argument("--out", type=Path, default=Path("out/overhead"))
    given = parser.parse_args()
    if missing := set(COMMANDS) - {words.split()[0] for words in JOBS.values()}:
        raise SystemExit(f"no job for {', '.join(sorted(missing))}")
    given.out.mkdir(parents=True, exist_ok=True)
    book, begun = given.out / "overhead.json", time.monotonic()
    table = json.loads(book.read_text()) if book.exists() else {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        prepare(folder)
        for name in given.only or [*SHORT, *JOBS]:
            if name in table or time.monotonic() - begun > 60.0 * given.minutes:
                continue
            table[name] = measured(name, folder, given.repeats, given.cold)
            book.write_text(json.dumps(table, indent=1))
            print(name, {key: shown(one) for key, one in table[name].items()}, flush=True)
    print(markdown(table))
    return 0


def shown(one: dict[str, float] | None) -> str:
    """A median of the processor, that of the clock in brackets."""
    wall = f" ({one['wall']:.2f})" if one and "wall" in one else ""
    return f"{one['cpu']:.2f}{wall}" if one else ""


def markdown(table: dict[str, dict]) -> str:
    """The table; "imports" are overheads in units of `UNIT`."""
    keys = ("help", "warm", "imports", "cold", "cold imports", "work")
    heads = ("`--help`", "overhead, warm", "imports", "overhead, cold", "imports", "own work")
    lines = [f"| command | {' | '.join(heads)} |", "|---" * (len(heads) + 1) + "|"]
    for name, row in table.items():
        lines.append(f"| {name} | {' | '.join(shown(row.get(key)) for key in keys)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
