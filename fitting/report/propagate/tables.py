"""Tables of a propagated study: outputs, indices, limits."""

import numpy as np

from fitting.propagate import Propagation
from fitting.propagate.problem import Problem

from ..cells import digits_apart, number, told_apart, with_half_width
from ..table import Table
from .numbers import exceedances, index_table, input_rows, lost, shown_column

ROW = "A row is the model computed once, with one set of values of all inputs."
"""Sentence on the word for a sample of a study."""
IF_ALL = "if every row had a result"
"""Heading of bounds that hold whatever the result of failed rows would be."""
MOST_SHOWN = 12
"""Maximum number of rows for a quantity in the table of indices; the files have all."""


def quantity_table(result: Propagation) -> Table:
    """A short table with one row for each quantity, at the point of its largest spread."""
    moments = result.moments
    rows = []
    for quantity in result.problem.columns.quantities:
        k = shown_column(result, quantity.name)
        low, middle, high = result.quantiles([0.05, 0.5, 0.95])[:, k]
        form = f".{digits_apart(low, high)}g"
        before = number(result.nominal[k], form), number(moments.mean[k], form), number(moments.sd[k], ".4g")
        cells = *before, *(number(x, form) for x in (low, middle, high))
        rows.append([result.problem.columns.shown[k], *cells])
    header = ["output", "nominal", "mean", "sd", "5 %", "50 %", "95 %"]
    note = f"Each output where it spreads most; columns.csv has all. {ROW}"
    return Table(header, rows, note)


def input_table(problem: Problem) -> Table:
    """Every input with its unit, its distribution and three of its quantiles."""
    told = [[*row[:3], *map(number, row[3:])] for row in input_rows(problem)]
    return Table(["input", "unit", "distribution", "5 %", "50 %", "95 %"], told)


def index_tables(result: Propagation) -> list[Table]:
    """The largest indices of every quantity, at the point of its largest spread.

    The note says how many there are, if the table has not all.
    """
    if result.summary.indices is None:
        return []
    wanted = result.problem.study.indices.of or [q.name for q in result.problem.columns.quantities]
    labels = result.problem.columns.labels
    named = dict(zip(labels, result.problem.columns.shown, strict=True))
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
                cells.append(with_half_width(value, high - value, 3))
                cells += [f"{number(least, '.2f')} to {number(most, '.2f')}"] if left_out else []
            rows.append([f"{key[1]} on {named[column]}", *cells])
    header = [cell for kind in kinds for cell in (kind, *((IF_ALL,) if left_out else ()))]
    note = "95 % intervals of the bootstrap."
    groups = len(result.problem.groups)
    if groups > MOST_SHOWN:
        note += f" For each output, the {MOST_SHOWN} largest of {groups}; indices.csv has all."
    if left_out:
        note += " Beside them: bounds of each index, if rows without a result had any result that was seen."
    return [Table(["input or group", *header], rows, note)]


def limit_table(result: Propagation) -> Table:
    """Table of the failure probability of each limit, by counting."""
    rows = [
        [
            result.problem.columns.limit(e.limit), f"{e.probability[-1]:.4g}",
            " to ".join(told_apart(e.low[-1], e.high[-1], least=3)),
            " to ".join(told_apart(*e.bounds, least=3)) if lost(result) else "every row has one",
        ]
        for e in exceedances(result)
    ]  # fmt: skip
    return Table(["limit", "share of rows", "95 % interval", f"{IF_ALL} (bounds)"], rows)
