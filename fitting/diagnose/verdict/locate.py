"""Place of the misfit of the base fit: its drivers, a range of the first one, and rows."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.data.recordings import schema
from pneusma_jax.model_discrepancy import unit_of
from pneusma_jax.units import amount, from_si

from ..evaluate.evaluation import row_count
from ..evaluate.program import Program
from ..fit.refit import Fit
from ..search.steps import Explanation
from ..settings import DEFAULT

DISCREPANCY = DEFAULT.discrepancy
LISTS = DEFAULT.lists
PLACE = DEFAULT.place

INTERNAL = ("gamma_", "ohms_", "taken", "slope_", "memory_", "renewal_")
"""Beginnings of the names of drivers that reports do not use."""


@dataclass(frozen=True)
class Place:
    """Place of the misfit.

    Attributes:
        drivers: strongest first.
        shares: share of the misfit's variance that a smooth function of each driver explains.
        regions: sentences.
        rows: recording, first and last row of the window with most misfit.
        like_time: driver that time goes with in every row, so that nothing tells them apart; empty if none.
    """

    drivers: list[str]
    shares: dict[str, float]
    regions: list[str]
    rows: tuple[str, int, int] | None
    like_time: str = ""

    def led_by(self, driver: str) -> "Place":
        """The same with another driver first."""
        ranked = [driver, *(d for d in self.drivers if d != driver)]
        return replace(self, drivers=ranked[: LISTS.told])


def locate(explanation: Explanation) -> Place:
    """Find the drivers, the region and the rows of the base model's misfit."""
    program, fit = explanation.program, explanation.base
    every = drivers_of(program, fit)
    alike = like_time(program, every)
    drivers = {name: x for name, x in every.items() if name != "time" or not alike}
    misfit, valid = misfit_of(program, fit)
    shares = {}
    for name, values in drivers.items():
        share = _explained(values[valid], misfit[valid])
        if share is not None:
            shares[name] = share
    ranked = sorted(shares, key=lambda name: -shares[name])[: LISTS.told]
    regions = [_region(program.kind, name, drivers[name][valid], misfit[valid]) for name in ranked[:1]]
    rows = _window(program, misfit, valid)
    if rows is not None and regions:
        where = next(r for r in program.recordings if r.name == rows[0])
        first, last = where.rows_of_whole(rows[1] - 1, rows[2] - 1)
        regions[0] += (
            f"; the stretch of one recording that holds most is {rows[0]} rows {first + 1}-{last + 1}"
        )
    return Place(ranked, shares, regions, rows, alike)


def knots_of(values: np.ndarray, count: int) -> np.ndarray | None:
    """Knots over a driver, at quantiles of it; None where it hardly varies.

    Knots keep a minimum distance. While a driver is held, it varies by its noise alone, and so does the
    prediction. A discrepancy with knots there would follow that noise.

    Args:
        values: values of the driver, finite, any shape.
        count: number of the quantiles.
    """
    low, high = np.quantile(values, [0.05, 0.95])
    apart, knots = DISCREPANCY.minimum_distance * (high - low) / count, []
    for knot in np.unique(np.quantile(values, np.linspace(0.0, 1.0, count))):
        if not knots or knot - knots[-1] > apart:
            knots.append(knot)
    return np.array(knots) if len(knots) >= 3 else None


def sized(kind: str, driver: str, value: float) -> str:
    """A value of a driver as text, in the unit of its column if it was recorded, else in SI.

    Args:
        kind: kind of the recordings.
        driver: name of the driver.
        value: its value, SI.
    """
    column = schema.column_of(kind, driver.removeprefix("max_"))
    if column is None:
        return amount(f"{value:.3g}", unit_of(driver) or "")
    unit = schema.quantity_and_unit(column)[1]
    return amount(f"{from_si(value, unit):.3g}", unit)


