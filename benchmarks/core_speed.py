"""How fast the core solves, as ratios to one evaluation of balance and Jacobian, with accuracy beside.

    python -m benchmarks.core_speed [--quick] [--most ROWS] [--out out/bench] [--only CASE ...] [--go-on]

Every case of `core_cases` runs in a process of its own (`core_one`), without the compilation cache on disk.
So its compile time and its peak memory are its own. Times are medians of repeats. They are taken in turn with
the floor, the evaluation of residual and Jacobian of 10,000 rows in blocks of 64. All but those of commands
are times of the processor, summed over threads: on a busy machine the work of others is not in them. Left in
the folder are `core_speed.txt` and `core_speed.json`, after every case, and `core_speed.png`. With
`--go-on`, cases that the folder has of the same code are not run again.
"""

import argparse
import datetime
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

CASES = {
    # name: title, sizes, unit
    "residual": ("residual", (1, 100, 10_000, 100_000), "rows"),
    "floor": ("residual and Jacobian", (1, 100, 10_000, 100_000), "rows"),
    "phase": ("`solve_batch` by phase", (1, 100, 10_000, 100_000, 1_000_000), "rows"),
    "resistance": ("`solve_batch` by resistance", (1, 100, 10_000, 100_000, 1_000_000), "rows"),
    "current": ("`simulate_history` by current", (1, 100, 10_000, 100_000, 1_000_000), "rows"),
    "inputs": ("batch by phase with gradient by inputs", (100, 10_000), "rows"),
    "numbers": ("batch by phase with gradient by every number", (100, 10_000), "rows"),
    "inputs_resistance": ("batch by resistance with gradient by inputs", (100, 1_000), "rows"),
    "known_inputs": ("the same by phase, outside of `jax.jit`", (100, 1_000, 10_000), "rows"),
    "known_numbers": ("by every number, outside of `jax.jit`", (100, 1_000, 10_000), "rows"),
    "history": ("history by phase", (100, 1_000, 10_000), "rows"),
    "history_resistance": ("history by resistance", (100, 1_000, 10_000), "rows"),
    "chain": ("chain without loads", (1, 2, 4, 8, 16), "segments"),
    "loaded_chain": ("chain under weight and a tip force", (1, 2, 4, 8, 16), "segments"),
    "coupon": ("coupon of silicone", (100, 1_000, 10_000), "rows"),
    "tube": ("tube under pressure", (100, 1_000, 10_000), "rows"),
    "wire": ("wire under a steady load", (100, 1_000, 10_000), "rows"),
    "spring": ("spring on a stand", (100, 1_000, 10_000), "rows"),
    "scipy_root": ("SciPy `root` (hybr), NumPy residual", (100,), "rows"),
    "nelder_mead": ("Nelder-Mead, NumPy residual", (20,), "rows"),
}
BATCH, MOST, TINY = 10_000, 100_000, 100
"""Rows at which ratios of batches are quoted; at most of a quick run; at most of a tiny one."""
CHECKS = ("accuracy", "command")
KINDS = ("cold", "again")
PACKAGES = ("jax", "jaxlib", "equinox", "optimistix", "lineax", "numpy", "scipy")


