"""Preview of an import as text for a terminal: kind, columns, units, ranges, first rows, notices."""

from collections.abc import Iterable, Sequence, Set

import numpy as np

from pneusma_jax.errors import counted

from ..recordings import NOT_STATED, Recording, schema

FIRST_ROWS = 5


def describe_all(recordings: Sequence[Recording]) -> list[str]:
    """Texts that show at a glance if the files were interpreted correctly.

    Returns:
        Several lines for each recording, see `describe`. Notices that several share are told once, in texts
        of their own behind those, with the names of the recordings.
    """
    owners: dict[str, list[str]] = {}
    for recording in recordings:
        for notice in dict.fromkeys(recording.notices):
            owners.setdefault(notice, []).append(recording.name)
    shared: dict[tuple[str, ...], list[str]] = {}
    for notice, names in owners.items():
        if len(names) > 1:
            shared.setdefault(tuple(names), []).append(notice)
    own = {notice for notice, names in owners.items() if len(names) == 1}
    texts = [describe(recording, own) for recording in recordings]
    for names, notices in shared.items():
        head = f"all {len(names)} recordings" if len(names) == len(recordings) else ", ".join(names)
        texts.append("\n".join([f"{head}:", *(f"  {line}" for line in _listed(notices))]))
    return texts


def describe(recording: Recording, told: Set[str] | None = None) -> str:
    """Text that shows at a glance if the file was interpreted correctly.

    Args:
        recording: recording from an importer.
        told: notices that are told here; all of the recording by default.

    Returns:
        Several lines: name and kind, a table of columns, the first rows, provenance, notices.
    """
    rows = counted(len(recording), "row")
    head = f"{recording.name}: kind {recording.kind}, specimen {recording.specimen}, {rows}"
    source = [f"{key}: {recording.source.get(key, NOT_STATED)}" for key in ("citation", "licence")]
    notices = [text for text in recording.notices if told is None or text in told]
    parts = [head, *_columns(recording), *_rows(recording), *source, *_listed(notices)]
    return "\n".join([parts[0], *(f"  {part}" for part in parts[1:])])


def _listed(notices: Iterable[str]) -> list[str]:
    """A line for each notice, questions last."""
    return [f"- {text}" for text in sorted(notices, key=lambda text: text.startswith("check: "))]


def _columns(recording: Recording) -> list[str]:
    lines = [f"{'column':<20}{'unit':>6}{'least':>14}{'largest':>14}{'missing':>9}"]
    for name, values in recording.columns.items():
        unit = schema.quantity_and_unit(name)[1] if name in recording.known_columns else "?"
        least, largest, missing = np.nanmin(values), np.nanmax(values), np.isnan(values).sum()
        unit = unit.replace("1pm", "1/m")
        lines.append(f"{name:<20}{unit:>6}{least:>14.6g}{largest:>14.6g}{missing:>9d}")
    return lines


def _rows(recording: Recording) -> list[str]:
    lines = ["first rows:", "".join(f"{name:>18}" for name in recording.columns)]
    for i in range(min(FIRST_ROWS, len(recording))):
        cells = ("" if np.isnan(values[i]) else f"{values[i]:.6g}" for values in recording.columns.values())
        lines.append("".join(f"{cell:>18}" for cell in cells))
    return lines
