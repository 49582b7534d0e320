"""The files of a propagated study: page, report, tables, figures."""

import json
from typing import Any

import numpy as np

from fitting.propagate import Propagation
from fitting.propagate.rare import RareResult

from .. import html
from ..elastomer.json_report import plain
from ..elastomer.tables import csv_text
from ..figures import png
from .figures import captioned
from .numbers import column_table, exceedances, index_table, lost
from .text import index_rows, quantity_rows, verdict

SCHEMA = "pneusma-propagated/1"


def documents(result: Propagation) -> dict[str, str | bytes]:
    """Content of every file, by file name."""
    drawn = captioned(result)
    tables = {"columns.csv": csv_text(*column_table(result)), "inputs.csv": csv_text(*_input_table(result))}
    if result.summary.indices is not None:
        tables["indices.csv"] = csv_text(*index_table(result))
    content = json.dumps(plain(report(result)), indent=1, ensure_ascii=False, allow_nan=False)
    return {
        "report.json": content + "\n",
        "report.html": _page(result, drawn),
        **tables,
        **{f"{name}.png": png(figure) for name, (figure, _) in drawn.items()},
    }


def _input_table(result: Propagation) -> tuple[list[str], list[list]]:
    """Inputs: what they are drawn from, where rows failed, and their correlation with every column."""
    problem, failures = result.problem, result.summary.failures
    coefficients = result.summary.correlation.coefficients
    words = {name: marginal.words for name, marginal in problem.inputs.marginals.items()}
    header = ["input", "distribution", "failed_apart", *(f"correlation {x}" for x in problem.columns.labels)]
    rows = [
        [name, words.get(name, "draws"), failures.uneven[k], *coefficients[k]]
        for k, name in enumerate(problem.inputs.names)
    ]
    return header, rows


def report(result: Propagation) -> dict[str, Any]:
    """The content of `report.json`: nothing of the run, so that it is the same after any number of kills."""
    problem, failures = result.problem, result.summary.failures
    sampling = problem.study.sampling
    header, rows = column_table(result)
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
        "notices": list(problem.notices),
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


def _page(result: Propagation, drawn: dict) -> str:
    problem = result.problem
    parts = [html.heading(problem.study.name, 1), html.paragraph(problem.response.title, "subtitle")]
    if problem.study.description:
        parts.append(html.paragraph(problem.study.description))
    parts.append(html.verdict(verdict(result)))
    parts += [html.paragraph(sentence, "warning") for sentence in problem.notices]
    if lost(result) > 0.0:
        parts.append(html.paragraph(_open(result), "warning"))
    parts += [
        html.heading("Outputs"),
        html.table(*quantity_rows(result), "Where each spreads most; columns.csv has all."),
    ]
    parts += _figures(drawn, ("band_", "distribution_"))
    header, rows = index_rows(result)
    if rows:
        note = "95 % intervals of the bootstrap."
        if result.summary.indices.left_out:
            note += " Beside them: between what each index lies, whatever failed rows are."
        parts += [html.heading("What the spread comes from"), html.table(header, rows, note)]
        parts += _figures(drawn, ("tornado_", "indices_"))
    if problem.study.limits:
        parts += [html.heading("Failure"), html.table(*_limit_rows(result))]
        parts += _figures(drawn, ("failure_",))
    if "failed_rows" in drawn:
        parts += [html.heading("Rows without a result"), html.figure(*drawn["failed_rows"])]
    seed = problem.study.sampling.seed
    return html.page(f"{problem.study.name}: uncertainty", parts, f"pneusma propagate, seed {seed}")


def _figures(drawn: dict, begin: tuple[str, ...]) -> list[str]:
    return [html.figure(*drawn[name]) for name in drawn if name.startswith(begin)]


def _limit_rows(result: Propagation) -> tuple[list[str], list[list[str]]]:
    rows = [
        [
            e.limit, f"{e.probability[-1]:.4g}", f"{e.low[-1]:.3g} to {e.high[-1]:.3g}",
            f"{e.bounds[0]:.3g} to {e.bounds[1]:.3g}",
        ]
        for e in exceedances(result)
    ]  # fmt: skip
    return ["limit", "share of rows", "95 % interval", "whatever failed rows are"], rows


def _open(result: Propagation) -> str:
    """What failed rows leave open of the first quantity."""
    header, rows = column_table(result)
    row = dict(zip(header, rows[0], strict=True))
    low, high = (np.format_float_positional(row[k], 4, fractional=False) for k in ("mean_least", "mean_most"))
    return (
        f"If every row without a result lay within what was seen, the mean of {row['column']} would be "
        "between"
        f" {low} and {high}, and 90 % of rows between {row['q5_least']:.4g} and {row['q95_most']:.4g} at "
        "the widest."
    )
