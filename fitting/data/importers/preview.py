"""Preview of an import as text for a terminal: kind, columns, units, ranges, first rows, notices."""

import numpy as np

from pneusma_jax.errors import counted

from ..recordings import NOT_STATED, Recording, schema

FIRST_ROWS = 5


def describe(recording: Recording) -> str:
    """Text that shows at a glance if the file was interpreted correctly.

    Args:
        recording: recording from an importer.

    Returns:
        Several lines: name and kind, a table of columns, the first rows, provenance, notices.
    """
    rows = counted(len(recording), "row")
    head = f"{recording.name}: kind {recording.kind}, specimen {recording.specimen}, {rows}"
    source = [f"{key}: {recording.source.get(key, NOT_STATED)}" for key in ("citation", "licence")]
    parts = [
        head,
        *_columns(recording),
        *_rows(recording),
        *source,
        *(f"- {text}" for text in sorted(recording.notices, key=lambda text: text.startswith("check: "))),
    ]
    return "\n".join([parts[0], *(f"  {part}" for part in parts[1:])])


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
