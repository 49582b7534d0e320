"""Contribution of a model discrepancy (`unmodelled`) to a simulation, and flags where it leaves its range."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Array

from fitting.data.recordings import schema
from fitting.specimens.saved_models import AddedDiscrepancy, AugmentedModel
from pneusma_jax.units import from_si

BEYOND = "model_beyond_range"
"""Column that is 1 in rows where a discrepancy is held at its end value or unknown, else 0."""


def marked(
    model: AugmentedModel, seen: Mapping[str, Array], kind: str, left_out: Sequence[str] = ()
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns and sentences about a model's discrepancies; empty for a model without any.

    Args:
        model: simulated model.
        seen: channels of the simulation, SI, shape (rows,) each.
        kind: kind of recording.
        left_out: quantities that the result shows without the discrepancy.

    Returns:
        `model_unmodelled_<column>`, the part added to an output in its column's unit, and `BEYOND`; then
        warnings.
    """
    columns: dict[str, np.ndarray] = {}
    notices = []
    for rest in model.remainders:
        sums, marks = f"unmodelled_{rest.quantity}", f"beyond_{rest.quantity}"
        if sums not in seen or rest.quantity in left_out:
            notices.append(f"{rest.words} of a {rest.kind}, does not act here: it is left out")
            continue
        column = _column(kind, rest.quantity)
        unit = schema.quantity_and_unit(column)[1]
        columns[f"model_unmodelled_{column}"] = np.asarray(from_si(np.asarray(seen[sums]), unit))
        beyond = np.asarray(seen[marks]) > 0.0
        columns[BEYOND] = np.maximum(columns.get(BEYOND, 0.0), beyond.astype(float))
        notices.append(f"{column} holds {rest.words}: it describes and does not explain")
        notices += _beyond(rest, beyond)
    return columns, notices


def _beyond(rest: AddedDiscrepancy, beyond: np.ndarray) -> list[str]:
    if not beyond.any():
        return []
    where = "" if beyond.size == 1 else f" in {int(beyond.sum())} of {beyond.size} rows"
    return [
        f"extrapolated: {rest.words}, was seen for {rest.span_words} only; beyond it is held at its end value"
        f"{where}"
    ]


def _column(kind: str, quantity: str) -> str:
    """Canonical column of an output."""
    return schema.column_of(kind, quantity) or quantity
