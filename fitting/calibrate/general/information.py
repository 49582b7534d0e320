"""What recordings of any kind say about each parameter, what they leave open, what a repeat would add."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fitting.calibrate.spring.information import HARDLY, STAYED, TOGETHER, Information
from fitting.inference.lasting_noise import Lasting, Series, lasting
from fitting.inference.parameters import Parameter, Parameters
from fitting.specimens import Rows
from pneusma_jax.calibration.records import Quantity

from .fit import GeneralFit

STEP = 1e-3
"""Step of a derivative, as a share of the parameter's prior 1-sigma."""
FLAT = 12.0**0.5
"""Width of a flat prior in its standard deviations."""
CONSIDERED = 0.1
"""Step of a constant that is held, as a share of its prior's 1-sigma."""
NOTHING = 0.98
"""Ratio of error bars above which a repeat is not said to help."""


@dataclass(frozen=True)
class Repeat:
    """What measuring once more like a recording would add.

    Attributes:
        name: name of the recording.
        information: expected gain about all free parameters [nats].
        shrinks: parameters whose error bar it shrinks most, with the ratio after to before, the most first.
    """

    name: str
    information: float
    shrinks: tuple[tuple[str, float], ...]


def informed(
    fit: GeneralFit, held: Mapping[str, Quantity] | None = None
) -> tuple[Information, list[np.ndarray], Lasting]:
    """Information of all fitted recordings together, and of each recording, held-out ones too; SI.

    And what zeros of the instruments that are off, or wander, add to the errors.

    Args:
        fit: any.
        held: constants that no recording shows, so that they were held; what is known of them counts.
    """
    names = fit.result.parameters.layout().free
    entries = [fit.result.parameters[name] for name in names]
    scale = np.array([_scale(entry) for entry in entries])
    slopes = [_slopes(fit, entry, size) for entry, size in zip(entries, scale, strict=True)]
    columns = [
        np.stack([_column(rows, slope[k], fit.inflation) for slope in slopes], axis=-1)
        for k, rows in enumerate(fit.rows)
    ]
    each = [column.T @ column for column in columns]
    fitted = [k for k, recording in enumerate(fit.recordings) if recording.role == "fit"]
    told = Information(
        names=tuple(names),
        matrix=np.sum([each[k] for k in fitted], axis=0),
        scale=scale,
        prior=np.array([_precision(entry) for entry in entries]),
        fixed=np.array([entry.at_bound for entry in entries]),
    )
    series = [one for k in fitted for one in _series(fit, k, slopes, ~told.fixed)]
    pull = np.array([0.0 if e.prior is None else e.value - e.prior.mean for e in entries])
    last = lasting(series, told.prior, pull, fit.inflation)
    if held:
        last = replace(last, held=_considered(fit, told, [columns[k] for k in fitted], fitted, held))
    return told, each, last


def _considered(
    fit: GeneralFit,
    told: Information,
    columns: Sequence[np.ndarray],
    fitted: Sequence[int],
    held: Mapping[str, Quantity],
) -> np.ndarray:
    """What the doubt about constants that are held adds to each parameter's variance, over that variance.

    The doubt is the prior's, reduced by the recordings' own information about such a constant. A fit with
    that constant free would have these errors (S. F. Schmidt's considered parameters, with the data's
    information about them).
    """
    covariance = told.covariance()
    taken = {name: quantity.value for name, quantity in held.items()}
    moved = []
    for name, quantity in held.items():
        step = CONSIDERED * quantity.prior.sd
        ends = [
            float(np.clip(quantity.value + side * step, quantity.prior.min, quantity.prior.max))
            for side in (-1.0, 1.0)
        ]
        below, above = (fit.predict({**fit.result.values, **taken, name: end}) for end in ends)
        size = quantity.prior.sd / (ends[1] - ends[0])
        rows = [
            _column(fit.rows[k], {n: (above[k][n] - below[k][n]) * size for n in above[k]}, fit.inflation)
            for k in fitted
        ]
        moved.append(np.concatenate(rows))
    more = np.stack(moved, axis=-1)
    slopes = np.where(told.fixed, 0.0, np.concatenate(list(columns)))
    pull = slopes.T @ more
    given_way = covariance @ pull
    doubt = np.linalg.inv(np.eye(len(held)) + more.T @ more - pull.T @ given_way)
    added, variance = np.einsum("ij,jk,ik->i", given_way, doubt, given_way), np.diag(covariance)
    return np.where(told.fixed | ~(variance > 0.0), 0.0, added / np.where(variance > 0.0, variance, 1.0))


