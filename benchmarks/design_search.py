"""The gradient way of a design study against a grid of all designs, CMA-ES and Optuna's TPE.

    python benchmarks/design_search.py --out out/design_search [--only cost|study|starts|grid|cma|tpe]

It needs `pip install -e .[benchmarks]`. The study is `wider_pneusma2`. Two things are compared.

- The continuous part: how much each method computes until its best design that keeps all constraints is
  within 1 % of the best that is known. CMA-ES and TPE have several seeds. The gradient way has single starts,
  spread over the box, and the study's own search from all its starts.
- The whole study, rounding included: the design that can be made, against a grid of all of them.

A *solve* is one design in all its states, without derivatives. A design with derivatives counts as many
solves as it takes times the processor time of one without, measured here. Every course goes to a file of its
own in the folder, and is not computed again when the script is given again.
"""

import argparse
import dataclasses
import itertools
import json
import time
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.design import read_study
from fitting.design.bodies import plan_of
from fitting.design.discrete import places_of
from fitting.design.log import Log, LoggedModel
from fitting.design.optimise import ALLOWED, Problem, from_starts, optimise
from fitting.design.program import Model
from fitting.design.run import run_study
from fitting.design.search import start_places
from fitting.report.figures import BLUE, GREEN, GREY, PURPLE, VERMILION, legend_above, save_figure, style

STUDY = "wider_pneusma2"
QUALITY = 0.01
FEW, LOT = 8, 256
REPEATS = 7


