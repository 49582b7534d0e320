"""Information of recordings of any kind about each parameter, and the gain from a repeat."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.calibrate.information import Information
from fitting.inference.lasting_noise import Lasting, Series, lasting
from fitting.inference.parameters import Parameter
from fitting.inference.parameters.parameter import FLAT
from fitting.specimens import Rows
from fitting.specimens.correlated_noise import independent
from pneusma_jax.calibration.records import Quantity

from .fit import GeneralFit
from .jumps import jumps

STEP = 1e-3
"""First step of a derivative, as a share of the parameter's prior 1-sigma."""
LONGEST = 1.0
"""Maximum step of a derivative, in standard errors that it gives if all other parameters were known.

An interval reaches as far to either side. Leads of an actuator had a prior of 0.6 ohm and an error of 4e-5
ohm. A step of 6e-4 ohm went over jumps of the prediction and gave an error of 4e-7 ohm."""
SHORTER = 0.1
"""Such a step that is taken in place of a longer one."""
STEEPEST = 1e-3
"""Minimum ratio of a step to the one before. An exponential that is followed for 15 errors is so steep there
that a tenth of the error is below `SHORTEST`."""
TRIES = 4
"""Maximum number of steps. Each is a tenth of the last or less, where the prediction jumps."""
SHORTEST = 1e-9
"""Minimum step of a derivative, as a share of the parameter's value, or of its first step near zero.

Equilibria are solved to 1e-10."""
GROWN = 10.0
"""Minimum ratio of an error to that of a longer step at which stairs are looked for [1]. There a deviation
from the slope counts that begins this much nearer than the error.

Of staircases of 0.25 to 5 errors the longer step gave the error, and a step of 0.1 errors gave none."""
CONSIDERED = 0.1
"""Step of a constant that is held, as a share of its prior's 1-sigma."""
NOTHING = 0.98
"""Ratio of error bars above which a repeat is not said to help."""


@dataclass(frozen=True)
class Repeat:
    """Expected gain from measuring once more like a recording.

    Attributes:
        name: name of the recording.
        information: expected gain about all free parameters within whose error the prediction does not jump
            [nats].
        shrinks: parameters whose error bar it shrinks most, with the ratio after to before, the most first.
    """

    name: str
    information: float
    shrinks: tuple[tuple[str, float], ...]


def informed(
    fit: GeneralFit, held: Mapping[str, Quantity] | None = None
) -> tuple[Information, list[np.ndarray], Lasting]:
    """Information of all fitted recordings together, and of each recording, held-out ones too; SI.

    And what zeros of the instruments that are off, or drift, add to the errors.

    Args:
        fit: any.
        held: constants that no recording shows, so that they were held; what is known of them counts.
    """
    names = fit.result.parameters.layout().free
    entries = [fit.result.parameters[name] for name in names]
    scale = np.array([_scale(entry) for entry in entries])
    start = fit.predict()
    found = [_slopes(fit, start, entry, size) for entry, size in zip(entries, scale, strict=True)]
    slopes = [one for one, _ in found]
    columns = [
        np.stack([_column(rows, slope[k], fit.inflation) for slope in slopes], axis=-1)
        for k, rows in enumerate(fit.rows)
    ]
    each = [column.T @ column for column in columns]
    fitted = [k for k, recording in enumerate(fit.recordings) if recording.role == "fit"]
    fisher = Information(
        names=tuple(names),
        matrix=np.sum([each[k] for k in fitted], axis=0),
        scale=scale,
        prior=np.array([_precision(entry) for entry in entries]),
        fixed=np.array([entry.at_bound for entry in entries]),
        jumping=tuple(name for name, (_, smooth) in zip(names, found, strict=True) if not smooth),
    )
    more = [_moved(fit, quantity) for quantity in (held or {}).values()]
    moving = np.concatenate([~fisher.fixed, np.ones(len(more), bool)])
    series = [one for k in fitted for one in _series(fit, k, [*slopes, *more], moving)]
    pull = np.array([0.0 if e.prior is None else e.value - e.prior.mean for e in entries] + [0.0] * len(more))
    precision = np.concatenate([fisher.prior, np.ones(len(more))])
    last = lasting(series, precision, pull, fit.inflation, fit.zeros, held=len(more))
    return fisher, each, last


