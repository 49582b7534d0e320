"""Quantities that a study asks of the model: outputs, functions of them, limits; as columns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.notes import joined
from fitting.inference.parameters.ties import RESERVED, evaluate, names_in
from pneusma_jax.actuator.result import solved
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import UNITS, amount, written

from .responses import Driver, Response, status_of_output
from .responses.expression import as_expression
from .responses.touching import TOUCHING

REDUCTIONS = ("largest", "smallest", "mean", "first", "last")
"""Functions that make one number of a quantity along the driver."""


@dataclass(frozen=True)
class Quantity:
    """One thing that is asked.

    Attributes:
        name: name for tables and figures; as an output, it ends in its unit.
        expression: expression in the model's outputs; the name of a single output is one, too.
        reduce: one of `REDUCTIONS`, or the value of the driver `at` which it is taken; None keeps the driver.
        noise: 1-sigma of a measurement of it, in its unit; 0 for the quantity itself.
        unit: its unit, where the study states or `check_quantities` finds one; empty for none. No row depends
            on it, so that it is in no fingerprint.
    """

    name: str
    expression: str
    reduce: str | float | None = None
    noise: float = 0.0
    unit: str = field(default="", repr=False)

    @property
    def shown(self) -> str:
        """Its name, with its unit where the name has none: `tip_angle [deg]`."""
        bare = self.unit in ("", "1") or unit_in_name(self.name)
        return self.name if bare else f"{self.name} [{written(self.unit)}]"


@dataclass(frozen=True)
class Limit:
    """Limit beyond which a quantity fails.

    Attributes:
        on: name of the quantity.
        above, below: it fails beyond these, in its unit; infinite where there is no such limit.
    """

    on: str
    above: float = np.inf
    below: float = -np.inf

    @property
    def words(self) -> str:
        """The limit, for people; all digits of its numbers, so that other limits read otherwise."""
        parts = [f"below {_digits(self.below)}"] if np.isfinite(self.below) else []
        parts += [f"above {_digits(self.above)}"] if np.isfinite(self.above) else []
        return f"{self.on} {' or '.join(parts)}"


def _digits(value: float) -> str:
    """A number in six digits where these are all of it; else in all of its digits."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


@dataclass(frozen=True)
class Columns:
    """Quantities as columns of one table.

    Attributes:
        quantities: the quantities, in their order.
        counts: columns of each.
        driver: or None.
    """

    quantities: tuple[Quantity, ...]
    counts: tuple[int, ...]
    driver: Driver | None

    @property
    def total(self) -> int:
        """Number of columns."""
        return sum(self.counts)

    def of(self, name: str) -> slice:
        """Columns of a quantity."""
        k = [q.name for q in self.quantities].index(name)
        return slice(sum(self.counts[:k]), sum(self.counts[: k + 1]))

    def along(self, name: str) -> bool:
        """True if a quantity is given along the driver."""
        part = self.of(name)
        return part.stop - part.start > 1

    @property
    def noise(self) -> np.ndarray:
        """1-sigma of each column's measurement, shape (columns,)."""
        return np.repeat([q.noise for q in self.quantities], self.counts)

    @property
    def labels(self) -> list[str]:
        """One for each column: the quantity, and the driver's value where there is one."""
        return self._each([quantity.name for quantity in self.quantities])

    @property
    def shown(self) -> list[str]:
        """The same for people: every quantity with its unit."""
        return self._each([quantity.shown for quantity in self.quantities])

    @property
    def units(self) -> list[str]:
        """Unit of each column; empty where none is known."""
        return [q.unit for q, count in zip(self.quantities, self.counts, strict=True) for _ in range(count)]

    def limit(self, words: str) -> str:
        """A limit in its words, with the unit of its numbers where the name of its quantity has none."""
        on = max((q for q in self.quantities if words.startswith(f"{q.name} ")), key=lambda q: len(q.name))
        return words if on.shown == on.name else amount(words, on.unit)

    def _each(self, names: Sequence[str]) -> list[str]:
        found = []
        for name, count in zip(names, self.counts, strict=True):
            points = self.driver.values if count > 1 else ()
            found += [f"{name} at {self.driver.name} = {x:g}" for x in points] or [name]
        return found


def check_quantities(
    asked: Sequence[Quantity], limits: Sequence[Limit], response: Response, where: str
) -> Columns:
    """Columns of what is asked, all outputs of the model where nothing is.

    Raises:
        InputError: for an expression that cannot be read, a driver that is not there, a limit on nothing.
    """
    asked = tuple(asked) or tuple(Quantity(name, name) for name in response.outputs)
    names = [quantity.name for quantity in asked]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{where}: two outputs are called {name!r}; give one another name")
    counts = []
    for quantity in asked:
        at = f"{where} [[output]] {quantity.name!r}"
        try:
            used = names_in(quantity.expression, quantity.name)
            evaluate([("_", quantity.expression)], dict.fromkeys(used, np.float64(1.0)))
        except InputError as error:
            raise InputError(f"{where} [[output]]: {as_expression(error)}") from None
        for name in sorted(used - set(response.outputs)):
            raise InputError(f"{at}: the model has no output {name!r}, {nearest(name, response.outputs)}")
        if not used:
            raise InputError(f"{at}: {quantity.expression!r} names no output of the model")
        if quantity.name in RESERVED:
            raise InputError(f"{at}: this is the name of a function; choose another")
        along = any(response.outputs[name] for name in used)
        if quantity.reduce is not None and not along:
            raise InputError(f"{at}: there is no driver to reduce over; leave out reduce and at")
        if isinstance(quantity.reduce, float):
            _check_place(quantity.reduce, response.driver, at)
        counts.append(len(response.driver.values) if along and quantity.reduce is None else 1)
    for limit in limits:
        if limit.on not in names:
            raise InputError(
                f"{where} [[limit]]: no output is called {limit.on!r}, {nearest(limit.on, names)}"
            )
    outputs = {name: unit_in_name(name) or "1" for name in response.outputs} if response.with_units else {}
    asked = tuple(replace(q, unit=_unit_of(q, outputs, f"{where} [[output]] {q.name!r}")) for q in asked)
    return Columns(asked, tuple(counts), response.driver)


