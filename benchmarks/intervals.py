"""How often the intervals that `characterise` quotes hold the truth, over many simulated campaigns.

    python benchmarks/intervals.py KIND [--campaigns 40] [--minutes 8] [--seeds FIRST] [--file FILE]
                                   [--workers 16]

KIND is wire, tube (walls known), tube_walls (walls open), spring (known alloy), spring_open (everything
open), actuator or actuator_coarse (rows 3 s apart). With `_drift` at its end zeros drift by the size of the
noise in every recording. Truths are drawn from the priors that the fits use. Every campaign is characterised
with the defaults of the command.
Three kinds of interval are compared in the same fits. `bar` is the Gaussian one of the standard error,
`risen` that of the profile's rise alone, and `quoted` the one that is quoted.

The constants of one campaign share their noise, so they are no independent trials. If one direction of
four constants is two deviations off, all four are outside. The range behind a coverage is that of campaigns
drawn anew with replacement (a cluster bootstrap), not the binomial one.

With `--workers` several processes of one thread each take one seed after the other. A finished campaign is
appended to the file at once, so that an interrupted run goes on.
"""

import argparse
import json
import multiprocessing
import os
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from posterior_coverage import clopper_pearson
from recovery import truths
from scipy.stats import chi2

FIRST_SEED = 38_000
DRIFT = "_drift"
"""End of a kind whose zeros drift, by the size of the noise until the end of each recording."""
KINDS = {
    "wire": ("wire", {"spread": "prior"}),
    "tube": ("tube", {"tolerance": {"wall_thickness_mm": 0.0, "silicone_stiffness": 0.05}}),
    "tube_walls": ("tube", {}),
    "spring": ("spring", {"interval_s": 2.0}),
    "spring_open": ("spring", {"interval_s": 2.0, "spread": "prior"}),
    "actuator": ("actuator", {}),
    "actuator_coarse": ("actuator", {"interval_s": 3.0}),
}
ONE_THREAD = {
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "NPROC": "1",
    "PNEUSMA_THREADS": "1",
}
"""Environment of a worker: linear algebra, the compiler's programs and parallel fits have one thread."""
DRAWN = 4000
"""Draws of the cluster bootstrap."""
Z = {50: 0.674490, 90: 1.644854}
"""Standard errors to either side that a Gaussian bar has."""


def wishes_of(kind: str) -> tuple[str, dict]:
    """What is simulated: the kind of recording, and its options."""
    what, wishes = KINDS[kind.removesuffix(DRIFT)]
    return what, wishes | ({"drift": 1.0} if kind.endswith(DRIFT) else {})


def one_campaign(kind: str, seed: int) -> dict:
    """Simulate and characterise one campaign: every constant's truth and intervals, in the unit of files."""
    from fitting.characterise import characterise
    from fitting.synthesise import synthesise, write_synthetic
    from pneusma_jax.units import from_si

    began = time.perf_counter()
    what, wishes = wishes_of(kind)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "made"
        write_synthetic(synthesise(what, seed=seed, **wishes), made)
        record = json.loads((made / "truth.json").read_text())
        spent = time.process_time()
        fit = characterise(made)
    spent, found, estimates = time.process_time() - spent, {}, fit.parameters
    for name, truth in truths(record, list(fit.fitted)).items():
        estimate, entry = estimates[name], fit.fitted[name]
        error, profile = entry.standard_error, fit.profiles.get(name)
        found[name] = {
            "truth": truth,
            "value": estimate.value,
            "gaussian_sd": None if error is None else float(from_si(error, entry.unit, difference=True)),
            "quoted": {str(p): list(ends) for p, ends in estimate.interval.items()},
            "risen": risen(profile, entry.unit),
            "rank": rank_of(profile, entry, truth),
            "curved": estimate.curved,
            "told": list(estimate.determined),
            "of_prior": estimate.of_prior,
        }
    fitted = fit.joint if what == "spring" else fit.fit
    return {
        "combinations": combinations_of(fit, record) if what == "spring" else [],
        "rise": rise_at_truth(fit, record) if what == "spring" else None,
        "seed": seed,
        "seconds": time.perf_counter() - began,
        "processor_seconds": spent,
        "reduced_chi_square": float(fitted.reduced_chi_square),
        "ended": bool(fitted.result.success),
        "parameters": found,
    }


