"""What a diagnosis costs: effects that are off, fits side by side, and the first use against later ones.

    python benchmarks/diagnosis_speed.py [CAMPAIGN] [--no-whole]

A run is the compiled program of a campaign once: outputs of all recordings and their derivatives along up
to `optimiser.directions` directions. It is timed with only the effects on that a fit of one effect needs,
and with all on, which changes no number. The same runs follow in one thread and in one for each core. The
whole command is timed with an empty cache and again with what that left.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

EXAMPLE = Path(__file__).resolve().parents[1] / "calibration_data" / "examples" / "actuator"
RUNS = 12


def main() -> None:
    """Print the times and their ratios."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("campaign", nargs="?", type=Path, default=EXAMPLE)
    arguments.add_argument("--no-whole", action="store_true", help="leave out the whole command, twice")
    given = arguments.parse_args()
    runs(given.campaign)
    if not given.no_whole:
        whole(given.campaign)


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
            program.evaluate(u + 1e-6 * k, columns[: program._compiled.width], stacked=program.stacked)
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


def whole(campaign: Path) -> None:
    """Times of the command."""
    with tempfile.TemporaryDirectory() as folder:
        place = os.environ | {"PNEUSMA_CACHE": str(Path(folder) / "cache")}
        for what in ("first use", "again"):
            command = [sys.executable, "-m", "fitting.cli", "diagnose", str(campaign)]
            command += ["--out", f"{folder}/{what}"]
            began = time.perf_counter()
            subprocess.run(command, check=True, env=place, capture_output=True)
            print(f"pneusma diagnose, {what}: {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
