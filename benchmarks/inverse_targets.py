"""Inverse problems: how many targets are met, how fast, and what happens to those out of reach; chains in
lumens.

    python benchmarks/inverse_targets.py --out out/inverse [--targets 1000] [--only single|chain|lumens]

Targets are states of random drives, so that they can be reached. Unreachable ones lie beyond: curvatures up
to four times the largest, tips of the chain pushed outwards by 20 to 60 %. The nearest point is compared
with a search over 200,000 random states for the actuator. For the chain it is compared with 100,000 random
states, from the three nearest of which SciPy's `least_squares` goes on. These states come from `solve_chain`
alone and their derivatives from differences, so nothing of the inverse's own (tables, atlas) is used. Lumens
that a chain does not pass are searched by brute force and by differential evolution.
"""

import argparse
import json
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import differential_evolution, least_squares, minimize
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import pneusma_jax as pj
from fitting.invert import Inverse, Limits
from fitting.invert.goals import sizes
from fitting.invert.lumen import Lumen, distances, refined
from fitting.invert.passage import pass_through
from fitting.invert.tables import looked_up
from fitting.report.figures import save_figure, style
from fitting.report.invert.figures import passage_figure
from pneusma_jax.serial_chain.segments import chain_shape

LIMITS = Limits((0.0, 50e3), 0.1)
SUITED = {"gentle": 8.0, "bent": 16.0, "tortuous": 24.0}
"""Curvatures of lumens that suit the chain [1/m]; a segment reaches 70 1/m."""
SWINGING = {"gentle": (0.5, 0.1), "bent": (0.9, 0.3), "tortuous": (1.4, 0.6)}
"""Largest angles of the centre line against the straight chain, across and up [rad], of lumens that bend
where the chain has no segment of that plane."""
LOT = 256
"""Number of states that go through a program together."""
STRATEGIES = ("best1bin", "rand1bin", "currenttobest1bin", "rand2bin")
"""Strategies of differential evolution, each with a seed of its own."""
REFINED = 3
"""Number of random states from which the brute-force search of a pose goes on."""


def random_drives(random, count, highest):
    """Pressures and fractions, half of the springs cold."""
    fractions = random.uniform(LIMITS.xi0_min, highest, (count, highest.size))
    fractions = np.where(random.random(fractions.shape) < 0.5, highest, fractions)
    return np.column_stack([random.uniform(*LIMITS.pressure, count), fractions])


def timed(work):
    """Result of a call, its seconds, and its seconds of processor time; compiled before."""
    work()
    began, busy = time.perf_counter(), time.process_time()
    result = work()
    return result, time.perf_counter() - began, time.process_time() - busy


def single(count, unreachable, seed):
    """PneuSMA2 to curvatures."""
    random, inverse = np.random.default_rng(seed), Inverse("pneusma2", LIMITS)
    drives = random_drives(random, count, inverse.highest)
    wanted = np.asarray(inverse.verified(drives).only.curvature)[:, None]
    found, seconds, busy = timed(lambda: inverse.solve(("curvature",), wanted))
    seen = np.asarray(inverse.verified(random_drives(random, 200_000, inverse.highest)).only.curvature)
    far = (
        random.uniform(1.05, 4.0, unreachable)
        * np.where(random.random(unreachable) < 0.5, -1, 1)
        * np.abs(seen).max()
    )
    lost = inverse.solve(("curvature",), far[:, None])
    nearest = np.array([np.min(np.abs(seen - x)) for x in far])
    return {
        "targets": count,
        "met": float(found.met.mean()),
        "worst_miss_1pm": float(found.misses["curvature"].max()),
        "per_second": count / seconds,
        "per_second_of_processor_time": count / busy,
        "unreachable": unreachable,
        "recognised": float(np.mean(~lost.met)),
        "told_what_holds": float(np.mean([bool(words) for words in lost.held])),
        "largest_excess_over_random_search": float(np.max(lost.misses["curvature"] / nearest) - 1.0),
    }