def risen(profile, unit: str) -> dict[str, list[float]]:
    """Intervals by the rise of chi-square alone, without the density beyond, in the unit of files."""
    from fitting.calibrate.profile_likelihood import RISES
    from pneusma_jax.units import constant_from_si

    if profile is None:
        return {}
    found = {str(p): np.clip(profile.interval(rise), *profile.bounds) for p, rise in RISES.items()}
    return {p: [float(constant_from_si(x, unit)) for x in ends] for p, ends in found.items()}


def rank_of(profile, entry, truth: float) -> float | None:
    """Part of the density below the truth, 0 to 1; None of a constant without a profile."""
    from pneusma_jax.units import constant_to_si

    if profile is None or len(profile.value) < 2:
        return None
    return float(np.interp(float(constant_to_si(truth, entry.unit)), *profile.distribution))


def rise_at_truth(fit, record: dict) -> tuple[float, int]:
    """Chi-square with priors at the truth, less that at the fit, and the number of free constants.

    If the fit is the least and the likelihood is right, it is distributed like chi-square with as many
    degrees of freedom. So one number of each campaign tells whether a direction is missed or the law is bent.
    """
    from fitting.calibrate.spring.residuals import values_of
    from fitting.specimens import residual_of
    from fitting.specimens.spring_trajectory import decided, undecided
    from pneusma_jax.units import to_si

    problem, data = fit.joint.problem, fit.joint.problem.data()
    truth = {n: float(to_si(v, fit.fitted[n].unit)) for n, v in truths(record, list(fit.fitted)).items()}

    def cost(values: dict, rows) -> float:
        point = values_of(problem.parameters, values)
        misfit = np.asarray(residual_of("spring")(point, decided(point, rows)))
        away = [(values[n] - p.prior.mean) / p.prior.sd for n, p in problem.parameters.items() if p.prior]
        return float(np.sum(misfit**2) + np.sum(np.square(away)))

    return cost(truth, undecided(data["rows"])) - cost(fit.joint.values, data["rows"]), len(truth)


def combinations_of(fit, record: dict) -> list[dict]:
    """Resistivities and stresses of a spring's phases: truth, value and interval."""
    from fitting.calibrate.spring.plateaus import shown_by
    from pneusma_jax.units import to_si

    numbers = {name: (p["value"], p["unit"]) for name, p in record["parameters"].items()}
    true = {name: float(to_si(value, unit)) for name, (value, unit) in numbers.items() if unit != "K"}
    _, law = shown_by(fit.base, [test for test in fit.tests if test.fitted])
    found = []
    for one, truth in zip(fit.combinations, np.asarray(law(true)), strict=True):
        ends = [one.low, one.high]
        found.append({"name": one.name, "truth": float(truth), "value": one.value, "ends": ends})
    return found


def intervals_of(one: dict, percent: int, which: str) -> tuple[float, float] | None:
    """Interval of one constant: `quoted`, `risen`, or the Gaussian `bar`; None where there is none."""
    if which != "bar":
        known = one.get(which, {})
        return tuple(known[str(percent)]) if str(percent) in known else None
    if one["gaussian_sd"] is None:
        return None
    half = Z[percent] * one["gaussian_sd"]
    return one["value"] - half, one["value"] + half


def error_of(one: dict, which: str) -> float:
    """Distance of the truth in standard deviations of the interval, on its own side; NaN without interval."""
    ends = intervals_of(one, 90, which)
    if ends is None:
        return float("nan")
    away = one["truth"] - one["value"]
    width = (ends[1] - one["value"] if away > 0.0 else one["value"] - ends[0]) / Z[90]
    return float(away / width) if width > 0.0 else float("nan" if away == 0.0 else np.copysign(np.inf, away))


