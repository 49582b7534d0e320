"""Files of a propagated study for programs: the content of `report.json`, and CSV files."""

from typing import Any

from fitting.data.csv_text import csv_rows
from fitting.propagate import Propagation
from fitting.propagate.rare import RareResult

from ..characterisation import CSV_DIGITS
from .numbers import INPUT_HEADER, column_table, exceedances, index_table, input_rows, lost
from .text import touching as words_on_touching
from .text import verdict

SCHEMA = "pneusma-propagated/1"


def files(result: Propagation) -> dict[str, str]:
    """Content of the files beside the report, by file name."""
    tables = {"columns.csv": column_table(result), "inputs.csv": _input_table(result)}
    if result.summary.indices is not None:
        tables["indices.csv"] = index_table(result)
    return {name: csv_rows(*table, digits=CSV_DIGITS) for name, table in tables.items()}


def _input_table(result: Propagation) -> tuple[list[str], list[list]]:
    """Table of inputs: their distributions, values at failed rows, and correlation with every column."""
    problem, failures = result.problem, result.summary.failures
    coefficients = result.summary.correlation.coefficients
    known = {row[0]: row for row in input_rows(problem)}
    correlations = [f"correlation {x}" for x in problem.columns.labels]
    header = [*INPUT_HEADER, "failed_apart", *correlations]
    names = enumerate(problem.inputs.names)
    rows = [[*known[name], failures.uneven[k], *coefficients[k]] for k, name in names]
    return header, rows


def content(result: Propagation) -> dict[str, Any]:
    """The content of `report.json`. It holds nothing of the run itself, so that it is the same after any
    number of kills."""
    problem, failures = result.problem, result.summary.failures
    sampling = problem.study.sampling
    header, rows = column_table(result)
    touching = result.summary.touching
    found: dict[str, Any] = {
        "schema": SCHEMA,
        "name": problem.study.name,
        "title": problem.response.title,
        "verdict": verdict(result),
        "fingerprint": problem.fingerprint,
        "sampling": {
            "method": sampling.method, "rows": problem.rows, "chunk": sampling.chunk, "seed": sampling.seed,
        },
        "inputs": list(problem.inputs.names),
        "columns": {row[0]: dict(zip(header[1:], row[1:], strict=True)) for row in rows},
        "limits": {
            e.limit: {
                "probability": float(e.probability[-1]), "low": float(e.low[-1]), "high": float(e.high[-1]),
                "least": e.bounds[0], "most": e.bounds[1], "along": list(map(float, e.probability)),
            }
            for e in exceedances(result)
        },
        "without_result": {
            "rows": failures.count,
            "share": lost(result),
            "apart": dict(zip(problem.inputs.names, map(float, failures.uneven), strict=True)),
        },
        "touching": {"rows": int(touching.rows), "least_deg": float(touching.least),
                     "most_deg": float(touching.most)} if touching.rows else None,
        "notices": [*problem.cautions, *words_on_touching(result), *problem.notices],
    }  # fmt: skip
    if result.summary.indices is not None:
        names, entries = index_table(result)
        found["indices"] = {
            "kind": result.summary.indices.kind,
            "blocks": result.summary.indices.blocks,
            "left_out": result.summary.indices.left_out,
            "values": [dict(zip(names, entry, strict=True)) for entry in entries],
        }
    if result.rare:
        found["rare"] = {limit: _rare(rare) for limit, rare in result.rare.items()}
    return found


def _rare(rare: RareResult) -> dict[str, Any]:
    found: dict[str, Any] = {"rows": rare.rows, "without_result": rare.without_result, "agree": rare.agree}
    if rare.subset is not None:
        found["subset"] = {
            "probability": rare.subset.probability, "interval": list(rare.subset.interval),
            "each": list(map(float, rare.subset.each)), "stalled": rare.subset.stalled,
        }  # fmt: skip
    if rare.form is not None:
        found["importance_sampling"] = {
            "probability": rare.form.probability, "interval": list(rare.form.interval),
            "samples": rare.form.samples, "failed": rare.form.failed,
        }  # fmt: skip
        found["form"] = {"probability": rare.form.by_form, "betas": list(map(float, rare.form.betas))}
    return found