def main(arguments: list[str] | None = None) -> None:
    """Measure, print and leave table and plot."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="at most 10^5 rows, short repeats, no fits")
    parser.add_argument("--most", type=int, default=1_000_000, metavar="ROWS", help="at most so many rows")
    parser.add_argument("--tiny", action="store_true", help="at most 100 rows: does it run at all?")
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    parser.add_argument("--only", nargs="+", choices=[*CASES, *CHECKS], metavar="CASE")
    parser.add_argument("--go-on", action="store_true", help="keep the cases that the folder has")
    given = parser.parse_args(arguments)
    names = given.only or [*CASES, *CHECKS]
    given.out.mkdir(parents=True, exist_ok=True)
    begun = earlier(given.out / "core_speed.json") if given.go_on else None
    for found in measured(names, given.quick, given.tiny, given.most, begun):
        (given.out / "core_speed.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        (given.out / "core_speed.txt").write_text(table(found), encoding="utf-8")
    plot(found, given.out / "core_speed.png")
    print(table(found))


def earlier(path: Path) -> dict | None:
    """Figures that an earlier run has left, None where there are none.

    Raises:
        SystemExit: if they are of other code.
    """
    if not path.exists():
        return None
    found = json.loads(path.read_text(encoding="utf-8"))
    then, now = found["machine"]["code"], machine()["code"]
    if then != now:
        raise SystemExit(f"{path} is of code {then}, and this is {now}: give another folder, or no --go-on.")
    return found


def measured(
    names: list[str], quick: bool, tiny: bool, most: int, begun: dict | None = None
) -> Iterator[dict]:
    """Figures so far, with machine, versions and date, after every case.

    Args:
        names: cases to be measured.
        quick, tiny: see the options.
        most: maximum of rows.
        begun: figures of an earlier run, whose cases are not run again.
    """
    most = TINY if tiny else min(most, MOST) if quick else most
    patience, longest = (0.2, 5.0) if tiny else (1.0, 30.0) if quick else (6.0, 120.0)
    found = begun or {"machine": machine(), "cases": {}}
    checks = {
        "accuracy": [TINY, TINY, 2] if tiny else [BATCH, 1_000, 20], "command": [1] if tiny or quick else [],
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        rows = Path(folder) / "rows.npz"
        child("prepare", rows, sizes=[most, min(BATCH, most)])
        for name in names:
            if name in found or name in found["cases"]:
                continue
            print(f"{datetime.datetime.now():%H:%M:%S} {name}", file=sys.stderr, flush=True)
            if name in CASES:
                sizes = [n for n in CASES[name][1] if n <= most]
                found["cases"][name] = child(name, rows, sizes, patience, longest)
            else:
                found[name] = child(name, rows, checks[name])
            found["machine"]["load_after"] = os.getloadavg()
            yield found
    yield found  # where an earlier run has left nothing to do


def child(name: str, rows: Path, sizes: object = (), patience: float = 1.0, longest: float = 60.0) -> object:
    """What a case prints, run in a process of its own.

    Raises:
        RuntimeError: if it fails.
    """
    command = [
        sys.executable, "-m", "benchmarks.core_one", name, str(rows), "--sizes", json.dumps(sizes),
        "--patience", str(patience), "--longest", str(longest),
    ]  # fmt: skip
    root = Path(__file__).resolve().parents[1]
    places = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    variables = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    done = subprocess.run(
        command, cwd=root, env=variables | {"PYTHONPATH": places}, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"Case {name} failed:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def machine() -> dict:
    """What the figures were measured on."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        processor = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        processor = platform.processor()
    describe = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"]
    revision = subprocess.run(describe, capture_output=True, text=True)
    return dict(
        date=f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC",
        system=platform.platform(), processor=processor, cores=os.cpu_count(),
        threads_of_XLA=os.environ.get("NPROC", "all cores"), load_before=os.getloadavg(),
        code=revision.stdout.strip() or "unknown", python=platform.python_version(),
        versions={name: importlib.metadata.version(name) for name in PACKAGES},
    )  # fmt: skip


# --- what it amounts to ---------------------------------------------------------------------------------


def _line(found: dict, name: str, size: int | None = None) -> dict | None:
    """Figures of a case at a size, by default at `BATCH`."""
    lines = [line for line in found["cases"].get(name, []) if "left_out" not in line]
    return next((line for line in lines if line["size"] == (size or BATCH)), None)


