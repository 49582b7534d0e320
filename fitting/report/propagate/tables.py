"""Tables of a propagated study: outputs, indices, limits."""

import numpy as np

from fitting.propagate import Propagation

from ..cells import number
from ..table import Table
from .numbers import exceedances, index_table, shown_column

MOST_SHOWN = 12
"""Maximum number of rows for a quantity in the table of indices; the files have all."""


def quantity_table(result: Propagation) -> Table:
    """A short table with one row for each quantity, at the point of its largest spread."""
    moments = result.moments
    rows = []
    for quantity in result.problem.columns.quantities:
        k = shown_column(result, quantity.name)
        low, middle, high = result.quantiles([0.05, 0.5, 0.95])[:, k]
        numbers = (result.nominal[k], moments.mean[k], moments.sd[k], low, middle, high)
        rows.append([result.problem.columns.labels[k], *(number(x, ".4g") for x in numbers)])
    header = ["output", "nominal", "mean", "sd", "5 %", "50 %", "95 %"]
    return Table(header, rows, "Where each spreads most; columns.csv has all.")


def index_tables(result: Propagation) -> list[Table]:
    """The largest indices of every quantity, at the point of its largest spread."""
    if result.summary.indices is None:
        return []
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
                cells.append(f"{number(value, '.3f')} ± {number(high - value, '.3f')}")
                cells += [f"{number(least, '.2f')} to {number(most, '.2f')}"] if left_out else []
            rows.append([f"{key[1]} on {column}", *cells])
    header = [cell for kind in kinds for cell in (kind, *(("whatever failed",) if left_out else ()))]
    note = "95 % intervals of the bootstrap."
    if left_out:
        note += " Beside them: between what each index lies, whatever failed rows are."
    return [Table(["input or group", *header], rows, note)]


def limit_table(result: Propagation) -> Table:
    """Table of the failure probability of each limit, by counting."""
    rows = [
        [
            e.limit, f"{e.probability[-1]:.4g}", f"{e.low[-1]:.3g} to {e.high[-1]:.3g}",
            f"{e.bounds[0]:.3g} to {e.bounds[1]:.3g}",
        ]
        for e in exceedances(result)
    ]  # fmt: skip
    return Table(["limit", "share of rows", "95 % interval", "whatever failed rows are"], rows)
