"""What `pneusma propagate` costs: rows a second, memory, kills, Dask, small probabilities, SALib and SciPy.

    python benchmarks/propagate_speed.py rate --rows 1000000       # PneuSMA2 over all its priors
    python benchmarks/propagate_speed.py against --rows 20000      # the same rows by SALib and scipy.optimize
    python benchmarks/propagate_speed.py kills --rows 200000       # killed ten times: the same bytes?
    python benchmarks/propagate_speed.py dask --rows 200000        # one process, and two workers of a cluster
    python benchmarks/propagate_speed.py probability --plain 1e8   # of a linear Gaussian limit, 1e-2 to 1e-6
    python benchmarks/propagate_speed.py actuator --rows 1000000   # of PneuSMA2, beside plain rows

`rate`, `kills` and `dask` run the command in processes of their own. Processor time stands beside wall-clock
time, which other work on the machine makes longer.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STUDY = """
schema = "pneusma-study/1"
name = "pneusma2_priors"
[model]
through = "{through}"
{model}
{vary}
{output}
[sampling]
rows = {rows}
chunk = {chunk}
method = "sobol"
keep = "{keep}"
"""
ACTUATOR = {
    "through": "state",
    "model": 'design = "pneusma2"\npressure_kPa = 30.0\nxi0_2 = 0.4',
    "vary": "[vary]\npriors = true",
    "output": '[[output]]\nname = "curvature_1pm"\n[[output]]\nname = "length_mm"',
}
CHEAP = {
    "through": "expression",
    "model": 'outputs = {y = "sin(x1) + 7*sin(x2)**2 + 0.1*x3**4*sin(x1)"}',
    "vary": "[input]\n" + "\n".join(f"x{k} = {{low = -3.14159, high = 3.14159}}" for k in (1, 2, 3)),
    "output": "",
}


def write(folder, rows, chunk=20_000, keep="summary", kind=ACTUATOR):
    path = Path(folder) / "study.toml"
    path.write_text(STUDY.format(rows=rows, chunk=chunk, keep=keep, **kind))
    return path


def command(study, out, *options):
    return [sys.executable, "-c", "from fitting.cli import main; main()", "propagate", str(study), "--out",
            str(out),
            *options]  # fmt: skip


def measured(*commands):
    """Wall-clock and processor seconds and peak memory [MiB] of commands that run side by side."""
    began, processor, memory = time.perf_counter(), 0.0, 0.0
    with tempfile.TemporaryFile() as said:
        started = [subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=said) for words in commands]
        for process in started:
            _, ended, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(ended)
            processor += used.ru_utime + used.ru_stime
            memory = max(memory, used.ru_maxrss / 1024.0)
        if any(process.returncode for process in started):
            said.seek(0)
            raise SystemExit(said.read().decode())
    return time.perf_counter() - began, processor, memory


def rate(options):
    kind = CHEAP if options.cheap else ACTUATOR
    with tempfile.TemporaryDirectory() as folder:
        start = measured(
            command(write(folder, 100, 100, kind=kind), Path(folder) / "start", "--devices", options.devices)
        )
        study = write(folder, options.rows, options.chunk, options.keep, kind)
        wall, processor, memory = measured(command(study, Path(folder) / "out", "--devices", options.devices))
        size = sum(p.stat().st_size for p in (Path(folder) / "out" / "chunks").iterdir())
    print(f"start and 100 rows: {start[0]:.1f} s, {start[1]:.1f} s of processor, {start[2]:.0f} MiB")
    print(
        f"{options.rows:,} rows: {wall:.1f} s, {processor:.1f} s of processor, peak {memory:.0f} MiB, "
        f"{size / 1e6:.1f} MB"
    )
    print(f"  {options.rows / wall:,.0f} rows/s of wall clock; without the start "
          f"{options.rows / max(processor - start[1], 1e-9):,.0f} rows/s of one core")  # fmt: skip


def against(options):
    """The same rows in one run: ours, then a loop as users of SALib write it, on a compiled residual."""
    import jax
    import numpy as np
    from SALib.sample import sobol
    from scipy import optimize, stats

    import pneusma_jax as pj
    from fitting.propagate import build_problem, read_study
    from fitting.propagate.responses.body import body_of
    from fitting.simulate.state import described_actuator
    from fitting.specimens.model_objects import BASE
    from pneusma_jax.actuator.balance import Problem, first_trial, residual

    pj.enable_float64()
    with tempfile.TemporaryDirectory() as folder:
        problem = build_problem(read_study(write(folder, options.rows)))
    names = problem.inputs.names
    body, _ = body_of(described_actuator(None, {"design": "pneusma2"}), BASE)
    described = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}

    def imbalance(unknowns, x):
        actuator = body.build(dict(zip(names, x, strict=True)))
        phases = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.4))
        return residual(unknowns, Problem(actuator, 30e3, phases, actuator.fresh_states()))

    compiled = jax.jit(imbalance)
    began = time.process_time()
    u = sobol.sample(described, 64, calc_second_order=False)[: options.loop]
    x = problem.inputs.values(stats.norm.ppf(np.clip(u, 1e-9, 1.0 - 1e-9)))
    guess = np.asarray(first_trial(body.build({})))
    compiled(guess, x[0]).block_until_ready()
    prepared, began = time.process_time() - began, time.process_time()
    found = [optimize.root(lambda y, row=row: np.asarray(compiled(y, row)), guess) for row in x]
    loop = (time.process_time() - began) / len(x)
    problem.evaluator(x[:1].repeat(2000, 0))
    z = np.random.default_rng(0).normal(size=(options.rows, len(names)))
    began = time.process_time()
    values = problem.inputs.values(z)
    problem.evaluator(values)
    ours = (time.process_time() - began) / options.rows
    solved = np.mean([one.success for one in found])
    print(f"SALib and scipy.optimize.root: {1.0 / loop:,.0f} rows/s of one core ({len(x)} rows, {solved:.1%} "
          "solved, "
          f"{prepared:.1f} s to begin)")  # fmt: skip
    print(f"ours: {1.0 / ours:,.0f} rows/s of one core ({options.rows:,} rows); ratio {loop / ours:.0f}")


def dask(options):
    """Processor time of a chunk, without the start: from two sizes.

    One worker against one process is what Dask costs. Two workers are to be held against two processes that
    run side by side without Dask: cores that share caches and memory are slower than one alone.
    """
    kind, cost = CHEAP if options.cheap else ACTUATOR, {}
    ways = {
        "one process": (1, ("--devices", "1")),
        "one worker": (1, ("--workers", "1")),
        "two processes side by side": (2, ("--devices", "1")),
        "two workers": (1, ("--workers", "2")),
    }
    with tempfile.TemporaryDirectory() as folder:
        for rows in (options.rows // 10, options.rows):
            for name, (count, more) in ways.items():
                study = write(folder, rows // count, options.chunk, kind=kind)
                outs = [Path(folder) / f"{name}-{rows}-{k}" for k in range(count)]
                cost[name, rows] = measured(*[command(study, out, *more) for out in outs])
        names = ("one process", "one worker", "two workers")
        folders = [Path(folder) / f"{name}-{options.rows}-0" / "chunks" for name in names]
        files = [[path.read_bytes() for path in sorted(place.iterdir())] for place in folders]
    chunks = 0.9 * options.rows / options.chunk
    for name in ways:
        few, many = cost[name, options.rows // 10], cost[name, options.rows]
        print(f"{name}: start {few[1]:.1f} s of processor, {(many[1] - few[1]) / chunks:.4f} s a chunk; "
              f"{many[0]:.1f} s in all")  # fmt: skip
    print(f"the same bytes: {files[0] == files[1] == files[2]}")


def kills(options):
    """Kill a study at random moments, resume it, and compare all bytes with those of an undisturbed run."""
    chance, hits, last = random.Random(options.seed), 0, 0
    with tempfile.TemporaryDirectory() as folder:
        study, whole, broken = (
            write(folder, options.rows, options.chunk),
            Path(folder) / "a",
            Path(folder) / "b",
        )
        measured(command(study, whole, "--devices", options.devices))
        tasks = len(list((whole / "chunks").iterdir()))
        for chunks in sorted(chance.randrange(tasks) for _ in range(options.kills)):
            words = command(study, broken, "--devices", options.devices, "--resume")
            process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            while process.poll() is None and len(list(broken.glob("chunks/chunk*"))) < max(chunks, last + 1):
                time.sleep(0.002)
            time.sleep(chance.random() * 0.5)
            if process.poll() is None:
                process.kill()
                hits += 1
            process.wait()
            last = len(list(broken.glob("chunks/chunk*")))
        measured(command(study, broken, "--devices", options.devices, "--resume"))
        files = [
            {p.relative_to(place): p.read_bytes() for p in place.rglob("*") if p.is_file()}
            for place in (whole, broken)
        ]
    same = files[0] == files[1]
    print(f"{hits} kills of {options.kills} hit a run of {tasks} chunks")
    print(f"the same bytes in {len(files[0])} files: {same}")


def plain_samples(limits, count, dimension, chunk=1_000_000):
    """How many of so many plain samples of a sum of standard normal numbers lie above each limit."""
    import numpy as np

    random, found = np.random.default_rng(1), np.zeros(len(limits), dtype=int)
    for first in range(0, count, chunk):
        total = random.standard_normal((dimension, min(chunk, count - first))).sum(axis=0)
        found += [int(np.sum(total > limit)) for limit in limits]
    return found


def probability(options):
    import numpy as np
    from scipy import stats

    import pneusma_jax as pj
    from fitting.propagate import build_problem, read_study
    from fitting.propagate.rare import estimate_rare

    pj.enable_float64()
    inputs = "\n".join(f"x{k} = {{mean = 0.0, sd = 1.0}}" for k in range(20))
    total = " + ".join(f"x{k}" for k in range(20))
    levels = (1e-2, 1e-4, 1e-6)
    limits = [np.sqrt(20.0) * stats.norm.isf(exact) for exact in levels]
    for exact, limit in zip(levels, limits, strict=True):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "study.toml"
            path.write_text(
                f'schema = "pneusma-study/1"\n[model]\nthrough = "expression"\noutputs = {{y = "{total}"}}\n'
                f"[input]\n{inputs}\n"
                f'[[limit]]\non = "y"\nabove = {limit}\n[rare]\n'
            )
            problem = build_problem(read_study(path))
            found = estimate_rare(problem, problem.study.limits[0])
        for name, part in (("subset simulation", found.subset), ("importance sampling", found.form)):
            low, high = part.interval
            print(f"{exact:.0e}: {name} {part.probability:.3e}, {low:.2e} to {high:.2e}")
        print(f"       FORM {found.form.by_form:.4e}; {found.rows:,} rows; agree: {found.agree}")
    count = int(options.plain)
    if count:
        began = time.process_time()
        for exact, failed in zip(levels, plain_samples(limits, count, 20), strict=True):
            low, high = stats.binomtest(int(failed), count).proportion_ci()
            print(f"{exact:.0e}: {count:,} plain samples {failed / count:.3e}, {low:.2e} to {high:.2e}")
        print(f"       {time.process_time() - began:.0f} s of processor")


def actuator(options):
    """Small probabilities of PneuSMA2's curvature, beside as many plain random rows as were asked for."""
    from scipy import stats

    import pneusma_jax as pj
    from fitting.propagate import propagate

    pj.enable_float64()
    levels = (1e-2, 1e-3, 1e-4)
    with tempfile.TemporaryDirectory() as folder:
        few = propagate(write(folder, max(20_000, options.rows // 10), options.chunk), Path(folder) / "few")
        limits = few.quantiles([1.0 - level for level in levels])[:, 0]
        study = Path(folder) / "study.toml"
        text = study.read_text().replace('method = "sobol"', f'method = "monte_carlo"\nseed = {options.seed}')
        text = text.replace(f"rows = {max(20_000, options.rows // 10)}", f"rows = {options.rows}")
        limits = [f'[[limit]]\non = "curvature_1pm"\nabove = {limit:.4f}\n' for limit in limits]
        study.write_text(text + "".join(limits) + "[rare]\n")
        result = propagate(study, Path(folder) / "out")
    count = int(result.summary.moments.count[0])
    for limit in result.problem.study.limits:
        failed, rare = int(result.summary.beyond[limit.words][-1]), result.rare[limit.words]
        low, high = stats.binomtest(failed, count).proportion_ci()
        print(f"{limit.words}: {count:,} plain rows {failed / count:.3e}, {low:.2e} to {high:.2e}")
        for name, part in (("subset simulation", rare.subset), ("importance sampling", rare.form)):
            low, high = part.interval
            print(f"       {name} {part.probability:.3e}, {low:.2e} to {high:.2e}")
        print(f"       FORM {rare.form.by_form}; {rare.rows:,} rows; agree: {rare.agree}")


WHAT = {
    "rate": rate, "against": against, "kills": kills, "dask": dask, "probability": probability,
    "actuator": actuator,
}  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=list(WHAT))
    parser.add_argument("--rows", type=int, default=20_000)
    parser.add_argument("--chunk", type=int, default=20_000)
    parser.add_argument("--keep", default="summary", choices=["summary", "outputs"])
    parser.add_argument("--loop", type=int, default=300, help="rows of SciPy's loop")
    parser.add_argument("--devices", default="1")
    parser.add_argument("--plain", type=float, default=0.0, help="plain samples beside small probabilities")
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1, help="of the moments of kills")
    parser.add_argument("--cheap", action="store_true", help="an expression in place of the actuator")
    options = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    WHAT[options.what](options)


if __name__ == "__main__":
    main()
