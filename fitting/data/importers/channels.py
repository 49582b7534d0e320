"""Assignment of named raw columns to the quantities of a recording, in their units."""

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pneusma_jax.errors import InputError
from pneusma_jax.units import UNITS, find_unit, suggested_unit

from ..recordings import schema
from ..recordings.columns import convert
from ..recordings.table import unusable
from .clock_columns import refuse_several_clocks
from .grid import Grid
from .making import Channel, Making
from .options import Options
from .other_headings import columns_by_word
from .parts import Sample
from .spelling import WEIGHTS, Heading, dimension, may_be_unit, pressure_zero, same_unit, unit_name
from .words import meaning

# Quantities from which the strain or the stress of a coupon or wire can be derived, itself first.
FAMILIES = (("strain", "stretch", "true_strain", "elongation"), ("stress", "true_stress", "force"))


class UnitMissing(InputError):
    """A required column whose unit is not stated."""


def units_missing(making: Making) -> InputError:
    """One error for all columns without a unit, so that they need not be stated one by one."""
    names = {schema.quantity_and_unit(name)[0] for name in schema.KINDS[making.kind].columns.known}
    plain = {"strain", "stretch", "true_strain", "cycle"}
    bare = [
        quantity
        for quantity, channel in making.channels.items()
        if channel.unit is None and quantity not in plain and (quantity in names | {"force", "elongation"})
    ]
    labels = ", ".join(repr(making.channels[quantity].label) for quantity in bare)
    subject = f"the unit of {labels} is" if len(bare) == 1 else f"the units of {labels} are"
    options = " ".join(f"--unit {quantity}=..." for quantity in bare)
    return unusable(
        making.place,
        f"{subject} not stated in the file; state {'it' if len(bare) == 1 else 'them'} with {options}",
    )


def named_channels(grid: Grid) -> dict[str, Channel]:
    """Quantities that the headings of a grid name. Of several headings for one, the first in `WORDS` wins.

    A heading that is in no list counts where one of its words names a quantity that no other column has.
    """
    found: dict[str, tuple[tuple[bool, int, int], Channel]] = {}
    for column, heading in enumerate(grid.headings):
        means = meaning(heading)
        empty = bool(np.isnan(grid.values[:, column]).all())
        if means is None or (empty and column not in grid.troubles):
            continue
        order = (empty, means.rank, column)
        if means.quantity not in found or order < found[means.quantity][0]:
            found[means.quantity] = (order, _channel(grid, column))
    channels = {quantity: channel for quantity, (_, channel) in found.items()}
    for quantity, column in columns_by_word(grid.headings, channels).items():
        if np.isfinite(grid.values[:, column]).any() or column in grid.troubles:
            channels[quantity] = _channel(grid, column)
    channels = _of_one_spring(channels)
    clock = None if "time" in channels else _clock(grid)
    return channels if clock is None else {"time": _channel(grid, clock), **channels}


def _of_one_spring(channels: dict[str, Channel]) -> dict[str, Channel]:
    """Channels of a spring on a stand without its number: a spring that is pulled alone is called 1, too."""
    if "force" not in channels:
        return channels
    renamed = {}
    for quantity in ("resistance", "current", "voltage"):
        numbered = [name for name in channels if re.fullmatch(rf"{quantity}_[0-9]", name)]
        if len(numbered) == 1 and quantity not in channels:
            renamed[numbered[0]] = quantity
    return {renamed.get(name, name): channel for name, channel in channels.items()}


def _clock(grid: Grid) -> int | None:
    """The one column that is in a unit of time, whatever its heading says, and rises from row to row.

    Without headings it is the one column that was read from dates or times of day.
    """
    if not grid.headings:
        return next(iter(grid.clocks)) if len(grid.clocks) == 1 else None
    columns = [k for k, heading in enumerate(grid.headings) if dimension(heading.unit) == "time"]
    if len(columns) != 1 or meaning(grid.headings[columns[0]]) is not None:
        return None
    values = grid.values[:, columns[0]]
    return columns[0] if len(values) > 1 and np.all(np.diff(values) > 0.0) else None


