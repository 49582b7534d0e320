"""Figures of a propagated study: bands, distributions, tornado, failure over the driver, failed rows."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from fitting.data.files import distinct_names
from fitting.propagate import Propagation
from fitting.propagate.statistics.failures import BINS

from ..figures import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    axis_label,
    legend_above,
    literal,
    only_first,
    style,
    unit_of,
)
from ..report import Picture
from .numbers import exceedances, shown_column, too_few

FAILED_ROWS = (
    "Where in the inputs rows have no result; level lines are inputs that do not matter for it."
)
ALONG = (
    "Bands are 95 % intervals, cut at the frame where they leave 0 to 1, as no true share does; the course is"
    " dotted where its interval holds 0."
)
MOST_BANDS = 6
MOST_COURSES = 6
"""Maximum number of inputs or groups whose indices are drawn along the driver, a panel each."""
MOST_UNEVEN = 4
"""Maximum number of inputs in the figure of rows without a result."""
MOST_BARS = 15
"""Maximum number of bars of a tornado diagram; the smallest of more are zero on any scale."""


def pictures(result: Propagation) -> list[Picture]:
    """Every figure, not drawn yet."""
    found, columns = [], result.problem.columns
    first = only_first(MOST_BANDS, len(columns.quantities), "outputs")
    for quantity in columns.quantities[:MOST_BANDS]:
        name = quantity.name
        if columns.along(name):
            caption = f"{name}: median, central 68 and 90 % of rows, and the model at nominal values.{first}"
            found.append(Picture(f"band_{_file(name)}", caption, partial(band, result, name)))
        else:
            caption = f"{name}: distribution over rows (0.2 to 99.8 %).{first}"
            found.append(Picture(f"distribution_{_file(name)}", caption, partial(distribution, result, name)))
    if result.summary.indices is not None:
        found += _of_indices(result)
    for limit in exceedances(result):
        if len(limit.probability) > 1:
            caption = f"Share of rows in which {limit.limit} held at this point or before."
            found.append(Picture(f"failure_{_file(limit.limit)}", caption, partial(failure, result, limit)))
    if result.summary.failures.count and not too_few(result):
        uneven = _largest(MOST_UNEVEN, len(result.problem.inputs.names), "inputs", "most uneven")
        found.append(Picture("failed_rows", FAILED_ROWS + uneven, partial(failed_rows, result)))
    return _named_apart(found)


def _largest(most: int, count: int, things: str, which: str = "largest") -> str:
    """End of the caption of a figure that draws the largest of `count` things; empty if it draws all."""
    return f" The {most} {which} of {count} {things} are drawn." if count > most else ""


def _of_indices(result: Propagation) -> list[Picture]:
    columns, found = result.problem.columns, []
    names = result.problem.study.indices.of or [q.name for q in columns.quantities]
    first = only_first(MOST_BANDS, len(names), "outputs")
    for name in names[:MOST_BANDS]:
        label = columns.labels[shown_column(result, name)]
        largest = _largest(MOST_BARS, len(result.problem.groups), "inputs or groups")
        said = f"What the variance of {label} comes from, with 95 % intervals of the bootstrap."
        caption = said + largest + first
        found.append(Picture(f"tornado_{_file(name)}", caption, partial(tornado, result, name)))
        if columns.along(name):
            largest = _largest(MOST_COURSES, len(result.problem.groups), "inputs or groups")
            caption = f"What {name} depends on, along the driver. {ALONG}{largest}"
            found.append(Picture(f"indices_{_file(name)}", caption, partial(indices_along, result, name)))
    return found


def _named_apart(pictures: list[Picture]) -> list[Picture]:
    """Pictures whose files do not replace each other: `x+y` and `x-y` give one name of a file."""
    names = distinct_names([picture.name for picture in pictures])
    return [Picture(name, one.caption, one.draw) for name, one in zip(names, pictures, strict=True)]


def _file(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name).strip("_")


def unit_in_brackets(result: Propagation, name: str) -> str:
    """Unit of a quantity whose name has none, in brackets; empty for a plain number."""
    (quantity,) = (q for q in result.problem.columns.quantities if q.name == name)
    return quantity.shown.removeprefix(name).strip()


def _axis(result: Propagation, name: str) -> str:
    """Words and unit of a quantity for an axis."""
    return f"{axis_label(name)} {unit_in_brackets(result, name)}".strip()


def band(result: Propagation, name: str) -> Figure:
    """Figure of quantiles along the driver, with the nominal result."""
    columns = result.problem.columns
    part, driver = columns.of(name), columns.driver
    low, lower, middle, upper, high = result.quantiles([0.05, 0.16, 0.5, 0.84, 0.95])[:, part]
    with style():
        figure = Figure(figsize=(6.8, 4.4), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(driver.values, low, high, color=SKY, alpha=0.35, linewidth=0, label="5 to 95 %")
        axes.fill_between(driver.values, lower, upper, color=SKY, alpha=0.8, linewidth=0, label="16 to 84 %")
        axes.plot(driver.values, middle, color=BLUE, label="median")
        nominal = result.nominal[part]
        if np.all(np.isfinite(nominal)):
            axes.plot(driver.values, nominal, color=BLACK, linestyle="--", linewidth=1.2, label="nominal")
        for limit in result.problem.study.limits:
            if limit.on == name:
                for value in (limit.below, limit.above):
                    if np.isfinite(value):
                        axes.axhline(value, color=VERMILION, linewidth=1.2, label="limit")
        axes.set(xlabel=axis_label(driver.name), ylabel=_axis(result, name), xlim=driver.values[[0, -1]])
        legend_above(axes, 5)
    return figure


def distribution(result: Propagation, name: str) -> Figure:
    """Figure of the density of a single number, from its quantiles."""
    k = result.problem.columns.of(name).start
    levels = np.linspace(0.002, 0.998, 61)
    edges = result.quantiles(levels)[:, k]
    with style():
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        axes = figure.subplots()
        if np.ptp(edges) > 1e-12 * np.abs(edges).max():  # more than rounding
            grid = np.linspace(edges[0], edges[-1], 41)
            share = np.diff(np.interp(grid, edges, levels))
            axes.stairs(share / np.diff(grid), grid, fill=True, color=SKY, alpha=0.8, label="rows")
        low, middle, high = result.quantiles([0.05, 0.5, 0.95])[:, k]
        axes.axvline(middle, color=BLUE, label="median")
        for edge in (low, high):
            axes.axvline(edge, color=BLUE, linestyle=":", label="5 and 95 %" if edge is low else None)
        if np.isfinite(result.nominal[k]):
            axes.axvline(result.nominal[k], color=BLACK, linestyle="--", linewidth=1.2, label="nominal")
        unit = unit_of(name) or unit_in_brackets(result, name) or "unit"
        axes.set(xlabel=_axis(result, name), ylabel=f"probability density per {unit}")
        axes.set_ylim(bottom=0.0)
        legend_above(axes, 4)
    return figure


def tornado(result: Propagation, name: str) -> Figure:
    """Figure of a quantity's indices with intervals, the largest on top."""
    problem, sums = result.problem, result.summary.indices
    column = shown_column(result, name)
    j = list(problem.index_columns).index(column)
    found = {kind: (value[:, j], half[:, j]) for kind, (value, half) in sums.estimates().items()}
    groups = np.asarray([literal(group) for group in problem.groups])
    last = list(found)[-1]
    order = np.argsort(np.nan_to_num(found[last][0], nan=-1.0))[-MOST_BARS:]
    places = np.arange(len(order))
    words = {"first": "first order", "total": "total", "shapley": "Shapley effect"}
    with style():
        figure = Figure(figsize=(6.8, 1.3 + 0.32 * len(order)), layout="constrained")
        axes = figure.subplots()
        width = 0.8 / len(found)
        for k, (kind, (value, half)) in enumerate(reversed(found.items())):
            colour = (BLUE, ORANGE)[k]
            axes.barh(
                places + (len(found) - 1 - 2 * k) * width / 2, value[order], 0.9 * width, xerr=half[order],
                color=colour, label=words[kind], error_kw={"elinewidth": 1.0, "ecolor": BLACK},
            )  # fmt: skip
        axes.set_yticks(places, groups[order])
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        axes.set(xlabel="share of the variance [1]", ylabel="input or group")
        axes.grid(False, axis="y")
        legend_above(axes)
    return figure


