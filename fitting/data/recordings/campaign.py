"""Reading of a campaign: a folder of recordings, or a single one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneusma_jax.errors import InputError

from . import schema, sidecar, stated_columns
from .questions import ask_about_copies
from .reading import read_merged
from .recording import Campaign, Recording
from .table import first_of, unusable

CAMPAIGN_FILE = "campaign.toml"


def read_campaign(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Campaign:
    """Read a folder of recordings (sub-folders too), or a single CSV as a campaign of one.

    Args:
        path: folder or CSV; `campaign.toml` in the folder gives the title and the shared tables.
        overrides: settings that take precedence over campaign and sidecars, with the keys of a sidecar.

    Returns:
        The campaign, with recordings in the order of their names.

    Raises:
        InputError: if there is nothing to read or any file cannot be used. The message is the first one's
            line, with the number of further bad files.
    """
    path = Path(path)
    if not path.exists():
        raise unusable(path, "there is no such file or folder")
    sidecar.check_settings(overrides or {}, sidecar.COMMAND_LINE, schema.SIDECAR_KEYS)
    shared = _shared_settings(path if path.is_dir() else path.parent)
    notices: list[str] = []
    files = [(path, path.stem)]
    if path.is_dir():
        found = _recordings_in(path, notices)
        files = [(file, file.relative_to(path).with_suffix("").as_posix()) for file in found]
    recordings: list[Recording] = []
    errors: list[InputError] = []
    for file, name in files:
        try:
            recordings.append(read_merged(file, shared, overrides, name))
        except InputError as error:
            errors.append(error)
    if errors:
        raise first_of(errors)
    _check_specimens(recordings)
    ask_about_copies(recordings)
    notices += [f"{CAMPAIGN_FILE}: {text}" for text in stated_columns.unused(shared, recordings)]
    title = shared.get("title", path.resolve().name if path.is_dir() else path.stem)
    return Campaign(title, recordings, path, notices)


def _shared_settings(folder: Path) -> dict[str, Any]:
    file = folder / CAMPAIGN_FILE
    if not file.exists():
        return {}
    found = sidecar.check_settings(sidecar.read_toml(file), file, schema.CAMPAIGN_KEYS)
    stated_columns.check_shared(found, file)
    return found


def _recordings_in(folder: Path, notices: list[str]) -> list[Path]:
    """CSV files below a folder, without hidden ones. A sidecar without its CSV is an error."""
    found = [p for p in sorted(folder.rglob("*")) if not _hidden(p.relative_to(folder))]
    files = [p for p in found if p.suffix.lower() == ".csv" and p.is_file()]
    if not files:
        raise unusable(folder, "there is no recording (NAME.csv) in this folder")
    described = {p.with_suffix("") for p in files}
    for other in (p for p in found if p.suffix == ".toml" and p.with_suffix("") not in described):
        if other.name == CAMPAIGN_FILE:
            if other.parent != folder:
                notices.append(
                    f"{other.relative_to(folder)} was not used; only the campaign's own folder has one"
                )
        elif _states_a_kind(other):
            raise unusable(other, f"this sidecar has no recording; {other.stem}.csv is missing beside it")
    return files


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _states_a_kind(file: Path) -> bool:
    """True if a TOML is a sidecar. Alloys and models may lie beside recordings too."""
    try:
        return sidecar.read_toml(file).get("kind") in schema.KINDS
    except InputError:
        return False


def _check_specimens(recordings: list[Recording]) -> None:
    first: dict[str, Recording] = {}
    for recording in recordings:
        other = first.setdefault(recording.specimen, recording)
        if other.kind != recording.kind:
            raise unusable(
                recording.path or recording.name,
                f"specimen {recording.specimen!r} is of kind {recording.kind} here but of kind {other.kind}"
                f" in {other.path}. One specimen is of one kind: give the other its own name",
            )
