"""The last steps that every import shares: clock, empty rows, provenance, and the checks of the format."""

import re
from dataclasses import dataclass, field

import numpy as np

from ..recordings import NOT_STATED, Recording, check_recording, schema
from ..recordings.nominal import nominal_geometry
from .channels import UnitMissing, canonical, units_missing, with_options
from .derive import CREDIBLE_STRESS_MPA, derive
from .making import Channel, Making
from .mode_of_loading import compression_in
from .options import Options
from .parts import Sample
from .provenance import Provenance, find_provenance
from .raw import RawFile
from .running_clock import with_clock
from .straighten import gauge_pressure, straighten, subtract
from .strain_unit import settle_strain_unit
from .taut import largest
from .unused import explain, mark_used
from .words import COMPRESS


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
        InputError: if the quantities of the kind cannot be made, or the numbers cannot be.
    """
    raw, grid = sample.raw, sample.require_grid()
    place = f"{raw.path} ({sample.title})" if sample.title else str(raw.path)
    making = Making(
        with_options(channels, options), kind, options, sample.sizes, place, [*sample.notices, *notices],
        raw=frozenset(channels),
    )  # fmt: skip
    try:
        subtract(making)
        gauge_pressure(making)
        settle_strain_unit(making)
        derive(making)
        subtract(making)
        columns = canonical(making)
    except UnitMissing:
        raise units_missing(making) from None
    mark_used(making, columns)
    about, doubtful = _words_of(sample, making)
    kept = straighten(columns, making, about)
    _say_engineering(columns, making)
    _say_preload(sample, making)
    columns = {name: values[kept] for name, values in columns.items()}
    if not COMPRESS.search(about):
        _ask_about_compression(columns, making, doubtful)
    columns, rows = _drop_empty(columns, np.array(grid.rows)[kept], making.notices)
    columns = with_clock(columns, rows, making)
    provenance = find_provenance(raw.path, options.citation, options.licence, facts.provenance)
    making.notices += provenance.notices
    absent = [key for key in ("citation", "licence") if not getattr(provenance, key)]
    if absent:
        making.say(
            f"{' and '.join(absent)} not stated: fine for numbers of your own, needed to publish those of"
            " others"
        )
    geometry = _geometry(facts, making)
    if kind == "wire" and not {"temperature_degC", "resistance_ohm"} & columns.keys():
        making.warn(
            "there is no temperature, which the phase of a wire follows: characterise and diagnose refuse"
            " it. State one that"
            " did not change with --constant temperature_degC=..."
        )
    most = float(np.nanmax(np.abs(columns["stress_MPa"]))) if kind == "wire" else 0.0
    if most > CREDIBLE_STRESS_MPA:
        making.warn(
            f"stress reaches {most:.0f} MPa, more than any nitinol bears: is the cross-section right, and the"
            " wire of such an alloy?"
        )
    name, specimen = _names(sample, options, facts)
    recording = Recording(
        name=name,
        path=raw.path,
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
    check_recording(recording, [int(row) for row in rows])
    explain(making, columns)
    recording.source["notes"] = list(making.notices)
    return recording


def _words_of(sample: Sample, making: Making) -> tuple[str, str]:
    """Texts that state the mode of loading (headings of strain and stress, lines above the table, the sheet's
    name), and a line that may state it."""
    labels = [making.channels[name].label for name in ("strain", "stress") if name in making.channels]
    said, doubtful = compression_in([*sample.require_grid().preamble, [sample.title], [sample.sheet]])
    return "\n".join([*labels, *said]), doubtful


def _ask_about_compression(columns: dict[str, np.ndarray], making: Making, doubtful: str) -> None:
    """Ask if a test was one of compression, where a line of the file may say so and strain is positive."""
    if doubtful and making.kind == "elastomer" and making.options.compression is None:
        if largest(columns["strain"]) > 0.0:
            making.warn(
                f"a line speaks of compression ({doubtful[:60]!r}), but not as the kind of test, so the"
                " specimen was taken as pulled; if it was pressed: --compression (--tension if it was pulled,"
                " and this line goes)"
            )


def _say_engineering(columns: dict[str, np.ndarray], making: Making) -> None:
    """Report that a stress of unstated definition was taken as engineering stress, where that makes a
    difference."""
    stress = making.channels.get("stress")
    if making.kind != "elastomer" or stress is None or "stress" not in making.raw or "strain" not in columns:
        return
    words = ("engineering", "eng", "nominal", "pk1", "piola", "true", "agrees")
    told = any(word in stress.label.lower() for word in words) or "force" in making.sources
    if not told and float(np.nanmax(np.abs(columns["strain"]))) > 0.05:
        making.say(
            f"{stress.label!r} taken as engineering stress, load over the first cross-section (if it is"
            " true stress:"
            f" --map true_stress={stress.label!r})"
        )


def _say_preload(sample: Sample, making: Making) -> None:
    """Report that a file mentions a preload, so that its strain begins there and not at zero stress."""
    for row in sample.require_grid().preamble:
        line = " ".join(cell for cell in row if cell).strip()
        if re.search(r"pre-?\s?load|pre-?tension|vorkraft|pr[ée]charge", line, re.IGNORECASE):
            making.say(
                f"the file speaks of a preload ({line[:60]!r}): strain is counted from there, if at all"
            )
            return


def _geometry(facts: Facts, making: Making) -> dict:
    """Content of the sidecar's [geometry]: dimensions of the kind, and a law that is to be identified."""
    kind, notices = making.kind, making.notices
    known = {*nominal_geometry(kind, {}), *(schema.GEOMETRY_NUMBERS if kind == "actuator" else ())}
    stated = {
        key: size
        for key, size in making.options.dimensions.items()
        if key in schema.GEOMETRY_NUMBERS and key in known
    }
    for key in stated:
        making.use("--dimension", key)
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
    return geometry


def _names(sample: Sample, options: Options, facts: Facts) -> tuple[str, str]:
    """Names of the recording and of its specimen. Several tests of a file are distinguished by their
    titles."""
    stem = slug(sample.raw.path.stem)
    name = slug(f"{stem}_{sample.title}") if sample.title else stem
    specimen = facts.specimen or stem
    if sample.title and sample.own_specimen:
        specimen = slug(f"{specimen}_{sample.title}")
    return name, options.specimen or specimen


def _source(sample: Sample, provenance: Provenance, facts: Facts) -> dict[str, object]:
    raw: RawFile = sample.raw
    return {
        "citation": provenance.citation or NOT_STATED,
        "licence": provenance.licence or NOT_STATED,
        **facts.source,
        "raw_file": raw.path.name,
        **({"raw_part": sample.title} if sample.title else {}),
        "raw_sha256": raw.sha256,
        "raw_format": facts.format,
    }


def slug(text: str) -> str:
    """A valid name for files and specimens: letters, digits, points, dashes and underscores."""
    kept = "".join(c if c.isalnum() or c in ".-" else "_" for c in text)
    return "_".join(part for part in kept.split("_") if part) or "recording"


def _drop_empty(
    columns: dict[str, np.ndarray], rows: np.ndarray, notices: list[str]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Remove columns without a number, and rows in which only the clock was recorded."""
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