def indices_along(result: Propagation, name: str) -> Figure:
    """Figure of total indices or Shapley effects along the driver, a panel for each important group.

    Intervals of few rows are wide, so each has a panel of its own. Shares lie between 0 and 1, and so does
    the frame: an interval that leaves it says nothing more. A course is dotted where its interval holds 0.
    """
    problem, sums = result.problem, result.summary.indices
    part, driver = problem.columns.of(name), problem.columns.driver
    first = list(problem.index_columns).index(part.start)
    kind = "total" if sums.kind == "sobol" else "shapley"
    value, half = (x[:, first : first + len(driver.values)] for x in sums.estimates()[kind])
    groups = [literal(group) for group in problem.groups]
    order = np.argsort(-np.nan_to_num(value, nan=0.0).max(axis=1))[:MOST_COURSES]
    top = np.nanmax(np.nan_to_num(value + half, nan=0.0)[order])
    top = float(np.clip(top, np.nanmax([*value[order].flat, 0.01]), 1.0))
    columns = 2 if len(order) == 4 else min(3, len(order))
    rows = -(-len(order) // columns)
    with style():
        figure = Figure(figsize=(6.8, 1.0 + 1.9 * rows), layout="constrained")
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes, k in zip(panels.flat, order, strict=False):
            low, high = value[k] - half[k], value[k] + half[k]
            axes.fill_between(driver.values, low, high, color=SKY, alpha=0.4, linewidth=0)
            told = np.where(low > 0.0, value[k], np.nan)
            axes.plot(driver.values, value[k], color=BLUE, linestyle=":", linewidth=1.4)
            axes.plot(driver.values, told, color=BLUE)
            axes.set_title(groups[k], fontsize=9)
            axes.set(xlim=driver.values[[0, -1]], ylim=(0.0, 1.04 * top))
        for axes in panels.flat[len(order) :]:
            axes.axis("off")
        for k in range(columns):  # below the lowest panel that is drawn in each column
            lowest = panels[(len(order) - 1 - k) // columns, k]
            lowest.tick_params(labelbottom=True)
            lowest.set_xlabel(axis_label(driver.name), fontsize=9)
        figure.supylabel("total Sobol index [1]" if kind == "total" else "Shapley effect [1]", fontsize=10)
    return figure


def failure(result: Propagation, found: object) -> Figure:
    """Figure of the probability of a failure up to each point of the driver."""
    driver = result.problem.columns.driver
    with style():
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(
            driver.values, found.low, found.high, color=SKY, alpha=0.6, linewidth=0, label="95 %"
        )
        axes.plot(driver.values, found.probability, color=BLUE, label="rows that have failed")
        axes.set(xlabel=axis_label(driver.name), ylabel="probability of failure so far [1]",
                 xlim=driver.values[[0, -1]])  # fmt: skip
        axes.set_ylim(bottom=0.0)
        legend_above(axes)
    return figure


def failed_rows(result: Propagation) -> Figure:
    """Figure of the share of failed rows over the quantile of the most telling inputs."""
    failures, names = result.summary.failures, result.problem.inputs.names
    order = np.argsort(-failures.uneven)[:MOST_UNEVEN]
    middle = 100.0 * (np.arange(BINS) + 0.5) / BINS
    with style():
        figure = Figure(figsize=(6.8, 4.2), layout="constrained")
        axes = figure.subplots()
        for k, colour in zip(order, (VERMILION, ORANGE, BLUE, SKY), strict=False):
            axes.plot(
                middle, 100.0 * failures.shares[k], color=colour, marker="o", markersize=3, label=names[k]
            )
        axes.axhline(100.0 * failures.share, color=GREY, linestyle="--", linewidth=1.2, label="all rows")
        axes.set(xlabel="quantile of the input [%]", ylabel="rows without a result [%]", xlim=(0.0, 100.0))
        axes.set_ylim(bottom=0.0)
        legend_above(axes, 3)
    return figure
