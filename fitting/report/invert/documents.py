"""An inversion, a trajectory or a passage as text, tables and files."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from fitting.data.csv_text import csv_text
from fitting.invert.goals import GOALS
from fitting.invert.lumen import Passage
from fitting.invert.run import Inversion, spring_name
from fitting.invert.trajectory import Trajectory
from fitting.report.figures import png
from fitting.report.render import plain
from fitting.report.table import Table, table_text
from pneusma_jax.units import from_si, unit_of_column

from .figures import passage_figure, targets_figure

SHOWN = 20
"""Number of targets that the text lists."""


def columns(result: Inversion, time: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Every target with its drives, as columns of a CSV."""
    table: dict[str, Any] = {} if time is None else {"time_s": time}
    at = 0
    for name in result.goals:
        for column in GOALS[name].columns:
            unit = _unit(column)
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


def _unit(column: str) -> str:
    return "1" if column.startswith("direction") else unit_of_column(column)[1]


def miss_words(name: str, miss: float) -> str:
    """Distance from a goal, in words."""
    unit = _unit(GOALS[name].columns[0]) if name != "direction" else "1"
    return f"{name} by {from_si(miss, unit):.3g} {unit}".removesuffix(" 1")


def drive_words(result: Inversion, k: int) -> str:
    """Drives of one target, in words."""
    springs = [
        f"xi0_{result.spring_name(j)} {x:.3f}" for j, x in enumerate(result.fractions[k]) if x < 1.0 - 1e-6
    ]
    cold = "" if springs or not result.springs else ", all springs cold"
    return f"{from_si(result.pressure[k], 'kPa'):.3f} kPa" + "".join(f", {s}" for s in springs) + cold


def inversion_text(result: Inversion, notes: list[str] | None = None) -> str:
    """An inversion as plain text."""
    met = int(result.met.sum())
    lines = [f"{met} of {result.met.size} targets are met.", *(notes or []), ""]
    rows = []
    for k in range(min(result.met.size, SHOWN)):
        missed = ", ".join(miss_words(n, m[k]) for n, m in result.misses.items())
        rows.append(
            [
                str(k + 1),
                drive_words(result, k),
                "met" if result.met[k] else f"misses {missed}",
                result.held[k],
            ]
        )
    lines.append(table_text(Table(("target", "drives", "result", "held by"), rows), indent=0))
    if result.met.size > SHOWN:
        lines.append(f"... and {result.met.size - SHOWN} more, in targets.csv")
    for k, ways in enumerate(result.ways[:SHOWN]):
        for drives in ways:
            springs = [
                f"xi0_{result.spring_name(j)} {x:.3f}" for j, x in enumerate(drives[1:]) if x < 1.0 - 1e-6
            ]
            lines.append(
                f"target {k + 1}, another way: {from_si(drives[0], 'kPa'):.3f} kPa, {', '.join(springs)}"
            )
    return "\n".join(lines)


def trajectory_text(result: Trajectory) -> str:
    """A trajectory as plain text, with irreversible steps first."""
    notes = [f"WARNING: {w}." for w in result.warnings()]
    notes.append(f"The exact history agrees with the search to {result.disagreement:.2g} of a goal's size.")
    return inversion_text(result.inversion, notes)


def passage_text(result: Passage) -> str:
    """A passage as plain text."""
    gap = from_si(result.clearance, "mm")
    fit = (
        f"passes with {gap:.2f} mm to the wall"
        if result.passes
        else f"does not pass: it overlaps the wall by {-gap:.2f} mm"
    )
    springs = [f"xi0_{spring_name(result.springs, k)} {x:.3f}" for k, x in enumerate(result.fractions)]
    return "\n".join([
        f"{result.lumen.name}, tortuosity {result.lumen.tortuosity:.3f}: the chain {fit};",
        f"its centre line is {from_si(result.offset, 'mm'):.2f} mm from the lumen's (root mean square).",
        f"Drives: {from_si(result.pressure, 'kPa'):.3f} kPa, {', '.join(springs)}",
    ])  # fmt: skip


def documents(result: Inversion | Trajectory) -> Mapping[str, str | bytes]:
    """Files of an inversion or a trajectory."""
    found = result.inversion if isinstance(result, Trajectory) else result
    time = result.time if isinstance(result, Trajectory) else None
    summary = {
        "schema": "pneusma-inversion/1",
        "targets": int(found.met.size),
        "met": int(found.met.sum()),
        "goals": list(found.goals),
        "warnings": result.warnings() if isinstance(result, Trajectory) else [],
        "ways": [ways.tolist() for ways in found.ways],
    }
    return {
        "targets.csv": csv_text(columns(found, time)),
        "targets.png": png(targets_figure(found, time)),
        "report.json": json.dumps(plain(summary), indent=1) + "\n",
    }


def passage_documents(result: Passage) -> Mapping[str, str | bytes]:
    """Files of a passage."""
    line = from_si(result.line, "mm")
    summary = {
        "schema": "pneusma-passage/1",
        "lumen": result.lumen.name,
        "tortuosity": result.lumen.tortuosity,
        "passes": result.passes,
        "clearance_mm": from_si(result.clearance, "mm"),
        "offset_mm": from_si(result.offset, "mm"),
        "pressure_kPa": from_si(result.pressure, "kPa"),
        "xi0": {spring_name(result.springs, k): float(x) for k, x in enumerate(result.fractions)},
    }
    return {
        "centre_line.csv": csv_text({f"{a}_mm": line[:, k] for k, a in enumerate("xyz")}),
        "passage.png": png(passage_figure([result])),
        "report.json": json.dumps(plain(summary), indent=1) + "\n",
    }