class Values:
    """Designs without derivatives: area [mm2], and the largest scaled violation."""

    def __init__(self, model: Model):
        self.model = model

    def __call__(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        size = FEW if len(places) <= FEW else LOT
        parts = [places[k : k + size] for k in range(0, len(places), size)]
        found = np.concatenate([self.model.values(part, size) for part in parts])
        area, excess = -1e6 * found[:, 0], found[:, 1:].max(axis=1)
        bad = ~np.all(np.isfinite(found), axis=1)
        return np.where(bad, 0.0, area), np.where(bad, 1.0, excess)


def course_of(area: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """Largest area of designs that keep all constraints, after each evaluation [mm2]."""
    return np.maximum.accumulate(np.where(np.asarray(excess) <= ALLOWED, area, 0.0))


def course_of_log(log: Log) -> np.ndarray:
    """The same of all evaluations of a study, in the order in which they were asked for."""
    known = list(log.known.values())
    return course_of(
        np.array([-1e6 * e.values[0] for e in known]), np.array([np.max(e.values[1:]) for e in known])
    )


def cost(model: Model, places: np.ndarray) -> float:
    """Processor time of designs with derivatives over that of the same without [1], medians."""
    values, slopes = (lambda: model.values(places)), (lambda: model.evaluate(places))
    spent = []
    for work in (values, slopes):
        work()
    for _ in range(REPEATS):  # in turn, so that both see the same load
        for work in (values, slopes):
            began = time.process_time()
            work()
            spent.append(time.process_time() - began)
    plain, with_slopes = np.array(spent).reshape(-1, 2).T
    return float(np.median(with_slopes) / np.median(plain))


def single_start(model: Model, place: np.ndarray) -> np.ndarray:
    """Course of the gradient way from one start."""
    evaluate = LoggedModel(model, Log(None, ""), 0, FEW)
    first = evaluate([place])[0]
    rows = np.arange(1, first.values.size)
    size = abs(first.values[0])
    problem = Problem(np.eye(rows.size + 1)[0] / size, rows, np.zeros(rows.size), np.ones(rows.size))
    optimise([problem], [place], evaluate)
    return course_of_log(evaluate.log)


def cma_way(values: Values, size: int, budget: int, seed: int) -> np.ndarray:
    """CMA-ES with its augmented Lagrangian for the constraint, a population at a time."""
    import cma

    seen: list[tuple[float, float]] = []
    known: dict[bytes, tuple[float, float]] = {}

    def looked_at(places: list) -> None:
        clipped = [np.clip(np.asarray(x, dtype=float), 0.0, 1.0) for x in places]
        new = [x for x in {x.tobytes(): x for x in clipped}.values() if x.tobytes() not in known]
        if new:
            found = list(zip(*values(np.array(new)), strict=True))
            known.update((x.tobytes(), one) for x, one in zip(new, found, strict=True))
            seen.extend(found)

    def both(x: np.ndarray) -> tuple[float, float]:
        looked_at([x])
        return known[np.clip(np.asarray(x, dtype=float), 0.0, 1.0).tobytes()]

    lagrangian = cma.ConstrainedFitnessAL(lambda x: -both(x)[0] / 1000.0, lambda x: [both(x)[1]], logging=0)
    options = {"bounds": [0, 1], "maxfevals": budget, "seed": seed, "verbose": -9, "verb_log": 0}
    strategy = cma.CMAEvolutionStrategy(size * [0.5], 0.25, options)
    while not strategy.stop() and len(seen) < budget:
        places = strategy.ask()
        looked_at(places)
        strategy.tell(places, [lagrangian(x) for x in places])
        lagrangian.update(strategy)
    return course_of(*np.array(seen).T)


def tpe_way(values: Values, size: int, budget: int, seed: int) -> np.ndarray:
    """Optuna's TPE, told of the constraint."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    seen = []

    def goal(trial: "optuna.Trial") -> float:
        place = np.array([trial.suggest_float(f"x{k}", 0.0, 1.0) for k in range(size)])
        area, excess = values(place[None])
        seen.append((area[0], excess[0]))
        trial.set_user_attr("excess", float(excess[0]))
        return area[0]

    sampler = optuna.samplers.TPESampler(
        seed=seed, multivariate=True, constraints_func=lambda t: (t.user_attrs["excess"],)
    )
    optuna.create_study(direction="maximize", sampler=sampler).optimize(goal, n_trials=budget)
    return course_of(*np.array(seen).T)


def grid_way(values: Values, model: Model, pitches: int) -> dict:
    """Every design that can be made; those that the diameter or the coil alone forbid are not solved."""
    axes = [
        places_of(model.space, k) if f.discrete else np.linspace(0.0, 1.0, pitches)
        for k, f in enumerate(model.space.free)
    ]
    every = np.array(list(itertools.product(*axes)))
    sizes = jax.vmap(model.space.parameters)(jnp.asarray(every))
    wire, mandrel = (np.asarray(sizes[n]) for n in ("wire_diameter", "mandrel_diameter"))
    fits = (mandrel + 2.0 * wire <= 1.4e-3 + 1e-9) & ((mandrel + wire) / wire >= 4.0 - 1e-9)
    began = time.process_time()
    area, excess = values(every[fits])
    spent = time.process_time() - began
    best = float(course_of(area, excess)[-1])
    return {"designs": len(every), "solves": int(fits.sum()), "best_mm2": best, "processor_s": spent}


def needed(course: np.ndarray, best: float) -> int | None:
    """Evaluations until within `QUALITY` of the best; None if never."""
    there = np.flatnonzero(np.asarray(course) >= (1.0 - QUALITY) * best)
    return int(there[0]) + 1 if there.size else None


def figure_of(courses: dict[str, list[tuple[np.ndarray, float]]], best: float) -> Figure:
    """Figure of the best area over solves; a course comes with the solves that one of its designs costs."""
    colours = dict(zip(courses, (VERMILION, PURPLE, BLUE, GREEN), strict=False))
    with style():
        figure = Figure(figsize=(6.8, 4.4), layout="constrained")
        axes = figure.subplots()
        for name, many in courses.items():
            for k, (course, each) in enumerate(many):
                solves = each * np.arange(1, len(course) + 1)
                axes.step(
                    solves, course, where="post", color=colours[name], alpha=0.8, linewidth=1.2,
                    label="_" if k else name,
                )  # fmt: skip
        axes.axhline((1.0 - QUALITY) * best, color=GREY, linestyle="--", label="within 1 % of the best")
        axes.set(xscale="log", xlabel="solves", ylabel="largest workspace area [mm2]", ylim=(0, 1.08 * best))
        legend_above(axes, 2)
    return figure


class Kept:
    """Results in files of a folder, each computed once."""

    def __init__(self, folder: Path):
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def __call__(self, name: str, work: Callable[[], object]) -> object:
        path = self.folder / f"{name}.json"
        if not path.exists():
            began = time.perf_counter()
            found = work()
            path.write_text(json.dumps(found.tolist() if isinstance(found, np.ndarray) else found))
            print(f"{name}: {time.perf_counter() - began:.0f} s", flush=True)
        return json.loads(path.read_text())

    def all_of(self, stem: str) -> list:
        """All results whose names begin so, in the order of their names."""
        paths = sorted(self.folder.glob(f"{stem}_*.json"), key=lambda p: int(p.stem.rpartition("_")[2]))
        return [json.loads(path.read_text()) for path in paths]


def whole_study(study: object) -> dict:
    """The study as users run it: evaluations in all, and the design that can be made."""
    result = run_study(study)
    return {"evaluations": result.evaluations, "made_mm2": 1e6 * result.made.objectives[0]}


def side_by_side(study: object, model: Model) -> np.ndarray:
    """Course of the study's own continuous search, from all its starts; `study` has the seed of these."""
    evaluate = LoggedModel(model, Log(None, ""), 0, study.starts)
    places = start_places(study, model)
    first = evaluate(places)
    rows = np.arange(1, first[0].values.size)
    size = float(np.median([abs(one.values[0]) for one in first]))
    problem = Problem(np.eye(rows.size + 1)[0] / size, rows, np.zeros(rows.size), np.ones(rows.size))
    from_starts(problem, places, evaluate)
    return course_of_log(evaluate.log)


def told(courses: list, each: float, best: float) -> dict:
    """Medians and extremes of several courses of a method, in solves; None where one never got there."""
    there = [needed(c, best) for c in courses]
    solves = [None if n is None else each * n for n in there]
    reached = sorted(s for s in solves if s is not None)
    return {
        "seeds": len(courses), "reached": len(reached), "solves_of_one_design": each, "solves": solves,
        "median": float(np.median([np.inf if s is None else s for s in solves])) if solves else None,
        "range": [reached[0], reached[-1]] if reached else None,
        "of_designs": [len(c) for c in courses], "best_mm2": [c[-1] for c in courses],
    }  # fmt: skip


def summary(kept: Kept) -> tuple[dict, Figure]:
    """Table and figure of all that is in the folder."""
    each = float(np.median(kept.all_of("cost")))
    groups = {
        "gradient, one start": (kept.all_of("start"), each),
        "gradient, 8 starts": (kept.all_of("together"), each),
        "CMA-ES": (kept.all_of("cma"), 1.0),
        "TPE": (kept.all_of("tpe"), 1.0),
    }
    best = max(course[-1] for many, _ in groups.values() for course in many)
    found = {"best_continuous_mm2": best, "cost_of_derivatives": kept.all_of("cost")}
    found |= {name: told(many, cost, best) for name, (many, cost) in groups.items()}
    found |= {"study": kept.all_of("study"), "grid": kept.all_of("grid")}
    if found["study"] and found["grid"]:
        solves = each * found["study"][0]["evaluations"]
        found["grid_over_study"] = found["grid"][0]["solves"] / solves
    return found, figure_of({n: [(c, x) for c in many] for n, (many, x) in groups.items() if many}, best)


def main() -> None:
    """Compute what is asked for, and print what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/design_search"))
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--starts", type=int, default=15, help="single starts beside the tables' own design")
    parser.add_argument("--cma", type=int, default=3000, help="evaluations of a seed")
    parser.add_argument("--tpe", type=int, default=1000, help="evaluations of a seed")
    parser.add_argument("--pitches", type=int, default=2)
    parser.add_argument("--only", choices=("cost", "study", "starts", "grid", "cma", "tpe"))
    options = parser.parse_args()
    pj.enable_float64()
    study = read_study(STUDY)
    model = Model(study, plan_of(*study.designs))
    values, size, kept = Values(model), len(model.space), Kept(options.out)
    wanted = lambda part: options.only in (None, part)  # noqa: E731
    own = start_places(study, model)
    spread = np.random.default_rng(40).random((options.starts, size))
    if wanted("cost"):
        kept("cost_1", lambda: cost(model, np.array(own)))
    if wanted("study"):
        kept("study_1", lambda: whole_study(study))
    if wanted("starts"):
        for seed in range(options.seeds):
            other = dataclasses.replace(study, seed=seed)
            kept(f"together_{seed + 1}", lambda other=other: side_by_side(other, model))
        for k, place in enumerate([own[0], *spread], 1):
            kept(f"start_{k}", lambda place=place: single_start(model, place))
    if wanted("grid"):
        kept("grid_1", lambda: grid_way(values, model, options.pitches))
    for name, way, budget in (("cma", cma_way, options.cma), ("tpe", tpe_way, options.tpe)):
        for seed in range(1, options.seeds + 1) if wanted(name) else ():
            kept(f"{name}_{seed}", lambda way=way, n=budget, s=seed: way(values, size, n, s))
    if kept.all_of("cost") and kept.all_of("start"):
        found, figure = summary(kept)
        save_figure(figure, options.out / "design_search.png")
        (options.out / "design_search.json").write_text(json.dumps(found, indent=1))
        print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
