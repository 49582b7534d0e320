"""The gradient way of a design study against a grid of all designs, CMA-ES and Optuna's TPE.

    python benchmarks/design_search.py --out out/design_search            (needs `pip install -e
    .[benchmarks]`)

The study is `wider_pneusma2`. Compared is, first, its continuous part: how many designs each method
evaluates until its best one that keeps all constraints is within 1 % of the best that is known. Second, the
design that can be made: every design of the study's own steps is solved, the pitch in five values. A design
counts as one evaluation of all its states, with derivatives for the gradient way and without for the others.
"""

import argparse
import itertools
import json
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

import pneusma_jax as pj
from fitting.design import read_study
from fitting.design.bodies import plan_of
from fitting.design.discrete import made_from, places_of
from fitting.design.log import Evaluator, Log
from fitting.design.optimise import Problem, best_of, optimise
from fitting.design.program import Model
from fitting.design.run import start_places
from fitting.report.figures import BLUE, GREEN, GREY, VERMILION, legend_above, save_figure, style

QUALITY = 0.01
LOT = 256
FEW = 8


class Values:
    """Values of designs without derivatives: area [mm2] and largest violation."""

    def __init__(self, model: Model):
        draws = jax.tree.map(lambda x: jnp.asarray(x)[0], model.draws.tree())

        def one(place):
            values, rows = model.outputs(place, draws, model.materials)
            return -values[0] * 1e6, jnp.max(rows)

        self._program = jax.jit(lambda places: jax.lax.map(one, places, batch_size=32))

    def __call__(self, places):
        lot = FEW if len(places) <= FEW else LOT
        filled = np.concatenate([places, np.repeat(places[-1:], -len(places) % lot, axis=0)])
        found = [self._program(jnp.asarray(filled[k : k + lot])) for k in range(0, len(filled), lot)]
        area, excess = (np.concatenate(x)[: len(places)] for x in zip(*found, strict=True))
        bad = ~np.isfinite(area) | ~np.isfinite(excess)
        return np.where(bad, 0.0, area), np.where(bad, 1.0, excess)


def best_so_far(area, excess):
    """Largest area of designs that keep all constraints, after each evaluation."""
    return np.maximum.accumulate(np.where(np.asarray(excess) <= 1e-6, area, 0.0))


def gradient_way(model, study, starts):
    """Course of the continuous search, and evaluations and area after rounding."""
    evaluate = Evaluator(model, Log(None, ""), 0, 8)
    places = start_places(study, model)[:starts]
    first = evaluate(places)
    size = abs(first[0].values[0])
    rows = np.arange(1, first[0].values.size)
    problem = Problem(np.eye(rows.size + 1)[0] / size, rows, np.zeros(rows.size), np.ones(rows.size))
    ideal = best_of(optimise([problem] * len(places), places, evaluate))
    known = list(evaluate.log.known.values())
    course = best_so_far([-1e6 * e.values[0] for e in known], [np.max(e.values[1:]) for e in known])
    made = made_from(ideal, problem, evaluate, "slsqp")
    return course, len(evaluate.log.known), -1e6 * made.evaluation.values[0]


def cma_way(values, size, budget, seed):
    """CMA-ES with its augmented Lagrangian for the constraint."""
    import cma

    seen, known = [], {}

    def both(x):
        place = np.clip(np.asarray(x, dtype=float), 0.0, 1.0)
        if place.tobytes() not in known:
            area, excess = values(place[None])
            seen.append((area[0], excess[0]))
            known[place.tobytes()] = seen[-1]
        return known[place.tobytes()]

    lagrangian = cma.ConstrainedFitnessAL(lambda x: -both(x)[0] / 1000.0, lambda x: [both(x)[1]], logging=0)
    options = {"bounds": [0, 1], "maxfevals": budget, "seed": seed, "verbose": -9, "verb_log": 0}
    strategy = cma.CMAEvolutionStrategy(size * [0.5], 0.25, options)
    while not strategy.stop() and len(seen) < budget:
        places = strategy.ask()
        strategy.tell(places, [lagrangian(x) for x in places])
        lagrangian.update(strategy)
    return best_so_far(*np.array(seen).T)


