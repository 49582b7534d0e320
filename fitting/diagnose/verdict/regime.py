"""The regime in which a model leaves more than noise: rows with a driver beyond a limit, or on one branch.

It is found on one half of the rows and confirmed on the other. Every recording is cut into stretches of
neighbouring rows, and the halves are every other stretch. The test is the exact one of Mann and Whitney. It
asks whether stretches inside the regime have larger misfit than those outside, by their ranks.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pneusma_jax.late import Late

from ..evaluate.program import Program
from ..fit.refit import Fit
from ..settings import DEFAULT
from .locate import distinct_drivers, sized

stats = Late("scipy.stats")
CHANCE = DEFAULT.chance
PLACE = DEFAULT.place


@dataclass(frozen=True)
class Regime:
    """Rows in which most of a misfit is.

    Attributes:
        text: description of the rows.
        share: share of the squared misfit beyond noise that they hold, in the half that confirms it [1].
        rows: share of that half's stretches that they are [1].
        p_value: p-value of the confirmation.
    """

    text: str
    share: float
    rows: float
    p_value: float


@dataclass(frozen=True)
class _Stretches:
    """Stretches of all recordings.

    Attributes:
        square: mean squared misfit of each, in variances of the noise, (stretches,).
        inside: true where most of its rows are in each regime, (stretches, regimes).
        texts: descriptions of the regimes.
    """

    square: np.ndarray
    inside: np.ndarray
    texts: list[str]


def regime_of(program: Program, fit: Fit, among: np.ndarray | None = None) -> Regime | None:
    """The regime of largest misfit of a model; None where none is confirmed.

    Args:
        program: program of the campaign.
        fit: model.
        among: true for recordings that are looked at, shape (recordings,); all by default.
    """
    chosen = np.ones(len(program.recordings), bool) if among is None else among
    found = _stretches(program, fit, chosen)
    if len(found.square) < 2 or not found.texts:
        return None
    half, other = slice(0, None, 2), slice(1, None, 2)
    chances = [_chance(found.square[half], own, "asymptotic") for own in found.inside[half].T]
    best = int(np.argmin(chances))
    square, inside = found.square[other], found.inside[other, best]
    p_value = _chance(square, inside, "exact")
    if p_value > CHANCE.level:
        return None
    return Regime(found.texts[best], _share(square, inside), float(inside.mean()), p_value)


def _chance(square: np.ndarray, inside: np.ndarray, method: str) -> float:
    """P-value of larger squares inside than outside; 1 where all are on one side."""
    if inside.all() or not inside.any():
        return 1.0
    found = stats.mannwhitneyu(square[inside], square[~inside], alternative="greater", method=method)
    return float(found.pvalue)


def _share(square: np.ndarray, inside: np.ndarray) -> float:
    """Share of the squares beyond noise that some stretches hold."""
    beyond = np.maximum(square - 1.0, 0.0)
    return float(beyond[inside].sum() / max(beyond.sum(), 1e-12))  # 0 of nothing


def _stretches(program: Program, fit: Fit, chosen: np.ndarray) -> _Stretches:
    """Every chosen recording in stretches, with the regimes that most of their rows are in."""
    regimes = [*_regimes(program.kind, distinct_drivers(program, fit)), *_recordings(program)]
    means, members = [], []
    for k in np.flatnonzero(chosen):
        squares, counts = _row_squares(program, fit, k)
        rows = np.flatnonzero(counts)
        for stretch in np.array_split(rows, max(len(rows) // PLACE.stretch, 1)):
            if len(stretch):
                means.append(squares[stretch].sum() / counts[stretch].sum())
                members.append([np.mean(inside[k][stretch]) > 0.5 for _, inside in regimes])
    texts = [text for text, _ in regimes]
    return _Stretches(np.array(means), np.array(members, bool).reshape(len(means), len(texts)), texts)


def _row_squares(program: Program, fit: Fit, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Sum of the squared misfits of all outputs in every row of recording k, and how many outputs there are.

    Both have the shape (rows,). Misfits are in standard deviations of the noise.
    """
    squares, first = np.zeros(program.stacked.mask.shape[1]), 0
    counts = np.zeros_like(squares)
    for channel in program.channels[k]:
        size, there = len(channel.measured), np.isfinite(channel.sigma)
        squares[:size] += np.where(there, fit.evaluation.misfit[k][first : first + size] ** 2, 0.0)
        counts[:size] += there
        first += size
    return squares, counts


def _regimes(kind: str, drivers: dict[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    """Names of regimes and the rows that are in them, (recordings, rows).

    Args:
        kind: kind of the recordings.
        drivers: values of every driver, SI, (recordings, rows). One that hardly varies has no regimes.
    """
    for name, values in drivers.items():
        values, words = np.nan_to_num(values), name.replace("_", " ")
        if np.ptp(values) <= 1e-9 * max(np.max(np.abs(values)), 1e-300):  # rounding errors, or zeros
            continue
        for q in PLACE.quantiles:
            limit = float(np.quantile(values, q))
            yield f"{words} above {sized(kind, name, limit)}", values > limit
            yield f"{words} below {sized(kind, name, limit)}", values < limit
        if name != "time":
            change = np.gradient(_smooth(values), axis=1)
            yield f"{words} is rising", change > 0.0
            yield f"{words} is falling", change < 0.0


def _recordings(program: Program) -> Iterator[tuple[str, np.ndarray]]:
    """Single recordings as regimes."""
    shape = len(program.recordings), program.stacked.mask.shape[1]
    for k, recording in enumerate(program.recordings):
        inside = np.zeros(shape, bool)
        inside[k] = True
        yield f"the recording is {recording.name}", inside


def _smooth(values: np.ndarray) -> np.ndarray:
    """Moving means over one stretch of rows, (recordings, rows)."""
    width = min(PLACE.stretch, values.shape[1])
    kernel = np.ones(width) / width
    padded = np.pad(values, ((0, 0), (width // 2, width - 1 - width // 2)), mode="edge")
    return np.stack([np.convolve(row, kernel, mode="valid") for row in padded])
