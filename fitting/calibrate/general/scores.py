"""Errors of predictions, recording by recording and overall."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import schema
from fitting.inference.metrics import metrics
from pneusma_jax.units import from_si

from .fit import GeneralFit


@dataclass(frozen=True)
class Score:
    """One output of one recording beside its prediction, rows that count.

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
        """MAE and RMSE in the unit of the column, RPD and its signed form as fractions."""
        return measures(self.measured, self.predicted)


def measures(measured: np.ndarray, predicted: np.ndarray) -> dict[str, float]:
    """The source's measures: `mae`, `rmse`, `rpd`, `rpd_signed`."""
    return {name: float(value) for name, value in metrics(measured, predicted).items()}


def scores(fit: GeneralFit) -> list[Score]:
    """Every measured output of every recording, held-out ones too."""
    found, kind = [], fit.kind
    for recording, rows, predicted in zip(fit.recordings, fit.rows, fit.predict(), strict=True):
        over = fit.model.specimen.plotted_over(rows)
        x_column = "time_s" if over == "time" else schema.column_of(kind, over)
        x = np.asarray(rows.time if over == "time" else rows.inputs[over])
        for name, weight in rows.weight.items():
            held = (np.asarray(weight) > 0.0) & np.isfinite(predicted[name])
            if not held.any():
                continue
            column = schema.column_of(kind, name)
            unit = schema.quantity_and_unit(column)[1]
            misfit = (weight * (predicted[name] - rows.measured[name]))[held]
            found.append(
                Score(
                    name=recording.name,
                    role=recording.role,
                    column=column,
                    x_column=x_column,
                    x=np.asarray(from_si(x[held], schema.quantity_and_unit(x_column)[1])),
                    measured=np.asarray(from_si(np.asarray(rows.measured[name])[held], unit)),
                    predicted=np.asarray(from_si(predicted[name][held], unit)),
                    rms_over_noise=float(np.sqrt(np.mean(misfit**2))),
                )
            )
    return found


def overall(found: Sequence[Score], role: str) -> dict[str, dict[str, float]]:
    """Measures over all recordings of a role together, by column."""
    columns = dict.fromkeys(score.column for score in found if score.role == role)
    result = {}
    for column in columns:
        mine = [score for score in found if score.role == role and score.column == column]
        result[column] = measures(
            np.concatenate([score.measured for score in mine]),
            np.concatenate([score.predicted for score in mine]),
        )
    return result
