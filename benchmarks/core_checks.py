"""Checks of `core_speed` beside its times: accuracy, and times of whole commands."""

import dataclasses
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import equinox as eqx
import numpy as np

import pneusma_jax as pj
from benchmarks.core_cases import Rows, hybrid, numpy_rows, simplex

FINER = 140
"""Gauss nodes of a panel for the reference, ten times those of the model."""
FLAT = 1.0
"""Curvature [1/m] below which an error is not divided by the row's own curvature but by this one."""
WRONG = 0.01
"""Error of curvature [1/m] from which a row counts as another equilibrium; noise of cameras is larger."""


def _errors(found: np.ndarray, exact: np.ndarray) -> dict:
    error = np.abs(found - exact) / np.maximum(np.abs(exact), FLAT)
    return dict(rows=len(exact), largest=float(np.max(error)), median=float(np.median(error)))


def accuracy(data: Rows, rows: int, few: int) -> dict:
    """Relative errors of curvature against ten times finer quadrature, and roots that were missed.

    Args:
        data: rows.
        rows: that are solved.
        few: that the simplex solves.
    """
    actuator = pj.make_actuator("pneusma2")
    fine = eqx.tree_at(
        lambda a: a.section, actuator, dataclasses.replace(actuator.section, nodes=FINER)
    )
    pressure = data.pressure[:rows]
    curvature = lambda body, drive: np.asarray(pj.solve_batch(body, pressure, drive).curvature)  # noqa: E731
    exact = curvature(fine, data.phases(rows))
    found = {"by phase": _errors(curvature(actuator, data.phases(rows)), exact)}
    # resistances of the finer model, whose own phases are the truth of both
    finer = pj.solve_batch(fine, pressure, data.phases(rows))
    drive = tuple(pj.Resistance(np.asarray(s.resistance)) for s in finer.springs)
    own = pj.solve_batch(actuator, pressure, drive)
    alone = np.asarray(own.status) == int(pj.Status.converged)
    found["by resistance"] = _errors(np.asarray(own.curvature)[alone], exact[alone])
    found["SciPy root (hybr)"] = _errors(numpy_rows(data, few, hybrid), exact[:few])
    found["Nelder-Mead"] = _errors(numpy_rows(data, few, simplex), exact[:few])
    more = pj.solve_batch(actuator, data.pressure, data.resistances(len(data.pressure)))
    alone = np.asarray(more.status) == int(pj.Status.converged)
    wrong = np.abs(np.asarray(more.curvature) - data.curvature) > WRONG
    return dict(
        errors=found,
        by_resistance=dict(
            rows=len(alone), failed=int(np.sum(~np.asarray(more.converged))),
            several=int(np.sum(np.asarray(more.status) == int(pj.Status.several_equilibria))),
            another_without_a_word=int(np.sum(alone & wrong)),
        ),
        steps_by_phase=float(np.mean(pj.solve_batch(actuator, pressure, data.phases(rows)).steps)),
    )  # fmt: skip


EXAMPLE = str(Path(__file__).resolve().parents[1] / "calibration_data" / "examples" / "elastomer")
COMMANDS = {
    "import": None,
    "help": ["--help"],
    "simulate": ["simulate", "--design", "pneusma2", "--pressure-kPa", "30", "--xi0-2", "0.4"],
    "characterise": ["characterise", EXAMPLE, "--out"],
    "posterior": ["posterior", EXAMPLE, "--max-steps", "1000", "--out"],
    "diagnose": ["diagnose", EXAMPLE, "--out"],
}
"""Commands that are timed: importing the package, the list of commands, one state; a fit, a posterior and a
diagnosis of the shipped coupons."""
OFTEN = ("import", "help", "simulate")
"""Commands that are timed more than twice."""
START = {name: "import os, sys; from fitting.cli import main; sys.exit(main())" for name in COMMANDS} | {
    "import": "from pneusma_jax import solve"
}  # fmt: skip


def command(tiny: bool = False) -> dict:
    """Times of commands from an empty compilation cache, and again, the median [s]; also of the processor.

    Python keeps its bytecode, as it does where a package is installed.

    Args:
        tiny: only the first three of them.
    """
    found = {}
    for name in list(COMMANDS)[: 3 if tiny else None]:
        with tempfile.TemporaryDirectory() as folder:
            _run(name, folder, "bytecode", cache="off")
            times = [_run(name, folder, turn) for turn in range(6 if name in OFTEN else 2)]
        (cold, cold_own), again = times[0], [statistics.median(x) for x in zip(*times[1:], strict=True)]
        found[name] = dict(
            cold_s=cold, cold_processor_s=cold_own, again_s=again[0], again_processor_s=again[1]
        )
    return found


def _run(name: str, folder: str, turn: object, cache: str = "") -> tuple[float, float]:
    """Wall-clock and processor time of a command in a process of its own [s]."""
    given = COMMANDS[name] or []
    given = given + [f"{folder}/out_{turn}"] * (given[-1:] == ["--out"])
    variables = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    variables |= {"PNEUSMA_CACHE": cache or f"{folder}/cache", "PYTHONPYCACHEPREFIX": f"{folder}/bytecode"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    called = [sys.executable, "-c", START[name], *given]
    subprocess.run(called, check=True, capture_output=True, env=variables)
    spent = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