def chain(count, unreachable, seed):
    """The chain of four to tip poses."""
    random, inverse = np.random.default_rng(seed), Inverse("orthogonal_chain", LIMITS)
    goals = ("tip", "direction")
    pose = np.asarray(inverse.verified(random_drives(random, count, inverse.highest)).end_pose)
    wanted = np.column_stack([pose[:, :3, 3], pose[:, :3, 2]])
    found, seconds, busy = timed(lambda: inverse.solve(goals, wanted))
    some = wanted[:unreachable].copy()
    some[:, :3] *= (0.35 / np.linalg.norm(some[:, :3], axis=1) * random.uniform(1.2, 1.6, len(some)))[:, None]
    print("met", found.met.mean(), "a second", count / seconds, "of the processor", count / busy, flush=True)
    lost, spent, _ = timed(lambda: inverse.solve(goals, some))
    scale = np.asarray(sizes(goals))
    look = exact_poses(inverse.body.chain)
    drives = random_drives(random, 100_000, inverse.highest)
    seen = look(drives) / scale
    nearest, which = cKDTree(seen).query(some / scale, k=REFINED)
    refined = brute_force(look, some / scale, scale, drives[which], inverse.highest)
    refined = np.minimum(nearest[:, 0], refined)
    ours = np.linalg.norm((lost.values - some) / scale, axis=1)
    return {
        "segments": len(inverse.body.segments),
        "targets": count,
        "met": float(found.met.mean()),
        "median_miss_mm": float(1e3 * np.median(found.misses["tip"])),
        "per_second": count / seconds,
        "per_second_of_processor_time": count / busy,
        "mean_heat": float(np.mean(np.sum((inverse.highest - found.fractions) ** 2, axis=1))),
        "unreachable": len(some),
        "unreachable_per_second": len(some) / spent,
        "recognised": float(np.mean(~lost.met)),
        "told_what_holds": float(np.mean(["at its" in words for words in lost.held])),
        "largest_excess_over_random_states": float(np.max(ours / nearest[:, 0]) - 1.0),
        "largest_excess_over_brute_force": float(np.max(ours / refined) - 1.0),
        "median_excess_over_brute_force": float(np.median(ours / refined) - 1.0),
        "within_1_percent_of_brute_force": float(np.mean(ours <= 1.01 * refined)),
        "nearer_than_brute_force_by_at_most": float(np.max(1.0 - ours / refined)),
    }


def exact_poses(chain):
    """Tip and direction [m, 1] of a chain at drives, shape (rows, 6), each from rest by `solve_chain`."""
    counts = [len(segment.springs) for segment in chain.segments]

    def pose(drives):
        drive, at = [], 1
        for count in counts:
            drive.append(tuple(pj.MartensiteFraction(x) for x in drives[at : at + count]))
            at += count
        frame = pj.solve_chain(chain, drives[0], drive, throw=False).end_pose
        return jnp.concatenate([frame[:3, 3], frame[:3, 2]])

    programs = {size: jax.jit(jax.vmap(pose)) for size in (10, 250)}

    def look(drives):
        size = 10 if len(drives) <= 10 else 250
        lots = [drives[k : k + size] for k in range(0, len(drives), size)]
        full = [np.concatenate([lot, np.repeat(lot[:1], size - len(lot), axis=0)]) for lot in lots]
        return np.concatenate([np.asarray(programs[size](jnp.asarray(x))) for x in full])[: len(drives)]

    return look


def brute_force(look, targets, scale, starts, highest):
    """Least distances from targets, in sizes of the goals, by SciPy from several states, by differences."""
    low = np.append(LIMITS.pressure[0], np.full(starts.shape[-1] - 1, LIMITS.xi0_min))
    high = np.append(LIMITS.pressure[1], highest)
    step = 1e-5

    def both(x, target):
        """Misses, and their derivatives by differences that stay in the box."""
        ways = np.where(x + step > 1.0, -step, step)
        values = look(low + (high - low) * np.vstack([x, x + np.diag(ways)])) / scale
        return values[0] - target, ((values[1:] - values[0]) / ways[:, None]).T

    found = np.full(len(targets), np.inf)
    for k, target in enumerate(targets):
        for place in (starts[k] - low) / (high - low):
            known = {}

            def at(x, target=target, known=known):
                if x.tobytes() not in known:
                    known[x.tobytes()] = both(x, target)
                return known[x.tobytes()]

            ended = least_squares(
                lambda x, at=at: at(x)[0], np.clip(place, 1e-6, 1.0 - 1e-6), jac=lambda x, at=at: at(x)[1],
                bounds=(0.0, 1.0), max_nfev=60,
            )  # fmt: skip
            found[k] = min(found[k], np.linalg.norm(ended.fun))
    return found


