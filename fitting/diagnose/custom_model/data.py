"""Recordings of one's own as arrays that map over one compiled function."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pneusma_jax.errors import InputError
from pneusma_jax.numerics.rows import filled


@dataclass(frozen=True)
class OwnRecording:
    """One test.

    Attributes:
        name: name for reports.
        columns: quantities that change from row to row, by name, each of shape (rows, ...).
        facts: fixed quantities by name, of any shape, but the same in all recordings.
        measured: outputs of the base, by name, each of shape (rows, ...); NaN where missing.
        sigma: 1-sigma of each output, in its unit.
        role: `fit`, or `validation`: never fitted, only predicted.
    """

    name: str
    columns: Mapping[str, np.ndarray]
    measured: Mapping[str, np.ndarray]
    sigma: Mapping[str, float]
    facts: Mapping[str, np.ndarray] = field(default_factory=dict)
    role: str = "fit"

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))


@dataclass(frozen=True)
class Stacked:
    """Recordings along a leading axis, padded by their last row to the longest.

    Attributes:
        columns, facts, measured: same as those of `OwnRecording`, with that axis.
        weight: one over sigma of every measured value, zero where missing or padded.
    """

    columns: dict[str, np.ndarray]
    facts: dict[str, np.ndarray]
    measured: dict[str, np.ndarray]
    weight: dict[str, np.ndarray]

    def tree(self, chosen: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
        """Argument of a residual: everything, weighed by a number for each recording."""
        weight = {k: w * chosen.reshape(-1, *[1] * (w.ndim - 1)) for k, w in self.weight.items()}
        parts = {"columns": self.columns, "facts": self.facts, "measured": self.measured}
        return {**parts, "weight": weight}

    def counted(self, chosen: np.ndarray) -> int:
        """Measured values of some recordings."""
        return int(sum((w[chosen > 0.0] > 0.0).sum() for w in self.weight.values()))


def stacked(recordings: Sequence[OwnRecording]) -> Stacked:
    """Stack recordings.

    Raises:
        InputError: if there are none, columns or outputs differ between them, or lengths do not agree.
    """
    if not recordings:
        raise InputError("there is no recording to explain")
    first, longest = recordings[0], max(len(r) for r in recordings)
    for recording in recordings:
        for what in ("columns", "facts", "measured", "sigma"):
            if set(getattr(recording, what)) != set(getattr(first, what)):
                raise InputError(
                    f"recording {recording.name!r} has other {what} than {first.name!r}:"
                    f" {sorted(getattr(recording, what))} and {sorted(getattr(first, what))}"
                )
        lengths = {len(values) for values in (*recording.columns.values(), *recording.measured.values())}
        if len(lengths) != 1:
            raise InputError(
                f"recording {recording.name!r} has columns of different lengths: {sorted(lengths)}"
            )
        for name, sigma in recording.sigma.items():
            if not sigma > 0.0:
                raise InputError(
                    f"recording {recording.name!r}: sigma of {name!r} must be more than 0, not {sigma:g}"
                )

    def padded(values: np.ndarray) -> np.ndarray:
        return filled(np.asarray(values, float), longest)

    def weights(recording: OwnRecording, name: str) -> np.ndarray:
        values = np.asarray(recording.measured[name], float)
        full = np.zeros((longest, *values.shape[1:]))
        full[: len(values)] = np.isfinite(values) / recording.sigma[name]
        return full

    return Stacked(
        {name: np.stack([padded(r.columns[name]) for r in recordings]) for name in first.columns},
        {name: np.stack([np.asarray(r.facts[name], float) for r in recordings]) for name in first.facts},
        {
            name: np.nan_to_num(np.stack([padded(r.measured[name]) for r in recordings]))
            for name in first.measured
        },
        {name: np.stack([weights(r, name) for r in recordings]) for name in first.measured},
    )
