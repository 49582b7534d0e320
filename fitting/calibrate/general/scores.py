"""Measured outputs beside their predictions, and errors of the predictions, by recording and overall."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import schema
from fitting.inference.metrics import metrics_over_all
from fitting.specimens import Rows
from pneusma_jax.units import from_si

from .fit import GeneralFit


@dataclass(frozen=True)
class Score:
    """One output of one recording beside its prediction.

    Only rows count whose measured value has a weight and whose prediction is finite.

    Attributes:
        name: name of the recording; role: `fit` or `validation`; column: column of the output.
        x_column: column that it is drawn over.
        x, measured, predicted: values in the units of files, shape (rows,).
        rms_over_noise: root mean square of the misfit over the noise [1].
    """

    name: str
    role: str
    column: str
    x_column: str
    x: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    rms_over_noise: float

    @property
    def metrics(self) -> dict[str, float]:
        """Four metrics by name, see `fitting.inference.metrics`; MAE and RMSE in the unit of the column."""
        return metrics_over_all([(self.measured, self.predicted)])


def scores(fit: GeneralFit) -> list[Score]:
    """Every measured output of every recording, held-out ones too."""
    found = []
    for recording, rows, predicted in zip(fit.recordings, fit.rows, fit.predict(), strict=True):
        x_column, x = _abscissa(fit, rows)
        for output, weight in rows.weight.items():
            counts = (np.asarray(weight) > 0.0) & np.isfinite(predicted[output])
            if not counts.any():
                continue
            column = schema.column_of(fit.kind, output)
            misfit = (weight * (predicted[output] - rows.measured[output]))[counts]
            found.append(
                Score(
                    name=recording.name,
                    role=recording.role,
                    column=column,
                    x_column=x_column,
                    x=_in_file_units(x[counts], x_column),
                    measured=_in_file_units(np.asarray(rows.measured[output])[counts], column),
                    predicted=_in_file_units(predicted[output][counts], column),
                    rms_over_noise=float(np.sqrt(np.mean(misfit**2))),
                )
            )
    return found


def _abscissa(fit: GeneralFit, rows: Rows) -> tuple[str, np.ndarray]:
    """Column that a recording is drawn over, and its values [SI]."""
    name = fit.model.specimen.plotted_over(rows)
    if name == "time":
        return "time_s", np.asarray(rows.time)
    return schema.column_of(fit.kind, name), np.asarray(rows.inputs[name])


def _in_file_units(values: np.ndarray, column: str) -> np.ndarray:
    return np.asarray(from_si(values, schema.quantity_and_unit(column)[1]))


def overall(every: Sequence[Score], role: str) -> dict[str, dict[str, float]]:
    """`Score.metrics` over all recordings of a role together, by column."""
    pairs: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for score in every:
        if score.role == role:
            pairs.setdefault(score.column, []).append((score.measured, score.predicted))
    return {column: metrics_over_all(same) for column, same in pairs.items()}
