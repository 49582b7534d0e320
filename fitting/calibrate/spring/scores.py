"""Shear stress as predicted from resistance beside the measured one, and its errors: by test and overall."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax
import numpy as np

from fitting.inference.metrics import metrics_over_all
from fitting.specimens.correlated_noise import uncorrelated
from fitting.specimens.process_noise import FACTOR, from_resistances
from fitting.specimens.rows import numbers
from fitting.specimens.spring_rows import spring_of
from fitting.specimens.spring_trajectory import undecided

from .problem import Problem
from .residuals import values_of

UNINFORMED = 0.05
"""1-sigma [1] of a martensite fraction read from resistance alone, from which a row is hardly informed.

It is at most 0.011 in all rows of the shipped campaign. It is 0.25 in its hot test where this is simulated at
a fraction of 0.05. Any limit between them tells the two apart.
"""
BEYOND = 3.0
"""Minimum distance of a martensite fraction from 0 to 1 that noise does not make, in standard deviations."""
NAMES_IN_MPA = {"mae": "mae_MPa", "rmse": "rmse_MPa"}
"""Names of the metrics of a stress that have a unit."""


@dataclass(frozen=True)
class Score:
    """A test as it is predicted from elongation and resistance alone.

    Only rows count whose force was measured and has a weight.

    Attributes:
        name: name of the recording.
        role: `fit` or `validation`.
        time: time of these rows [s], shape (rows,).
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
    def impossible(self) -> float:
        """Share of rows whose fraction by resistance is below 0 or above 1 by more than its uncertainty."""
        if not self.xi0.size:
            return 0.0
        return float(np.mean((self.xi0 > 1.0 + BEYOND * self.xi0_sd) | (self.xi0 < -BEYOND * self.xi0_sd)))

    @property
    def metrics(self) -> dict[str, float]:
        """Four metrics by name, see `fitting.inference.metrics`; MAE and RMSE in MPa."""
        return _stress_metrics([(self.stress, self.predicted)])


def scores(problem: Problem, values: Mapping[str, float]) -> list[Score]:
    """Every test, those for validation too, predicted from elongation and resistance."""
    point = values_of(problem.parameters, values)
    plain = uncorrelated(undecided(problem.stacked))  # stack without decisions and without zeros that drift
    walk = plain.extra["process_noise"] / FACTOR  # a fit alone widens the variance, see FACTOR
    predicted, sd, _ = jax.device_get(from_resistances(point, plain, walk))
    result = []
    for k, test in enumerate(problem.tests):
        force_per_stress = float(spring_of(numbers(point, problem.rows[k])).geometry.force(1.0))  # m^2
        weight = {name: np.asarray(w[k]) for name, w in problem.stacked.weight.items()}
        compared = np.asarray(problem.stacked.mask[k]) & (weight["force"] > 0.0)
        measured = {name: np.asarray(m[k]) for name, m in problem.stacked.measured.items()}
        misfit = {name: weight[name] * (getattr(predicted, name)[k] - measured[name]) for name in weight}
        with_resistance = weight["resistance"] > 0.0
        result.append(
            Score(
                name=test.name,
                role=test.recording.role,
                time=np.asarray(problem.stacked.time[k])[compared],
                gamma=predicted.gamma[k][compared],
                stress=measured["force"][compared] / force_per_stress,
                predicted=predicted.stress[k][compared],
                xi0=predicted.xi0[k][compared],
                xi0_sd=sd[k][compared],
                uninformed=float(np.mean(sd[k][compared] > UNINFORMED)) if compared.any() else 0.0,
                resistance_rms=_rms(misfit["resistance"][with_resistance]),
                force_rms=_rms(misfit["force"][compared]),
            )
        )
    return result


def overall(every: Sequence[Score], role: str) -> dict[str, float] | None:
    """`Score.metrics` over all tests of a role together; None where there are none."""
    pairs = [(score.stress, score.predicted) for score in every if score.role == role and score.stress.size]
    return _stress_metrics(pairs) if pairs else None


def _stress_metrics(pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> dict[str, float]:
    """Metrics over pairs of measured and predicted shear stress [Pa]."""
    found = metrics_over_all((measured / 1e6, predicted / 1e6) for measured, predicted in pairs)
    return {NAMES_IN_MPA.get(name, name): value for name, value in found.items()}


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
