"""One point of a profile: a fit with the parameter held, begun at several places and gone on to its end."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fitting.inference.least_squares import FitResult, Status
from fitting.inference.least_squares.covariance import Uncertainty

from .profile_likelihood import WIDTH_99

LONGER = 6
"""Most times that a fit which made all steps that are allowed goes on."""
FITS = 30
"""Most fits for each constant in a search. What one leaves, later ones may take."""
GAINS = 0.1
"""Least fall of chi-square in one turn to go on for; it moves the end of a 90 % interval by 2 %."""
FAR = 2.0
"""Root of the rise over that of 99 % from which a fit does not go on: it decides about no end."""


class ConstrainedFit(Protocol):
    """A fit from values (first) with some parameters held (second), SI."""

    def __call__(self, values: Mapping[str, float], held: Mapping[str, float]) -> FitResult:
        """Everything is decided as at the best fit."""


@dataclass
class Work:
    """Fits that a search has made, and may have made by the end of a constant's profile.

    Attributes:
        done: fits so far.
        most: fits that are allowed so far.
        cut: true if this constant's profile wanted more.
    """

    done: int = 0
    most: int = 0
    cut: bool = False

    def begin(self) -> None:
        """Another constant, with fits of its own and what others left."""
        self.most, self.cut = self.most + FITS, False

    def over(self) -> bool:
        """True if no further fit is allowed; remembered, as whoever asks wants one."""
        self.cut = self.cut or self.done >= self.most
        return self.done >= self.most


@dataclass(frozen=True)
class HeldFits:
    """Fits of all other parameters with one held.

    Attributes:
        name: name of the parameter.
        fit: function that fits with some parameters held.
        again: the same with everything decided anew, tried where `fit` stops early; None for none.
        least: the best fit, with nothing held.
        rise_per_sd: rise of chi-square that counts as one standard deviation.
        work: counts the fits.
    """

    name: str
    fit: ConstrainedFit
    again: ConstrainedFit | None
    least: FitResult
    rise_per_sd: float
    work: Work

    def at(
        self, value: float, starts: Sequence[Mapping[str, float]], near: Mapping[str, float]
    ) -> FitResult | None:
        """The lowest fit with the parameter at a value; None where the model has no answer.

        Args:
            value: value of the parameter, SI.
            starts: values of all parameters to begin from, in this order, SI.
            near: those of a point close by, to decide everything anew from where no start has an answer.
        """
        result = self._to_the_end(self._lowest(starts, value), value)
        if self.again is None or (result is not None and _ended(result)):
            return result
        self.work.done += 1
        other = self.again(near if result is None else result.values, {self.name: value})
        return min(
            (r for r in (result, other) if r is not None and r.chi_square is not None),
            key=lambda r: r.chi_square,
            default=None,
        )

    def rise(self, result: FitResult) -> float:
        """Rise of chi-square over the best fit; negative where it fell."""
        return result.chi_square - self.least.chi_square

    def rise_by_data(self, result: FitResult) -> float:
        """Part of the rise that the recordings make."""
        return _by_data(result) - _by_data(self.least)

    def _once(self, begin: Mapping[str, float], value: float) -> FitResult:
        self.work.done += 1
        return self.fit(begin, {self.name: value})

    def _lowest(self, starts: Sequence[Mapping[str, float]], value: float) -> FitResult | None:
        """The first fit that ends, else the lowest of those that stopped early; None if there is none."""
        found = []
        for start in starts:
            result = self._once(start, value)
            if result.chi_square is not None:
                found.append(result)
                if _ended(result):
                    return result
        return min(found, key=lambda r: r.chi_square, default=None)

    def _to_the_end(self, result: FitResult | None, value: float) -> FitResult | None:
        """A fit that made all steps that are allowed, gone on while it gains and may decide about an end."""
        for _ in range(LONGER):
            if result is None or not _cut_short(result) or self.work.over():
                break
            if self.rise(result) > self.rise_per_sd * (FAR * WIDTH_99) ** 2:
                break
            further = self._once(result.values, value)
            if further.chi_square is None or further.chi_square >= result.chi_square:
                break
            gain, result = result.chi_square - further.chi_square, further
            if gain < self.rise_per_sd * GAINS:
                break
        return result


def _ended(result: FitResult) -> bool:
    """True if a fit has converged, made all steps that are allowed, or gains too little to go on.

    Another start would gain little.
    """
    return result.success or _cut_short(result) or getattr(result, "status", None) is Status.LINGERING


def _cut_short(result: FitResult) -> bool:
    """True if a fit has made all steps that are allowed."""
    return getattr(result, "status", None) is Status.MAX_STEPS


def _by_data(result: FitResult) -> float:
    """Chi-square of the recordings alone."""
    own = getattr(result, "residual", None)
    return float("nan") if own is None else float(np.sum(np.asarray(own) ** 2))


def followers(uncertainty: Uncertainty, name: str) -> dict[str, float]:
    """Change of the other parameters with one, by the covariance of the fit."""
    names, covariance = uncertainty.names, uncertainty.covariance
    if name not in names:
        return {}
    k = names.index(name)
    return {n: float(covariance[i, k] / covariance[k, k]) for i, n in enumerate(names) if i != k}
