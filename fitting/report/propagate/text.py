"""A propagated study as text: the verdict first, then tables."""

import textwrap

import numpy as np

from fitting.inference.progress import duration
from fitting.propagate import Propagation
from fitting.propagate.problem import Problem
from fitting.propagate.rare import RareResult
from fitting.propagate.responses import SENTENCES

from ..text_table import words_table
from .numbers import exceedances, index_table, lost, shown_column

WIDTH = 100
MOST_SHOWN = 12
"""Rows of a table of indices; the files have all."""
TELLING = 0.2
"""Distance of two distributions from which an input is named as one that tells failed rows apart: of 100
failed
rows, chance alone gives 0.14 at most in 95 % of cases (Kolmogorov-Smirnov)."""


def verdict(result: Propagation) -> list[str]:
    """The few sentences to read if nothing else is read."""
    problem, said = result.problem, []
    failures = result.summary.failures
    words = {"sobol": "Sobol points", "monte_carlo": "random draws", "latin_hypercube": "Latin hypercubes"}
    said.append(
        f"{problem.response.title}: {problem.rows:,} rows of {len(problem.inputs.names)} inputs, by "
        f"{words[problem.study.sampling.method]}."
    )
    said += [_quantity(result, quantity.name) for quantity in problem.columns.quantities[:4]]
    rest = len(problem.columns.quantities) - 4
    if rest > 0:
        said.append(f"{rest} more outputs are in the table.")
    for found in exceedances(result):
        said.append(
            f"{found.limit}: in {_percent(found.probability[-1])} of rows, "
            f"{_percent(found.low[-1])} to {_percent(found.high[-1])} (95 %)."
        )
    said += [sentence for rare in result.rare.values() for sentence in rare_sentences(rare)]
    if result.summary.indices is not None:
        said += _index_sentences(result)
    if failures.count:
        said += failure_sentences(result)
    return said


def _quantity(result: Propagation, name: str) -> str:
    k = shown_column(result, name)
    low, middle, high = result.quantiles([0.05, 0.5, 0.95])[:, k]
    nominal = result.nominal[k]
    beside = f", nominal {nominal:.4g}" if np.isfinite(nominal) else ""
    return f"{result.problem.columns.labels[k]}: {middle:.4g}, 90 % between {low:.4g} and {high:.4g}{beside}."


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _index_sentences(result: Propagation) -> list[str]:
    problem, sums = result.problem, result.summary.indices
    name = "total" if sums.kind == "sobol" else "shapley"
    value, half = sums.estimates()[name]
    labels, columns = problem.columns.labels, list(problem.index_columns)
    of = problem.columns.quantities[0].name if not problem.study.indices.of else problem.study.indices.of[0]
    shown = shown_column(result, of)
    j = columns.index(shown)
    order = [int(i) for i in np.argsort(-np.nan_to_num(value[:, j], nan=-1.0))[:3]]
    groups = list(problem.groups)
    words = "total Sobol index" if name == "total" else "Shapley effect"
    parts = ", ".join(f"{groups[i]} {value[i, j]:.2f} ± {half[i, j]:.2f}" for i in order)
    said = [f"What {labels[shown]} depends on most ({words}, 95 %): {parts}."]
    if sums.left_out:
        said.append(
            f"{_percent(sums.share_left_out)} of blocks have a row without a result and are left out whole; "
            "the table says between what each index lies, whatever these rows would have been."
        )
    return said


def failure_sentences(result: Propagation) -> list[str]:
    """How many rows have no result, why, where, and what that can have changed."""
    failures, problem = result.summary.failures, result.problem
    codes = [code for code in np.flatnonzero(failures.reasons) if code > 1]
    why = "; ".join(
        f"{failures.reasons[c]:,}: {SENTENCES.get(int(c), 'no result').rstrip('.')}" for c in codes
    )
    said = [f"{failures.count:,} rows ({_percent(lost(result))}) have no result ({why})."]
    far = failures.uneven
    names = problem.inputs.names
    k = int(np.argmax(far))
    if far[k] > TELLING:
        worst = int(np.argmax(failures.shares[k]))
        bins = failures.shares.shape[1]
        said.append(
            f"They differ from other rows most in {names[k]}: of its values between the "
            f"{100 * worst // bins} and {100 * (worst + 1) // bins} % quantile, "
            f"{_percent(failures.shares[k, worst])}"
            " have none."
        )
    else:
        said.append("No single input tells them apart from other rows.")
    return said


