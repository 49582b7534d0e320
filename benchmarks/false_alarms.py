"""How often a diagnosis contradicts the model of a simulated campaign in which nothing is concealed.

    python -m benchmarks.false_alarms KIND [--seeds FIRST COUNT] [--interval SECONDS] [--out DIR]

Campaigns are those of `pneusma synthesise KIND`, with their own tolerances and noise. A finished campaign is
not run again. Each line has the seed, the reduced chi-square of the refitted base model on the recordings
that were fitted, how many of its constants are within 1.645 of their errors, and what is said. At the end are
the mean errors of the constants in these errors, and their root mean squares.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.evaluate.unknowns import Unknowns
from fitting.diagnose.fit.prediction import predictive_chi_square
from fitting.diagnose.fit.refit import Fit
from fitting.synthesise import synthesise, write_synthetic
from pneusma_jax import enable_float64
from pneusma_jax.units import to_si

NORMAL_90 = 1.645
"""Half of the interval that holds 90 % of a normal distribution, in standard deviations."""


def said(kind: str, seed: int, interval: float | None, folder: Path) -> dict:
    """What a diagnosis says of one campaign.

    Args:
        kind: kind of the recordings.
        seed: seed of the campaign.
        interval: time between rows [s]; the kind's own if None.
        folder: folder to write it to.
    """
    made = synthesise(kind, seed=seed, interval_s=interval)
    write_synthetic(made, folder, force=True)
    (folder / "truth.json").unlink()
    found = diagnose(read_campaign(folder), seed=0)
    fit = found.explanation
    return {
        "mismatch": bool(found.mismatch),
        "named": {one.slug: round(float(one.probability), 2) for one in found.found},
        "reduced_chi2": float(predictive_chi_square(fit.program, fit.base, fit.program.fitted)),
        "errors": _errors(fit.program.unknowns, fit.base, made.truth),
    }


def _errors(unknowns: Unknowns, base: Fit, truth: dict) -> dict[str, float]:
    """Errors of the base constants over their standard errors, where the truth has them."""
    true, found = truth["parameters"], {}
    for k in unknowns.base:
        item = unknowns.items[k]
        if item.name in true and base.sd(k) > 0.0:
            value = to_si(true[item.name]["value"], true[item.name]["unit"])
            found[item.name] = float((base.u[k] - item.scaled(value)) / base.sd(k))
    return found


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
    alarms, errors = 0, []
    for seed in range(first, first + count):
        folder = out / f"{args.kind}_{seed}_{args.interval or 'own'}"
        done = folder.with_name(f"{folder.name}.json")
        if not done.exists():
            done.parent.mkdir(parents=True, exist_ok=True)
            done.write_text(json.dumps(said(args.kind, seed, args.interval, folder)))
        one = json.loads(done.read_text())
        alarms += one["mismatch"]
        errors.append(one["errors"])
        within = sum(abs(error) < NORMAL_90 for error in one["errors"].values())
        told = f"{within} of {len(one['errors'])}, {one['named'] or 'consistent'}"
        print(f"{seed}: {one['reduced_chi2']:.3f}, {told}", flush=True)
    print(f"{args.kind}: {alarms} of {count} called a mismatch")
    for name in errors[0] if errors else ():
        own = np.array([one[name] for one in errors if name in one])
        within = np.mean(np.abs(own) < NORMAL_90)
        print(f"{name}: mean {own.mean():+.2f}, rms {np.sqrt(np.mean(own**2)):.2f}, within 90 % {within:.0%}")


if __name__ == "__main__":
    main()