def goals(found: dict) -> list[tuple[str, float | None, str, bool | None]]:
    """Name, measured value, goal and whether it is met; None where the run did not measure it."""
    rows = []

    def add(name: str, value: float | None, goal: float, unit: str = "", least: bool = False) -> None:
        met = None if value is None else value >= goal if least else value <= goal
        rows.append((name, value, f"{'>=' if least else '<='} {goal:g}{unit}", met))

    def of(name: str, key: str, size: int | None = None) -> float | None:
        line = _line(found, name, size)
        return None if line is None else line[key]

    def over(name: str, other: str) -> float | None:
        line = _line(found, name)
        return None if line is None else line["over"][other]

    def ratio(slow: float | None, fast: float | None) -> float | None:
        return None if slow is None or fast is None else slow / fast

    solve = of("phase", "over_floor")
    add("batched solve / residual and Jacobian", solve, 8)
    add("by resistance / by phase", over("resistance", "phase"), 2)
    simplex = of("nelder_mead", "over_floor", CASES["nelder_mead"][1][0])
    add("Nelder-Mead / batched solve", ratio(simplex, solve), 30_000, least=True)
    add("solve and gradient by inputs / solve", over("inputs", "phase"), 1.2)
    add("solve and gradient by every number / solve", over("numbers", "phase"), 1.5)
    add("the same by inputs, outside of `jax.jit`", over("known_inputs", "phase"), 1.2)
    add("the same by every number, outside of `jax.jit`", over("known_numbers", "phase"), 1.5)
    first = found["cases"].get("phase", [None])[0]
    add("compile, batched solve by phase", None if first is None else first["compile_s"], 3, " s")
    first = found["cases"].get("resistance", [None])[0]
    add("compile, batched solve by resistance", None if first is None else first["compile_s"], 3, " s")
    for name, what in (("inputs", "inputs"), ("numbers", "every number")):
        first = found["cases"].get(name, [None])[0]
        add(f"compile, its gradient by {what}", None if first is None else first["compile_s"], 5, " s")
    programs_of = {
        "phase": "solve by phase", "known_inputs": "gradient by inputs", "known_numbers": "by every number",
        "inputs": "gradient by inputs under `jax.jit`",
    }  # fmt: skip
    for name, what in programs_of.items():
        later = [line for line in found["cases"].get(name, [])[1:] if "left_out" not in line]
        programs = max((line["programs"] for line in later), default=None)
        add(f"programs for another number of rows, {what}", programs, 0)
    for name in ("phase", "resistance"):
        peak = of(name, "peak_MB", 1_000_000)
        add(f"peak memory, 10^6 rows by {name}", peak, 1000, " MB")
    add("history row by phase / row of a batched solve", over("history", "phase"), 2)
    command = found.get("command", {}).get("simulate", {})
    add("`pneusma simulate`, cold", command.get("cold_s"), 3, " s")
    add("`pneusma simulate`, again", command.get("again_s"), 1.2, " s")
    add("`from pneusma_jax import solve`", found.get("command", {}).get("import", {}).get("again_s"), 1, " s")
    add("`pneusma --help`", found.get("command", {}).get("help", {}).get("again_s"), 0.2, " s")
    errors = found.get("accuracy", {}).get("errors", {})
    for way in ("by phase", "by resistance"):
        add(f"error of curvature {way}", errors.get(way, {}).get("largest"), 1e-8)
    return rows


