"""What reports on every characterised specimen share: parameters as table, CSV and JSON."""

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
    """Parameters with their errors.

    Args:
        parameters: by name.
        start: where each began, in the unit of files.
        share: standard error over the prior's 1-sigma, where there is one.
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
    """Value and standard error; a value that stopped at a bound usually has none."""
    without = estimate.at_bound and not math.isfinite(estimate.sd)
    return with_error(estimate.value, None if without else estimate.sd)


def remark(estimate: Estimate) -> str:
    """What is to be known about an estimate beside its numbers."""
    return "at bound" if estimate.at_bound else ""


def estimate_json(estimate: Estimate) -> dict[str, Any]:
    """An estimate as `report.json` has it."""
    return {"value": estimate.value, "sd": estimate.sd, "unit": estimate.unit, "at_bound": estimate.at_bound}


def estimates_json(parameters: Mapping[str, Estimate]) -> dict[str, dict[str, Any]]:
    """Estimates by name as `report.json` has them."""
    return {name: estimate_json(estimate) for name, estimate in parameters.items()}


def estimate_cells(estimate: Estimate) -> list[object]:
    """Value, standard error, unit and bound of an estimate, as CSV files have them."""
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
    """The content of `report.json`: what all kinds have, around what is special to one (`more`)."""
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
    """What was fitted to which recordings.

    Args:
        what: the specimen, `"Wire"`.
        recordings: such recordings in words, `"test"`; the plural is made with an s.
        fitted: names of those that were fitted.
        held_out: names of those that only score.
    """
    plural = "" if len(fitted) == 1 else "s"
    rest = f", {len(held_out)} held out ({_names(held_out)})" if held_out else ""
    return f"{what}, {len(fitted)} {recordings}{plural} fitted ({_names(fitted)}){rest}"


def _names(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def footer(seed: int) -> str:
    """What made the report."""
    return f"pneusma characterise, seed {seed}"