def hats_at(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Piecewise linear functions that are 1 at one knot and 0 at all others, at x, shape (knots, rows)."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))])


def drivers_of(program: Program, fit: Fit) -> dict[str, np.ndarray]:
    """Everything that rows differ in, by the names that reports use, (recordings, rows)."""
    count = len(program.recordings)
    found = {name: np.asarray(values)[:count] for name, values in fit.evaluation.drivers.items()}
    found = {n: v for n, v in found.items() if not n.startswith(INTERNAL)}
    found["time"] = np.asarray(program.stacked.time)[:count]
    for name, values in found.items():
        if name == "strain" and "max_strain" not in found:
            found = found | {"max_strain": np.maximum.accumulate(np.nan_to_num(values), axis=1)}
            break
    return found


def distinct_drivers(program: Program, fit: Fit) -> dict[str, np.ndarray]:
    """`drivers_of` without time where another driver says the same, as the strain of steady pulls does."""
    found = drivers_of(program, fit)
    return {name: x for name, x in found.items() if name != "time" or not like_time(program, found)}


def like_time(program: Program, drivers: dict[str, np.ndarray]) -> str:
    """Driver of which time is a function in fitted rows, to within two knots of a discrepancy; or nothing.

    A discrepancy over one of them is then one over the other. What drives the model is the likelier cause.
    """
    rows = np.asarray(program.stacked.mask)[: len(program.recordings)].astype(bool)
    rows &= program.fitted[:, None]
    time = drivers["time"][rows]
    recorded = program.recordings[0].has
    for name in sorted(drivers, key=lambda one: not recorded(one)):
        x = np.nan_to_num(drivers[name][rows])
        edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, DISCREPANCY.knots + 1)))
        if name == "time" or len(edges) <= DISCREPANCY.knots:
            continue
        place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, DISCREPANCY.knots - 1)
        spans = [np.ptp(time[place == bin]) for bin in np.unique(place)]  # some may be empty
        if max(spans) <= 2.0 * np.ptp(time) / DISCREPANCY.knots:
            return name
    return ""


def misfit_of(program: Program, fit: Fit, quantity: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Misfit of an output in standard deviations, (recordings, rows), and where it counts.

    Args:
        program: program of the campaign.
        fit: model.
        quantity: the output; by default the first one of each recording.
    """
    size = program.stacked.mask.shape[1]
    misfit = np.zeros((len(program.recordings), size))
    valid = np.zeros_like(misfit, bool)
    for k, channels in enumerate(program.channels):
        for j, channel in enumerate(channels):
            if channel.quantity != (channels[0].quantity if quantity is None else quantity):
                continue
            rows = slice(0, len(channel.measured))
            there = np.isfinite(channel.sigma) & np.isfinite(fit.evaluation.predicted[k][j])
            error = np.where(there, fit.evaluation.predicted[k][j] - channel.measured, 0.0)
            misfit[k, rows] = np.where(there, error / np.where(there, channel.sigma, 1.0), 0.0)
            valid[k, rows] = there
    return misfit, valid


def _explained(x: np.ndarray, y: np.ndarray) -> float | None:
    """Share of y's mean square that its mean over bins of x explains; None where x does not vary."""
    x = np.nan_to_num(x)
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, PLACE.bins + 1)))
    if len(edges) < 3:
        return None
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(place, minlength=len(edges) - 1)
    mean = np.bincount(place, y, minlength=len(edges) - 1) / np.maximum(count, 1)
    return float(np.sum(count * mean**2) / max(np.sum(y**2), 1e-12))


def _region(kind: str, name: str, x: np.ndarray, y: np.ndarray) -> str:
    """The half-range of a driver that holds most of the misfit for its size, in words."""
    x = np.nan_to_num(x)
    total, best = max(float(np.sum(y**2)), 1e-12), None
    for q in PLACE.quantiles:
        limit = float(np.quantile(x, q))
        for word, inside in (("<", x < limit), (">", x > limit)):
            if inside.any():
                share, size = float(np.sum(y[inside] ** 2)) / total, float(np.mean(inside))
                lead = share - size
                if best is None or lead > best[0]:
                    best = (lead, word, limit, share)
    if best is None:
        return f"all of {name}"
    return f"{name} {best[1]} {sized(kind, name, best[2])} ({100.0 * best[3]:.0f} % of the misfit)"


def _window(program: Program, misfit: np.ndarray, valid: np.ndarray) -> tuple[str, int, int] | None:
    best = None
    for k, recording in enumerate(program.recordings):
        count = row_count(program.stacked, k)
        width = max(4, int(PLACE.window_part * count))
        squares = np.cumsum(np.concatenate([[0.0], np.where(valid[k], misfit[k] ** 2, 0.0)]))
        if count < width:
            continue
        sums = squares[width : count + 1] - squares[: count + 1 - width]
        first = int(np.argmax(sums))
        if best is None or sums[first] > best[0]:
            best = (sums[first], recording.name, first + 1, first + width)
    return None if best is None else best[1:]
