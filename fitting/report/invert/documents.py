"""Files of an inversion, a trajectory or a passage: the content of `report.json`, and CSV files."""

from typing import Any

import numpy as np

from fitting.data.csv_text import csv_text
from fitting.invert.goals import GOALS
from fitting.invert.passage import Passage
from fitting.invert.result import Inversion, spring_name
from fitting.invert.trajectory import Trajectory
from pneusma_jax.units import from_si

from .words import misses_of, passage_verdict, unit_of, verdict


def columns(result: Inversion, time: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Every target with its drives, as columns of a CSV."""
    table: dict[str, Any] = {} if time is None else {"time_s": time}
    at = 0
    for name in result.goals:
        for column in GOALS[name].columns:
            unit = unit_of(column)
            table[f"wanted_{column}"] = from_si(result.wanted[:, at], unit)
            table[f"model_{column}"] = from_si(result.values[:, at], unit)
            at += 1
    table["pressure_kPa"] = from_si(result.pressure, "kPa")
    for k in range(len(result.springs)):
        name = result.spring_name(k)
        table[f"xi0_{name}"] = result.fractions[:, k]
        table[f"resistance_{name}_ohm"] = result.resistances[:, k]
        table[f"current_{name}_A"] = result.currents[:, k]
    table["met"] = np.where(result.met, "yes", "no")
    table["held_by"] = np.array(result.held)
    return table


def files(result: Inversion, time: np.ndarray | None = None) -> dict[str, str]:
    """Content of the files beside the report, by file name."""
    return {"targets.csv": csv_text(columns(result, time))}


def summary(result: Inversion, warnings: list[str]) -> dict[str, Any]:
    """The content of `report.json`."""
    return {
        "schema": "pneusma-inversion/1",
        "design": result.design,
        "verdict": verdict(result),
        "targets": int(result.met.size),
        "met": int(result.met.sum()),
        "goals": list(result.goals),
        "warnings": warnings,
        "results": [_one(result, k) for k in range(result.met.size)],
        "ways": [ways.tolist() for ways in result.ways],
        "ways_heat_W": [watts.tolist() for watts in result.way_heat],
    }


def _one(result: Inversion, k: int) -> dict[str, Any]:
    """One target: what was wanted and is reached, by how much each goal is missed, and the drives."""
    names = [name for goal in result.goals for name in GOALS[goal].columns]
    shown = lambda row: {  # noqa: E731
        name: float(from_si(x, unit_of(name))) for name, x in zip(names, row, strict=True)
    }
    springs = [result.spring_name(j) for j in range(len(result.springs))]
    return {
        "wanted": shown(result.wanted[k]),
        "reached": shown(result.values[k]),
        "miss": {f"{goal}_{unit.replace('1/m', '1pm')}": value for goal, value, unit in misses_of(result, k)},
        "met": bool(result.met[k]),
        "held_by": result.held[k],
        "pressure_kPa": float(from_si(result.pressure[k], "kPa")),
        "xi0": dict(zip(springs, result.fractions[k].tolist(), strict=True)),
        "resistance_ohm": dict(zip(springs, result.resistances[k].tolist(), strict=True)),
        "current_A": dict(zip(springs, result.currents[k].tolist(), strict=True)),
        "heat_W": float(result.heat[k]),
    }


def trajectory_summary(result: Trajectory) -> dict[str, Any]:
    """The content of `report.json` of a trajectory."""
    return summary(result.inversion, result.warnings()) | {"disagreement": result.disagreement}


def passage_files(result: Passage) -> dict[str, str]:
    """Content of the files beside the report of a passage, by file name."""
    line = from_si(result.line, "mm")
    drives: dict[str, Any] = {"pressure_kPa": [from_si(result.pressure, "kPa")]}
    for name, x, ohms, amperes in zip(
        _names(result), result.fractions, result.resistances, result.currents, strict=True
    ):
        drives |= {f"xi0_{name}": [x], f"resistance_{name}_ohm": [ohms], f"current_{name}_A": [amperes]}
    return {
        "centre_line.csv": csv_text({f"{a}_mm": line[:, k] for k, a in enumerate("xyz")}),
        "drives.csv": csv_text(drives),
    }


def _names(result: Passage) -> list[str]:
    """Names of all springs."""
    return [spring_name(result.springs, k) for k in range(len(result.springs))]


def passage_summary(result: Passage) -> dict[str, Any]:
    """The content of `report.json` of a passage."""
    return {
        "schema": "pneusma-passage/1",
        "design": result.design,
        "verdict": passage_verdict(result),
        "lumen": result.lumen.name,
        "tortuosity": result.lumen.tortuosity,
        "passes": result.passes,
        "clearance_mm": from_si(result.clearance, "mm"),
        "clearance_wanted_mm": from_si(result.wanted, "mm"),
        "tightest_mm": from_si(result.touch.along, "mm"),
        "tightest_segment": result.touch.segment,
        "too_near_mm": from_si(result.touch.stretches, "mm").tolist(),
        "held_by": result.held,
        "apart_mm": from_si(result.apart, "mm"),
        "to_the_end": result.to_the_end,
        "reached_mm": from_si(result.reached, "mm"),
        "offset_mm": from_si(result.offset, "mm"),
        "pressure_kPa": from_si(result.pressure, "kPa"),
        "xi0": dict(zip(_names(result), result.fractions.tolist(), strict=True)),
        "resistance_ohm": dict(zip(_names(result), result.resistances.tolist(), strict=True)),
        "current_A": dict(zip(_names(result), result.currents.tolist(), strict=True)),
    }
