"""Reading of one recording: CSV, sidecar and overrides become a checked `Recording`."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pneusma_jax.errors import counted

from . import schema, sidecar, stated_columns
from .checks import check_recording
from .columns import canonical_columns, held_by, infer_kind
from .recording import Recording
from .table import Table, read_table, unusable
from .unusual import ask_about_units, question_units

_STATED = re.compile(r"(?P<name>[^\W\d][^\d:=]*?)\s*[:=]\s*[+-]?\.?\d")
"""Beginning of a comment that states a number: `wire diameter: 0.25`."""


def read_recording(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Recording:
    """Read `NAME.csv` and the `NAME.toml` beside it.

    Args:
        path: CSV file.
        overrides: settings that take precedence over the sidecar, with its keys (the command line's).

    Returns:
        The recording, with columns in canonical units.

    Raises:
        InputError: if anything in either file cannot be used; one line with file, row, column and remedy.
    """
    return read_merged(Path(path), {}, overrides)


def read_merged(
    path: Path,
    campaign: Mapping[str, Any],
    overrides: Mapping[str, Any] | None = None,
    name: str | None = None,
) -> Recording:
    """Read a recording of a campaign.

    Args:
        path: CSV file.
        campaign: checked tables that the campaign shares.
        overrides: settings as in `read_recording`.
        name: name in reports; by default the file's name without its ending.

    Raises:
        InputError: as `read_recording`.
    """
    if path.suffix.lower() == ".toml":
        raise unusable(path, f"this is a sidecar; name the recording itself, {path.with_suffix('.csv').name}")
    table = read_table(path)
    beside = path.with_suffix(".toml")
    stated = (
        sidecar.check_settings(sidecar.read_toml(beside), beside, schema.SIDECAR_KEYS)
        if beside.exists()
        else {}
    )
    commanded = sidecar.check_settings(overrides or {}, sidecar.COMMAND_LINE, schema.SIDECAR_KEYS)
    settings = sidecar.merge(campaign, stated, commanded)
    notices = list(table.notices)
    kind = settings.get("kind")
    if kind is None:
        kind, reason = infer_kind(table, settings.get("constant", {}))
        missing = f"{beside.name} does not state the kind" if beside.exists() else f"no sidecar {beside.name}"
        notices.append(f"{missing}: taken as kind {kind} from its columns ({reason})")
    where = beside if beside.exists() else path
    constant = _constants(table, settings, campaign, kind, where)
    columns, more, written = canonical_columns(table, kind, constant)
    if "specimen" not in settings:
        notices.append(f"no specimen stated: recordings that state none are taken as one specimen, {kind!r}")
    zero = stated_columns.zeros(campaign.get("zero", {}), kind, where, strict=False)
    extra = [column for column in columns if column not in schema.KINDS[kind].columns.known]
    recording = Recording(
        name=name or path.stem,
        path=path,
        kind=kind,
        role=settings.get("role", "fit"),
        specimen=settings.get("specimen", kind),
        real=settings.get("real"),
        source=settings.get("source", {}),
        noise=stated_columns.shared_noise(campaign.get("noise", {}), kind, columns, where)
        | stated_columns.check_noise(settings.get("noise", {}), kind, extra, where),
        geometry=settings.get("geometry", {}),
        tolerance=settings.get("tolerance"),
        zero=zero | stated_columns.zeros(settings.get("zero", {}), kind, where),
        columns=columns,
        notices=notices + more,
        comments=table.comments,
        noise_includes_rounding=settings.get("noise_includes_rounding", False),
    )
    others = {n: unit for n, unit in written.items() if unit != schema.quantity_and_unit(n)[1]}
    recording.written.update({name: (unit, 0.0) for name, unit in others.items()})
    check_recording(recording, table.rows, where)
    question_units(recording, table.header, table.rows)
    if schema.IMPORTED in recording.source:  # import asked, of the units of the raw file
        recording.notices.extend(_unsettled(recording))
    else:
        ask_about_units(recording, written)
    recording.notices.extend([*_sizes_in_comments(recording, beside.name), *_remarks(recording)])
    return recording


def _unsettled(recording: Recording) -> list[str]:
    """Questions about units that import left open, as its notes have them."""
    notes = recording.source.get("notes", [])
    asked = (note for note in notes if isinstance(note, str) and note.startswith("check:"))
    return [note for note in asked if "--unit" in note]


def _constants(
    table: Table, settings: Mapping[str, Any], campaign: Mapping[str, Any], kind: str, where: Path
) -> dict[str, Any]:
    """Constants in the place of columns: the campaign's for columns that the table lacks, then its own.

    Raises:
        InputError: if the recording states a constant and has a column of it.
    """
    own = stated_columns.constants(settings.get("constant", {}), kind, where, {})
    shared = stated_columns.constants({}, kind, where, campaign.get("constant", {}))
    for name in own:
        if held_by(table, kind, name):
            file = table.path.name
            raise unusable(where, f"[constant] {name}: {file} has a column of it; remove one of them")
    return {**{name: value for name, value in shared.items() if not held_by(table, kind, name)}, **own}


def _sizes_in_comments(recording: Recording, beside: str) -> list[str]:
    """Questions about sizes of the specimen that comments state and [geometry] does not."""
    known = {key: key for key in recording.full_geometry() if key in schema.GEOMETRY_NUMBERS}
    if "mandrel_diameter_mm" in known:
        known["coil_diameter_mm"] = "mandrel_diameter_mm"  # the wire wider
    words = {key.removesuffix("_mm").replace("_", " "): stated for key, stated in known.items()}
    found = []
    for comment in recording.comments:
        stated = _STATED.match(comment)
        name = " ".join(re.split(r"[\s_]+", stated["name"].lower())) if stated else ""
        key = words.get(name.removesuffix(" mm"))
        if key is not None and key not in recording.geometry:
            found.append(
                f"check: the comment {comment!r} was not read; state {key} under [geometry] of {beside}, or "
                f"the source's {recording.full_geometry()[key]:g} is taken"
            )
    return found


def _remarks(recording: Recording) -> list[str]:
    """Remarks on a missing licence and on rows of the same time."""
    found, columns = [], recording.columns
    licence = recording.source.get("licence", recording.source.get("license", ""))
    if recording.real and not str(licence).strip():
        found.append("real = true, and no licence is stated: fine for numbers of your own")
    repeated = int(np.sum(np.diff(columns["time_s"]) == 0.0)) if "time_s" in columns else 0
    if repeated:
        found.append(f"{counted(repeated, 'row has', 'rows have')} the same time_s as the row before")
    return found