def _channel(grid: Grid, column: int) -> Channel:
    heading = grid.headings[column] if grid.headings else None
    read_as = "s" if column in grid.clocks else None
    return Channel(
        values=grid.values[:, column],
        unit=heading.unit if heading else read_as,
        label=heading.text if heading and heading.text else f"column {column + 1}",
        zero=heading.zero if heading else "",
        trouble=grid.troubles.get(column, ""),
        two_units=grid.contradictions.get(column, ()),
        by_row=column in grid.by_row,
        column=column,
    )


def channels_of(sample: Sample, options: Options, notices: list[str]) -> dict[str, Channel]:
    """Quantities that the headings or the user name; the user's names win.

    A strain or stress that the user names in any form replaces the one that headings name.

    Raises:
        InputError: if a named column is not there (the ones that exist are listed), or if the table has
            clocks that run differently.
    """
    grid = sample.require_grid()
    mapped = mapped_channels(sample, options)
    notices += refuse_several_clocks(sample, {q: c.column for q, c in mapped.items()})
    mapped_columns = {channel.column for channel in mapped.values()}
    recognised = {q: c for q, c in named_channels(grid).items() if c.column not in mapped_columns}
    if options.interval_s is not None and not grid.headings:
        recognised.pop("time", None)  # `columns_aside` names it
    for family in FAMILIES:
        if any(quantity in mapped for quantity in family):
            aside = [q for q in family if q in recognised and q not in mapped]
            # A further column of the same quantity is kept for comparison, but does not come first.
            first = min(family.index(q) for q in family if q in mapped)
            for quantity in (q for q in aside if family.index(q) < first):
                notices.append(f"{recognised[quantity].label!r} set aside for what --map names")
                del recognised[quantity]
    found = {**recognised, **mapped}
    for quantity, channel in recognised.items():
        if quantity != "time" and meaning(grid.headings[channel.column]) is None:
            notices.append(
                f"check: {channel.label!r} taken as {quantity} by one of its words (--map {quantity}=... to"
                " correct)"
            )
    for quantity in (q for q in options.units if q in found and found[q].by_row):
        raise unusable(
            sample.raw.path, f"--unit {quantity}: the file states the unit of {found[quantity].label!r} row"
            " by row; leave the option out",
        )  # fmt: skip
    return found


def mapped_channels(sample: Sample, options: Options) -> dict[str, Channel]:
    """Quantities that the user named with `--map`, by heading or by column number from 1.

    Raises:
        InputError: if there is no such column; the ones that exist are listed.
    """
    grid = sample.require_grid()
    texts = [heading.text for heading in grid.headings]
    found = {}
    for quantity, wanted in options.columns.items():
        column = _column(grid, wanted)
        if column is None:
            listed = (
                ", ".join(repr(text) for text in texts) if texts else f"numbers 1 to {grid.values.shape[1]}"
            )
            raise unusable(
                sample.raw.path, f"--map {quantity}={wanted}: there is no such column; there are {listed}"
            )
        found[quantity] = _channel(grid, column)
    return found


def has_column(grid: Grid, wanted: str) -> bool:
    """True if a table has the column that `--map` names, by heading or number."""
    return _column(grid, wanted) is not None


def _column(grid: Grid, wanted: str) -> int | None:
    for match in (
        lambda heading: heading.text == wanted,
        lambda heading: heading.text.casefold() == wanted.casefold(),
        lambda heading: heading.name == wanted.casefold(),
    ):
        hits = [i for i, heading in enumerate(grid.headings) if match(heading)]
        if hits:
            return hits[0]
    if wanted.isdecimal() and 1 <= int(wanted) <= grid.values.shape[1]:
        return int(wanted) - 1
    return None


def numbered(grid: Grid, quantities: Iterable[str]) -> dict[str, Channel]:
    """Quantities of the columns of a file without header, in order."""
    return {q: replace(_channel(grid, i), label=f"column {i + 1}") for i, q in enumerate(quantities)}


def with_options(channels: dict[str, Channel], options: Options) -> dict[str, Channel]:
    """Channels with the units and factors that the user stated; these win over the file's own."""
    changed = dict(channels)
    for quantity, unit in options.units.items():
        if quantity in changed:
            zero = pressure_zero(unit) or changed[quantity].zero
            changed[quantity] = replace(changed[quantity], unit=unit_name(unit), zero=zero, two_units=())
    for quantity, factor in options.scales.items():
        if quantity in changed:
            changed[quantity] = replace(changed[quantity], values=factor * changed[quantity].values)
    return changed


