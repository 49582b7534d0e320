"""Disagreements of the Gaussian approximation with the draws, and their meaning for an error bar."""

import math
from dataclasses import dataclass

from fitting.inference.numbers import number

SHIFT, RATIO, SKEWNESS = 0.25, 1.15, 0.5
"""Minimum disagreement to be reported: of means in standard deviations, of the ratio of widths, of
skewness."""


@dataclass(frozen=True)
class Disagreement:
    """Disagreement about one parameter.

    Attributes:
        shift: mean of the draws less the mode, in Laplace's standard deviations; NaN without one.
        ratio: standard deviation of the draws over Laplace's; NaN without one.
        skewness: skewness of the draws.
    """

    shift: float
    ratio: float
    skewness: float

    @property
    def notable(self) -> bool:
        """True if the approximation would mislead."""
        return bool(self.reasons)

    @property
    def reasons(self) -> list[str]:
        """Ends of a sentence, one for each kind of disagreement."""
        if math.isnan(self.ratio):
            return ["has no Laplace approximation (on a bound, or not determined by the data)"]
        found = []
        if abs(self.shift) > SHIFT:
            found.append(
                f"its mean lies {number(abs(self.shift), '.2g')} sd "
                f"{'above' if self.shift > 0 else 'below'} the fit"
            )
        if not 1.0 / RATIO < self.ratio < RATIO:
            wide = self.ratio > 1.0
            small = "too small" if wide else "too large"
            found.append(f"its error is {number(self.ratio, '.2g')} times the fit's ({small} there)")
        if abs(self.skewness) > SKEWNESS:
            found.append(
                f"it leans to {'high' if self.skewness > 0 else 'low'} values (skewness {self.skewness:+.2g})"
            )
        return found


def compare(mean: float, sd: float, skewness: float, mode: float, laplace_sd: float) -> Disagreement:
    """Compare draws with the approximation of the same parameter, both in one unit."""
    if not laplace_sd > 0.0:
        return Disagreement(math.nan, math.nan, skewness)
    return Disagreement((mean - mode) / laplace_sd, sd / laplace_sd, skewness)