def _moved(fit: GeneralFit, quantity: Quantity) -> list[dict[str, np.ndarray]]:
    """Change of every output with a constant that is held, by one standard deviation of its prior."""
    prior = quantity.prior
    reach = [quantity.value + side * CONSIDERED * prior.sd for side in (-1.0, 1.0)]
    low, high = (float(np.clip(end, prior.min, prior.max)) for end in reach)
    below, above = (fit.predict({**fit.result.values, quantity.name: end}) for end in (low, high))
    size = prior.sd / (high - low)
    return [{n: (a[n] - b[n]) * size for n in a} for b, a in zip(below, above, strict=True)]


def _series(
    fit: GeneralFit, k: int, slopes: Sequence[list[dict[str, np.ndarray]]], free: np.ndarray
) -> list[Series]:
    """Residuals of every output of a recording, with their slopes by parameters that are not at a bound."""
    rows, predicted, found = fit.rows[k], fit.predict()[k], []
    for name, weight in rows.weight.items():
        weight = np.asarray(weight)
        held = (weight > 0.0) & np.isfinite(predicted[name])
        columns = np.stack([_column_of(weight * held, s[k][name]) for s in slopes], axis=-1)
        if held.any():
            misfit = weight * (predicted[name] - rows.measured[name])
            time, share = np.asarray(rows.time)[held], rows.own_share(name)[held]
            found.append(Series(time, misfit[held], (columns * free)[held], name, share=share))
    return found


def _scale(entry: Parameter) -> float:
    """Natural size of a parameter: the standard deviation of its prior, or its magnitude without bounds."""
    sd = float(entry.prior_sd)
    return sd if np.isfinite(sd) else abs(float(entry.value)) or 1.0


def _precision(entry: Parameter) -> float:
    """Precision of the prior [SI^-2]; zero without a prior and bounds."""
    if entry.prior is not None:
        return entry.prior.sd**-2
    width = entry.max - entry.min
    return (FLAT / width) ** 2 if np.isfinite(width) else 0.0


def _slopes(
    fit: GeneralFit, start: Sequence[Mapping[str, np.ndarray]], entry: Parameter, size: float
) -> tuple[list[dict[str, np.ndarray]], bool]:
    """Derivative of every output by one parameter, and whether it describes the cost within its error.

    It comes from two predictions inside the bounds, no further from the fit than the error that it gives. A
    prediction that jumps there gives a smaller error, the closer they are. Two more predictions, an error
    away, show other jumps. Where it jumps, the derivative at the fit counts. So it does where a search inside
    a prediction would falsify a difference. Predictions closer than `SHORTEST` would differ by rounding
    alone.

    Args:
        fit: any.
        start: outputs of every recording at the fit.
        entry: parameter.
        size: its natural size, SI.
    """
    if fit.model.searches:
        return fit.derivative(entry.name), True
    step, least = STEP * size, np.inf
    shortest = SHORTEST * max(abs(entry.value), step)
    for _ in range(TRIES):
        slopes = _difference(fit, entry, step)
        error = _error_alone(fit, slopes)
        if entry.at_bound:
            return slopes, True
        if step <= LONGEST * error:
            reach = min(error, size)
            holds = reach / GROWN if error > GROWN * least else 0.0
            if any(_jumps(fit, start, slopes, entry, (shortest, end), holds) for end in (-reach, reach)):
                break
            return slopes, True
        step, least = max(SHORTER * error, STEEPEST * step), min(error, least)
        if step < shortest:
            break
    return fit.derivative(entry.name), False


def _jumps(
    fit: GeneralFit,
    start: Sequence[Mapping[str, np.ndarray]],
    slopes: Sequence[Mapping[str, np.ndarray]],
    entry: Parameter,
    ends: tuple[float, float],
    holds: float,
) -> bool:
    """True if the prediction jumps on one side of the fit.

    Args:
        fit, start, entry: as of `_slopes`.
        slopes: derivative of every output by the parameter.
        ends: shortest distance from the fit, and longest one with the sign of the side, SI.
        holds: distance within which the slope must hold, SI.
    """
    side, far = float(np.sign(ends[1])), abs(ends[1])
    room = entry.max - entry.value if side > 0.0 else entry.value - entry.min

    def deviation(distance: float) -> np.ndarray:
        moved = fit.predict({**fit.result.values, entry.name: entry.value + side * distance})
        return _fitted_column(
            fit,
            [
                {name: now[name] - before[name] - side * distance * slope[name] for name in now}
                for now, before, slope in zip(moved, start, slopes, strict=True)
            ],
        )

    return jumps(deviation, ends[0], min(far, room), holds)


