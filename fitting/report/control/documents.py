"""Files of a study of closed loops: the content of `report.json`, and every time history as CSV."""

from typing import Any

from fitting.control.loop import Run
from fitting.control.sweep import HOLD, SINCE, STEP, Sweep
from fitting.data.csv_text import csv_text

from .words import verdict


def files(result: Sweep) -> dict[str, str]:
    """Content of the files beside the report, by file name."""
    first = result.cases[0].without
    columns = {"time_s": first.time, "wanted_1pm": first.wanted}
    for case in result.cases:
        name = case.name.replace(" ", "_")
        columns[f"{name}_1pm"] = case.without.curvature
        if case.known is not None:
            columns[f"{name}_known_1pm"] = case.known.curvature
    return {"control.csv": csv_text(columns)}


def summary(result: Sweep) -> dict[str, Any]:
    """The content of `report.json`."""
    cases = [
        {"concealed": case.name, "without": _numbers(case.without), "known": _numbers(case.known)}
        for case in result.cases
    ]
    return {
        "schema": "pneusma-control/1",
        "design": result.design,
        "verdict": verdict(result),
        "pressure_kPa": 1e-3 * result.loop.pressure,
        "seed": result.loop.seed,
        "cases": cases,
    }


def _numbers(run: Run | None) -> dict[str, float] | None:
    if run is None:
        return None
    return {
        "rmse_1pm": run.rmse(SINCE),
        "settling_s": run.settling(STEP, HOLD),
        "observer_rmse_1pm": run.rmse(SINCE, observer=True),
    }
