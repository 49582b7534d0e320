"""Distributions of one input, as functions of a standard normal score.

A score z has the probability Phi(z) below it. Scores, and not probabilities, because a Gaussian copula
correlates them, subset simulation and FORM live in their space, and upper tails keep their digits.
"""

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Float
from scipy import stats
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr, ndtri

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import to_si

SPACING = 0.2
"""Maximum distance of the scores at which quantiles of draws are joined [sd]: 31 scores for 4,000 draws."""
BEYOND = 10
"""Number of draws beyond the outermost of these scores. It scatters by a third, as the root of itself."""


class Marginal(Protocol):
    """Distribution of one input."""

    def at(self, z: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """Values [SI] at normal scores."""

    def slope(self, z: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """Derivative of the value by the score [SI]."""

    @property
    def words(self) -> str:
        """Description for people."""


@dataclass(frozen=True)
class Gaussian:
    """A normal distribution, cut at `low` and `high`; SI."""

    mean: float
    sd: float
    low: float = -np.inf
    high: float = np.inf

    def _cut(self, z: np.ndarray) -> np.ndarray:
        """Score of the distribution without cuts at a score of the cut one."""
        low, high = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        inside = ndtr(high) - ndtr(low)
        below, above = ndtr(low) + inside * ndtr(z), ndtr(-high) + inside * ndtr(-z)
        return np.where(z <= 0.0, ndtri(below), -ndtri(above))

    def at(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        return np.clip(self.mean + self.sd * self._cut(z), self.low, self.high)

    def slope(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`; zero at scores beyond 38, where double precision knows no probability."""
        low, high = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        cut = self._cut(z)
        known = np.isfinite(cut)
        slope = np.exp(0.5 * (np.where(known, cut, 0.0) ** 2 - z**2))
        return self.sd * (ndtr(high) - ndtr(low)) * np.where(known, slope, 0.0)

    @property
    def words(self) -> str:
        """See `Marginal`."""
        ends = "" if np.isinf(self.low) and np.isinf(self.high) else ", cut"
        return f"normal{ends}"


@dataclass(frozen=True)
class FromScipy:
    """Any continuous distribution of `scipy.stats`.

    Attributes:
        name: name of the distribution there.
        numbers: its shapes, `loc` and `scale`, as (name, value), in `unit`.
        unit: unit of its values.
    """

    name: str
    numbers: tuple[tuple[str, float], ...]
    unit: str = "1"

    @property
    def _frozen(self) -> stats.rv_continuous:
        return getattr(stats, self.name)(**dict(self.numbers))

    def _values(self, z: np.ndarray) -> np.ndarray:
        """Values in `unit` at normal scores; each tail by its own probability, which keeps its digits."""
        return np.where(z <= 0.0, self._frozen.ppf(ndtr(z)), self._frozen.isf(ndtr(-z)))

    def at(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        return to_si(self._values(np.asarray(z, float)), self.unit)

    def slope(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`; zero where the density is zero."""
        z = np.asarray(z, float)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = stats.norm.pdf(z) / self._frozen.pdf(self._values(z))
        return to_si(np.where(np.isfinite(slope), slope, 0.0), self.unit, difference=True)

    @property
    def words(self) -> str:
        """See `Marginal`."""
        return self.name


@dataclass(frozen=True, eq=False)
class Empirical:
    """Draws of a posterior, as a smooth function of the score.

    The quantiles of the draws are joined by a monotone cubic, whose slope FORM can follow. The tails are
    those of a normal distribution, and end at the outermost draws: of what lies beyond, draws say nothing.

    Attributes:
        values: values in ascending order [SI], shape (draws,).
    """

    values: Float[np.ndarray, " draws"]
    _curve: PchipInterpolator = field(init=False, repr=False)

    def __post_init__(self) -> None:
        count = len(self.values)
        scores = ndtri((np.arange(count) + 0.5) / count)
        end = -ndtri(min(BEYOND, 0.25 * count) / count)
        knots = np.linspace(-end, end, 1 + 2 * math.ceil(end / SPACING))
        curve = PchipInterpolator(knots, np.interp(knots, scores, self.values), extrapolate=False)
        object.__setattr__(self, "_curve", curve)

    @property
    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Outermost scores of the curve, and the slopes of the tails: those of the last half sigma inside."""
        outer = self._curve.x[[0, -1]]
        inner = outer - 0.5 * np.sign(outer)
        return outer, (self._curve(outer) - self._curve(inner)) / (outer - inner)

    def _without_ends(self, z: np.ndarray) -> np.ndarray:
        """Values at normal scores, the tails going on beyond the outermost draws."""
        (low, high), (falling, rising) = self._ends
        below, above = np.minimum(z - low, 0.0), np.maximum(z - high, 0.0)
        return self._curve(np.clip(z, low, high)) + falling * below + rising * above

    def at(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        return np.clip(self._without_ends(np.asarray(z, float)), self.values[0], self.values[-1])

    def slope(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`; zero where the values end."""
        z = np.asarray(z, float)
        (low, high), (falling, rising) = self._ends
        inside = self._curve(np.clip(z, low, high), 1)
        slope = np.where(z < low, falling, np.where(z > high, rising, inside))
        value = self._without_ends(z)
        return np.where((value < self.values[0]) | (value > self.values[-1]), 0.0, slope)

    @property
    def words(self) -> str:
        """See `Marginal`."""
        return f"{len(self.values)} draws of a posterior"


def from_scipy(name: str, numbers: dict[str, float], unit: str, where: str) -> FromScipy:
    """A distribution of `scipy.stats`, checked.

    Args:
        name: name of the distribution there.
        numbers: its shapes, `loc` and `scale`.
        unit: unit of its values.
        where: file and key, for messages.

    Raises:
        InputError: for a name or shape that is not there, or numbers that give no distribution.
    """
    known = [n for n in dir(stats) if isinstance(getattr(stats, n), stats.rv_continuous)]
    if name not in known:
        raise InputError(
            f"{where}: distribution {name!r} is none of the continuous ones of scipy.stats; "
            f"{nearest(name, known) if len(name) > 2 else 'such as norm, uniform, lognorm, beta'}"
        )
    kind = getattr(stats, name)
    shapes = [s.strip() for s in (kind.shapes or "").split(",") if s.strip()]
    for key in numbers:
        if key not in (*shapes, "loc", "scale"):
            raise InputError(
                f"{where}: {key!r} is no parameter of {name}, which has "
                f"{', '.join((*shapes, 'loc', 'scale'))}"
            )
    for shape in shapes:
        if shape not in numbers:
            raise InputError(f"{where}: {name} needs the shape {shape!r}")
    made = FromScipy(name, tuple(sorted(numbers.items())), unit)
    with np.errstate(all="ignore"):
        ends = made.at(np.array([-2.0, 0.0, 2.0]))
    if not np.all(np.isfinite(ends)) or not ends[2] > ends[0]:
        stated = ", ".join(f"{key} = {value:g}" for key, value in numbers.items())
        raise InputError(f"{where}: {name} with {stated} is no distribution: its quantiles are not finite")
    return made
