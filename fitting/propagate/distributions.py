"""Distributions of one input, as functions of a standard normal score.

A score z has the probability Phi(z) below it. Scores, and not probabilities, because a Gaussian copula
correlates them, subset simulation and FORM live in their space, and upper tails keep their digits.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float
from scipy import stats
from scipy.special import ndtr, ndtri

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import to_si


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
        held = ndtr(high) - ndtr(low)
        below, above = ndtr(low) + held * ndtr(z), ndtr(-high) + held * ndtr(-z)
        return np.where(z <= 0.0, ndtri(below), -ndtri(above))

    def at(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        return np.clip(self.mean + self.sd * self._cut(z), self.low, self.high)

    def slope(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        low, high = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        cut = self._cut(z)
        return self.sd * (ndtr(high) - ndtr(low)) * np.exp(0.5 * (cut**2 - z**2))

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

    def at(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        frozen, z = self._frozen, np.asarray(z, float)
        values = np.where(z <= 0.0, frozen.ppf(ndtr(z)), frozen.isf(ndtr(-z)))
        return to_si(values, self.unit)

    def slope(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        frozen, z = self._frozen, np.asarray(z, float)
        values = np.where(z <= 0.0, frozen.ppf(ndtr(z)), frozen.isf(ndtr(-z)))
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = stats.norm.pdf(z) / frozen.pdf(values)
        return to_si(np.where(np.isfinite(slope), slope, 0.0), self.unit, difference=True)

    @property
    def words(self) -> str:
        """See `Marginal`."""
        return self.name


@dataclass(frozen=True, eq=False)
class Empirical:
    """Draws of a posterior, joined by straight lines between their quantiles.

    Attributes:
        values: values in ascending order [SI], shape (draws,).
    """

    values: Float[np.ndarray, " draws"]

    def _place(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        place = ndtr(z) * (len(self.values) - 1)
        first = np.minimum(place.astype(int), len(self.values) - 2)
        return first, place - first

    def at(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`."""
        first, rest = self._place(np.asarray(z, float))
        return self.values[first] + rest * (self.values[first + 1] - self.values[first])

    def slope(self, z: np.ndarray) -> np.ndarray:
        """See `Marginal`; over a hundredth of the draws, because single ones lie anywhere."""
        z = np.asarray(z, float)
        half = 0.05
        return (self.at(z + half) - self.at(z - half)) / (2.0 * half)

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
