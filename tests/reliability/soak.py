"""Commands killed at random moments: no half-written result, and a run that goes on gives the same bytes.

    python tests/reliability/soak.py --kills 200 --minutes 60 --out out/soak

Each command is first run to its end, which gives the reference and the time it takes. Then it is killed (SIGKILL) one
to three times in a row, each at a random moment of that time. After each kill every file must be whole, and every folder
must hold the results of one run or none. The command then runs to its end, with `--resume` where it has that option.
Its results must have the reference's bytes; where a file states how long something took, everything else in it must be
equal. The campaign itself may be ended and begun again: it goes on, and counts up.
"""

import argparse
import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT)]

from fitting.data.sealed import check_seal  # noqa: E402
from pneusma_jax.program_cache import _source  # noqa: E402

PNEUSMA = [sys.executable, "-m", "fitting.cli"]
PROOF = [sys.executable, "-m", "validation.blind.proof"]
LIMIT_S = 900.0
MOST_KILLS = 3
"""Maximum number of kills of one run; the proof takes a case for a failure after three."""


class Command(NamedTuple):
    """A command that is killed.

    Attributes:
        words: of it, without `--out out`.
        again: words for the run after a kill, from the folder that the kill left.
        files: whose bytes must agree with the reference, as patterns.
        state: files and folders that a run keeps to go on from; they are no results.
        kills: largest number of kills of one run.
        times: keys of JSON files that state seconds, which no two runs share.
    """

    words: list[str]
    again: Callable[[Path], list[str]]
    files: tuple[str, ...]
    state: tuple[str, ...] = ()
    kills: int = MOST_KILLS
    times: tuple[str, ...] = ()


def force(out: Path) -> list[str]:
    """Begin anew where anything is there."""
    return ["--force"] if out.exists() else []


def resume(state: str) -> Callable[[Path], list[str]]:
    """Go on where there is something to go on from, else begin anew."""
    return lambda out: ["--resume"] if (out / state).exists() else force(out)


STUDY = """schema = "pneusma-study/1"
name = "narrow"
design = "pneusma2"
starts = 2
[free]
wall_thickness = {made = "continuous", from = 0.8, to = 1.6, unit = "mm"}
active_coils = {made = "integer", from = 50, to = 70}
[state.bent]
pressure = {value = 30, unit = "kPa"}
xi0_2 = 0.4
[objective.curvature]
quantity = "curvature"
goal = "maximise"
state = "bent"
[constraint.wall]
quantity = "hoop_stress"
at_most = {value = 300, unit = "kPa"}
"""
COMMANDS = {
    "diagnose": Command(
        [*PNEUSMA, "diagnose", "silicone", "--seed", "1"], force, ("report.json", "augmented.toml", "*.png")
    ),
    "characterise-batch": Command(
        [*PNEUSMA, "characterise-batch", "tube_1", "tube_2", "tube_3"], resume("fitted"), ("**/report.json", "*.csv"),
        ("fitted",),
    ),
    "posterior": Command(
        [*PNEUSMA, "posterior", "silicone", "--law", "neo_hookean", "--max-steps", "600", "--sampler", "nuts"],
        resume("chain.h5"), ("report.json", "summary.csv", "posterior.nc"), ("chain.h5",),
    ),
    "propagate": Command(
        [*PNEUSMA, "propagate", "band.toml"], resume("study.json"), ("report.json", "*.csv", "chunks/*"),
        ("study.json", "chunks"),
    ),
    "design": Command(
        [*PNEUSMA, "design", "study.toml"], lambda out: force(out) if (out / "report.json").exists() else [],
        ("report.json", "design.toml"), ("evaluations.jsonl",),
    ),
    "proof": Command(
        [*PROOF, "run", "--plan", "fixed", "--kinds", "elastomer", "--limit", "2", "--date", "2026-01-01T00:00Z",
         "--ledger", "out/ledger.jsonl"],
        lambda out: [], ("*/score.json", "*/plan.json", "*/reports/*/report.json", "*/campaigns/**/*.*"), ("**",), 2,
        ("times", "seconds", "cpu_seconds"),
    ),
}  # fmt: skip


