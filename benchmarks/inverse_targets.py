"""Inverse problems: how many targets are met, how fast, and what happens to those out of reach; chains in
lumens.

    python benchmarks/inverse_targets.py --out out/inverse [--targets 1000] [--only single|chain|lumens]

Targets are states of random drives, so that they can be reached. Unreachable ones lie beyond: curvatures up
to four times the largest, tips of the chain pushed outwards by 20 to 60 %. The nearest point is compared
with a search over 200,000 random states for the actuator, 100,000 for the chain.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import pneusma_jax as pj
from fitting.invert import Inverse, Limits
from fitting.invert.goals import sizes
from fitting.invert.lumen import Lumen, pass_through
from fitting.report.figures import save_figure, style
from fitting.report.invert.figures import passage_figure

LIMITS = Limits((0.0, 50e3), 0.1)
LUMENS = {"gentle": (0.5, 0.1), "bent": (0.9, 0.3), "tortuous": (1.4, 0.6)}
"""Largest angles of the centre line against the straight chain, across and up [rad]."""


def random_drives(random, count, springs):
    """Pressures and fractions, half of the springs cold."""
    fractions = random.uniform(LIMITS.xi0_min, 1.0, (count, springs))
    fractions[random.random((count, springs)) < 0.5] = 1.0
    return np.column_stack([random.uniform(*LIMITS.pressure, count), fractions])


def timed(work):
    """Result of a call and its seconds, compiled before."""
    work()
    began = time.perf_counter()
    result = work()
    return result, time.perf_counter() - began


def single(count, unreachable, seed):
    """PneuSMA2 to curvatures."""
    random, inverse = np.random.default_rng(seed), Inverse("pneusma2", LIMITS)
    wanted = np.asarray(inverse.verified(random_drives(random, count, 2)).only.curvature)[:, None]
    found, seconds = timed(lambda: inverse.solve(("curvature",), wanted))
    seen = np.asarray(inverse.verified(random_drives(random, 200_000, 2)).only.curvature)
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
        "unreachable": unreachable,
        "recognised": float(np.mean(~lost.met)),
        "told_what_holds": float(np.mean([bool(words) for words in lost.held])),
        "largest_excess_over_random_search": float(np.max(lost.misses["curvature"] / nearest) - 1.0),
    }


def chain(count, unreachable, seed):
    """The chain of four to tip poses."""
    random, inverse = np.random.default_rng(seed), Inverse("orthogonal_chain", LIMITS)
    goals = ("tip", "direction")
    pose = np.asarray(inverse.verified(random_drives(random, count, len(inverse.springs))).end_pose)
    wanted = np.column_stack([pose[:, :3, 3], pose[:, :3, 2]])
    found, seconds = timed(lambda: inverse.solve(goals, wanted))
    some = wanted[:unreachable].copy()
    some[:, :3] *= (0.35 / np.linalg.norm(some[:, :3], axis=1) * random.uniform(1.2, 1.6, len(some)))[:, None]
    lost = inverse.solve(goals, some)
    scale = np.asarray(sizes(goals))
    seen = np.asarray(inverse.verified(random_drives(random, 100_000, len(inverse.springs))).end_pose)
    tree = cKDTree(np.column_stack([seen[:, :3, 3], seen[:, :3, 2]]) / scale)
    nearest, _ = tree.query(some / scale)
    ours = np.linalg.norm((lost.values - some) / scale, axis=1)
    return {
        "segments": len(inverse.body.segments),
        "targets": count,
        "met": float(found.met.mean()),
        "median_miss_mm": float(1e3 * np.median(found.misses["tip"])),
        "per_second": count / seconds,
        "unreachable": len(some),
        "recognised": float(np.mean(~lost.met)),
        "largest_excess_over_random_search": float(np.max(ours / nearest) - 1.0),
    }


def bent_lumen(name, bends, diameter=30e-3, length=230e-3):
    """A lumen along a smooth curve: two angles that swing along it."""
    s = np.linspace(0.0, 1.0, 200)
    across, up = bends[0] * np.sin(np.pi * s) ** 2, bends[1] * np.sin(2.0 * np.pi * s) * s
    slope = np.stack([np.sin(up), np.sin(across) * np.cos(up), np.cos(across) * np.cos(up)], axis=1)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(slope[:-1] * length / (len(s) - 1), axis=0)])
    return Lumen(name, points, np.full(len(points), diameter))


def lumens(out):
    """The chain of four through three lumens."""
    inverse = Inverse("orthogonal_chain", LIMITS)
    passages, seconds = [], []
    for name, bends in LUMENS.items():
        began = time.perf_counter()
        passages.append(pass_through(inverse, bent_lumen(name, bends)))
        seconds.append(time.perf_counter() - began)
    with style():
        save_figure(passage_figure(passages), out / "lumens.png")
    return [
        {
            "name": p.lumen.name,
            "tortuosity": p.lumen.tortuosity,
            "passes": p.passes,
            "clearance_mm": 1e3 * p.clearance,
            "offset_mm": 1e3 * p.offset,
            "seconds": spent,
        }
        for p, spent in zip(passages, seconds, strict=True)
    ]


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
