"""One case of `core_speed` in a process of its own, named on the command line; its numbers as JSON."""

import argparse
import dataclasses
import json
import resource
import statistics
import sys
import time
from pathlib import Path

import jax
import numpy as np

import pneusma_jax as pj
from benchmarks.core_cases import BESIDE, CASES, FLOOR_ROWS, Call, Rows, floor, prepared, wait
from benchmarks.core_checks import accuracy, command

CHECKS = ("accuracy", "command")


class Compiled:
    """How many programs were compiled, and how long that took [s] from tracing to machine code."""

    def __init__(self) -> None:
        self.programs, self.seconds = 0, 0.0
        jax.monitoring.register_event_duration_secs_listener(self._heard)

    def _heard(self, event: str, duration: float, **_: object) -> None:
        if event == "/jax/core/compile/backend_compile_duration":
            self.programs += 1
            self.seconds += duration


def peak_memory() -> float:
    """Largest memory that this process has had so far [MB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3 / 1.024)


def seconds(call: Call) -> float:
    """Time of the processor, of all threads, until a call's result is there [s]."""
    began = time.process_time()
    wait(call())
    return time.process_time() - began


def measured(name: str, data: Rows, sizes: tuple[int, ...], patience: float, longest: float) -> list[dict]:
    """One line per size of a case.

    First every size is called once, the smallest first, and memory is read after each. Then each is called
    again and again, in turn with the floor and the case beside it. A busy machine slows all of them alike.

    Args:
        name: of `CASES`.
        data: rows.
        sizes: ascending.
        patience: time for the repeats of one size [s]; three are made at least.
        longest: time that the first call of a size may be expected to take [s]; larger sizes are left out.
    """
    compiled, prepare, lines = Compiled(), CASES[name](data), []
    begin = peak_memory()
    per_row = 0.0
    for n in sizes:
        if per_row * n > longest:
            lines.append(dict(size=n, left_out=f"it would take about {per_row * n:.0f} s a call"))
            continue
        call = prepare(n)
        programs, spent = compiled.programs, compiled.seconds
        cold = seconds(call)
        lines.append(
            dict(
                size=n, cold_s=cold, programs=compiled.programs - programs,
                compiler_s=compiled.seconds - spent, peak_MB=peak_memory(), before_MB=begin,
            )  # fmt: skip
        )
        per_row = seconds(call) / n
    rows = min(FLOOR_ROWS, len(data.pressure))
    floor_call = floor(data)(rows)
    beside = {BESIDE[name]: CASES[BESIDE[name]](data)} if name in BESIDE else {}
    wait(floor_call())
    for line in lines:
        n = line["size"]
        if "left_out" in line:
            continue
        calls = {"own": prepare(n), "floor": floor_call} | {k: make(n) for k, make in beside.items()}
        for call in calls.values():
            wait(call())
        times = {key: [] for key in calls}
        began = time.perf_counter()
        while len(times["own"]) < 3 or (
            time.perf_counter() - began < patience and len(times["own"]) < 50
        ):
            for key, call in calls.items():
                times[key].append(seconds(call))
        warm = {key: statistics.median(spent) for key, spent in times.items()}
        floor_row = warm["floor"] / rows
        line |= dict(
            warm_s=warm["own"], repeats=len(times["own"]), row_us=1e6 * warm["own"] / n,
            floor_row_us=1e6 * floor_row, over_floor=warm["own"] / n / floor_row,
            compile_s=max(line["cold_s"] - warm["own"], 0.0),
        )  # fmt: skip
        line["over"] = {other: warm["own"] / warm[other] for other in beside}
    return lines


def main() -> None:
    """Measure one case and print it as JSON."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("case", choices=["prepare", *CASES, *CHECKS])
    arguments.add_argument("rows", type=Path, help="file of the rows, which `prepare` writes")
    arguments.add_argument("--sizes", type=json.loads, default=[])
    arguments.add_argument("--patience", type=float, default=4.0)
    arguments.add_argument("--longest", type=float, default=60.0)
    given = arguments.parse_args()
    pj.enable_float64(cache=given.case == "prepare")  # the rows are not measured
    if given.case == "command":
        print(json.dumps(command(tiny=bool(given.sizes))))
        return
    if given.case == "prepare":
        np.savez(given.rows, **dataclasses.asdict(prepared(*given.sizes)))
        print("{}")
        return
    with np.load(given.rows) as kept:
        data = Rows(**kept)
    if given.case == "accuracy":
        most, rows, few = given.sizes
        data = dataclasses.replace(
            data, **{k: getattr(data, k)[:most] for k in ("pressure", "xi0", "resistance", "curvature")}
        )
        print(json.dumps(accuracy(data, rows, few)))
        return
    print(json.dumps(measured(given.case, data, tuple(given.sizes), given.patience, given.longest)))


if __name__ == "__main__":
    main()
