"""Commands killed at random moments: no half-written result, and a second run gives the same bytes.

    python tests/reliability/soak.py --kills 200 --seed 1 --out out/soak.json

Each command is first run to its end, which gives the reference and the time it takes. Then it is killed (SIGKILL) at
a random moment of that time, again and again. After each kill every folder of results must be whole or absent. The
command then runs to its end, with `--resume` where it has one, and its numbers must have the reference's bytes.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PNEUSMA = [sys.executable, "-m", "fitting.cli"]
# name -> (command without --out, option of the second run, files whose bytes must agree)
COMMANDS = {
    "diagnose": (["diagnose", "silicone", "--seed", "1"], "--force", ("report.json", "augmented.toml")),
    "characterise": (["characterise", "silicone", "--law", "neo_hookean"], "--force", ("report.json", "material.toml")),
    "characterise-batch": (["characterise-batch", "tube_1", "tube_2", "tube_3"], "--force", ("report.json",)),
    "posterior": (
        ["posterior", "silicone", "--law", "neo_hookean", "--max-steps", "1000"], "--resume", ("report.json", "summary.csv"),
    ),
}  # fmt: skip
LIMIT_S = 900.0


def campaigns(folder: Path) -> None:
    """Small simulated campaigns that the commands work on."""
    shutil.copytree(ROOT / "calibration_data" / "examples" / "pulled_silicone", folder / "silicone")
    for seed in (1, 2, 3):
        run(["synthesise", "tube", "--out", f"tube_{seed}", "--seed", str(seed)], folder)


def run(words: list[str], folder: Path) -> float:
    """Run a command to its end; returns the seconds it took."""
    begun = time.monotonic()
    done = subprocess.run([*PNEUSMA, *words], cwd=folder, capture_output=True, text=True, timeout=LIMIT_S)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)} ended with {done.returncode}: {done.stderr[-2000:]}")
    return time.monotonic() - begun


def killed(words: list[str], folder: Path, after: float) -> bool:
    """Start a command and kill it after some seconds; whether it was still running then."""
    process = subprocess.Popen(
        [*PNEUSMA, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        process.wait(timeout=after)
        return False
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return True


def half_written(out: Path) -> list[str]:
    """Folders of results without the file that is written last; a chain on disk is no result yet."""
    if not out.exists():
        return []
    folders = [out, *(path for path in out.rglob("*") if path.is_dir() and not path.name.startswith("."))]
    wrong = []
    for folder in folders:
        names = {path.name for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")}
        if names - {"chain.h5"} and "report.json" not in names:
            wrong.append(f"{folder.name}: {', '.join(sorted(names))}")
    return wrong


def difference(out: Path, reference: Path, files: tuple[str, ...]) -> list[str]:
    """Files whose bytes differ from the reference."""
    wanted = [path.relative_to(reference) for name in files for path in reference.rglob(name)]
    return [str(path) for path in wanted if (out / path).read_bytes() != (reference / path).read_bytes()]


def one(name: str, folder: Path, seconds: float, rng: np.random.Generator) -> str:
    """Kill once and run again; empty if all is well, else what is not."""
    words, again, files = COMMANDS[name]
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    after = float(rng.uniform(0.05, 1.0)) * seconds
    if not killed([*words, "--out", "out"], folder, after):
        return ""
    if wrong := half_written(out):
        return f"killed after {after:.1f} s, half-written: {'; '.join(wrong)}"
    resumed = [again] if out.exists() and (again == "--force" or (out / "chain.h5").exists()) else []
    run([*words, "--out", "out", *resumed], folder)
    wrong = difference(out, folder / f"reference_{name}", files)
    return f"killed after {after:.1f} s, other bytes: {', '.join(wrong)}" if wrong else ""


def main() -> int:
    """Run the campaign, print its table, write it as JSON; 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=200, help="in all, shared among the commands")
    parser.add_argument("--only", choices=COMMANDS, action="append")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rng, names = np.random.default_rng(given.seed), given.only or list(COMMANDS)
    counts: Counter = Counter()
    failures: list[dict[str, str]] = []
    with tempfile.TemporaryDirectory(prefix="soak") as place:
        folder = Path(place)
        campaigns(folder)
        seconds = {}
        for name in names:
            words = COMMANDS[name][0]
            run([*words, "--out", f"reference_{name}"], folder)  # the first run compiles
            shutil.rmtree(folder / f"reference_{name}")
            seconds[name] = run([*words, "--out", f"reference_{name}"], folder)
            print(f"{name}: {seconds[name]:.1f} s to its end", flush=True)
        for k in range(given.kills):
            name = names[k % len(names)]
            wrong = one(name, folder, seconds[name], rng)
            counts[f"{name}: {'failed' if wrong else 'well'}"] += 1
            print(f"{k + 1} of {given.kills}, {name}: {wrong or 'well'}", flush=True)
            if wrong:
                failures.append({"command": name, "said": wrong})
    for outcome, count in sorted(counts.items()):
        print(f"{outcome:30s} {count:4d}")
    if given.out:
        given.out.parent.mkdir(parents=True, exist_ok=True)
        given.out.write_text(
            json.dumps({"counts": counts, "seconds": seconds, "failures": failures}, indent=1)
        )
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
