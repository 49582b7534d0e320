"""Shared parts of the reports on all characterised specimens: parameters as table, CSV and JSON."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from fitting.calibrate.result import SCHEMA, Estimate
from fitting.data.csv_text import csv_rows

from .cells import number, percent, relative, with_error
from .table import Table

ERRORS = "± one standard error."
CSV_DIGITS = 10
"""Number of significant digits in CSV files of results."""
MOST_NAMES = 12
"""Maximum number of recordings that a subtitle names."""


def parameter_table(
    parameters: Mapping[str, Estimate], start: Mapping[str, float], share: Mapping[str, float | None]
) -> Table:
    """Table of parameters with their errors.

    Args:
        parameters: parameters by name.
        start: start value by name, in the unit of files.
        share: standard error over the prior's standard deviation by name, where there is a prior.
    """
    rows = [
        [
            name, estimate_text(e), e.unit, relative(e.value, e.sd), percent(share.get(name)),
            number(start.get(name), ".4g"), remark(e),
        ]
        for name, e in parameters.items()
    ]  # fmt: skip
    return Table(["parameter", "value", "unit", "relative error", "of prior's sd", "start", ""], rows, ERRORS)


def estimate_text(estimate: Estimate) -> str:
    """Value and standard error. A value at its bound usually has none."""
    without = estimate.at_bound and not math.isfinite(estimate.sd)
    return with_error(estimate.value, None if without else estimate.sd)


def remark(estimate: Estimate) -> str:
    """Remark on an estimate beside its numbers."""
    return "at bound" if estimate.at_bound else ""


def estimate_json(estimate: Estimate) -> dict[str, Any]:
    """An estimate for `report.json`."""
    return {"value": estimate.value, "sd": estimate.sd, "unit": estimate.unit, "at_bound": estimate.at_bound}


def estimates_json(parameters: Mapping[str, Estimate]) -> dict[str, dict[str, Any]]:
    """Estimates by name for `report.json`."""
    return {name: estimate_json(estimate) for name, estimate in parameters.items()}


def estimate_cells(estimate: Estimate) -> list[object]:
    """Value, standard error, unit and bound of an estimate for CSV files."""
    return [estimate.value, estimate.sd, estimate.unit, "yes" if estimate.at_bound else "no"]


def parameters_csv(parameters: Mapping[str, Estimate]) -> str:
    """`parameters.csv`: one row for each parameter."""
    header = ["parameter", "value", "sd", "unit", "at_bound"]
    rows = [[name, *estimate_cells(estimate)] for name, estimate in parameters.items()]
    return csv_rows(header, rows, digits=CSV_DIGITS)


def content(
    kind: str,
    title: str,
    real: bool | None,
    verdict: Sequence[str],
    parameters: Mapping[str, Estimate],
    warnings: Sequence[str],
    seed: int,
    more: Mapping[str, Any],
) -> dict[str, Any]:
    """The content of `report.json`: entries of all kinds, around those of one kind (`more`)."""
    return {
        "schema": SCHEMA,
        "kind": kind,
        "title": title,
        "real": real,
        "verdict": verdict,
        "parameters": estimates_json(parameters),
        "warnings": warnings,
        **more,
        "seed": seed,
    }


def subtitle(what: str, recordings: str, fitted: Sequence[str], held_out: Sequence[str]) -> str:
    """Subtitle: specimen and fitted recordings.

    Args:
        what: name of the specimen, `"Wire"`.
        recordings: word for such recordings, `"test"`; the plural is made with an s.
        fitted: names of the fitted recordings.
        held_out: names of the recordings that only score.
    """
    plural = "" if len(fitted) == 1 else "s"
    rest = f", {len(held_out)} held out ({_names(held_out)})" if held_out else ""
    return f"{what}, {len(fitted)} {recordings}{plural} fitted ({_names(fitted)}){rest}"


def _names(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def footer(seed: int) -> str:
    """Footer with program and version."""
    return f"pneusma characterise, seed {seed}"