def _heading_of(quantity: str, making: Making, grid: Grid) -> Heading | None:
    """Heading of the column that a quantity is taken from; None if it has none."""
    channel = making.channels.get(quantity)
    if channel is None or not grid.headings or channel.column < 0:
        return None
    return grid.headings[channel.column]


def say_other_units(making: Making, grid: Grid) -> None:
    """Warn of units and zeros of a pressure that the user states, and that contradict the headings."""
    for quantity, unit in making.options.units.items():
        heading, zero = _heading_of(quantity, making, grid), pressure_zero(unit)
        if heading is None:
            continue
        label = making.channels[quantity].label
        if quantity == "pressure" and zero and heading.zero not in ("", zero):
            making.warn(
                f"{label!r} states a pressure that is {heading.zero}, and --unit {quantity}={unit}"
                f" one that is {zero}: {zero} was used"
            )
        stated = heading.unit
        if stated is None or same_unit(stated, unit):
            continue
        if not may_be_unit(stated):
            known = f"--unit {quantity}={unit} was used"
            making.say(f"{label!r} states {stated}, which is no known unit: {known}")
        else:
            making.warn(
                f"{label!r} states {stated}, and --unit {quantity}={unit} another unit: {unit} was"
                " used"
            )


def refuse_absolute_stress(making: Making, grid: Grid) -> None:
    """Refuse a stress whose heading has the unit of a pressure with a zero: `Stress (MPaa)`.

    Raises:
        InputError: with the unit that may be meant.
    """
    for quantity in ("stress", "true_stress"):
        heading = _heading_of(quantity, making, grid)
        if heading is None or quantity in making.options.units:
            continue
        if heading.written and dimension(heading.unit) == "pressure":
            label = making.channels[quantity].label
            raise unusable(
                making.place, f"column {label!r}: {heading.written!r} says from which zero a pressure counts,"
                f" and a stress is none; if {heading.unit} is meant: --unit {quantity}={heading.unit}",
            )  # fmt: skip


def in_unit(channel: Channel, wanted: str, quantity: str, place: object) -> np.ndarray:
    """Values of a channel in a unit. Where a force is wanted, a mass is converted to its weight.

    Raises:
        InputError: if the numbers cannot be read, or if the unit is not stated, stated twice, unknown, or of
            another dimension.
    """
    option = f"state it with --unit {quantity}=..."
    if channel.trouble:
        raise unusable(place, f"{channel.trouble}; write it as the other numbers are, or leave it empty")
    if channel.two_units:
        one, other, *shown = channel.two_units
        said = f"the heading {channel.label!r} states two units, {one} and {other}"
        if shown:
            said = f"the sheet displays {channel.label!r} {shown[0]}, so that its cells hold {one} or {other}"
        raise unusable(
            place, f"{said}: say which one counts, --unit {quantity}={one} or --unit {quantity}={other}"
        )
    if channel.unit is None:
        if wanted == "1":
            return channel.values
        raise UnitMissing(f"{place}: the unit of {channel.label!r} is not stated in the file; {option}")
    unit = unit_name(channel.unit)
    if find_unit(wanted).dimension == "force":
        unit = WEIGHTS.get(unit, unit)
    if unit not in UNITS:
        why = f"unknown unit {unit!r}, {suggested_unit(unit, find_unit(wanted).dimension)}"
        raise unusable(place, f"column {channel.label!r}: {why}; {option}")
    measured = find_unit(unit).dimension
    if measured != find_unit(wanted).dimension:
        raise unusable(
            place, f"column {channel.label!r} is in {unit}, which is not a unit of {quantity} such as"
            f" {wanted}; {option}",
        )
    return convert(channel.values, unit, wanted)