def prepare(folder: Path) -> None:
    """Small simulated campaigns and studies that the commands work on."""
    shutil.copytree(ROOT / "calibration_data" / "examples" / "pulled_silicone", folder / "silicone")
    for seed in (1, 2, 3):
        run([*PNEUSMA, "synthesise", "tube", "--out", f"tube_{seed}", "--seed", str(seed)], folder)
    band = (ROOT / "calibration_data" / "examples" / "studies" / "pneusma2_band.toml").read_text()
    (folder / "band.toml").write_text(
        band.replace("rows = 20000", "rows = 4096").replace("chunk = 10000", "chunk = 512")
    )
    (folder / "study.toml").write_text(STUDY)


def run(words: list[str], folder: Path) -> float:
    """Run a command to its end; returns the seconds it took.

    Raises:
        RuntimeError: if it fails.
    """
    begun = time.monotonic()
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words[2:])} ended with {done.returncode}: {done.stderr[-2000:]}")
    return time.monotonic() - begun


def killed(words: list[str], folder: Path, after: float) -> float | None:
    """Start a command and kill it after some seconds; if it ended before, the seconds that it took."""
    begun = time.monotonic()
    process = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(timeout=after)
        return time.monotonic() - begun
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return None


def broken(out: Path, command: Command) -> list[str]:
    """Files that are not whole, and folders with some of the results but without `report.json`, the last one."""
    if not out.exists():
        return []
    wrong = []
    visible = [p for p in out.rglob("*") if not any(part.startswith(".") for part in p.relative_to(out).parts)]
    for path in (path for path in visible if path.is_file()):
        try:
            whole(path)
        except Exception as error:
            wrong.append(f"{path.relative_to(out)}: {error}")
    state = {path for pattern in command.state for path in out.glob(pattern)}
    for folder in [out, *(path for path in visible if path.is_dir())]:
        if {folder, *folder.parents} & state:
            continue
        names = {p.name for p in folder.iterdir() if p.is_file() and p not in state and not p.name.startswith(".")}
        if names and "report.json" not in names:
            wrong.append(f"{folder.name} has {', '.join(sorted(names))} and no report.json")
    return wrong


def whole(path: Path) -> None:
    """Read a file to its end by what it is.

    Raises:
        Exception: if it is cut.
    """
    content = path.read_bytes()
    check_seal(content, path.name)
    if path.suffix in (".json", ".jsonl"):
        complete = content[: content.rfind(b"\n") + 1].splitlines()  # a log may end in a line that is being written
        for line in [content] if path.suffix == ".json" else complete:
            json.loads(line)
    if path.suffix == ".png" and b"IEND" not in content[-16:]:
        raise ValueError("the picture is cut")
    if path.suffix == ".html" and not content.rstrip().endswith(b"</html>"):
        raise ValueError("the page is cut")


def difference(out: Path, reference: Path, command: Command) -> list[str]:
    """Files that are missing or whose bytes differ from the reference; times are no difference."""
    found = [path.relative_to(reference) for pattern in command.files for path in reference.glob(pattern)]
    for pattern in command.files:
        if not any(reference.glob(pattern)):
            raise RuntimeError(f"{reference} has no {pattern}")
    return [str(p) for p in found if not (out / p).exists() or not same(out / p, reference / p, command.times)]


def same(one: Path, other: Path, times: tuple[str, ...]) -> bool:
    """Whether two files have the same bytes, or say the same but for seconds."""
    if one.read_bytes() == other.read_bytes():
        return True
    if one.suffix != ".json" or not times:
        return False
    return without(json.loads(one.read_text()), times) == without(json.loads(other.read_text()), times)


def without(value: object, keys: tuple[str, ...]) -> object:
    """A JSON document without some of its keys, at any depth."""
    if isinstance(value, dict):
        return {key: without(inner, keys) for key, inner in value.items() if key not in keys}
    return [without(inner, keys) for inner in value] if isinstance(value, list) else value


