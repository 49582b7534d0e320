"""Profile likelihoods: the misfit over one parameter when all others follow it, and its intervals."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fitting.inference.parameters import Parameters
from pneusma_jax.late import Late

interpolate = Late("scipy.interpolate")
ALIKE = 1.0
"""Chi-square within which two fits are as good."""
CURVED = 0.3
"""Relative departure from a parabola from which the standard error misleads."""
FLAT = float(np.sqrt(12.0))
"""Width of a flat prior in its standard deviations."""
RISES = {50: 0.454936, 68: 1.0, 90: 2.705543}
"""Chi-square that an interval of so many per cent spans: quantiles of its distribution for one parameter.

The 68 is one standard deviation, 68.27 %."""
WIDTH_90 = float(np.sqrt(RISES[90]))
"""Standard errors from the best value to the end of a 90 % interval, of a parabola."""
NEAR = 0.15
"""Relative distance of the root of a rise from that of a limit up to which no further point is looked for.

Between points the value is interpolated over the root, in which a parabola is a straight line."""

RENEWALS = 2
"""Maximum number of times that a fit goes on where a profile found a lower chi-square."""


@dataclass(frozen=True)
class Profile:
    """Misfit over one parameter.

    Attributes:
        name: name of the parameter.
        value: values at which it was held, SI, ascending, shape (points,).
        rise: rise of chi-square, priors included, above its least value, shape (points,).
        stopped: true where the other parameters stopped before their end, at a kink of the law's memory; the
            rise is an upper limit there; shape (points,).
        sd: standard error that a parabola would have, SI; NaN of a parameter at a bound.
        below: chi-square at the fit, less its least value on the profile. If it is more than chance explains,
            the fit had not reached its end.
        lowest: free parameters there, SI; empty where the fit is the least.
        told: part of the rise that the recordings alone make, shape (points,); None where nobody asked.
        bounds: bounds of the parameter, SI.
        unit: rise that counts as one standard deviation: more than 1 beside noise that lasts.
        visited: all free parameters at every point, SI; empty where nobody kept them.
    """

    name: str
    value: np.ndarray
    rise: np.ndarray
    stopped: np.ndarray
    sd: float
    below: float = 0.0
    lowest: Mapping[str, float] = field(default_factory=dict)
    told: np.ndarray | None = None
    bounds: tuple[float, float] = (-np.inf, np.inf)
    unit: float = 1.0
    visited: Sequence[Mapping[str, float]] = ()

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
        """Ends of the values whose chi-square rises by less than `rise`, in units of `unit`; infinite where
        the profile never does.
        """
        lower, upper = (self._end(side, rise) for side in (-1, 1))
        return lower[0], upper[0]

    def quoted(self, percent: int) -> tuple[float, float]:
        """Interval of 50, 68 or 90 %, SI; a side that never rises enough ends at the parameter's bound."""
        low, high = self.interval(RISES[percent])
        return (
            self.bounds[0] if low == -np.inf else max(low, self.bounds[0]),
            self.bounds[1] if high == np.inf else min(high, self.bounds[1]),
        )

    def brackets(self) -> tuple[bool, bool]:
        """True for each end of the 90 % interval (lower, upper) that the recordings themselves determine.

        They do where at least half of the rise there is theirs; elsewhere priors or a bound end it.
        """
        lower, upper = (self._end(side, RISES[90]) for side in (-1, 1))
        return lower[1], upper[1]

    def _end(self, side: int, rise: float) -> tuple[float, bool]:
        """Last place on one side at which the profile passes a rise; infinite if it does not.

        And whether the recordings make it. A fit that stopped early leaves an upper limit, so what lies
        further out and lower counts.
        """
        value, root, told = self._course(side)
        limit = float(np.sqrt(rise * self.unit))
        if len(root) < 2 or root[-1] < (1.0 - NEAR) * limit:
            return side * np.inf, False
        if root[-1] >= limit:
            end = float(interpolate.PchipInterpolator(root, value)(limit))
        else:  # as the last two points go on, where that is not far
            further = (limit - root[-1]) * (value[-1] - value[-2]) / (root[-1] - root[-2])
            if abs(further) > 2.0 * NEAR * abs(value[-1] - value[0]):
                return side * np.inf, False
            end = float(value[-1] + further)
        k = int(np.argmin(np.abs(root - limit)))
        return end, told is None or bool(told[k] >= 0.5 * root[k] ** 2)

    def _course(self, side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Values of one side outwards, the root of their rise, ascending, and the recordings' part of it.

        A point with one as low further out is left out.
        """
        outwards = slice(int(np.argmin(self.rise)), None, side)
        value, rise = self.value[outwards], self.rise[outwards]
        kept = [k for k in range(len(rise)) if k == 0 or 0.0 < rise[k] < rise[k + 1 :].min(initial=np.inf)]
        told = None if self.told is None else self.told[outwards][kept]
        return value[kept], np.sqrt(rise[kept]), told

    def joined(self, others: Sequence[tuple[float, float]]) -> "Profile":
        """The same profile with other fits that are nearly as good, each with the parabola of `sd`.

        Those inside the 90 % interval change nothing: the profile has been there.

        Args:
            others: value and rise of chi-square above the fit's, SI.
        """
        limit, points = RISES[90] * self.unit, []
        low, high = self.quoted(90)
        for value, rise in others:
            if rise >= limit or not np.isfinite(self.sd) or low <= value <= high:
                continue
            reach = self.sd * np.sqrt(limit - rise) * (1.0 if value > high else -1.0)
            points += [(value, rise), (value + reach, limit)]
        ends, known = self.bounds, (self.value.min(), self.value.max())
        points = [(v, r) for v, r in points if ends[0] <= v <= ends[1] and not known[0] <= v <= known[1]]
        if not points:
            return self
        value = np.concatenate([self.value, [v for v, _ in points]])
        order = np.argsort(value)
        more = lambda own, added: np.concatenate([own, added])[order]  # noqa: E731
        rises = [r for _, r in points]
        return replace(
            self,
            value=value[order],
            rise=more(self.rise, rises),
            stopped=more(self.stopped, [False] * len(points)),
            told=None if self.told is None else more(self.told, rises),
            visited=(),
        )


def lower_end(found: Mapping[str, Profile]) -> tuple[str, Mapping[str, float]] | None:
    """Parameter and place of the profile that fell furthest below the fit; None where none did."""
    deepest = max(found.values(), key=lambda p: p.below, default=None)
    return (deepest.name, deepest.lowest) if deepest and deepest.below > ALIKE else None


def to_the_end(
    fit: Any, profiled: Callable[[Any], tuple], gone_on: Callable[[Any, str, Mapping[str, float]], Any]
) -> tuple[Any, tuple]:
    """A fit and its profiles; the fit goes on where a profile finds a lower chi-square than the fit has.

    Args:
        fit: the fit to begin with.
        profiled: function from a fit to a tuple that begins with its profiles by name.
        gone_on: function from a fit, the name of the lowest profile and its parameters there to a new fit.
    """
    found = profiled(fit)
    for _ in range(RENEWALS):
        lower = lower_end(found[0])
        if not lower:
            break
        fit = gone_on(fit, *lower)
        found = profiled(fit)
    return fit, found


def loosest(parameters: Parameters, names: Sequence[str], count: int) -> list[str]:
    """Parameters, of those named, that the recordings leave most open, measured by their priors or ranges.

    One that stopped at a bound has no error and comes last.
    """
    share = {}
    for name in names:
        entry = parameters[name]
        size = entry.prior.sd if entry.prior is not None else (entry.max - entry.min) / FLAT
        if entry.standard_error is not None:
            share[name] = entry.standard_error / size
        elif entry.at_bound and entry.prior is not None:
            share[name] = 0.0
    return sorted(share, key=share.get, reverse=True)[:count]