def canonical(making: Making) -> dict[str, np.ndarray]:
    """Canonical columns of a kind in its units, the clock first. Unused channels are reported.

    Raises:
        InputError: if a unit is missing or wrong, or a required column cannot be made.
    """
    kind, channels = making.kind, making.channels
    rules = schema.KINDS[kind].columns
    columns = {}
    for name in sorted(rules.known, key=lambda name: name != "time_s"):  # the clock first
        quantity, unit = schema.quantity_and_unit(name)
        if quantity not in channels:
            continue
        channel = channels[quantity]
        spared = name in rules.optional or (name == "time_s" and making.options.interval_s is not None)
        spared &= quantity not in making.options.columns
        if channel.trouble and spared and np.isnan(channel.values).all():
            continue  # a column of words beside the numbers, such as `Cycle: loading`
        columns[name] = in_unit(channel, unit, quantity, making.place) + 0.0  # no -0
        making.say(_origin(name, unit, channel))
    known = {schema.quantity_and_unit(name)[0] for name in rules.known}
    unused = [quantity for quantity in channels if quantity not in known]
    used = {channels[schema.quantity_and_unit(name)[0]].label for name in columns}
    used |= {channels[q].label for q in making.sources if q in channels}
    spare = [label for label in dict.fromkeys(channels[q].label for q in unused) if label not in used]
    for quantity in unused:
        label = channels[quantity].label
        if label not in spare or f"{quantity}_1" not in known:
            continue
        spare.remove(label)
        making.say(
            f"check: {label!r} is a {quantity}, but of which spring is not said, so it is left out"
            f" (--map {quantity}_1=... or {quantity}_2=... takes it)"
        )
    if spare:
        making.say(f"not needed for kind {kind} and left out: {', '.join(repr(label) for label in spare)}")
    _add_constants(columns, making)
    _check_present(columns, making)
    return columns


def _origin(name: str, unit: str, channel: Channel) -> str:
    """Origin of a column in words: the file's column and its unit, or its source quantities."""
    if channel.made:
        return f"{name} is {channel.made}"
    if channel.unit is None:
        return f"{name} from {channel.label!r}"
    stated = unit_name(channel.unit)
    weight = f" (taken as {WEIGHTS[stated]})" if stated in WEIGHTS and stated != unit else ""
    return f"{name} from {channel.label!r}" + ("" if stated == unit else f", in {stated}{weight}")


def _add_constants(columns: dict[str, np.ndarray], making: Making) -> None:
    """Columns of constant quantities that the user or the file states."""
    rules = schema.KINDS[making.kind].columns
    rows = len(next(iter(columns.values()), next(iter(making.channels.values())).values))
    names = {schema.quantity_and_unit(name)[0]: name for name in rules.known}
    for quantity, (value, unit) in making.options.constants.items():
        name = names.get(quantity)
        if name is None:
            continue
        if name in columns:
            raise unusable(
                making.place, f"--constant {quantity}_{unit}: the file has it in"
                f" {making.channels[quantity].label!r}; leave the option out",
            )  # fmt: skip
        columns[name] = np.full(rows, convert(value, unit, schema.quantity_and_unit(name)[1]))
        making.use("--constant", quantity)
        making.say(f"{name} is {columns[name][0]:g} in every row, as stated with --constant")
        if name in making.sizes and abs(making.sizes[name].value - columns[name][0]) > 1e-6 * abs(value):
            making.warn(
                f"the file states another {quantity} than --constant does ({making.sizes[name].said!r})"
            )
    for key in ("temperature_degC", "stress_MPa"):
        if key in rules.known and key not in columns and making.kind == "wire" and key in making.sizes:
            size = making.sizes[key]
            columns[key] = np.full(rows, size.value)
            making.say(f"{key} is {size.value:g} in every row, as the file states ({size.said!r})")


def _check_present(columns: dict[str, np.ndarray], making: Making) -> None:
    rules = schema.KINDS[making.kind].columns
    others = f"; {making.unrecognised}" if making.unrecognised else ""
    absent = [name for name in rules.required if name not in columns and name != "time_s"]
    constant = " ".join(f"--constant {name}=..." for name in absent)
    if absent:
        raise unusable(
            making.place, f"a recording of kind {making.kind} needs {', '.join(absent)}, which was not"
            f" found{others}. Name the columns with --map QUANTITY=COLUMN, or state what did"
            f" not change with {constant}",
        )  # fmt: skip
    if rules.one_of and not any(name in columns for name in rules.one_of):
        raise unusable(
            making.place, f"a recording of kind {making.kind} needs one of {', '.join(rules.one_of)}{others};"
            " name it with --map QUANTITY=COLUMN",
        )  # fmt: skip