def _series(
    fit: GeneralFit, k: int, slopes: Sequence[list[dict[str, np.ndarray]]], free: np.ndarray
) -> list[Series]:
    """What is left of every output of a recording, with its slopes by parameters that are not at a bound."""
    rows, predicted, found = fit.rows[k], fit.predict()[k], []
    for name, weight in rows.weight.items():
        weight = np.asarray(weight)
        held = (weight > 0.0) & np.isfinite(predicted[name])
        columns = np.stack([_column_of(weight * held, s[k][name]) for s in slopes], axis=-1)
        if held.any():
            misfit = weight * (predicted[name] - rows.measured[name])
            found.append(Series(np.asarray(rows.time)[held], misfit[held], (columns * free)[held], name))
    return found


def _scale(entry: Parameter) -> float:
    """Natural size of a parameter: of its prior, of its range where it is flat, or its own."""
    if entry.prior is not None:
        return float(entry.prior.sd)
    width = entry.max - entry.min
    return width / FLAT if np.isfinite(width) else abs(float(entry.value)) or 1.0


def _precision(entry: Parameter) -> float:
    if entry.prior is not None:
        return entry.prior.sd**-2
    width = entry.max - entry.min
    return (FLAT / width) ** 2 if np.isfinite(width) else 0.0


def _slopes(fit: GeneralFit, entry: Parameter, size: float) -> list[dict[str, np.ndarray]]:
    """Derivative of every output by one parameter, from two predictions inside its bounds."""
    low, high = max(entry.value - STEP * size, entry.min), min(entry.value + STEP * size, entry.max)
    below, above = (fit.predict({**fit.result.values, entry.name: value}) for value in (low, high))
    pairs = zip(below, above, strict=True)
    return [{name: (b[name] - a[name]) / (high - low) for name in a} for a, b in pairs]


def _column(rows: Rows, slopes: Mapping[str, np.ndarray], inflation: float) -> np.ndarray:
    weights = {name: np.asarray(rows.weight[name]) / inflation for name in slopes}
    return np.concatenate([_column_of(weights[name], slope) for name, slope in slopes.items()])


def _column_of(weight: np.ndarray, slope: np.ndarray) -> np.ndarray:
    return np.nan_to_num(weight * slope, posinf=0.0, neginf=0.0)


def repeats(fit: GeneralFit, told: Information, each: Sequence[np.ndarray]) -> list[Repeat]:
    """Every recording as if it were measured once more, the most informative first."""
    now, found = told.sd(), []
    for recording, more in zip(fit.recordings, each, strict=True):
        ratio = np.where(now > 0.0, told.sd(more) / np.where(now > 0.0, now, 1.0), 1.0)
        order = [k for k in np.argsort(ratio) if ratio[k] < NOTHING and not told.fixed[k]]
        shrinks = tuple((told.names[k], float(ratio[k])) for k in order[:4])
        found.append(Repeat(recording.name, told.gain(more), shrinks))
    return sorted(found, key=lambda repeat: -repeat.information)


def advice(found: Sequence[Repeat]) -> str:
    """The recommendation in a sentence."""
    best = found[0]
    if not best.shrinks:
        return "Measuring any of these once more would shrink no error bar by more than 2 %."
    helped = ", ".join(f"{name} to {100.0 * ratio:.0f} %" for name, ratio in best.shrinks)
    return (
        f"Of repeats of what was measured, one more like {best.name} says most ({best.information:.1f} "
        f"nats): it would shrink the error of {helped} of what it is. Tests of another kind were not "
        "compared."
    )


def cannot_tell(
    told: Information,
    parameters: Parameters,
    start: Mapping[str, float],
    absent: Mapping[str, str] | None = None,
) -> list[dict[str, Any]]:
    """What these recordings leave open, in words.

    Args:
        told: Fisher information of the recordings.
        parameters: free parameters at the values found.
        start: values before the fit, SI.
        absent: parameters whose bound means that there is nothing, with a sentence each.

    Returns:
        Entries with `kind`, `parameters`, a number and `text`. There is one for each parameter at a bound,
        still at its start or hardly informed. Loose combinations and pairs that are known only together have
        one, too.
    """
    absent = absent or {}
    stopped = [name for name, fixed in zip(told.names, told.fixed, strict=True) if fixed]
    entries = [_bound(name, absent.get(name)) for name in stopped]
    alone, covered = _alone(told, parameters, start)
    return entries + alone + _loose(told, covered) + _pairs(told)


