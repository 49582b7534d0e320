"""Time of every command beside its own work: medians, with programs on disk and without.

    python -m benchmarks.command_overhead --repeats 10 --cold 3 --out out/overhead

Three numbers per command. `help` is the time of `--help`: the interpreter and the command line. `warm` is the
time of the smallest complete job of the command whose programs are on disk. The job's own work is in it, so
it bounds the overhead from above. `cold` is the same with an empty cache. Processor times stand beside the
times of the clock: on a busy machine they say more.
"""

import argparse
import json
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PNEUSMA = [sys.executable, "-m", "fitting.cli"]
RAW = "Sample A\nTime (s),Strain (%),Stress (kPa)\n" + "".join(f"{k},{2 * k},{3.0 * k}\n" for k in range(20))
TUBE = str(ROOT / "calibration_data" / "examples" / "tube")
SILICONE = str(ROOT / "calibration_data" / "examples" / "pulled_silicone")
# name of a row -> words; {out} is a fresh folder
JOBS = {
    "import": "import RAW.csv --kind elastomer --preview",
    "synthesise": "synthesise tube --out {out} --seed 1",
    "effects": "effects",
    "simulate, a state": "simulate --design pneusma2 --pressure-kPa 30 --xi0-2 0.4",
    "simulate, a protocol": "simulate --protocol tube_inflation --out {out}",
    "workspace": "workspace --design pneuflex_s --out {out}",
    "characterise": f"characterise {TUBE} --out {{out}}",
    "characterise-batch": f"characterise-batch {TUBE} --out {{out}}",
    "diagnose": f"diagnose {SILICONE} --out {{out}}",
    "posterior": f"posterior {TUBE} --out {{out}} --max-steps 50",
    "propagate": "propagate band.toml --out {out}",
    "invert": "invert --design pneusma2 --curvature-1pm 40",
    "plan": "plan --out {out}",
    "design": "design study.toml --out {out}",
    "control": "control --out {out}",
    "wiring": "wiring --springs 3 --out {out}",
    "check": "check",
    "completion": "completion bash",
}


def timed(words: list[str], folder: Path, cache: str | None = None) -> tuple[float, float]:
    """Seconds of the clock and of the processor that a command takes.

    Raises:
        RuntimeError: if it fails.
    """
    environment = dict(os.environ) | ({"PNEUSMA_CACHE": cache} if cache else {})
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([*PNEUSMA, *words], cwd=folder, capture_output=True, text=True, env=environment)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1):  # 1: the answer is no, such as a target out of reach
        raise RuntimeError(f"{' '.join(words)} ended with {done.returncode}: {done.stderr[-500:]}")
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def prepare(folder: Path) -> None:
    """Inputs of the jobs."""
    (folder / "RAW.csv").write_text(RAW)
    band = (ROOT / "calibration_data" / "examples" / "studies" / "pneusma2_band.toml").read_text()
    (folder / "band.toml").write_text(
        band.replace("rows = 20000", "rows = 64").replace("chunk = 10000", "chunk = 64")
    )
    page = (ROOT / "docs" / "design.md").read_text()
    (folder / "study.toml").write_text(re.search(r"```toml\n(.*?)```", page, flags=re.S)[1])


def measured(words: str, folder: Path, repeats: int, empty: bool) -> dict[str, float]:
    """Medians over runs of one job, each into a fresh folder, and with a fresh cache if `empty`."""
    found = []
    for k in range(repeats):
        out, cache = folder / f"out_{k}", folder / f"cache_{k}"
        shutil.rmtree(out, ignore_errors=True)
        found.append(timed(words.format(out=out).split(), folder, str(cache) if empty else None))
        shutil.rmtree(cache, ignore_errors=True)
        shutil.rmtree(out, ignore_errors=True)
    wall, cpu = zip(*found, strict=True)
    return {"wall": statistics.median(wall), "cpu": statistics.median(cpu), "runs": repeats}


def main() -> int:
    """Measure what is missing, print the table, write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=10, help="runs of `help` and `warm`")
    parser.add_argument("--cold", type=int, default=3, help="runs with an empty cache; 0 for none")
    parser.add_argument("--only", choices=JOBS, action="append")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no job later than this")
    parser.add_argument("--out", type=Path, default=Path("out/overhead"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    book, begun = given.out / "overhead.json", time.monotonic()
    table = json.loads(book.read_text()) if book.exists() else {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        prepare(folder)
        for name in given.only or JOBS:
            if name in table or time.monotonic() - begun > 60.0 * given.minutes:
                continue
            row = {"help": measured(f"{JOBS[name].split()[0]} --help", folder, given.repeats, False)}
            measured(JOBS[name], folder, 1, False)  # compiles what is not on disk
            row["warm"] = measured(JOBS[name], folder, given.repeats, False)
            if given.cold:
                row["cold"] = measured(JOBS[name], folder, given.cold, True)
            table[name] = row
            book.write_text(json.dumps(table, indent=1))
            print(
                name,
                {key: f"{value['wall']:.2f} ({value['cpu']:.2f})" for key, value in row.items()},
                flush=True,
            )
    print(markdown(table))
    return 0


def markdown(table: dict[str, dict]) -> str:
    """Medians of the clock, those of the processor in brackets."""
    lines = ["| command | help | warm | cold |", "|---|---|---|---|"]
    for name, row in table.items():
        known = [row.get(key) for key in ("help", "warm", "cold")]
        cells = (f"{one['wall']:.2f} ({one['cpu']:.2f})" if one else "" for one in known)
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
