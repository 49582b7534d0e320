"""How often a diagnosis contradicts the model of a simulated campaign in which nothing is concealed.

    python -m benchmarks.false_alarms KIND [--seeds FIRST COUNT] [--interval SECONDS] [--out DIR]

Campaigns are those of `pneusma synthesise KIND`, with their own tolerances and noise. A finished campaign is
not run again. Each line has the seed, the reduced chi-square of the refitted base model on the recordings
that were fitted, and what is said.
"""

import argparse
import json
import tempfile
from pathlib import Path

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.fit.prediction import predictive_chi_square
from fitting.synthesise import synthesise, write_synthetic
from pneusma_jax import enable_float64


def said(kind: str, seed: int, interval: float | None, folder: Path) -> dict:
    """What a diagnosis says of one campaign.

    Args:
        kind: kind of the recordings.
        seed: seed of the campaign.
        interval: time between rows [s]; the kind's own if None.
        folder: folder to write it to.
    """
    write_synthetic(synthesise(kind, seed=seed, interval_s=interval), folder, force=True)
    (folder / "truth.json").unlink()
    found = diagnose(read_campaign(folder), seed=0)
    fit = found.explanation
    return {
        "mismatch": bool(found.mismatch),
        "named": {one.slug: round(float(one.probability), 2) for one in found.found},
        "reduced_chi2": float(predictive_chi_square(fit.program, fit.base, fit.program.fitted)),
    }


def main() -> None:
    """Count."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("kind")
    parser.add_argument("--seeds", nargs=2, type=int, default=(930, 20), metavar=("FIRST", "COUNT"))
    parser.add_argument("--interval", type=float)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    enable_float64()
    out = args.out or Path(tempfile.mkdtemp())
    first, count = args.seeds
    alarms = 0
    for seed in range(first, first + count):
        folder = out / f"{args.kind}_{seed}_{args.interval or 'own'}"
        done = folder.with_name(f"{folder.name}.json")
        if not done.exists():
            done.parent.mkdir(parents=True, exist_ok=True)
            done.write_text(json.dumps(said(args.kind, seed, args.interval, folder)))
        one = json.loads(done.read_text())
        alarms += one["mismatch"]
        print(f"{seed}: {one['reduced_chi2']:.3f} {one['named'] or 'consistent'}", flush=True)
    print(f"{args.kind}: {alarms} of {count} called a mismatch")


if __name__ == "__main__":
    main()