def held_back(name: str) -> dict[str, Any]:
    """An entry of `cannot_tell` for a constant that no recording shows, so that it was held."""
    text = (
        f"{name} is still at the value it started from: it was held, since no recording takes the load off, "
        "which alone would show it; its error is the prior's."
    )
    return {"kind": "at_start", "parameters": [name], "posterior_over_prior": 1.0, "text": text}


def _bound(name: str, absent: str | None = None) -> dict[str, Any]:
    if absent:
        return {"kind": "absent", "parameters": [name], "text": absent}
    text = (
        f"{name} stopped at its bound: the data, or another cause of misfit, pull it further than it may go. "
        "It has no error, and the other errors hold if it is truly there."
    )
    return {"kind": "at_bound", "parameters": [name], "text": text}


def _alone(
    told: Information, parameters: Parameters, start: Mapping[str, float]
) -> tuple[list[dict[str, Any]], set[str]]:
    """Parameters about which the recordings say next to nothing even if all others were known."""
    entries, covered = [], set()
    marginal = told.sd() / told.scale
    best = told.alone() / told.scale
    for k, name in enumerate(told.names):
        if told.fixed[k] or best[k] < HARDLY:
            continue
        covered.add(name)
        stayed = abs(parameters[name].value - start[name]) < STAYED * told.scale[k]
        where = "is still at the value it started from" if stayed else "is hardly informed"
        text = (
            f"{name} {where}: these recordings do not show it, and its error of {100.0 * marginal[k]:.0f} "
            "% of the prior's comes from the prior."
        )
        kind = "at_start" if stayed else "not_informed"
        ratio = float(marginal[k])
        entries.append({"kind": kind, "parameters": [name], "posterior_over_prior": ratio, "text": text})
    return entries, covered


def _loose(told: Information, covered: set[str]) -> list[dict[str, Any]]:
    """Combinations along which the recordings say less than the priors."""
    kept = [k for k, name in enumerate(told.names) if not told.fixed[k] and name not in covered]
    if len(kept) < 2:
        return []
    scaled = (told.matrix * np.outer(told.scale, told.scale))[np.ix_(kept, kept)]
    entries = []
    for value, axis in _axes(scaled):
        ratio = 1.0 / np.sqrt(1.0 + max(value, 0.0))
        if ratio < HARDLY:
            break
        main = [i for i in np.argsort(-np.abs(axis)) if abs(axis[i]) >= 0.4 * np.abs(axis).max()]
        names = [told.names[kept[i]] for i in main]
        if len(names) < 2:
            continue
        moves = " while ".join(
            f"{name} {'rises' if axis[i] > 0 else 'falls'}" for name, i in zip(names, main, strict=True)
        )
        text = (
            f"{', '.join(names[:-1])} and {names[-1]} cannot be separated by these recordings: {moves}, "
            f"by as much as the priors allow, and the fit stays as good (error along it {100.0 * ratio:.0f} "
            "% of the priors')."
        )
        entry = {"kind": "loose_direction", "parameters": names, "posterior_over_prior": float(ratio)}
        entries.append({**entry, "text": text})
    return entries


def _axes(scaled: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """Eigenvalues, the smallest first, with their directions."""
    width, axes = np.linalg.eigh(scaled)
    return [(float(value), axis) for value, axis in zip(width, axes.T, strict=True)]


def _pairs(told: Information) -> list[dict[str, Any]]:
    covariance = told.covariance()
    spread = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    correlation = covariance / np.outer(spread, spread)
    entries = []
    for i, one in enumerate(told.names):
        for j in range(i):
            if told.fixed[i] or told.fixed[j] or abs(correlation[i, j]) < TOGETHER:
                continue
            text = (
                f"{told.names[j]} and {one} are known only together (correlation "
                f"{correlation[i, j]:+.3f}): what they make together was measured, not each of them."
            )
            entries.append({
                "kind": "known_together", "parameters": [told.names[j], one],
                "correlation": float(correlation[i, j]), "text": text,
            })  # fmt: skip
    return entries
