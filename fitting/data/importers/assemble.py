"""The last steps that every import shares: clock, empty rows, provenance, and the checks of the format."""

import itertools
import re
from dataclasses import dataclass, field

import numpy as np

from pneusma_jax.units import UNITS, find_unit

from ..recordings import (
    NOT_STATED,
    Recording,
    ask_about_units,
    check_recording,
    schema,
)
from ..recordings.columns import convert
from .channels import (
    UnitMissing,
    canonical,
    refuse_absolute_stress,
    say_other_units,
    units_missing,
    with_options,
)
from .compression import About
from .derive import derive, question_stress
from .doubtful_readings import question_labels, question_readings, question_twice
from .empty_rows import without_empty_rows
from .header_lines import lines_unread, say_header
from .leaps import question_leaps
from .making import Channel, Making
from .names import name_of, slug
from .options import Options
from .other_headings import unrecognised
from .parts import Sample
from .provenance import Provenance, find_provenance
from .raw import RawFile
from .rounding import shortest
from .running_clock import with_clock
from .sidecar_geometry import geometry_of_sidecar, identify_other_alloy
from .signs_and_zeros import ATMOSPHERE_KPA, correct_signs_and_zeros, gauge_pressure, subtract
from .specimen_sizes import say_other_sizes, say_sizes_of_the_source
from .spelling import WEIGHTS, unit_name
from .stated_lines import question_lines
from .status_columns import question_status
from .strain_unit import refuse_impossible_wire, settle_strain_unit, warn_of_impossible_strain
from .unused import explain, mark_used


@dataclass(frozen=True)
class Facts:
    """Facts that a format finds in its file beyond the numbers.

    Attributes:
        format: name of the format.
        specimen: name of the specimen in the preamble, if any.
        provenance: citation and licence, if the preamble identifies the source.
        geometry: dimensions of the specimen that the preamble states; canonical keys.
        source: further lines for [source].
    """

    format: str
    specimen: str = ""
    provenance: Provenance | None = None
    geometry: dict = field(default_factory=dict)
    source: dict[str, str] = field(default_factory=dict)


def assemble(
    sample: Sample,
    channels: dict[str, Channel],
    kind: str,
    options: Options,
    facts: Facts,
    notices: list[str],
) -> Recording:
    """Make a recording from the channels of one test of a raw file.

    Args:
        sample: test with its file, table of numbers, title and dimensions.
        channels: channels by quantity.
        kind: kind of recording to make.
        options: instructions of the user: units, factors, dimensions, provenance, specimen and role.
        facts: facts that the format found.
        notices: notices so far; further ones are appended.

    Returns:
        A checked recording, `real = true`. Citation and licence are "not stated" where none was found.

    Raises:
        InputError: if the quantities of the kind cannot be made, or the numbers are impossible.
    """
    making = _making(sample, channels, kind, options, notices)
    refuse_absolute_stress(making, sample.require_grid())
    say_other_units(making, sample.require_grid())
    columns, rows = _columns(sample, making)
    provenance = _provenance(sample, facts, making)
    geometry = geometry_of_sidecar(facts.geometry, making)
    say_sizes_of_the_source(geometry, columns, making)
    say_other_sizes(making)
    _question(sample, channels, columns, rows, making)
    name, specimen = _names(sample, options, facts)
    recording = Recording(
        name=name,
        path=sample.raw.path,
        kind=kind,
        role=options.role,
        specimen=specimen,
        real=True,
        source=_source(sample, provenance, facts),
        geometry=geometry,
        zero=making.zero,
        columns=columns,
        notices=making.notices,
    )
    identify_other_alloy(recording, making)
    refuse_impossible_wire(making)
    recording.written.update(_in_the_file(recording, channels, making))
    check_recording(recording, [int(row) for row in rows])
    ask_about_units(recording, _written_units(recording, making), _units_known(sample, making))
    explain(making)
    question_lines(sample, recording, making)
    recording.source |= say_header(sample, making)
    recording.source["notes"] = list(making.notices)
    if making.clock_counts_rows:
        recording.source[schema.CLOCK] = schema.COUNTED
    return recording