def unit_in_name(name: str) -> str:
    """Unit in which a name ends, as `curvature_1pm` does; empty for `tip_angle` and `xi0_2`."""
    stem, _, unit = name.rpartition("_")
    return unit if stem and unit in UNITS and not unit.isdigit() else ""


def _unit_of(quantity: Quantity, outputs: Mapping[str, str], where: str) -> str:
    """Unit of a quantity: stated, in its name, or that of the one output of the model that it is.

    Args:
        quantity: the quantity.
        outputs: unit of each output of the model; empty for a model whose numbers have none.
        where: file and table, for messages.

    Raises:
        InputError: if two of these differ, and not only in their spelling, as `1/m` and `1pm` do.
    """
    ways = {
        "unit": quantity.unit, "its name": unit_in_name(quantity.name),
        f"the output {quantity.expression}": outputs.get(quantity.expression, ""),
    }  # fmt: skip
    found = {way: unit for way, unit in ways.items() if unit}
    if len({UNITS[unit] for unit in found.values()}) > 1:
        said = joined([f"{unit!r} by {way}" for way, unit in found.items()])
        raise InputError(f"{where}: its unit is {said}; an output is told in the model's own unit, so change "
                         "one, or convert it in 'of'")  # fmt: skip
    return next(iter(found.values()), "")


def without_unit(columns: Columns) -> list[str]:
    """A sentence on quantities whose unit nobody states; none where all are known."""
    bare = [q.name for q in columns.quantities if not q.unit]
    if not bare:
        return []
    has = "has no unit" if len(bare) == 1 else "have no units"
    return [f"{joined(bare)} {has}: state unit in [[output]], or let the name end in one (tip_deg)"]


def _check_place(place: float, driver: Driver, where: str) -> None:
    low, high = driver.values[0], driver.values[-1]
    if not min(low, high) <= place <= max(low, high):
        raise InputError(f"{where}: at = {place:g} lies outside of {driver.name}, {low:g} to {high:g}")


def row_function(response: Response, columns: Columns, names: tuple[str, ...]):
    """One row of the study as a pure function: values [SI] of the named numbers to columns, status and angle.

    The angle is the largest [deg] of a body that may touch itself in the row, and 0 of any other.

    A row without a result, or with a column that is not finite, is NaN in all columns. Its status tells the
    first output that is not finite.
    """
    lines = [(f"_{k}", q.expression) for k, q in enumerate(columns.quantities)]

    def row(x: Array) -> tuple[Array, Array, Array]:
        outputs, status = response.answer(dict(zip(names, x, strict=True)))
        found = evaluate(lines, outputs, jnp)
        parts = []
        for (key, _), quantity, count in zip(lines, columns.quantities, columns.counts, strict=True):
            value = jnp.asarray(found[key], float)
            if quantity.reduce is not None:
                value = _reduced(value, quantity.reduce, columns.driver)
            parts.append(jnp.broadcast_to(value, (count,)))
        whole = jnp.concatenate(parts)
        each = jnp.stack([jnp.all(jnp.isfinite(part)) for part in parts])
        status = jnp.where(~jnp.all(each) & solved(status), status_of_output(jnp.argmin(each)), status)
        touching = jnp.where(solved(status), jnp.max(outputs.get(TOUCHING, jnp.zeros(()))), 0.0)
        return jnp.where(solved(status), whole, jnp.nan), status.astype(jnp.uint8), touching

    return row


def _reduced(value: Array, how: str | float, driver: Driver) -> Array:
    if isinstance(how, float):
        return jnp.interp(how, jnp.asarray(driver.values), value)
    return {
        "largest": jnp.max, "smallest": jnp.min, "mean": jnp.mean, "first": lambda x: x[0],
        "last": lambda x: x[-1],
    }[how](value)  # fmt: skip


def exceeded(y: np.ndarray, limits: Sequence[Limit], columns: Columns) -> dict[str, np.ndarray]:
    """True for rows that have failed, for each limit up to each point of its quantity, shape (rows,
    points)."""
    found = {}
    for limit in limits:
        part = y[:, columns.of(limit.on)]
        with np.errstate(invalid="ignore"):
            beyond = (part > limit.above) | (part < limit.below)
        found[limit.words] = np.logical_or.accumulate(beyond, axis=1)
    return found


def margin(y: Mapping[str, Array] | Array, limit: Limit, columns: Columns) -> Array:
    """Distance to a limit in the quantity's unit, negative beyond it; of a band that of its worst point.

    Args:
        y: columns of rows, shape (rows, columns).
        limit: limit of one quantity.
        columns: columns of the study.
    """
    part = y[:, columns.of(limit.on)]
    sides = []
    if np.isfinite(limit.above):
        sides.append(limit.above - part)
    if np.isfinite(limit.below):
        sides.append(part - limit.below)
    return jnp.min(jnp.concatenate(sides, axis=1), axis=1)