def one(
    command: Command, folder: Path, reference: Path, seconds: float, rng: np.random.Generator
) -> tuple[int, str, float]:
    """Kill a run once or more, then let it end; the number of kills, what is not well, and the seconds of a run.

    Kills fall within these seconds. A run that ends before its kill shows that they are fewer than was known.
    """
    out, kills = folder / "out", 0
    shutil.rmtree(out, ignore_errors=True)
    for _ in range(int(rng.integers(1, command.kills + 1))):
        after = float(rng.uniform(0.03, 1.0)) * seconds
        begun_anew = not out.exists()
        if took := killed([*command.words, "--out", "out", *command.again(out)], folder, after):
            seconds = min(seconds, took) if begun_anew else seconds
            break
        kills += 1
        if wrong := broken(out, command):
            return kills, f"killed after {after:.1f} s: {'; '.join(wrong)}", seconds
    if kills == 0:
        return 0, "", seconds
    try:
        run([*command.words, "--out", "out", *command.again(out)], folder)
    except RuntimeError as error:
        return kills, f"killed after {after:.1f} s, and then: {error}", seconds
    wrong = difference(out, reference, command)
    return kills, f"killed after {after:.1f} s, other bytes: {', '.join(wrong)}" if wrong else "", seconds


def references(folder: Path, names: list[str]) -> dict[str, float]:
    """Results of runs that nobody killed, and the seconds that they took; made once per version of the source."""
    book = folder / "seconds.json"
    known = json.loads(book.read_text()) if book.exists() else {}
    if known.get("source") != _source():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        prepare(folder)
        known = {"source": _source()}
    for name in names:
        if name in known:
            continue
        shutil.rmtree(folder / "out", ignore_errors=True)
        run([*COMMANDS[name].words, "--out", "out"], folder)  # the first run compiles
        shutil.rmtree(folder / "out")
        known[name] = run([*COMMANDS[name].words, "--out", "out"], folder)
        shutil.rmtree(folder / f"reference_{name}", ignore_errors=True)
        (folder / "out").rename(folder / f"reference_{name}")
        book.write_text(json.dumps(known))
        print(f"{name}: {known[name]:.1f} s to its end", flush=True)
    return known


def main() -> int:
    """Run the campaign, or go on with it; print its table; 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=200, help="in all, shared among the commands")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no run later than this")
    parser.add_argument("--only", choices=COMMANDS, action="append")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("out/soak"), help="folder; soak.json in it counts")
    given = parser.parse_args()
    begun, names = time.monotonic(), given.only or list(COMMANDS)
    work, book = (given.out / "work").resolve(), given.out / "soak.json"
    seconds = references(work, names)
    found = json.loads(book.read_text()) if book.exists() else {"rounds": 0, "kills": {}, "runs": {}, "failures": []}
    while sum(found["kills"].values()) < given.kills and time.monotonic() - begun < 60.0 * given.minutes:
        rng = np.random.default_rng([given.seed, found["rounds"]])
        name = min(names, key=lambda name: found["kills"].get(name, 0))  # as many of each
        kills, wrong, seconds[name] = one(
            COMMANDS[name], work, work / f"reference_{name}", seconds[name], rng
        )
        found["rounds"] += 1
        found["kills"][name] = found["kills"].get(name, 0) + kills
        found["runs"][name] = found["runs"].get(name, 0) + 1
        print(f"{sum(found['kills'].values())} of {given.kills}, {name}: {wrong or 'well'}", flush=True)
        if wrong:
            found["failures"].append({"command": name, "said": wrong})
        book.write_text(json.dumps(found, indent=1))
    for name in names:
        bad = sum(failure["command"] == name for failure in found["failures"])
        print(f"{name:20s} {found['kills'].get(name, 0):4d} kills of {found['runs'].get(name, 0):4d} runs, {bad} failed")
    return 1 if found["failures"] else 0


if __name__ == "__main__":
    sys.exit(main())