def lumen_along(name, slope, diameter, length):
    """A lumen whose centre line has given directions, shape (points, 3)."""
    steps = slope[:-1] * length / (len(slope) - 1)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return Lumen(name, points, np.full(len(points), diameter))


def swinging_lumen(name, bends, diameter=18e-3, length=230e-3):
    """A lumen along a smooth curve: two angles that swing along it, wherever the chain's segments are."""
    s = np.linspace(0.0, 1.0, 200)
    across, up = bends[0] * np.sin(np.pi * s) ** 2, bends[1] * np.sin(2.0 * np.pi * s) * s
    slope = np.stack([np.sin(up), np.sin(across) * np.cos(up), np.cos(across) * np.cos(up)], axis=1)
    return lumen_along(name, slope, diameter, length)


def suited_lumen(name, curvature, diameter=18e-3, length=230e-3):
    """A lumen that turns by turns in the two planes of the chain's segments, 60 mm each, smoothed over 20 mm.

    Its curvature is part of what a segment reaches, so that a chain with such planes can follow it.
    """
    s = np.linspace(0.0, length, 460)
    part, half = np.minimum(s // 60e-3, 3).astype(int), 20
    planes = curvature * np.array([[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])[part]
    soft = np.stack([np.convolve(np.pad(k, half, "edge"), np.ones(2 * half + 1) / (2 * half + 1), "valid")
                     for k in planes.T], axis=1)  # fmt: skip
    frame, slope = np.eye(3), []
    for bend in soft:
        slope.append(frame[:, 2])
        turn = np.array([-bend[1], bend[0], 0.0]) * length / len(s)
        frame = frame @ Rotation.from_rotvec(turn).as_matrix()
    return lumen_along(name, np.array(slope), diameter, length)


def away_from(inverse, lumen):
    """Distances of the chain's points from a lumen's centre line [mm] at a place in the box, in tables."""
    line, box = tuple(jnp.asarray(x) for x in refined(lumen)), inverse.box()
    tables = inverse.by_tables.tables

    def away(place):
        found = looked_up(tables, box.drives(place))
        shape = chain_shape(inverse.body.chain, found[:, :2], found[:, 2])
        return 1e3 * distances(shape.polyline(12), line)[0]

    return away


def polished(away, places):
    """Largest distance [mm] where SciPy's SLSQP ends that minimises it, from each place."""
    values, slopes = jax.jit(away), jax.jit(jax.jacfwd(away))
    ends = []
    for place in places:
        ended = minimize(
            lambda x: x[-1], np.append(place, values(place).max()), jac=lambda x: np.eye(x.size)[-1],
            bounds=[(0.0, 1.0)] * place.size + [(0.0, 1e3)],
            constraints={
                "type": "ineq",
                "fun": lambda x: x[-1] - np.asarray(values(x[:-1])),
                "jac": lambda x: np.pad(-np.asarray(slopes(x[:-1])), ((0, 0), (0, 1)), constant_values=1.0),
            },
            method="SLSQP", options={"maxiter": 200, "ftol": 1e-8},
        )  # fmt: skip
        ends.append(float(np.max(values(np.clip(ended.x[:-1], 0.0, 1.0)))))
    return ends


def largest_of(away):
    """Largest distance [mm] at many places."""
    program = jax.jit(lambda x: jax.lax.map(lambda p: jnp.max(away(p)), x, batch_size=LOT))

    def largest(places):
        full = np.resize(places, (-(-len(places) // LOT) * LOT, places.shape[1]))
        return np.asarray(program(jnp.asarray(full)))[: len(places)]

    return largest


def narrowest(inverse, lumen, starts=24):
    """Least diameter [mm] of a lumen along a line that the chain would pass, by brute force: that of the best
    random state, and that where SLSQP ends from the nearest of 240,000 random states and from others of them.
    """
    box, random, away = inverse.box(), np.random.default_rng(0), away_from(inverse, lumen)
    more = box.places(random_drives(random, 200_000, inverse.highest))
    places = np.clip(np.concatenate([more, box.places(inverse.atlas.drives)]), 0.0, 1.0)
    far = largest_of(away)(places)
    order = np.argsort(np.where(np.isfinite(far), far, np.inf))
    some = np.append(order[: starts // 2], order[np.linspace(100, 50_000, starts // 2).astype(int)])
    return diameter_for(inverse, min(polished(away, places[some]))), diameter_for(inverse, far[order[0]])


def evolved(inverse, lumen, seconds=75.0):
    """The same by differential evolution over the drives, by strategy: its end, also polished by SLSQP."""
    away, found = away_from(inverse, lumen), {}
    largest, count = largest_of(away), 1 + len(inverse.springs)
    for seed, strategy in enumerate(STRATEGIES):
        began = time.process_time()
        ended = differential_evolution(
            lambda x: largest(np.atleast_2d(x.T)), [(0.0, 1.0)] * count, strategy=strategy, popsize=57,
            maxiter=1_000_000, tol=1e-6, mutation=(0.4, 0.9), recombination=0.8, init="sobol", seed=seed,
            polish=False, vectorized=True, updating="deferred",
            callback=lambda *_, b=began, **__: time.process_time() - b > seconds,
        )  # fmt: skip
        ends = (ended.fun, polished(away, [ended.x])[0])
        needed = [diameter_for(inverse, x) for x in ends]
        found[strategy] = {"evaluations": ended.nfev * len(ended.population), "diameters_mm": needed}
    return found


def diameter_for(inverse, distance):
    """Diameter of a lumen [mm] whose wall the chain just touches, from its largest distance [mm]."""
    return 2.0 * (float(distance) + 1e3 * max(float(s.section.radius) for s in inverse.body.segments))


def lumens(out):
    """The chain of four through three lumens that suit its planes, and three that do not."""
    inverse, found = Inverse("orthogonal_chain", LIMITS), []
    suited = [suited_lumen(name, curvature) for name, curvature in SUITED.items()]
    swinging = [swinging_lumen(name, bends) for name, bends in SWINGING.items()]
    for name, group in (("lumens", suited), ("swinging_lumens", swinging)):
        passages = []
        for lumen in group:
            began = time.perf_counter()
            passages.append(pass_through(inverse, lumen))
            spent = time.perf_counter() - began
            one = passages[-1]
            least, random = (None, None) if one.passes else narrowest(inverse, lumen)
            found.append(
                {
                    "name": lumen.name,
                    "tortuosity": lumen.tortuosity,
                    "diameter_mm": 1e3 * lumen.diameter[0],
                    "passes": one.passes,
                    "clearance_mm": 1e3 * one.clearance,
                    "offset_mm": 1e3 * one.offset,
                    "seconds": spent,
                    "narrowest_by_brute_force_mm": least,
                    "narrowest_of_random_states_mm": random,
                    "narrowest_by_evolution": None if one.passes else evolved(inverse, lumen),
                }
            )
            print(found[-1], flush=True)
        with style():
            save_figure(passage_figure(passages), out / f"{name}.png")
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/inverse"))
    parser.add_argument("--targets", type=int, default=1000)
    parser.add_argument("--unreachable", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=("single", "chain", "lumens"))
    options = parser.parse_args()
    pj.enable_float64()
    options.out.mkdir(parents=True, exist_ok=True)
    parts = {
        "single": lambda: single(options.targets, options.unreachable, options.seed),
        "chain": lambda: chain(options.targets, options.unreachable, options.seed),
        "lumens": lambda: lumens(options.out),
    }
    for name, part in parts.items():
        if options.only in (None, name):
            found = part()
            (options.out / f"{name}.json").write_text(json.dumps(found, indent=1))
            print(name, json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