def table(found: dict) -> str:
    """Text of a run."""
    head = found["machine"]
    versions = ", ".join(f"{name} {value}" for name, value in head["versions"].items())
    load = [f"{head[key][0]:.1f}" for key in ("load_before", "load_after")]
    out = [
        f"Speed of the core, {head['date']}, code {head['code']}",
        f"{head['processor']}, {head['cores']} cores, {head['system']}; XLA on {head['threads_of_XLA']}",
        f"Python {head['python']}, {versions}",
        f"Load of the machine (mean of a minute) before {load[0]}, after {load[1]}; this run makes about 1",
        "",
        "cold: first call less a warm one. programs: compiled in the first call.",
        "a row: median of warm calls over their rows or segments.",
        "floors: the same over residual and Jacobian of a row, timed in turn in the same process.",
        "begin, peak: memory of the process before the first call, and largest so far, first calls only.",
        "",
        f"{'':46}{'size':>9}  {'cold':>8} {'programs':>8} {'a row':>13} "
        f"{'floors':>10} {'begin':>7} {'peak':>8}",
    ]
    for name, lines in found["cases"].items():
        title, _, unit = CASES[name]
        for line in lines:
            start = f"{title:46}{line['size']:9d}"
            title = "" if unit == "rows" else "  (segments)"
            if "left_out" in line:
                out.append(f"{start}  left out: {line['left_out']}")
                continue
            out.append(
                f"{start}  {line['compile_s']:6.2f} s {line['programs']:8d} {line['row_us']:10.2f} us "
                f"{line['over_floor']:10.2f} {line['before_MB']:4.0f} MB {line['peak_MB']:5.0f} MB"
            )
    if "accuracy" in found:
        out += ["", "Errors of curvature against 140 Gauss nodes a panel, relative (below 1 1/m, over 1 1/m)"]
        for way, error in found["accuracy"]["errors"].items():
            figures = f"largest {error['largest']:.1e}  median {error['median']:.1e}"
            out.append(f"  {way:20} {error['rows']:6d} rows  {figures}")
        roots = found["accuracy"]["by_resistance"]
        out.append(
            f"  {roots['rows']} rows by resistance: {roots['failed']} fail, {roots['several']} are "
            f"said to have several equilibria, {roots['another_without_a_word']} take another without a word"
        )
        out.append(f"  Newton steps of a row by phase: {found['accuracy']['steps_by_phase']:.2f} on average")
    if "command" in found:
        out += [
            "",
            "Commands: from an empty compilation cache, and again (median); in brackets the processor's time",
        ]
        for name, times in found["command"].items():
            cold, again = (f"{times[k + '_s']:7.2f} s ({times[k + '_processor_s']:5.2f} s)" for k in KINDS)
            out.append(f"  {name:22} {cold} {again}")
    out += ["", f"{'Goal':70} {'measured':>12}  {'goal':>10}"]
    for name, value, goal, met in goals(found):
        shown = "-" if value is None else f"{value:.3g}" if abs(value) < 1000 else f"{value:,.0f}"
        out.append(f"{name:70} {shown:>12}  {goal:>10}  {'' if met is None else 'met' if met else 'NOT met'}")
    return "\n".join(out) + "\n"


def plot(found: dict, path: Path) -> None:
    """Cost of a row over the number of rows, of a segment over the number of segments."""
    figure, axes = plt.subplots(1, 2, figsize=(12, 7.5), width_ratios=(3, 1.3), layout="constrained")
    drawn = {"rows": 0, "segments": 0}
    for name, lines in found["cases"].items():
        title, _, unit = CASES[name]
        there = [line for line in lines if "left_out" not in line]
        axis = axes[0] if unit == "rows" else axes[1]
        k = drawn[unit]
        drawn[unit] += 1
        axis.loglog(
            [line["size"] for line in there], [line["over_floor"] for line in there],
            marker="osD^vP"[k % 6], color=plt.get_cmap("tab10")(k % 10),
            linestyle=("-", "--", ":")[k // 10], markersize=5, label=title.replace("`", ""),
        )  # fmt: skip
    for axis, unit in zip(axes, drawn, strict=True):
        axis.axhline(1.0, color="black", linewidth=1.0, zorder=0)
        axis.set(xlabel=f"{unit} in a call", ylabel=f"cost per {unit[:-1]} / residual and Jacobian of a row")
        axis.grid(alpha=0.3)
        axis.set_visible(drawn[unit] > 0)
        if drawn[unit]:  # under the axes, where no line is
            columns = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.1), "frameon": False}
            axis.legend(fontsize=8, ncols=3 if unit == "rows" else 1, **columns)
    segments = CASES["chain"][1]
    axes[1].set_xticks(segments, [str(n) for n in segments])
    axes[1].minorticks_off()
    figure.suptitle(f"Warm calls, {found['machine']['processor']}, {found['machine']['date']}", fontsize=10)
    figure.savefig(path, dpi=120)
    plt.close(figure)


if __name__ == "__main__":
    main()