def tpe_way(values, size, budget, seed):
    """Optuna's TPE, told of the constraint."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    seen = []

    def goal(trial):
        place = np.array([trial.suggest_float(f"x{k}", 0.0, 1.0) for k in range(size)])
        area, excess = values(place[None])
        seen.append((area[0], excess[0]))
        trial.set_user_attr("excess", float(excess[0]))
        return area[0]

    sampler = optuna.samplers.TPESampler(
        seed=seed, multivariate=True, constraints_func=lambda t: (t.user_attrs["excess"],)
    )
    optuna.create_study(direction="maximize", sampler=sampler).optimize(goal, n_trials=budget)
    return best_so_far(*np.array(seen).T)


def grid_way(values, model, pitches):
    """Every design that can be made; those that the diameter or the coil alone forbid are not solved."""
    axes = [
        places_of(model.space, k) if f.discrete else np.linspace(0.0, 1.0, pitches)
        for k, f in enumerate(model.space.free)
    ]
    every = np.array(list(itertools.product(*axes)))
    sizes = jax.vmap(model.space.parameters)(jnp.asarray(every))
    wire, mandrel = (np.asarray(sizes[n]) for n in ("wire_diameter", "mandrel_diameter"))
    fits = (mandrel + 2.0 * wire <= 1.4e-3 + 1e-9) & ((mandrel + wire) / wire >= 4.0 - 1e-9)
    area, excess = values(every[fits])
    return len(every), int(fits.sum()), best_so_far(area, excess)[-1]


def needed(course, best):
    """Evaluations until within `QUALITY` of the best, None if never."""
    there = np.flatnonzero(course >= (1.0 - QUALITY) * best)
    return int(there[0]) + 1 if there.size else None


def figure_of(courses, best):
    with style():
        figure = Figure(figsize=(6.8, 4.2), layout="constrained")
        axes = figure.subplots()
        for (name, many), colour in zip(courses.items(), (VERMILION, BLUE, GREEN), strict=False):
            for k, course in enumerate(many):
                axes.plot(
                    np.arange(1, len(course) + 1), course, color=colour, alpha=0.7, label="_" if k else name
                )
        axes.axhline((1.0 - QUALITY) * best, color=GREY, linestyle="--", label="within 1 % of the best")
        axes.set(
            xscale="log", xlabel="designs evaluated", ylabel="largest workspace area [mm2]", ylim=(0, None)
        )
        legend_above(axes, 2)
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/design_search"))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--cma", type=int, default=4000, help="evaluations")
    parser.add_argument("--tpe", type=int, default=1500, help="evaluations")
    parser.add_argument("--pitches", type=int, default=5)
    parser.add_argument("--without-grid", action="store_true")
    options = parser.parse_args()
    pj.enable_float64()
    options.out.mkdir(parents=True, exist_ok=True)
    study = read_study("wider_pneusma2")
    model = Model(study, plan_of("pneusma2"))
    values, size = Values(model), len(model.space)
    one, _, _ = gradient_way(model, study, 1)
    eight, evaluations, made = gradient_way(model, study, 8)
    courses = {"gradient": [one, eight]}
    results = {"made_mm2": made, "gradient_evaluations_with_rounding": evaluations, "times_s": {}}
    for name, way, budget in (("CMA-ES", cma_way, options.cma), ("TPE", tpe_way, options.tpe)):
        began = time.perf_counter()
        courses[name] = [way(values, size, budget, seed) for seed in range(1, options.seeds + 1)]
        results["times_s"][name] = time.perf_counter() - began
    best = max(course[-1] for many in courses.values() for course in many)
    results["best_continuous_mm2"] = best
    for name, many in courses.items():
        results[name] = [{"needed": needed(c, best), "of": len(c), "best_mm2": float(c[-1])} for c in many]
    save_figure(figure_of(courses, best), options.out / "design_search.png")
    if not options.without_grid:
        began = time.perf_counter()
        every, solved, found = grid_way(values, model, options.pitches)
        results["grid"] = {"designs": every, "solved": solved, "best_mm2": float(found)}
        results["times_s"]["grid"] = time.perf_counter() - began
    (options.out / "design_search.json").write_text(json.dumps(results, indent=1))
    print(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
