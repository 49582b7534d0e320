"""The last steps that every import shares: clock, empty rows, provenance, and the checks of the format."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..recordings import Recording, check_recording, schema
from ..recordings.table import refuse
from .channels import Channel, canonical, with_options
from .derive import derive
from .grid import Grid
from .options import GEOMETRY, Options
from .provenance import Provenance, find_provenance
from .raw import RawFile

LOGGED_CLOCK = "clock_as_logged"
DEFAULT_INTERVAL_S = 1.0


@dataclass(frozen=True)
class Facts:
    """What a format knows about its file beyond the numbers.

    Attributes:
        format: the format's name.
        specimen: from the preamble, if it names one.
        provenance: if the preamble identifies the source.
        geometry: of the specimen, where the preamble states it; canonical keys.
        source: more lines for [source].
    """

    format: str
    specimen: str = ""
    provenance: Provenance | None = None
    geometry: dict = field(default_factory=dict)
    source: dict[str, str] = field(default_factory=dict)


def assemble(
    raw: RawFile,
    grid: Grid,
    channels: dict[str, Channel],
    kind: str,
    options: Options,
    facts: Facts,
    notices: list[str],
) -> Recording:
    """Make a recording of the channels of a raw file.

    Args:
        raw: the file, for messages and its fingerprint.
        grid: the table the channels come from.
        channels: by quantity.
        kind: of recording to make.
        options: of the person; units, factors, sizes, provenance, specimen and role.
        facts: what the format knows.
        notices: what was understood so far; more are added after them.

    Returns:
        A checked recording, `real = true`; its licence is empty where none was found.

    Raises:
        InputError: if the quantities of the kind cannot be made, or the numbers cannot be.
    """
    notices = list(notices)
    channels = with_options(channels, options)
    derive(channels, kind, options, raw.path, notices)
    columns = canonical(channels, kind, raw.path, notices)
    rows = np.array(grid.rows)
    columns, rows = _drop_empty(columns, rows, notices)
    columns = _with_clock(columns, rows, kind, options, raw.path, notices)
    provenance = find_provenance(raw.path, options.citation, options.licence, facts.provenance)
    notices += provenance.notices
    for key, option in (("citation", "--citation"), ("licence", "--licence")):
        if not getattr(provenance, key):
            notices.append(f"no {key} was found; state it with {option}")
    stated = {key: size for key, size in options.dimensions.items() if key in GEOMETRY}
    geometry = {**facts.geometry, **stated}
    fitted = {"elastomer": "material", "wire": "alloy"}.get(kind)
    if fitted and fitted not in geometry:
        geometry[fitted] = "fit"
        notices.append(
            f'{fitted} = "fit": its law is to be identified; name a known one in the sidecar instead'
        )
    elif kind in ("spring", "actuator") and not stated:
        notices.append(
            "the sidecar has no [geometry]: state the specimen's with --dimension, or the source's is assumed"
        )
    recording = Recording(
        name=slug(raw.path.stem),
        path=raw.path,
        kind=kind,
        role=options.role,
        specimen=options.specimen or facts.specimen or slug(raw.path.stem),
        real=True,
        source=_source(raw, provenance, facts),
        geometry=geometry,
        columns=columns,
        notices=notices,
    )
    # Without a licence it may still be looked at; writing it is refused.
    check_recording(replace(recording, real=None), [int(row) for row in rows])
    recording.source["notes"] = list(notices)
    return recording


def _source(raw: RawFile, provenance: Provenance, facts: Facts) -> dict[str, object]:
    stated = {"citation": provenance.citation, "licence": provenance.licence}
    return {
        **{key: text for key, text in stated.items() if text},
        **facts.source,
        "raw_file": raw.path.name,
        "raw_sha256": raw.sha256,
        "raw_format": facts.format,
    }


def slug(text: str) -> str:
    """A name for files and specimens: letters, digits, points, dashes and underscores."""
    kept = "".join(c if c.isalnum() or c in ".-" else "_" for c in text)
    return "_".join(part for part in kept.split("_") if part) or "recording"


def _drop_empty(
    columns: dict[str, np.ndarray], rows: np.ndarray, notices: list[str]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Leave out columns without a single number, and rows in which nothing but the clock was recorded."""
    for name in [name for name, values in columns.items() if np.isnan(values).all()]:
        notices.append(f"{name} has no number in it and was left out")
        del columns[name]
    data = [values for name, values in columns.items() if name != "time_s"]
    empty = np.all([np.isnan(values) for values in data], axis=0)
    if "time_s" in columns:
        empty = empty | np.isnan(columns["time_s"])
    if empty.any():
        notices.append(
            f"{int(empty.sum())} rows without a time or without any value dropped (row {rows[empty][0]})"
        )
    return {name: values[~empty] for name, values in columns.items()}, rows[~empty]


def _with_clock(
    columns: dict[str, np.ndarray],
    rows: np.ndarray,
    kind: str,
    options: Options,
    path: Path,
    notices: list[str],
) -> dict[str, np.ndarray]:
    """A clock that never goes back: made where there is none, set aside where reset, spread where coarse."""
    needed = "time_s" in schema.COLUMNS[kind].required
    if "time_s" not in columns:
        if not needed:
            return columns
        step = options.interval_s or DEFAULT_INTERVAL_S
        notices.append(
            f"the file has no clock: time_s counts the rows, {step:g} s apart (--interval states the true"
            " step); nothing that depends on rate can be judged from it"
        )
        return {"time_s": step * np.arange(len(rows), dtype=float), **columns}
    time = columns["time_s"]
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size and needed:
        raise refuse(
            path, f"the clock goes back from {time[back[0]]:g} to {time[back[0] + 1]:g} s; cut the file"
            " there, and import the pieces",
            int(rows[back[0] + 1]), "time",
        )  # fmt: skip
    if back.size:
        where = ", ".join(str(rows[i + 1]) for i in back[:5])
        notices.append(
            f"the clock goes back {back.size} time{'s' * (back.size > 1)} (row {where}): kept as"
            f" {LOGGED_CLOCK}, which nothing uses; the order of rows is taken as the order of time"
        )
        others = {name: values for name, values in columns.items() if name != "time_s"}
        return {**others, LOGGED_CLOCK: time}
    return {**columns, "time_s": _spread(time, notices)}


def _spread(time: np.ndarray, notices: list[str]) -> np.ndarray:
    """Spread the samples of one tick of a coarse clock evenly over that tick (its resolution at most)."""
    steps = np.diff(time)
    repeats = int(np.sum(steps == 0.0))
    if repeats == 0 or not (steps > 0.0).any():
        return time
    resolution = float(steps[steps > 0.0].min())
    ticks, first, counts = np.unique(time, return_index=True, return_counts=True)
    width = np.append(np.minimum(np.diff(ticks), resolution), resolution)
    offset = np.arange(len(time)) - np.repeat(first, counts)
    notices.append(
        f"{repeats} rows repeat the time before them (the clock steps by {resolution:g} s): spread evenly"
        " over a step"
    )
    return time + np.repeat(width / counts, counts) * offset
