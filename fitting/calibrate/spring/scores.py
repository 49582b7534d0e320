"""Errors of the shear stress as predicted from resistance, test by test and overall."""

from collections.abc import Mapping
from dataclasses import dataclass

import jax
import numpy as np

from fitting.inference.metrics import metrics
from fitting.specimens.correlated_noise import uncorrelated
from fitting.specimens.process_noise import FACTOR, from_resistances
from fitting.specimens.rows import numbers
from fitting.specimens.spring_rows import spring_of
from fitting.specimens.spring_trajectory import undecided

from .problem import Problem, values_of

UNINFORMED = 0.05
"""1-sigma of a martensite fraction read from resistance alone, from which a row counts as hardly informed."""


@dataclass(frozen=True)
class Score:
    """A test as it is predicted from elongation and resistance alone, by rows that count.

    Attributes:
        name: name of the recording.
        role: `fit` or `validation`.
        time: time of the rows with a force [s], shape (rows,).
        gamma: shear strain [1], shape (rows,).
        stress, predicted: measured and predicted shear stress [Pa], shape (rows,).
        xi0, xi0_sd: martensite fraction read from resistance, and its standard deviation [1], shape (rows,).
        uninformed: share of the rows whose resistance hardly informs the martensite fraction.
        resistance_rms: root mean square of the resistance's misfit under a smooth martensite fraction, over
            its noise [1].
        force_rms: root mean square of the force's misfit, over its noise [1].
    """

    name: str
    role: str
    time: np.ndarray
    gamma: np.ndarray
    stress: np.ndarray
    predicted: np.ndarray
    xi0: np.ndarray
    xi0_sd: np.ndarray
    uninformed: float
    resistance_rms: float
    force_rms: float

    @property
    def metrics(self) -> dict[str, float]:
        """MAE and RMSE in MPa, RPD and its signed form as fractions."""
        return stress_metrics(self.stress, self.predicted)


def stress_metrics(stress: np.ndarray, predicted: np.ndarray) -> dict[str, float]:
    """The source's measures of shear stress [Pa]: `mae_MPa`, `rmse_MPa`, `rpd`, `rpd_signed`."""
    found = metrics(stress / 1e6, predicted / 1e6)
    named = {"mae": "mae_MPa", "rmse": "rmse_MPa", "rpd": "rpd", "rpd_signed": "rpd_signed"}
    return {new: float(found[old]) for old, new in named.items()}


def scores(problem: Problem, values: Mapping[str, float]) -> list[Score]:
    """Every test, those for validation too, predicted from elongation and resistance."""
    point, plain = values_of(problem.parameters, values), uncorrelated(undecided(problem.stacked))
    implied = plain.extra["process_noise"] / FACTOR  # it suits predictions
    found, sd, _ = jax.device_get(from_resistances(point, plain, implied))
    result = []
    for k, test in enumerate(problem.tests):
        area = float(spring_of(numbers(point, problem.rows[k])).geometry.force(1.0))
        weight = {name: np.asarray(w[k]) for name, w in problem.stacked.weight.items()}
        compared = np.asarray(problem.stacked.mask[k]) & (weight["force"] > 0.0)
        measured = {name: np.asarray(m[k]) for name, m in problem.stacked.measured.items()}
        misfit = {name: weight[name] * (getattr(found, name)[k] - measured[name]) for name in weight}
        known = weight["resistance"] > 0.0
        result.append(
            Score(
                name=test.name,
                role=test.recording.role,
                time=np.asarray(problem.stacked.time[k])[compared],
                gamma=found.gamma[k][compared],
                stress=measured["force"][compared] / area,
                predicted=found.stress[k][compared],
                xi0=found.xi0[k][compared],
                xi0_sd=sd[k][compared],
                uninformed=float(np.mean(sd[k][compared] > UNINFORMED)) if compared.any() else 0.0,
                resistance_rms=_rms(misfit["resistance"][known]),
                force_rms=_rms(misfit["force"][compared]),
            )
        )
    return result


def overall(found: list[Score], role: str) -> dict[str, float] | None:
    """Measures over all tests of a role together; None where there are none."""
    mine = [score for score in found if score.role == role and score.stress.size]
    if not mine:
        return None
    return stress_metrics(
        np.concatenate([score.stress for score in mine]), np.concatenate([score.predicted for score in mine])
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
