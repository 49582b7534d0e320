"""What a diagnosis costs: effects that are off, fits side by side, and the first use against later ones.

    python benchmarks/diagnosis_speed.py [CAMPAIGN ...] [--only runs|whole] [--against CHECKOUT]

A run is the compiled program of a campaign once: outputs of all recordings and their derivatives along up
to `optimiser.directions` directions. It is timed with only the effects on that a fit of one effect needs,
and with all on, which changes no number. The same runs follow in one thread and in one for each core. The
whole command is timed with an empty cache and again with what that left; with `--against` also by the code of
another checkout, in turn. On a busy machine the times of the processor say more than those of the clock.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

HERE = Path(__file__).resolve().parents[1]
EXAMPLE = HERE / "calibration_data" / "examples" / "actuator"
RUNS = 12


def main() -> None:
    """Print the times and their ratios."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("campaigns", nargs="*", type=Path, default=[EXAMPLE])
    arguments.add_argument("--only", choices=("runs", "whole"), help="single runs, or the whole command")
    arguments.add_argument("--against", type=Path, help="checkout of other code for the whole command")
    given = arguments.parse_args()
    for campaign in given.campaigns:
        if given.only != "whole":
            runs(campaign)
        if given.only != "runs":
            whole(campaign.resolve(), given.against)


def runs(campaign: Path) -> None:
    """Times of single runs."""
    from pneusma_jax import enable_float64

    enable_float64()
    from fitting.data.recordings import read_campaign
    from fitting.diagnose.evaluate.program import Program
    from fitting.inference.parallel import run_parallel
    from fitting.specimens.registry import kind_of

    recordings = read_campaign(campaign)
    program = Program.of(recordings, kind_of(recordings))
    unknowns = program.unknowns
    needed, u = unknowns.present, unknowns.neutral

    def timed(columns: np.ndarray) -> float:
        spent = []
        for k in range(RUNS):
            began = time.perf_counter()
            moved = u.copy()
            moved[unknowns.base] += 1e-6 * k  # effects stay as they are: off
            program.evaluate(moved, columns[: program._compiled.width], stacked=program.stacked)
            spent.append(time.perf_counter() - began)
        return float(np.median(spent[2:]))

    few, all_on = [], []
    for slug in unknowns.slugs:
        columns = np.concatenate([unknowns.base, unknowns.of([slug])]).astype(int)
        unknowns.present = needed
        few.append(timed(columns))
        unknowns.present = lambda *_: np.ones(len(unknowns.slugs), bool)
        all_on.append(timed(columns))
    unknowns.present = needed
    print(f"{campaign}: {len(unknowns.slugs)} effects, recordings x rows {program.stacked.mask.shape}")
    one, every = 1e3 * np.median(few), 1e3 * np.median(all_on)
    print(f"a run with one effect on: median {one:.0f} ms, with all {every:.0f} ms, ratio {every / one:.1f}")
    jobs = [unknowns.base] * 4
    began = time.perf_counter()
    list(map(timed, jobs))
    alone = time.perf_counter() - began
    began = time.perf_counter()
    run_parallel(timed, jobs)
    together = time.perf_counter() - began
    print(f"the same runs in one thread and in one for each core: ratio {alone / together:.1f}")


def whole(campaign: Path, other: Path | None) -> None:
    """Times of the command by this code and another, each with a cache of its own."""
    codes = {"this code": HERE} | ({"the other": other.resolve()} if other else {})
    with tempfile.TemporaryDirectory() as folder:
        for what in ("first use", "again"):
            spent = {name: once(campaign, code, Path(folder) / name, what) for name, code in codes.items()}
            told = [f"{name} {wall:.0f} s, processor {cpu:.0f} s" for name, (wall, cpu) in spent.items()]
            if other:
                (mine, own), (theirs, their) = spent.values()
                told.append(f"ratio {theirs / mine:.2f}, processor {their / own:.2f}")
            print(f"{campaign.name}, pneusma diagnose, {what}: {'; '.join(told)}", flush=True)


def once(campaign: Path, code: Path, folder: Path, what: str) -> tuple[float, float]:
    """Seconds of the clock and of the processor of one diagnosis."""
    folder.mkdir(exist_ok=True)
    place = os.environ | {"PNEUSMA_CACHE": str(folder / "cache"), "PYTHONPATH": str(code)}
    command = [sys.executable, "-m", "fitting.cli", "diagnose", str(campaign)]
    command += ["--out", str(folder / what)]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, env=place, capture_output=True, cwd=folder)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
