"""Profile likelihoods: the misfit over one parameter when all others follow it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fitting.inference.least_squares import FitResult
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameter, Parameters
from pneusma_jax.errors import InputError, nearest

ALIKE = 1.0
"""Chi-square within which two fits are as good."""
STEPS = (-2.0, -1.0, 1.0, 2.0)
"""Standard errors from the best value at which the others are refitted."""
CURVED = 0.3
"""Relative departure from a parabola from which the standard error misleads."""

Pinned = Callable[[Mapping[str, float], Mapping[str, float]], FitResult]
"""A fit from values (first) with some parameters held (second), SI, everything decided as at the best fit."""


@dataclass(frozen=True)
class Profile:
    """Misfit over one parameter.

    Attributes:
        name: of the parameter.
        value: where it was held, SI, ascending, shape (points,).
        rise: of chi-square, priors included, above its least value, shape (points,).
        stopped: where the others stopped before their end, at a kink of the law's memory: the rise is an
            upper limit there; shape (points,).
        sd: standard error that a parabola would have, SI.
        below: by how much chi-square is less at its least than at the fit; more than chance says that the fit
            had not reached its end.
        lowest: free parameters there, SI; empty where the fit is the least.
    """

    name: str
    value: np.ndarray
    rise: np.ndarray
    stopped: np.ndarray
    sd: float
    below: float = 0.0
    lowest: Mapping[str, float] = field(default_factory=dict)

    @property
    def parabola(self) -> np.ndarray:
        """Rise that the standard error stands for, shape (points,)."""
        return ((self.value - self.value[np.argmin(self.rise)]) / self.sd) ** 2

    @property
    def curved(self) -> bool:
        """The profile is not the parabola of the standard error, which misleads or spans other fits, too."""
        off = self._off
        return bool(np.any(off < -CURVED) or np.any(off[~self.stopped] > CURVED))

    @property
    def unsure(self) -> bool:
        """Fits that stopped early leave open whether the profile is that parabola."""
        return not self.curved and bool(np.any(self._off[self.stopped] > CURVED))

    @property
    def _off(self) -> np.ndarray:
        """Relative departure from the parabola, 0 next to its centre, shape (points,)."""
        wanted = self.parabola
        away = wanted > 0.5
        return np.where(away, self.rise / np.where(away, wanted, 1.0) - 1.0, 0.0)

    def interval(self, rise: float = 1.0) -> tuple[float, float]:
        """Ends of the values whose chi-square rises by less than `rise`; infinite where the profile never
        does.
        """
        root = np.sqrt(self.rise)
        middle = int(np.argmin(self.rise))
        low, high = root[: middle + 1][::-1], root[middle:]
        values_low, values_high = self.value[: middle + 1][::-1], self.value[middle:]
        limit = np.sqrt(rise)
        lower = float(np.interp(limit, low, values_low)) if low.max() >= limit else -np.inf
        upper = float(np.interp(limit, high, values_high)) if high.max() >= limit else np.inf
        return lower, upper


def followed(
    names: Sequence[str],
    parameters: Mapping[str, Parameter],
    values: Mapping[str, float],
    uncertainty: Uncertainty,
    fit: Pinned,
) -> dict[str, Profile]:
    """Profile likelihoods: from the best fit outwards, each point begun at its neighbour's.

    Args:
        names: of free parameters with a standard error.
        parameters: at the best fit, SI.
        values: the same as numbers.
        uncertainty: of the best fit.
        fit: with parameters held; called once with none.

    Returns:
        By parameter.

    Raises:
        InputError: if one is not free, has no standard error, or the model has no answer at the fit.
    """
    for name in names:
        if name not in parameters:
            raise InputError(f"there is no free parameter {name!r}, {nearest(name, parameters)}")
        if parameters[name].standard_error is None:
            raise InputError(f"{name} has no standard error, so there is nothing to profile it over")
    least = fit(values, {}).chi_square if names else 0.0
    if least is None:
        raise InputError(f"the model has no answer at the fit, so {', '.join(names)} cannot be profiled")
    return {name: _followed(parameters[name], name, values, uncertainty, fit, least) for name in names}


def _followed(
    entry: Parameter,
    name: str,
    values: Mapping[str, float],
    uncertainty: Uncertainty,
    fit: Pinned,
    least: float,
) -> Profile:
    """Profile of one parameter over a fit whose chi-square is `least`."""
    found, results = [(entry.value, 0.0, False)], {}
    follow = _followers(uncertainty, name)
    for side in (-1.0, 1.0):
        at = dict(values)
        for step in sorted((s for s in STEPS if s * side > 0.0), key=abs):
            value = float(np.clip(entry.value + step * entry.standard_error, entry.min, entry.max))
            if any(value == known for known, _, _ in found):
                continue
            moved = value - at[name]
            start = {n: at[n] + moved * slope for n, slope in follow.items()}
            result = _lowest([{**at, **start}, at], lambda begin, pin={name: value}: fit(begin, pin))
            if result is None:
                break
            found.append((value, result.chi_square - least, not result.success))
            at = results[value] = result.values
    found.sort()
    value, rise, stopped = (np.array(column) for column in zip(*found, strict=True))
    below = max(-float(rise.min()), 0.0)
    lowest = results.get(float(value[np.argmin(rise)]), {})
    return Profile(name, value, rise + below, stopped, float(entry.standard_error), below, lowest)


def lower_end(found: Mapping[str, Profile]) -> tuple[str, Mapping[str, float]] | None:
    """Parameter and place of the profile that fell furthest below the fit; None where none did."""
    deepest = max(found.values(), key=lambda p: p.below, default=None)
    return (deepest.name, deepest.lowest) if deepest and deepest.below > ALIKE else None


def loosest(parameters: Parameters, names: Sequence[str], count: int) -> list[str]:
    """Parameters, of those named, that the recordings leave most open, measured by their priors."""
    share = {}
    for name in names:
        entry = parameters[name]
        if entry.standard_error is not None and entry.prior is not None:
            share[name] = entry.standard_error / entry.prior.sd
    return sorted(share, key=share.get, reverse=True)[:count]


def _lowest(
    starts: Sequence[Mapping[str, float]], fit: Callable[[Mapping[str, float]], FitResult]
) -> FitResult | None:
    """The first fit that ends well, else the lowest of those that stopped early; None if there is none."""
    found = []
    for start in starts:
        result = fit(start)
        if result.chi_square is not None:
            found.append(result)
            if result.success:
                return result
    return min(found, key=lambda r: r.chi_square, default=None)


def _followers(uncertainty: Uncertainty, name: str) -> dict[str, float]:
    """How the other parameters move with one, by the covariance of the fit."""
    names, covariance = uncertainty.names, uncertainty.covariance
    if name not in names:
        return {}
    k = names.index(name)
    return {n: float(covariance[i, k] / covariance[k, k]) for i, n in enumerate(names) if i != k}
