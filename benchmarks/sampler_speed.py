"""Effective samples a second of the samplers, on posteriors of five simulated campaigns.

    python benchmarks/sampler_speed.py KIND [--samplers emcee,nuts,tempered] [--minutes 5] [--seed 1]
                                       [--dir FOLDER] [--plain] [--report]

KIND is tube, wire, spring (known alloy), spring_open or actuator. Every sampler draws from the same density,
from the same fit. Each goes on until the rule of quotable draws holds (R-hat below 1.01, 1,000 effective
samples, 50 autocorrelation times) or its minutes of processor time are over. So where two have converged,
their R-hat is alike.

`--plain` leaves out what this package adds to emcee and NUTS: straightened valleys, and draws about the fit.
Give it a folder of its own.

Time is that of the processor, which does not mind what else runs. The first piece of a run compiles; the rate
without it is given beside the whole one. Chains and results lie in the folder: a run that was stopped goes
on, and finished ones are only reported.
"""

import argparse
import json
import os
import pickle
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from recovery import KINDS, OPTIONS, WISHES

FIRST_STEPS = {"emcee": 200, "nuts": 50, "tempered": 200}
"""Steps of the first piece; every further one doubles the length."""
WORDS = ("sampler", "steps", "effective", "R-hat", "seconds", "evaluations", "per s", "per s, compiled")


def fitted(kind: str, seed: int, folder: Path):
    """The fit of a simulated campaign, kept in the folder."""
    from fitting.characterise import characterise
    from fitting.synthesise import synthesise, write_synthetic

    kept = folder / f"{kind}_{seed}.fit"
    if not kept.exists():
        made = folder / f"{kind}_{seed}"
        write_synthetic(synthesise(KINDS.get(kind, kind), seed=seed, **WISHES[kind]), made, force=True)
        options = OPTIONS.get(kind, {"starts": 1}) | {"profile": 0}
        kept.write_bytes(pickle.dumps(characterise(made, seed=seed, **options)))
    return pickle.loads(kept.read_bytes())


def run(fit, sampler: str, seed: int, minutes: float, stem: Path) -> dict:
    """Pieces of one sampler's run until it has converged or the time is over."""
    from fitting.sample import Settings, sample
    from fitting.sample.problems import sampling_problem

    note, chain = stem.with_suffix(".json"), stem.with_suffix(".h5")
    known = json.loads(note.read_text()) if note.exists() else {"sampler": sampler, "pieces": []}
    problem, steps = sampling_problem(fit), FIRST_STEPS[sampler]
    while not known.get("converged"):
        spent = sum(piece["seconds"] for piece in known["pieces"])
        if spent > 60.0 * minutes:
            break
        wanted = steps * 2 ** len(known["pieces"])
        began = time.process_time()
        settings = Settings(sampler=sampler, max_steps=wanted, seed=seed)
        found = sample(
            problem.target, problem.parameters, settings, file=chain, resume=chain.exists(), progress=False
        )
        known["pieces"].append({"steps": wanted, "seconds": time.process_time() - began})
        known |= {
            "converged": bool(found.converged),
            "effective": float(np.min(found.convergence.effective)),
            "r_hat": float(np.max(found.convergence.r_hat)),
            "evaluations": int(found.evaluations),
            "steps": int(found.chains.shape[1]),
            "constants": problem.target.dimension,
        }
        note.write_text(json.dumps(known))
    return known


def leave_out_additions() -> None:
    """Samplers as others have them: walkers and chains in a chart alone."""
    from fitting.sample import independent, unbounded

    independent.LIKELY = np.inf
    unbounded.bend_of = lambda rows, determined, seed: np.zeros((len(determined),) * 3)


def line(known: dict) -> str:
    """One row of the table."""
    seconds = [piece["seconds"] for piece in known["pieces"]]
    if not seconds:
        return f"| {known['sampler']} | not begun |"
    effective, later = known["effective"], sum(seconds[1:])
    share = 1.0 - known["pieces"][0]["steps"] / max(known["steps"], 1)
    rate = f"{effective * share / later:.2f}" if later > 0.0 else "-"
    state = "" if known["converged"] else " (not converged)"
    return (
        f"| {known['sampler']}{state} | {known['steps']} | {effective:.0f} | {known['r_hat']:.4f} | "
        f"{sum(seconds):.0f} | {known['evaluations']} | {effective / sum(seconds):.2f} | {rate} |"
    )


def main() -> None:
    """Run what is missing, then print the table."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("kind", choices=list(WISHES))
    arguments.add_argument("--samplers", default="emcee,nuts")
    arguments.add_argument("--minutes", type=float, default=5.0, help="of processor time, for each sampler")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--dir", type=Path, default=Path("sampler_speed"))
    arguments.add_argument("--report", action="store_true", help="only print what is known")
    arguments.add_argument("--plain", action="store_true", help="no straight valleys, no draws about the fit")
    given = arguments.parse_args()
    from pneusma_jax import enable_float64

    enable_float64()
    if given.plain:
        leave_out_additions()
    given.dir.mkdir(parents=True, exist_ok=True)
    rows = []
    for sampler in given.samplers.split(","):
        stem = given.dir / f"{given.kind}_{given.seed}_{sampler}"
        if given.report:
            note = stem.with_suffix(".json")
            rows += [json.loads(note.read_text())] if note.exists() else []
            continue
        rows.append(run(fitted(given.kind, given.seed, given.dir), sampler, given.seed, given.minutes, stem))
    print(f"{given.kind}: {rows[0]['constants'] if rows else 'no'} constants, seed {given.seed}")
    print(f"| {' | '.join(WORDS)} |")
    print("|" + "---|" * len(WORDS))
    for known in rows:
        print(line(known))


if __name__ == "__main__":
    main()