def rare_sentences(rare: RareResult) -> list[str]:
    """A small probability in words."""
    said = []
    if rare.subset is not None:
        low, high = rare.subset.interval
        stalled = rare.subset.stalled
        runs = len(rare.subset.each)
        note = (
            f" {stalled} of {runs} runs came no closer to the limit and counted what they had."
            if stalled
            else ""
        )
        said.append(
            f"{rare.limit}: probability {rare.subset.probability:.3g} by subset simulation, {low:.2g} to "
            f"{high:.2g}"
            f" (95 %).{note}"
        )
    if rare.form is not None:
        low, high = rare.form.interval
        points = len(rare.form.betas)
        what = f"{points} design point{'s' * (points != 1)}" if points else "no design point"
        by = "" if rare.form.by_form is None else f"; FORM alone {rare.form.by_form:.3g}"
        said.append(
            f"{rare.limit}: {rare.form.probability:.3g} by importance sampling ({what}), {low:.2g} to "
            f"{high:.2g}"
            f" (95 %){by}."
        )
    if rare.no_gradient:
        said.append(f"{rare.limit}: no FORM, because {rare.no_gradient}.")
    if rare.agree is False:
        said.append(f"{rare.limit}: the two DISAGREE; believe neither before a run with more samples.")
    spent = f"{rare.rows:,} rows were spent on {rare.limit}"
    lost_rows = (
        f", of which {rare.without_result:,} have no result and count as not failed"
        if rare.without_result
        else ""
    )
    return [*said, f"{spent}{lost_rows}."]


def quantity_rows(result: Propagation) -> tuple[list[str], list[list[str]]]:
    """A short table: one row for each quantity, at the point where it spreads most."""
    moments = result.moments
    rows = []
    for quantity in result.problem.columns.quantities:
        k = shown_column(result, quantity.name)
        low, middle, high = result.quantiles([0.05, 0.5, 0.95])[:, k]
        numbers = (result.nominal[k], moments.mean[k], moments.sd[k], low, middle, high)
        rows.append([result.problem.columns.labels[k], *(f"{x:.4g}" for x in numbers)])
    return ["output", "nominal", "mean", "sd", "5 %", "50 %", "95 %"], rows


def index_rows(result: Propagation) -> tuple[list[str], list[list[str]]]:
    """The largest indices of every quantity, at the point where it spreads most."""
    if result.summary.indices is None:
        return [], []
    wanted = result.problem.study.indices.of or [q.name for q in result.problem.columns.quantities]
    labels = result.problem.columns.labels
    shown = {labels[shown_column(result, name)] for name in wanted}
    found: dict[tuple[str, str], dict[str, list]] = {}
    for group, column, name, *numbers in index_table(result)[1]:
        if column in shown:
            found.setdefault((column, group), {})[name] = numbers
    kinds, left_out = list(next(iter(found.values()))), result.summary.indices.left_out
    order = sorted(found, key=lambda key: (key[0], -np.nan_to_num(found[key][kinds[-1]][0], nan=-1.0)))
    rows = []
    for column in sorted(shown):
        for key in [key for key in order if key[0] == column][:MOST_SHOWN]:
            cells = []
            for kind in kinds:
                value, low, high, least, most = found[key][kind]
                cells.append(f"{value:.3f} ± {high - value:.3f}")
                cells += [f"{least:.2f} to {most:.2f}"] if left_out else []
            rows.append([f"{key[1]} on {column}", *cells])
    header = [cell for kind in kinds for cell in (kind, *(("whatever failed",) if left_out else ()))]
    return ["input or group", *header], rows


def text_report(result: Propagation) -> str:
    """The whole result as plain text."""
    wrapped = [textwrap.fill(s, WIDTH, initial_indent="  ", subsequent_indent="  ") for s in verdict(result)]
    parts = [f"{result.problem.study.name}", "\n".join(["Verdict", *wrapped])]
    parts.append("Outputs\n" + words_table(*quantity_rows(result), 2))
    header, rows = index_rows(result)
    if rows:
        parts.append("Indices (95 % intervals)\n" + words_table(header, rows, 2))
    if result.computed:
        rate = result.computed / max(result.seconds, 1e-9)
        parts.append(
            f"{result.computed:,} rows computed in {duration(result.seconds)}, {rate:,.0f} a second with "
            "compiling"
        )
    return "\n\n".join(parts)


def plan_text(problem: Problem) -> str:
    """What a study would do."""
    lines = [
        f"{problem.study.name}: {problem.response.title}",
        f"  {problem.rows:,} rows in {len(problem.tasks):,} chunks, {problem.columns.total} columns",
        f"  on disk about {_bytes(problem)}",
        f"  {len(problem.inputs.names)} inputs:",
    ]
    rows = [[name, marginal.words] for name, marginal in problem.inputs.marginals.items()]
    if problem.inputs.draws is not None:
        draws = problem.inputs.draws
        rows.append(["posterior", f"{len(draws.table):,} joint draws of {', '.join(draws.names)}"])
    return "\n".join([*lines, words_table(["input", "distribution"], rows, 4)])


def _bytes(problem: Problem) -> str:
    rows = problem.rows * (8 * problem.columns.total + 1) if problem.study.sampling.keep == "outputs" else 0
    sums = len(problem.tasks) * 16_000 * problem.columns.total
    return f"{(rows + sums) / 1e6:,.0f} MB"