def counts(campaigns: list[list[dict]], which: str) -> dict[str, float]:
    """Coverage in per cent with its 95 % range, and the worst error, of constants that have an interval.

    Args:
        campaigns: constants of each campaign.
        which: kind of interval, see `intervals_of`.
    """
    found: dict[str, float] = {}
    for percent in Z:
        held = np.zeros((len(campaigns), 2))
        for k, constants in enumerate(campaigns):
            ends = [(one, intervals_of(one, percent, which)) for one in constants]
            told = [low <= one["truth"] <= high for one, (low, high) in ((o, e) for o, e in ends if e)]
            held[k] = sum(told), len(told)
        low, high = spread_of(held)
        total = held.sum(axis=0)
        found |= {f"held_{percent}": 100.0 * float(total[0] / total[1]) if total[1] else np.nan}
        found |= {f"low_{percent}": 100.0 * low, f"high_{percent}": 100.0 * high, "constants": int(total[1])}
    errors = np.array([error_of(one, which) for constants in campaigns for one in constants])
    found["worst"] = float(np.nanmax(np.abs(errors), initial=0.0))
    return found


def spread_of(held: np.ndarray) -> tuple[float, float]:
    """95 % range of a share, from numbers held and asked of each campaign, shape (campaigns, 2).

    One constant a campaign has the exact binomial range; several, that of campaigns drawn anew.
    """
    total = held.sum(axis=0)
    if not total[1]:
        return np.nan, np.nan
    if held[:, 1].max() <= 1:
        return clopper_pearson(int(total[0]), int(total[1]))
    drawn = np.random.default_rng(0).integers(len(held), size=(DRAWN, len(held)))
    sums = held[drawn].sum(axis=1)
    low, high = np.quantile(sums[:, 0] / np.maximum(sums[:, 1], 1.0), [0.025, 0.975])
    return float(low), float(high)


def report(kind: str, done: list[dict], parameters: bool) -> None:
    """Print the table of a kind: before, after, and by parameter on request."""
    seconds = np.median([entry["seconds"] for entry in done])
    stopped = sum(not entry["ended"] for entry in done)
    spent = [entry["processor_seconds"] for entry in done if "processor_seconds" in entry] or [np.nan]
    print(
        f"{kind}: {len(done)} campaigns, {seconds:.0f} s each (median; processor time of the fit "
        f"{np.median(spent):.0f} s, at most {np.max(spent):.0f}), {stopped} fits did not end well"
    )
    every = [list(entry["parameters"].values()) for entry in done]
    everything = [one for constants in every for one in constants]
    for which in ("bar", "risen", "quoted"):
        found = counts(every, which)
        print(
            f"  {which}: of {found['constants']} constants 50 % intervals hold {found['held_50']:.1f} % "
            f"({found['low_50']:.0f} to {found['high_50']:.0f}), 90 % intervals {found['held_90']:.1f} % "
            f"({found['low_90']:.0f} to {found['high_90']:.0f}), worst error {found['worst']:.1f} of its sd"
        )
    ranks = [one["rank"] for one in everything if one.get("rank") is not None]
    if ranks:
        shares = np.histogram(ranks, np.linspace(0.0, 1.0, 11))[0]
        print(f"  ranks of the truth in the density, by tenths: {' '.join(map(str, shares))}")
    told = [one for entry in done for one in entry.get("combinations", [])]
    if told:
        held = np.mean([one["ends"][0] <= one["truth"] <= one["ends"][1] for one in told])
        print(f"  of {len(told)} resistivities and stresses 90 % intervals hold {100.0 * held:.1f} %")
    rises = [entry["rise"] for entry in done if entry.get("rise")]
    if rises:
        p = chi2.sf(*np.array(rises).T)
        print(
            f"  chi-square at the truth above the fit's: {', '.join(f'{rise:.0f}' for rise, _ in rises)} "
            f"for {rises[0][1]} constants; p {np.min(p):.2g} to {np.max(p):.2g}, all together "
            f"{chi2.sf(*np.sum(rises, axis=0)):.2g}"
        )
    curved = np.mean([one["curved"] for one in everything])
    print(f"  {100.0 * curved:.0f} % of the profiles are no parabolas")
    if not parameters:
        return
    for name in done[0]["parameters"]:
        mine = [entry["parameters"][name] for entry in done if name in entry["parameters"]]
        cells = [counts([[one] for one in mine], which) for which in ("bar", "quoted")]
        shares = [one["of_prior"] for one in mine if one["of_prior"] is not None]
        print(
            f"    {name:22s} " + "; ".join(
                f"{c['held_50']:.0f} and {c['held_90']:.0f} %, worst {c['worst']:.1f}" for c in cells
            ) + (f"; {100.0 * np.median(shares):.0f} % of the prior" if shares else "")
        )  # fmt: skip


