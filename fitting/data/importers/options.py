"""Options of an import: statements of the user that the file lacks, parsed and checked."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import UNITS, dimension_of, suggested_unit, to_si

from ..recordings import schema
from ..recordings.columns import written_unit
from ..recordings.sidecar import implausible_size
from .row_ranges import RowChoice, parse_rows
from .spelling import pressure_zero, unit_name

# Quantities that a column of a raw file may hold: those of the recording format, and what they are
# made from.
QUANTITIES = tuple(
    dict.fromkeys(
        [schema.quantity_and_unit(name)[0] for kind in schema.KINDS.values() for name in kind.columns.known]
        + ["stretch", "true_strain", "true_stress", "voltage", "voltage_1", "voltage_2", "voltage_3"]
    )
)
# Synonyms of a quantity on the command line.
SYNONYMS = {
    "displacement": "elongation", "extension": "elongation", "position": "elongation", "load": "force",
    "temp": "temperature", "angle": "bend_angle",
}  # fmt: skip
# Sizes of a specimen that turn machine readings into strain and stress.
DIMENSIONS = ("gauge_length_mm", "area_mm2", "diameter_mm", "width_mm", "thickness_mm", "span_mm", "depth_mm")
# Dimensions of a spring, a tube or an actuator, which go into the sidecar as they are.
GEOMETRY = tuple(schema.GEOMETRY_NUMBERS)
# The circuit that raw voltages were measured with (Eq. 2.50): adjustment voltage and set resistor of the
# current regulator, gain and offset voltage of an amplifier.
CIRCUIT = ("adjust_V", "set_ohm", "gain", "offset_V")


SLACK_WORDS = ("auto", "fit", "keep")


@dataclass
class Used:
    """Record of the options that were used, and of the reasons why others were not.

    Attributes:
        names: pairs of option and name, such as `("--scale", "force")`.
        why: sentence for each stated pair that was not used.
    """

    names: set[tuple[str, str]] = field(default_factory=set)
    why: dict[tuple[str, str], str] = field(default_factory=dict)


@dataclass(frozen=True)
class Options:
    """Instructions for an import. None or absent means that the file decides.

    Attributes:
        kind: kind of recording to make.
        format: name of the raw format, in place of detection.
        columns: raw column by quantity, given by its heading or its number from 1.
        units: unit of the raw column by quantity; that of a pressure may name its zero (`kPaa`).
        scales: factor on the raw numbers by quantity (-1 turns a sign).
        dimensions: dimension of the specimen by name (`DIMENSIONS`, `GEOMETRY`), in the unit of its name.
        circuit: constants of the circuit that turns raw voltages into resistance, by name (`CIRCUIT`).
        constants: value and unit by quantity that did not change during the test.
        subtracted: offset and its unit by quantity, such as a zero or the atmospheric pressure.
        compression: true if the specimen was in compression; None leaves it to the file.
        slack: strain (or elongation in mm) up to which a specimen hung slack. `"auto"` finds it. `"fit"`
            leaves it and the load cell's zero to every fit. `"keep"` leaves the start unchanged without a
            notice. None reports slack that is found.
        rows: ranges of the rows that are kept, by the name of the test; under an empty name for the only one.
        sheet: name or number of the only sheet to read.
        interval_s: seconds between samples, for files without a clock.
        speed: constant speed of a machine's crosshead, and as it was written; None for none [m/s].
        licence, citation, specimen, role: entries of the sidecar.
        successive: true if the files hold tests of one specimen, one after the other, that are one recording.
    """

    kind: str | None = None
    format: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)
    dimensions: Mapping[str, float] = field(default_factory=dict)
    circuit: Mapping[str, float] = field(default_factory=dict)
    constants: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    subtracted: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    compression: bool | None = None
    slack: str | float | None = None
    rows: RowChoice = field(default_factory=dict)
    sheet: str | None = None
    interval_s: float | None = None
    speed: tuple[float, str] | None = None
    licence: str | None = None
    citation: str | None = None
    specimen: str | None = None
    role: str = "fit"
    successive: bool = False
    used: Used = field(default_factory=Used, compare=False)

    def stated(self) -> list[tuple[str, str]]:
        """Pairs of option and name of every statement that a file must use."""
        tables = {
            "--map": self.columns, "--unit": self.units, "--scale": self.scales,
            "--dimension": self.dimensions, "--constant": self.constants, "--subtract": self.subtracted,
            "--circuit": self.circuit,
        }  # fmt: skip
        pairs = [(option, name) for option, table in tables.items() for name in table]
        pairs += (
            [("--compression" if self.compression else "--tension", "")]
            if self.compression is not None
            else []
        )
        pairs += [("--slack", "")] if self.slack is not None else []
        pairs += [("--speed", "")] if self.speed is not None else []
        return pairs + ([("--interval", "")] if self.interval_s is not None else [])

    def mends(self) -> bool:
        """True if any option changes the numbers of a recording."""
        return bool(
            self.scales
            or self.constants
            or self.subtracted
            or self.compression
            or self.speed
            or self.rows
            or self.slack not in (None, "keep", "fit")
        )

    def with_own_record(self) -> "Options":
        """The same options with a record of use of their own."""
        return replace(self, used=Used())


def make_options(
    *,
    kind: str | None = None,
    format: str | None = None,
    columns: Iterable[str] = (),
    units: Iterable[str] = (),
    scales: Iterable[str] = (),
    dimensions: Iterable[str] = (),
    circuit: Iterable[str] = (),
    constants: Iterable[str] = (),
    subtracted: Iterable[str] = (),
    compression: bool | None = None,
    slack: str | None = None,
    rows: Iterable[str] = (),
    sheet: str | None = None,
    interval_s: float | None = None,
    speed: str | None = None,
    licence: str | None = None,
    citation: str | None = None,
    specimen: str | None = None,
    role: str = "fit",
    successive: bool = False,
) -> Options:
    """Options from texts of the form `NAME=VALUE`, as on the command line.

    Raises:
        InputError: for an unknown quantity, unit, dimension or kind, a malformed pair, or an impossible
            number.
    """
    if kind is not None and kind not in schema.KINDS:
        raise InputError(f"--kind {kind}: no such kind of recording, {nearest(kind, schema.KINDS)}")
    if role not in schema.ROLES:
        raise InputError(f"--role {role}: no such role, {nearest(role, schema.ROLES)}")
    if interval_s is not None and not (math.isfinite(interval_s) and interval_s > 0.0):
        raise InputError(f"--interval {interval_s:g}: seconds between samples must be more than 0")
    sizes, parts = _sizes(dimensions), _circuit(circuit)
    return Options(
        kind=kind,
        format=format,
        columns=dict(_pairs("--map", columns, QUANTITIES)),
        units={name: _unit(name, text) for name, text in _pairs("--unit", units, QUANTITIES)},
        scales={name: _number("--scale", name, text) for name, text in _pairs("--scale", scales, QUANTITIES)},
        dimensions=sizes,
        circuit=parts,
        constants=_amounts("--constant", constants),
        subtracted=_amounts("--subtract", subtracted),
        compression=compression,
        slack=_slack(slack),
        rows=parse_rows(rows),
        sheet=sheet,
        interval_s=interval_s,
        speed=None if speed is None else _speed(speed),
        licence=licence,
        citation=citation,
        specimen=specimen,
        role=role,
        successive=successive,
    )


def _sizes(texts: Iterable[str]) -> dict[str, float]:
    """Stated sizes of the specimen by name, each plausible in the unit of its name."""
    pairs = _pairs("--dimension", texts, (*DIMENSIONS, *GEOMETRY))
    sizes = {name: _number("--dimension", name, text) for name, text in pairs}
    for name, size in sizes.items():
        if size <= 0.0:
            raise InputError(f"--dimension {name}={size:g}: a size must be more than 0")
        if wrong := implausible_size(name, size, schema.geometry_unit(name)):
            raise InputError(f"--dimension {name}: {wrong}")
    return sizes


def _circuit(texts: Iterable[str]) -> dict[str, float]:
    """Stated parts of the measuring circuit by name."""
    parts = {name: _number("--circuit", name, text) for name, text in _pairs("--circuit", texts, CIRCUIT)}
    for name, value in parts.items():
        if name in ("adjust_V", "set_ohm") and value <= 0.0:
            raise InputError(f"--circuit {name}={value:g}: must be more than 0")
    return parts


def _pairs(option: str, texts: Iterable[str], names: tuple[str, ...]) -> list[tuple[str, str]]:
    pairs: dict[str, str] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        name = SYNONYMS.get(name, name) if names is QUANTITIES else name
        if not equals or not value:
            raise InputError(f"{option} {text}: must be NAME=VALUE, e.g. {option} {names[0]}=...")
        if name not in names:
            raise InputError(f"{option} {text}: {name!r} is not known here, {nearest(name, names)}")
        if name in pairs:
            raise InputError(f"{option} {name} is given twice; keep one")
        pairs[name] = value.strip("\"'")
    return list(pairs.items())


def _speed(text: str) -> tuple[float, str]:
    """Speed of a crosshead [m/s] from a text such as `10 mm/min`, and the text.

    Raises:
        InputError: if it is no positive number with a length over a time.
    """
    found = re.fullmatch(r"\s*([-+.\deE]+)\s*(\w+)\s*/\s*(\w+)\s*", text)
    number, length, time = found.groups() if found else ("", "", "")
    try:
        value = speed_of(float(number), length, time)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"--speed {text}: must be a positive number of a length over a time, e.g. 10mm/min")
    return float(value), f"{number} {length}/{time}"


def speed_of(number: float, length: str, time: str) -> float:
    """Speed [m/s] of a number and its two units; NaN where they are no length and no time."""
    units = unit_name(length), unit_name(time)
    known = all(unit in UNITS for unit in units) and list(map(dimension_of, units)) == ["length", "time"]
    return float(number * to_si(1.0, units[0]) / to_si(1.0, units[1])) if known else math.nan


def _slack(text: str | None) -> str | float | None:
    if text is None or text in SLACK_WORDS:
        return text
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0.0:
        raise InputError(
            f"--slack {text}: must be auto, fit, keep, or the strain (mm of a spring) at which it grew taut"
        )
    return value


def _amounts(option: str, texts: Iterable[str]) -> dict[str, tuple[float, str]]:
    """Value and unit by quantity, from texts such as `temperature_degC=22`.

    Raises:
        InputError: for an unknown quantity, a unit that is absent, unknown or of another dimension, or a
            value that is not a number.
    """
    amounts: dict[str, tuple[float, str]] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        word, underscore, unit_text = name.rpartition("_")
        name = f"{SYNONYMS.get(word, word)}_{unit_text}" if underscore else name
        if not equals or not value:
            raise InputError(f"{option} {text}: must be NAME_UNIT=VALUE, e.g. {option} temperature_degC=22")
        canonical = _canonical_of(name)
        if canonical is None:
            names = sorted({column for kind in schema.KINDS.values() for column in kind.columns.known})
            raise InputError(f"{option} {text}: {name!r} is not known here, {nearest(name, names)}")
        quantity, _ = schema.quantity_and_unit(canonical)
        if quantity == "time" and option == "--constant":
            raise InputError(
                f"{option} {text}: a time goes on; state the seconds between rows with --interval"
            )
        try:
            unit = written_unit(name, canonical)
        except InputError as error:
            raise InputError(f"{option} {text}: {error}") from None
        if quantity in amounts:
            raise InputError(f"{option} {quantity} is given twice; keep one")
        try:
            number = float(value.strip("\"'"))
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise InputError(f"{option} {text}: {value!r} must be a number")
        amounts[quantity] = (number, unit)
    return amounts


def _canonical_of(name: str) -> str | None:
    """A canonical column whose quantity a name refers to, in any unit."""
    for kind in schema.KINDS.values():
        for canonical in kind.columns.known:
            if schema.names_quantity(name, canonical):
                return canonical
    return None


def _number(option: str, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value == 0.0:
        raise InputError(f"{option} {name}={text}: must be a number other than 0")
    return value


def _unit(name: str, text: str) -> str:
    """Name of a unit; of a pressure as it is written if it says from which zero it counts (`kPaa`)."""
    unit = unit_name(text)
    if unit not in UNITS:
        alike = next((c for c in map(lambda kind: schema.column_of(kind, name), schema.KINDS) if c), None)
        dimension = None if alike is None else dimension_of(schema.quantity_and_unit(alike)[1])
        raise InputError(f"--unit {name}={text}: unknown unit {unit!r}, {suggested_unit(unit, dimension)}")
    if not pressure_zero(text):
        return unit
    if name != "pressure":
        raise InputError(
            f"--unit {name}={text}: {text!r} says from which zero a pressure counts, and {name} is none; did"
            f" you mean {unit!r}?"
        )
    return text
