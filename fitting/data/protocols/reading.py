"""Protocols as TOML: start values, then steps along which each named channel changes linearly to its new
value.

    schema = "pneusma-protocol/1"
    name = "thermal_cycle"
    kind = "actuator"                  # actuator | spring | tube
    interval_s = 0.5                   # between rows; a four-hundredth of the whole by default
    repeat = 2                         # of all steps; 1 by default

    [start]
    pressure_kPa = 20.0
    xi0_2 = 1.0

    [[step]]
    duration_s = 40.0                  # 0: a jump
    xi0_2 = 0.4                        # channels that a step does not name hold their value

Channels of an actuator are `pressure_kPa`, `ambient_degC`, and one per driven spring. That is one of `xi0_K`,
`resistance_K_ohm`, `temperature_K_degC`, `current_K_A` (root mean square) or `duty_K` (share of the time that
`[supply]` is on). In a chain, `segment_N = {xi0_K = ...}` drives one segment.

A spring has `elongation_mm` and one of `xi0`, `resistance_ohm`, `temperature_degC`. A tube has
`pressure_kPa`. Any unit of the right dimension is allowed.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from fitting.data.recordings import schema
from fitting.data.recordings.kinds import PHASE
from fitting.data.recordings.size_limits import CURRENT_LIMIT_A
from pneusma_jax.documents import check_keys, finite_number, read_document, shipped_names
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import dimension_of, to_si, unit_of_column

SCHEMA = "pneusma-protocol/1"
TOP = (
    "schema", "name", "kind", "description", "interval_s", "repeat", "start", "step", "supply",
)  # fmt: skip
DIMENSIONS = {
    "pressure": "pressure",
    "xi0": "number",
    "duty": "number",
    "resistance": "resistance",
    "current": "current",
    "temperature": "temperature",
    "ambient": "temperature",
    "elongation": "length",
}
LIMITS = {  # Minimum and maximum in SI, and both in words
    "pressure": (-102e3, 1000e3, "a gauge pressure from -102 to 1000 kPa"),
    "xi0": (0.0, 1.0, "a fraction from 0 (hot) to 1 (cold)"),
    "duty": (0.0, 1.0, "a share from 0 to 1"),
    "resistance": (1e-9, math.inf, "more than 0 ohm"),
    "current": (0.0, CURRENT_LIMIT_A, f"0 to {CURRENT_LIMIT_A:g} A"),
    "temperature": (-273.15, math.inf, "above absolute zero"),
    "ambient": (-273.15, math.inf, "above absolute zero"),
    "elongation": (-math.inf, math.inf, "finite"),
}
USUAL_ROWS, MOST_ROWS = 400, 200_000
_EXAMPLES = resources.files("calibration_data").joinpath("examples", "protocols")
_PLAIN = re.compile(r"(xi0|duty)(_\d+)?")
_SEGMENT = re.compile(r"segment_(\d+)")


@dataclass(frozen=True)
class Protocol:
    """Prescribed inputs over time.

    Attributes:
        name, description: texts for people.
        kind: kind of specimen: `actuator`, `spring` or `tube`.
        path: path of the file.
        time: time [s], ascending, shape (rows,).
        channels: inputs by quantity (`pressure`, `xi0_2`, `elongation`, ...; `2.xi0_1` is of segment 2), SI,
            shape (rows,).
        supply: `current` [A] while it is on, and `period` [s] of its pulses (0: averaged heat).
    """

    name: str
    description: str
    kind: str
    path: Path
    time: np.ndarray
    channels: Mapping[str, np.ndarray]
    supply: Mapping[str, float]

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.time)


def protocol_examples() -> list[str]:
    """Names of the protocols that come with the package, sorted."""
    return shipped_names(_EXAMPLES)


def load_protocol(name_or_path: str | Path) -> Protocol:
    """Read, check and sample a protocol.

    Args:
        name_or_path: name of a shipped protocol, or a path.

    Raises:
        InputError: one line with file, step, channel and remedy, for anything unknown, missing or impossible.
            Examples are no step, a negative duration, or a channel without a start value.
    """
    name = str(name_or_path)
    if name in protocol_examples():
        path = Path("calibration_data", "examples", "protocols", f"{name}.toml")
        place: Any = _EXAMPLES.joinpath(f"{name}.toml")
    elif name.endswith(".toml"):
        path = place = Path(name)
    else:
        raise InputError(f"there is no protocol {name!r}, {nearest(name, protocol_examples())}")
    return _protocol(read_document(place, path, "a protocol", SCHEMA, TOP), path)


def _protocol(document: dict[str, Any], path: Path) -> Protocol:
    kind = document.get("kind", "actuator")
    kinds = [name for name, one in schema.KINDS.items() if one.channels]
    if kind not in kinds:
        raise InputError(f"{path}: kind is {kind!r}, {nearest(str(kind), kinds)}")
    steps = document.get("step")
    if not isinstance(steps, list) or not steps:
        raise InputError(f"{path}: this history is empty: a protocol needs at least one [[step]]")
    repeat = document.get("repeat", 1)
    if isinstance(repeat, bool) or not isinstance(repeat, int) or repeat < 1:
        raise InputError(f"{path}: repeat must be a whole number from 1, but it is {repeat!r}")
    if len(steps) * repeat > MOST_ROWS:
        raise InputError(
            f"{path}: {len(steps)} steps, {repeat} times, are too many, at most {MOST_ROWS} are taken"
        )
    supply = _supply(document.get("supply", {}), path)
    corners, values = _corners(document.get("start", {}), steps * repeat, kind, path)
    if corners[-1] == 0.0:
        raise InputError(f"{path}: this history is empty: its steps take no time")
    time = _clock(document, float(corners[-1]), supply, path)
    return Protocol(
        name=str(document.get("name", path.stem)),
        description=str(document.get("description", "")),
        kind=kind,
        path=path,
        time=time,
        channels={name: _interpolated(time, corners, column) for name, column in values.items()},
        supply=supply,
    )


def _corners(start: Any, steps: list, kind: str, path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and values of every channel at the ends of the steps."""
    if not isinstance(start, dict):
        raise InputError(f"{path}: start must be a table, [start], but it is {start!r}")
    now = _values(start, kind, f"{path}: [start]")
    needed = schema.KINDS[kind].needed
    if schema.quantity_and_unit(needed)[0] not in now:
        raise InputError(f"{path}: [start] needs {needed}, which drives every {kind}")
    _check_phases(now, f"{path}: [start]")
    clock, rows = [0.0], [now]
    for number, step in enumerate(steps, 1):
        where = f"{path}: step {number}"
        if not isinstance(step, dict) or "duration_s" not in step:
            raise InputError(f"{where}: duration_s is missing; 0 is a jump")
        duration = finite_number(step["duration_s"], f"{where}: duration_s")
        if duration < 0.0:
            raise InputError(f"{where}: duration_s is {duration:g}, but time cannot go backwards")
        changes = _values({k: v for k, v in step.items() if k != "duration_s"}, kind, where)
        for name in changes:
            if name not in now:
                raise InputError(f"{where}: channel {name!r} has no value in [start] to go on from")
        now = now | changes
        clock.append(clock[-1] + duration)
        rows.append(now)
    return np.array(clock), {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _values(table: Mapping[str, Any], kind: str, where: str) -> dict[str, float]:
    """Channels of a table in SI. Those of single segments have the segment's number in front."""
    found: dict[str, float] = {}
    of_kind = schema.KINDS[kind]
    for key, entry in table.items():
        segment = _SEGMENT.fullmatch(key)
        if segment and of_kind.numbered and isinstance(entry, dict):
            own = _values(entry, kind, f"{where} {key}")
            found |= {f"{int(segment[1])}.{name}": value for name, value in own.items()}
            continue
        name, unit = (key, "1") if _PLAIN.fullmatch(key) else _channel(key, where)
        stem = name.partition("_")[0]
        if stem not in of_kind.channels or (of_kind.numbered and stem in PHASE and name == stem):
            known = [*of_kind.channels, "segment_1", "duration_s"]
            raise InputError(
                f"{where}: unknown channel {key!r} of a protocol for a {kind}, {nearest(key, known)}"
            )
        if dimension_of(unit) != DIMENSIONS[stem]:
            raise InputError(f"{where}: {key} must be a {DIMENSIONS[stem]}, but {unit!r} is not")
        value = float(to_si(finite_number(entry, f"{where}: {key}"), unit))
        low, high, words = LIMITS[stem]
        if not low <= value <= high:
            raise InputError(f"{where}: {key} = {entry:g} must be {words}")
        found[name] = value
    return found


def _channel(key: str, where: str) -> tuple[str, str]:
    try:
        return unit_of_column(key)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _check_phases(channels: Mapping[str, float], where: str) -> None:
    """Check that each spring is driven by one quantity."""
    channel_of: dict[str, str] = {}
    for name in channels:
        segment, _, rest = name.rpartition(".")
        stem, _, number = rest.partition("_")
        spring = f"{segment}.{number}"
        if stem in PHASE and spring in channel_of:
            raise InputError(f"{where}: {channel_of[spring]} and {name} both drive one spring; keep one")
        if stem in PHASE:
            channel_of[spring] = name


def _supply(table: Any, path: Path) -> dict[str, float]:
    if not isinstance(table, dict):
        raise InputError(f"{path}: supply must be a table, [supply], but it is {table!r}")
    check_keys(table, ("current_A", "period_s"), f"{path}: [supply]")
    read = {}
    for key, entry in table.items():
        read[key.partition("_")[0]] = value = finite_number(entry, f"{path}: [supply] {key}")
        if value <= 0.0:
            raise InputError(f"{path}: [supply] {key} must be more than 0, but it is {value:g}")
        if key == "current_A" and value > CURRENT_LIMIT_A:
            most = f"at most {CURRENT_LIMIT_A:g}"
            raise InputError(f"{path}: [supply] {key} must be {most}, but it is {value:g}")
    return read


def _clock(document: dict[str, Any], total: float, supply: dict[str, float], path: Path) -> np.ndarray:
    interval = finite_number(document.get("interval_s", total / USUAL_ROWS), f"{path}: interval_s")
    if interval <= 0.0:
        raise InputError(f"{path}: interval_s must be more than 0, but it is {interval:g}")
    if supply.get("period") and interval > 0.1 * supply["period"]:
        raise InputError(
            f"{path}: interval_s is {interval:g}, but pulses of {supply['period']:g} s need a tenth of that"
            " or less. Leave out [supply] period_s to take the mean heat"
        )
    with np.errstate(over="ignore"):
        wanted = np.ceil(np.divide(total, interval) - 1e-9) + 1.0
    if not wanted <= MOST_ROWS:
        raise InputError(
            f"{path}: {wanted:.6g} rows are too many, at most {MOST_ROWS} are taken: widen interval_s"
        )
    rows = int(wanted)
    return np.minimum(interval * np.arange(rows), total)


def _interpolated(time: np.ndarray, corners: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Linear interpolation between corners; at a jump, the value after it."""
    last = np.searchsorted(corners, time, side="right") - 1
    after = np.minimum(last + 1, len(corners) - 1)
    span = corners[after] - corners[last]
    share = np.where(span > 0.0, (time - corners[last]) / np.where(span > 0.0, span, 1.0), 0.0)
    return column[last] + share * (column[after] - column[last])
