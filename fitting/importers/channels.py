"""From named columns of a raw file to the quantities of a recording: units, stretch, extension, load."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from pneusma_jax.errors import InputError
from pneusma_jax.units import find_unit

from ..recordings import schema
from ..recordings.columns import convert
from ..recordings.table import refuse
from .grid import Grid, Sample, unit_name
from .options import Options


@dataclass(frozen=True)
class Channel:
    """One quantity of a raw file.

    Attributes:
        values: shape (rows,), NaN where blank.
        unit: as the file or the person states it; None if neither does.
        label: the raw column's own name or number.
    """

    values: np.ndarray
    unit: str | None
    label: str


# Headings that name a quantity of the recording format, in lower case and without their unit.
_WORDS = {
    "time": ("time", "elapsed time", "test time", "total time", "t"),
    "strain": (
        "engineering strain",
        "eng. strain",
        "eng strain",
        "nominal strain",
        "tensile strain",
        "strain",
    ),
    "stress": (
        "engineering stress",
        "eng. stress",
        "eng stress",
        "nominal stress",
        "tensile stress",
        "stress",
    ),
    "true_strain": ("true strain",),
    "true_stress": ("true stress",),
    "stretch": ("stretch", "stretch ratio", "lambda"),
    "elongation": (
        "extension",
        "elongation",
        "displacement",
        "tensile displacement",
        "crosshead",
        "position",
    ),
    "force": ("load", "force", "tensile force"),
    "temperature": (
        "temperature",
        "specimen temperature",
        "temp",
        "temperature chamber",
        "chamber temperature",
    ),
    "resistance": ("resistance",),
    "current": ("current",),
    "pressure": ("pressure", "gauge pressure", "gage pressure"),
    "length": ("length",),
    "curvature": ("curvature",),
    "bend_angle": ("bend angle", "bending angle"),
    "cycle": ("cycle", "cycle number", "total cycle count"),
    "voltage": ("voltage", "output voltage", "v out", "vout"),
    **{f"voltage_{k}": (f"voltage {k}",) for k in (1, 2, 3)},
    **{f"resistance_{k}": (f"resistance {k}", f"r{k}") for k in (1, 2, 3)},
    **{f"current_{k}": (f"current {k}", f"i{k}") for k in (1, 2, 3)},
}


def named_channels(grid: Grid) -> dict[str, Channel]:
    """Quantities that the headings of a grid name; of two headings for one, the first in `_WORDS` wins."""
    found: dict[str, Channel] = {}
    for quantity, words in _WORDS.items():
        for word in words:
            column = next((i for i, heading in enumerate(grid.headings) if heading.name == word), None)
            if column is not None and not np.isnan(grid.values[:, column]).all():
                heading = grid.headings[column]
                found[quantity] = Channel(grid.values[:, column], heading.unit, heading.text)
                break
    return found


def mapped_channels(sample: Sample, options: Options) -> dict[str, Channel]:
    """Quantities that the person named with `--map`, by heading or by number from 1.

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
            raise refuse(
                sample.raw.path, f"--map {quantity}={wanted}: there is no such column; there are {listed}"
            )
        heading = grid.headings[column] if grid.headings else None
        label = heading.text if heading else f"column {column + 1}"
        found[quantity] = Channel(grid.values[:, column], heading.unit if heading else None, label)
    return found


def _column(grid: Grid, wanted: str) -> int | None:
    for match in (
        lambda heading: heading.text == wanted,
        lambda heading: heading.text.casefold() == wanted.casefold(),
        lambda heading: heading.name == wanted.casefold(),
    ):
        hits = [i for i, heading in enumerate(grid.headings) if match(heading)]
        if hits:
            return hits[0]
    if wanted.isdigit() and 1 <= int(wanted) <= grid.values.shape[1]:
        return int(wanted) - 1
    return None


def numbered(grid: Grid, quantities: Iterable[str]) -> dict[str, Channel]:
    """Quantities of the columns of a file without header, in order."""
    return {q: Channel(grid.values[:, i], None, f"column {i + 1}") for i, q in enumerate(quantities)}


def with_options(channels: dict[str, Channel], options: Options) -> dict[str, Channel]:
    """Channels with the units and factors that the person stated; these win over the file's own."""
    changed = dict(channels)
    for quantity, unit in options.units.items():
        if quantity in changed:
            changed[quantity] = replace(changed[quantity], unit=unit)
    for quantity, factor in options.scales.items():
        if quantity in changed:
            changed[quantity] = replace(changed[quantity], values=factor * changed[quantity].values)
    return changed


def in_unit(channel: Channel, wanted: str, quantity: str, place: object) -> np.ndarray:
    """Values of a channel in a unit.

    Raises:
        InputError: if the unit is not stated, unknown, or of another dimension.
    """
    option = f"state it with --unit {quantity}=..."
    if channel.unit is None:
        if wanted == "1":
            return channel.values
        raise refuse(place, f"the unit of {channel.label!r} is not stated in the file; {option}")
    unit = unit_name(channel.unit)
    try:
        dimension = find_unit(unit).dimension
    except InputError as error:
        raise refuse(place, f"column {channel.label!r}: {error}; {option}") from None
    if dimension != find_unit(wanted).dimension:
        raise refuse(
            place, f"column {channel.label!r} is in {unit}, which is not a unit of {quantity}; {option}"
        )
    return convert(channel.values, unit, wanted)


def canonical(
    channels: dict[str, Channel], kind: str, place: object, notices: list[str]
) -> dict[str, np.ndarray]:
    """Canonical columns of a kind in its units, the clock first; channels that it has no use for are named.

    Raises:
        InputError: if a unit is missing or wrong, or a required column cannot be made.
    """
    rules = schema.COLUMNS[kind]
    columns = {}
    for name in sorted(rules.known, key=lambda name: name != "time_s"):  # the clock first
        quantity, unit = schema.quantity_and_unit(name)
        if quantity in channels:
            channel = channels[quantity]
            columns[name] = in_unit(channel, unit, quantity, place) + 0.0  # no -0
            stated = unit_name(channel.unit) if channel.unit else "1"
            notices.append(f"{name} from {channel.label!r}" + ("" if stated == unit else f", in {stated}"))
    unused = [
        channels[q].label
        for q in channels
        if not any(schema.quantity_and_unit(n)[0] == q for n in rules.known)
    ]
    used = {channels[schema.quantity_and_unit(name)[0]].label for name in columns}
    spare = [label for label in dict.fromkeys(unused) if label not in used]
    if spare:
        notices.append(
            f"not needed for kind {kind} and left out: {', '.join(repr(label) for label in spare)}"
        )
    absent = [name for name in rules.required if name not in columns and name != "time_s"]
    if absent:
        raise refuse(
            place, f"a recording of kind {kind} needs {', '.join(absent)}, which was not found; "
            "name the columns with --map QUANTITY=COLUMN",
        )  # fmt: skip
    if rules.one_of and not any(name in columns for name in rules.one_of):
        raise refuse(
            place, f"a recording of kind {kind} needs one of {', '.join(rules.one_of)}; name it with --map"
        )
    return columns