def _making(
    sample: Sample, channels: dict[str, Channel], kind: str, options: Options, notices: list[str]
) -> Making:
    """What is known before any column is made."""
    path, headings = sample.raw.path, sample.require_grid().headings
    place = f"{path} ({sample.title})" if sample.title else str(path)
    others = unrecognised(headings, {channel.column for channel in channels.values()}, channels)
    return Making(
        with_options(channels, options), kind, options, sample.sizes, place, [*sample.notices, *notices],
        raw=frozenset(channels), unrecognised=others, unread=tuple(lines_unread(sample.require_grid())),
        called=sample.called, kept=sample.kept,
    )  # fmt: skip


def _columns(sample: Sample, making: Making) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Columns in canonical units on a clock, with signs and zeros right; and their rows in the file."""
    columns = _quantities(making)
    mark_used(making, columns)
    keep = correct_signs_and_zeros(columns, making, _loading_texts(sample, making))
    _notice_engineering_stress(columns, making)
    _notice_preload(sample, making)
    columns = {name: values[keep] for name, values in columns.items()}
    columns, rows = without_empty_rows(columns, np.array(sample.require_grid().rows)[keep], making)
    question_twice(columns, making)
    columns = with_clock(columns, rows, making)
    return {name: shortest(values, _taken_off(name, making)) for name, values in columns.items()}, rows


def _taken_off(name: str, making: Making) -> float:
    """Largest number that was taken off a column, in its unit; its rounding errors are the column's."""
    quantity, _, unit = name.rpartition("_")
    channel = making.channels.get(quantity or name)
    beyond = 0.0
    if quantity in making.options.subtracted:
        value, stated = making.options.subtracted[quantity]
        beyond = float(convert(value, stated, unit))
    if channel is not None and channel.zero == "absolute":
        beyond = max(beyond, ATMOSPHERE_KPA)
    if channel is not None and quantity == "temperature" and channel.unit is not None:
        beyond = max(beyond, abs(find_unit(unit_name(channel.unit)).offset))
    return abs(beyond)


def _question(
    sample: Sample,
    channels: dict[str, Channel],
    columns: dict[str, np.ndarray],
    rows: np.ndarray,
    making: Making,
) -> None:
    """Notices on numbers that may be read wrongly; a refusal where they cannot be right."""
    if making.kind == "wire" and not {"temperature_degC", "resistance_ohm"} & columns.keys():
        perhaps = f"; {making.unrecognised}" if "--map temperature=" in making.unrecognised else ""
        making.warn(
            "there is no temperature, which the phase of a wire follows: characterise and diagnose refuse "
            f"it. State one that did not change with --constant temperature_degC=...{perhaps}"
        )
    question_stress(columns, making)
    dated = "time" in channels and channels["time"].column in sample.require_grid().origins
    question_readings(columns, rows, dated, making)
    question_leaps(columns, rows, making)
    question_labels(channels, making)
    question_status(sample.require_grid(), making)
    _question_rows(columns, making)


def _quantities(making: Making) -> dict[str, np.ndarray]:
    """Columns in canonical units: stated, converted from other quantities, and without their zeros."""
    try:
        subtract(making)
        gauge_pressure(making)
        settle_strain_unit(making)
        derive(making)
        warn_of_impossible_strain(making)
        subtract(making)
        return canonical(making)
    except UnitMissing:
        raise units_missing(making) from None


def _provenance(sample: Sample, facts: Facts, making: Making) -> Provenance:
    """Citation and licence; notices say where they were found, or that they are missing."""
    options = making.options
    found = find_provenance(sample.raw.path, options.citation, options.licence, facts.provenance)
    making.notices += found.notices
    absent = [key for key in ("citation", "licence") if not getattr(found, key)]
    if absent:
        making.say(
            f"{' and '.join(absent)} not stated: fine for numbers of your own, needed to publish those of "
            "others"
        )
    return found


def _loading_texts(sample: Sample, making: Making) -> About:
    """Texts that may mention the loading: headings of strain and stress, the preamble, the sheet's name."""
    labels = [making.channels[name].label for name in ("strain", "stress") if name in making.channels]
    lines = [
        "; ".join(cell.strip() for cell in row if cell.strip()) for row in sample.require_grid().preamble
    ]
    return About(labels, lines, [sample.title, sample.sheet])