def _difference(fit: GeneralFit, entry: Parameter, step: float) -> list[dict[str, np.ndarray]]:
    """Derivative of every output by one parameter, from predictions a step to either side, within bounds."""
    low, high = max(entry.value - step, entry.min), min(entry.value + step, entry.max)
    below, above = (fit.predict({**fit.result.values, entry.name: value}) for value in (low, high))
    pairs = zip(below, above, strict=True)
    return [{name: (b[name] - a[name]) / (high - low) for name in a} for a, b in pairs]


def _error_alone(fit: GeneralFit, slopes: Sequence[Mapping[str, np.ndarray]]) -> float:
    """Standard error of a parameter by its slopes in the fitted recordings, if all others were known [SI]."""
    told = float(np.sum(_fitted_column(fit, slopes) ** 2))
    return 1.0 / np.sqrt(told) if told > 0.0 else np.inf


def _fitted_column(fit: GeneralFit, columns: Sequence[Mapping[str, np.ndarray]]) -> np.ndarray:
    """Outputs of all fitted recordings in standard deviations, in one column."""
    parts = zip(fit.recordings, fit.rows, columns, strict=True)
    return np.concatenate(
        [_column(rows, one, fit.inflation) for recording, rows, one in parts if recording.role == "fit"]
    )


def _column(rows: Rows, slopes: Mapping[str, np.ndarray], inflation: float) -> np.ndarray:
    weights = {name: np.asarray(rows.weight[name]) / inflation for name in slopes}
    columns = {name: _column_of(weights[name], slope) for name, slope in slopes.items()}
    return np.concatenate([np.asarray(independent(rows, name, x)) for name, x in columns.items()])


def _column_of(weight: np.ndarray, slope: np.ndarray) -> np.ndarray:
    return np.nan_to_num(weight * slope, posinf=0.0, neginf=0.0)


def repeats(fit: GeneralFit, fisher: Information, each: Sequence[np.ndarray]) -> list[Repeat]:
    """Every recording as if it were measured once more, the most informative first.

    Only parameters whose slopes describe an error count. A specimen of which nothing is fitted is left out:
    a test of it would say most of its own sizes.
    """
    now, found = fisher.sd(), []
    fitted = {recording.specimen for recording in fit.recordings if recording.role == "fit"}
    for recording, more in zip(fit.recordings, each, strict=True):
        if recording.specimen not in fitted:
            continue
        ratio = np.where(now > 0.0, fisher.sd(more) / np.where(now > 0.0, now, 1.0), 1.0)
        order = [k for k in np.argsort(ratio) if ratio[k] < NOTHING and fisher.told[k]]
        shrinks = tuple((fisher.names[k], float(ratio[k])) for k in order[:4])
        found.append(Repeat(recording.name, fisher.gain(more), shrinks))
    return sorted(found, key=lambda repeat: -repeat.information)


def advice(found: Sequence[Repeat]) -> str:
    """The recommendation in a sentence."""
    best = found[0]
    if not best.shrinks:
        return "Measuring any of these once more would shrink no error bar by more than 2 %."
    helped = ", ".join(f"{name} to {100.0 * ratio:.0f} %" for name, ratio in best.shrinks)
    return (
        f"Of all repeats, one of {best.name} would tell most ({best.information:.1f} nats of information). "
        f"It would shrink the error of {helped} of its present size. Tests of another kind were not compared."
    )


def held_back(name: str) -> dict[str, Any]:
    """An entry of `open_constants` for a constant that no recording shows, so that it was held."""
    text = (
        f"{name} is still at the value it started from. It was held, because only a recording that takes the "
        "load off would show it. Its error is the prior's."
    )
    return {"kind": "at_start", "parameters": [name], "posterior_over_prior": 1.0, "text": text}