def read(file: Path) -> list[dict]:
    """Campaigns of a file, in the order of seeds; a last line that was cut off is left out."""
    lines = file.read_text().split("\n")[:-1] if file.exists() else []
    return sorted(map(json.loads, filter(None, lines)), key=lambda entry: entry["seed"])


def append(file: Path, entry: dict) -> None:
    """Append one campaign as a line, in one write, so that lines of several processes never mix."""
    stream = os.open(file, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        os.write(stream, (json.dumps(entry) + "\n").encode())
    finally:
        os.close(stream)


def work(kind: str, file: Path, seeds: list[int], taken, minutes: float) -> None:
    """Characterise one seed after the other until there is none, or the next would end too late.

    Args:
        kind: see `KINDS`.
        file: where finished campaigns are appended.
        seeds: of all campaigns that are missing.
        taken: number of seeds that workers have taken, a shared integer with a lock.
        minutes: time from now until the last campaign should have ended.
    """
    from pneusma_jax import enable_float64

    enable_float64()
    end, shortest = time.monotonic() + 60.0 * minutes, np.inf
    while time.monotonic() + (shortest if np.isfinite(shortest) else 0.0) < end:
        with taken.get_lock():
            place = taken.value
            taken.value += 1
        if place >= len(seeds):
            return
        began = time.monotonic()
        try:
            entry = one_campaign(kind, seeds[place])
        except Exception as error:  # one campaign that fails is counted, and the others go on
            entry = {"seed": seeds[place], "failed": f"{type(error).__name__}: {error}"}
        append(file, entry)
        shortest = min(shortest, time.monotonic() - began)  # the first one compiles, and says too much


def work_together(kind: str, file: Path, seeds: list[int], minutes: float, workers: int) -> None:
    """The same by several processes of one thread each; says which of them died."""
    os.environ.update(ONE_THREAD)
    context = multiprocessing.get_context("spawn")
    taken = context.Value("q", 0)
    crew = [context.Process(target=work, args=(kind, file, seeds, taken, minutes)) for _ in range(workers)]
    for worker in crew:
        worker.start()
    for worker in crew:
        worker.join()
    dead = [worker.exitcode for worker in crew if worker.exitcode]
    if dead:
        print(f"{len(dead)} of {workers} workers died, with exit codes {', '.join(map(str, dead))}")


def main() -> None:
    """Run what is missing, then report."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("kind", choices=[k + end for k in KINDS for end in ("", DRIFT)])
    arguments.add_argument("--campaigns", type=int, default=40)
    arguments.add_argument(
        "--minutes",
        type=float,
        default=np.inf,
        help="begin no campaign that would end after these, if it took as long as its worker's shortest",
    )
    arguments.add_argument("--seeds", type=int, default=FIRST_SEED, help="first seed")
    arguments.add_argument("--workers", type=int, default=1, help="processes of one thread each")
    arguments.add_argument("--file", type=Path, help="results so far; KIND_intervals.jsonl by default")
    arguments.add_argument("--report", action="store_true", help="only report what is in the file")
    arguments.add_argument("--parameters", action="store_true", help="report every parameter, too")
    given = arguments.parse_args()
    file = given.file or Path(f"{given.kind}_intervals.jsonl")
    known = {entry["seed"] for entry in read(file)}
    missing = [s for s in range(given.seeds, given.seeds + given.campaigns) if s not in known]
    if missing and not given.report:
        crew = min(given.workers, len(missing))
        if crew > 1:
            work_together(given.kind, file, missing, given.minutes, crew)
        else:
            work(given.kind, file, missing, multiprocessing.Value("q", 0), given.minutes)
    found = read(file)
    failed = [entry for entry in found if "failed" in entry]
    for reason in dict.fromkeys(entry["failed"] for entry in failed):
        seeds = [entry["seed"] for entry in failed if entry["failed"] == reason]
        print(f"{len(seeds)} failed, the first of them seed {seeds[0]}: {reason}")
    done = [entry for entry in found if "failed" not in entry]
    if not done:
        raise SystemExit(f"{file} holds no finished campaign")
    report(given.kind, done, given.parameters)


if __name__ == "__main__":
    main()