def _notice_engineering_stress(columns: dict[str, np.ndarray], making: Making) -> None:
    """Report that a stress of unstated definition was taken as engineering stress, where that makes a
    difference."""
    stress = making.channels.get("stress")
    if making.kind != "elastomer" or stress is None or "stress" not in making.raw or "strain" not in columns:
        return
    words = ("engineering", "eng", "nominal", "pk1", "piola", "true", "agrees")
    is_stated = any(word in stress.label.lower() for word in words) or "force" in making.sources
    if not is_stated and float(np.nanmax(np.abs(columns["strain"]))) > 0.05:
        making.say(
            f"{stress.label!r} taken as engineering stress, load over the first cross-section (if it is"
            " true stress:"
            f" --map true_stress={stress.label!r})"
        )


def _notice_preload(sample: Sample, making: Making) -> None:
    """Report that a file mentions a preload, so that its strain begins there and not at zero stress."""
    for row in sample.require_grid().preamble:
        line = " ".join(cell for cell in row if cell).strip()
        if re.search(r"pre-?\s?load|pre-?tension|vorkraft|pr[ée]charge", line, re.IGNORECASE):
            making.say(
                f"the file speaks of a preload ({line[:60]!r}): strain is counted from there, if at all"
            )
            return


def _question_rows(columns: dict[str, np.ndarray], making: Making) -> None:
    """Ask about columns that were logged at moments of their own, so that no row has both."""
    rules = schema.KINDS[making.kind].columns
    needed = [name for name in rules.required if name in columns and name != "time_s"]
    others = [name for name in (*rules.one_of, "temperature_degC") if name in columns and name not in needed]
    for first, second in (*itertools.combinations(needed, 2), *itertools.product(needed, others)):
        if not (np.isfinite(columns[first]) & np.isfinite(columns[second])).any():
            making.warn(
                f"no row has both {first} and {second}, and a fit needs both in a row. Where each was logged"
                " at moments of its own, bring them to one clock in the file"
            )
            return


def _written_units(recording: Recording, making: Making) -> dict[str, str]:
    """Units that the file states, by canonical column that is read from it. A strain of lengths has none."""
    channels = {name: making.channels.get(schema.quantity_and_unit(name)[0]) for name in recording.columns}
    stated = {name: one for name, one in channels.items() if one is not None and one.unit and not one.made}
    made = {"strain": "1"} if (strain := making.channels.get("strain")) is not None and strain.made else {}
    return {name: unit_name(one.unit) for name, one in stated.items()} | made


def _in_the_file(
    recording: Recording, channels: dict[str, Channel], making: Making
) -> dict[str, tuple[str, float]]:
    """Unit of each column that stands in the file, and the air's pressure where that was taken off [kPa]."""
    options, found = making.options, {}
    for name in recording.columns:
        quantity = schema.quantity_and_unit(name)[0]
        channel = channels.get(quantity)
        if channel is None or quantity in {**options.scales, **options.subtracted}:
            continue
        unit = unit_name(options.units.get(quantity, channel.unit or ""))
        unit = WEIGHTS.get(unit, unit) if quantity == "force" else unit
        absolute = quantity == "pressure" and "less an atmosphere" in making.channels[quantity].made
        if unit in UNITS and (absolute or not making.channels[quantity].made):
            found[name] = unit, ATMOSPHERE_KPA if absolute else 0.0
    return found


def _units_known(sample: Sample, making: Making) -> set[str]:
    """Quantities whose unit is beyond doubt: stated by the user, or the time of a calendar or a clock."""
    clock = making.channels.get("time")
    read = clock is not None and clock.column in sample.require_grid().clocks
    return {*making.options.units, *(["time"] if read or making.options.interval_s else [])}


def _names(sample: Sample, options: Options, facts: Facts) -> tuple[str, str]:
    """Names of the recording and of its specimen. Several tests of a file are distinguished by their
    titles."""
    specimen = facts.specimen or slug(sample.raw.path.stem)
    if sample.title and sample.own_specimen:
        specimen = slug(f"{specimen}_{sample.title}")
    return name_of(sample.raw.path, sample.title), options.specimen or specimen


def _source(sample: Sample, provenance: Provenance, facts: Facts) -> dict[str, object]:
    raw: RawFile = sample.raw
    return {
        "citation": provenance.citation or NOT_STATED,
        "licence": provenance.licence or NOT_STATED,
        **facts.source,
        schema.IMPORTED: raw.path.name,
        **({"raw_part": sample.title} if sample.title else {}),
        **({"rows_left_out": sample.left_out} if sample.left_out else {}),
        "raw_sha256": raw.sha256,
        "raw_format": facts.format,
    }
