"""Profile likelihoods: the misfit over one parameter when all others follow it, and its intervals.

An interval of 90 % ends where chi-square has risen by 2.71, as of a parabola. Further out a profile may stay
low: along a bent valley, or in a second one. Then far more than 10 % lies beyond these ends. So the profile
is also taken as a density, proportional to exp(-rise / 2). The rise at which both ends are quoted is the one
that leaves 10 % of it outside, and at least 2.71.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pneusma_jax.late import Late

interpolate = Late("scipy.interpolate")
ALIKE = 1.0
"""Chi-square within which two fits are as good."""
CURVED = 0.3
"""Relative departure from a parabola from which the standard error misleads."""
RISES = {50: 0.454936, 68: 1.0, 90: 2.705543}
"""Chi-square that an interval of so many per cent spans: quantiles of its distribution for one parameter.

The 68 is one standard deviation, 68.27 %."""
WIDTH_90 = float(np.sqrt(RISES[90]))
"""Standard errors from the best value to the end of a 90 % interval, of a parabola."""
WIDTH_99 = 2.575829
"""The same of a 99 % interval, the end of a profile. 1 % of a Gaussian lies beyond it. That is a tenth of the
10 % that decide about the ends of a 90 % interval."""
NEAR = 0.15
"""Relative distance of the root of a rise from that of a limit, within which a point stands for the limit. No
further point is looked for then, and the profile is extended to the limit.

Between points the value is interpolated over the root, in which a parabola is a straight line."""
FADED = 5.0
"""Root of the rise up to which a density is counted; beyond it a Gaussian has 6e-7 left."""
LAST = 1.0 / 3.0
"""Part of a side over which its growth is taken, to go on beyond its last point. Two points that are close
together say little about it: fits that stopped early differ by chance."""
PARABOLA = np.array([-2.575829, -1.644854, -1.0, -0.5, 0.0, 0.5, 1.0, 1.644854, 2.575829])
"""Places of points of another valley, in its standard errors: up to 99 %, as a profile's own. Between them
the root of the rise is interpolated."""
TIED = 1e-6
"""Least rise of another valley: of two with the same evidence the fit's is the best."""
FINE = 1000
"""Points of a density on each side between the outermost fit and the best, and again beyond that fit. A
quantile of a Gaussian then has an error of 1e-6."""


@dataclass(frozen=True)
class OtherValley:
    """Another valley of the misfit beside the profiled one, as a Gaussian.

    Attributes:
        value: place of its least chi-square, SI.
        sd: standard error of the parameter in it, SI.
        lost: twice the logarithm of the profiled valley's evidence over this one's.
    """

    value: float
    sd: float
    lost: float


@dataclass(frozen=True)
class Profile:
    """Misfit over one parameter.

    Attributes:
        name: name of the parameter.
        value: values at which it was held, SI, ascending, shape (points,).
        rise: rise of chi-square, priors included, above its least value, shape (points,).
        stopped: true where the other parameters stopped before their end, at a kink of the law's memory,
            shape (points,). The rise is an upper limit there.
        sd: standard error that a parabola would have, SI; NaN of a parameter at a bound.
        below: chi-square at the fit, less its least value on the profile. If it is more than chance explains,
            the fit had not reached its end.
        lowest: free parameters there, SI; empty where the fit is the least.
        rise_by_data: part of the rise that the recordings alone make, shape (points,); None where unknown.
        bounds: bounds of the parameter, SI.
        rise_per_sd: rise of chi-square that counts as one standard deviation [1]; more than 1 where zeros of
            instruments are off or drift.
        visited: all free parameters at every point, SI; empty where nobody kept them.
        cut: true if the search ended since it had made all fits that are allowed.
        alone: the profile before other valleys came `beside` it; None where none did.
    """

    name: str
    value: np.ndarray
    rise: np.ndarray
    stopped: np.ndarray
    sd: float
    below: float = 0.0
    lowest: Mapping[str, float] = field(default_factory=dict)
    rise_by_data: np.ndarray | None = None
    bounds: tuple[float, float] = (-np.inf, np.inf)
    rise_per_sd: float = 1.0
    visited: Sequence[Mapping[str, float]] = ()
    cut: bool = False
    alone: "Profile | None" = None

    @property
    def gives_interval(self) -> bool:
        """True if it has points beside the fit."""
        return len(self.value) > 1

    @property
    def parabola(self) -> np.ndarray:
        """Rise that the standard error stands for, shape (points,)."""
        return ((self.value - self.value[np.argmin(self.rise)]) / self.sd) ** 2

    @property
    def curved(self) -> bool:
        """The profile is not the parabola of the standard error, which misleads or spans other fits, too.

        Beyond the 90 % interval only what lies lower than the parabola counts.
        """
        off = self._departure
        return bool(np.any(off < -CURVED) or np.any(off[~self.stopped & self._inside] > CURVED))

    @property
    def unsure(self) -> bool:
        """Fits that stopped early leave open whether the profile is that parabola."""
        return not self.curved and bool(np.any(self._departure[self.stopped & self._inside] > CURVED))

    @property
    def _inside(self) -> np.ndarray:
        """True for points up to the end of the 90 % interval, shape (points,)."""
        end = (1.0 + NEAR) ** 2 * RISES[90] * self.rise_per_sd
        return (self.rise <= end) | (self.parabola <= end)

    @property
    def _departure(self) -> np.ndarray:
        """Relative departure from the parabola, 0 next to its centre, shape (points,)."""
        wanted = self.parabola
        away = wanted > 0.5
        return np.where(away, self.rise / np.where(away, wanted, 1.0) - 1.0, 0.0)

    def interval(self, rise: float = 1.0) -> tuple[float, float]:
        """Ends of the values whose chi-square rises by less than `rise`, in units of `rise_per_sd`.

        An end is infinite where the profile never rises so far.
        """
        return self._end(-1, rise), self._end(1, rise)

    def quoted(self, percent: int, level: tuple[float, float] = (1.0, 1.0)) -> tuple[float, float]:
        """Interval of 50, 68 or 90 %, SI: where chi-square has risen as of a parabola, or further.

        It is further in two cases: less than that share of the density lies within, or fits that stopped
        early alone would narrow the interval of the standard error. A side that never rises enough ends at
        the parameter's bound. Beside other valleys no interval is narrower than alone, however the root
        between points is interpolated.

        Args:
            percent: 50, 68 or 90.
            level: factors on `rise_per_sd` at this percentage, for the lower and the upper end.
        """
        if level != (1.0, 1.0):
            lower, upper = (self._in_units(side).quoted(percent) for side in level)
            return lower[0], upper[1]
        low, high = self.interval(RISES[percent])
        below, above = self._ends_by_density(percent)
        low = min(low, below, self._end_by_error(-1, percent))
        high = max(high, above, self._end_by_error(1, percent))
        if self.alone is not None:
            own = self.alone.quoted(percent)
            low, high = min(low, own[0]), max(high, own[1])
        return max(low, self.bounds[0]), min(high, self.bounds[1])

    def _in_units(self, factor: float) -> "Profile":
        """The same profile with another rise that counts as one standard deviation."""
        alone = None if self.alone is None else self.alone._in_units(factor)
        return replace(self, rise_per_sd=factor * self.rise_per_sd, alone=alone)

    def _end_by_error(self, side: int, percent: int) -> float:
        """End of the standard error's interval on one side, where only fits that stopped early end the
        profile's; the best value elsewhere.

        Their rises are upper limits. So they do not narrow the interval of the standard error.
        """
        best, limit = int(np.argmin(self.rise)), RISES[percent] * self.rise_per_sd
        beyond = np.arange(len(self.rise)) * side > best * side
        ends = beyond & (self.rise >= limit)
        if not np.isfinite(self.sd) or not np.any(ends) or np.any(ends & ~self.stopped):
            return float(self.value[best])
        return float(self.value[best] + side * self.sd * math.sqrt(limit))

    def _ends_by_density(self, percent: int) -> tuple[float, float]:
        """Ends of equal rise that hold a share of the density."""
        rise = np.unique(np.concatenate([root for _, root in self._sides]))
        pairs = zip(self._sides, self._masses, strict=True)
        held = sum(np.interp(rise, root, mass) for (_, root), mass in pairs)
        share = math.erf(math.sqrt(0.5 * RISES[percent]))
        limit = np.interp(share * held[-1], held, rise)
        below, above = (float(np.interp(limit, root, value)) for value, root in self._sides)
        return below, above

    @cached_property
    def distribution(self) -> tuple[np.ndarray, np.ndarray]:
        """Values, ascending, and the part of the density exp(-rise / 2) below each."""
        ((left, _), (right, _)), (below, above) = self._sides, self._masses
        value = np.concatenate([left[:0:-1], right])
        total = below[-1] + np.concatenate([-below[:0:-1], above])
        return value, total / total[-1] if total[-1] > 0.0 else np.linspace(0.0, 1.0, len(total))

    @cached_property
    def _masses(self) -> list[np.ndarray]:
        """Density on each side between the best value and each of `_sides`."""
        found = []
        for value, root in self._sides:
            density = np.exp(-0.5 * root**2)
            steps = 0.5 * (density[1:] + density[:-1]) * np.abs(np.diff(value))
            found.append(np.concatenate([[0.0], np.cumsum(steps)]))
        return found

    @cached_property
    def _sides(self) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Fine values of each side outwards, and the root of the rise there in standard deviations."""
        return self._side(-1), self._side(1)

    def _side(self, side: int) -> tuple[np.ndarray, np.ndarray]:
        """Values of one side outwards, from the best one to the bound, and the root of the rise there.

        Between points the root is interpolated. Beyond them it goes on as it has grown over the last third.
        """
        value, root, _ = self._outwards(side)
        best, root = float(value[0]), root / math.sqrt(self.rise_per_sd)
        if len(root) < 2:
            return np.array([best]), np.zeros(1)
        away, room = np.abs(value - best), abs(self.bounds[0 if side < 0 else 1] - best)
        apart = np.concatenate([[True], np.diff(away) > 0.0])  # two starts may have ended at one place
        away, root = away[apart], root[apart]
        k = int(np.flatnonzero(away <= (1.0 - LAST) * away[-1])[-1])
        growth = (root[-1] - root[k]) / (away[-1] - away[k])
        further = max(FADED - root[-1], 0.0) / growth if growth > 0.0 else np.inf
        end = min(away[-1] + further, room)
        end = end if np.isfinite(end) else away[-1]  # flat, and without a bound: what lies beyond is unknown
        fine = np.unique(np.concatenate([np.linspace(0.0, min(x, end), FINE) for x in (away[-1], end)]))
        within = interpolate.PchipInterpolator(away, root)(np.minimum(fine, away[-1]))
        return best + side * fine, within + growth * np.maximum(fine - away[-1], 0.0)

    def brackets(self) -> tuple[bool, bool]:
        """True for each end of the 90 % interval (lower, upper) that the recordings themselves determine.

        They do where at least half of the rise there is theirs; elsewhere priors or a bound end it.
        """
        low, high = self.quoted(90)
        return self._determined(-1, low), self._determined(1, high)

    def _determined(self, side: int, end: float) -> bool:
        """True if the recordings make at least half of the rise at one end of the 90 % interval."""
        if not np.isfinite(self._end(side, RISES[90])):
            return False
        value, root, rise_by_data = self._outwards(side)
        k = 1 + int(np.argmin(np.abs(value[1:] - end)))
        return rise_by_data is None or bool(rise_by_data[k] >= 0.5 * root[k] ** 2)

    def _end(self, side: int, rise: float) -> float:
        """Last place on one side at which the profile passes a rise; infinite if it does not.

        A fit that stopped early leaves an upper limit, so what lies further out and lower counts.
        """
        value, root, _ = self._outwards(side)
        limit = float(np.sqrt(rise * self.rise_per_sd))
        if len(root) < 2 or root[-1] < (1.0 - NEAR) * limit:
            return side * np.inf
        if root[-1] >= limit:
            return float(interpolate.PchipInterpolator(root, value)(limit))
        # as the last two points go on, where that is not far
        further = (limit - root[-1]) * (value[-1] - value[-2]) / (root[-1] - root[-2])
        if abs(further) > 2.0 * NEAR * abs(value[-1] - value[0]):
            return side * np.inf
        return float(value[-1] + further)

    def _outwards(self, side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Points of one side from the best one outwards, of which the rise grows.

        A point with one as low further out is left out.

        Args:
            side: -1 for the lower side, 1 for the upper one.

        Returns:
            Values, SI, roots of the rise, and the recordings' part of the rise or None; shape (points,) each.
        """
        outwards = slice(int(np.argmin(self.rise)), None, side)
        value, rise = self.value[outwards], self.rise[outwards]
        kept = [k for k in range(len(rise)) if k == 0 or 0.0 < rise[k] < rise[k + 1 :].min(initial=np.inf)]
        rise_by_data = None if self.rise_by_data is None else self.rise_by_data[outwards][kept]
        return value[kept], np.sqrt(rise[kept]), rise_by_data

    def joined(self, others: Sequence[tuple[float, float]]) -> "Profile":
        """The same profile with other fits that are nearly as good, each with the parabola of `sd`.

        Those inside the 90 % interval change nothing: the profile has been there.

        Args:
            others: value and rise of chi-square above the fit's, SI.
        """
        limit, points = RISES[90] * self.rise_per_sd, []
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
            rise_by_data=None if self.rise_by_data is None else more(self.rise_by_data, rises),
            visited=(),
        )

    def with_valleys(self, others: Sequence[OtherValley]) -> "Profile":
        """The same profile with other valleys: at each place the rise of the lowest of all.

        A valley rises from twice the logarithm of the evidence that it lost. A wider one begins higher, as
        its evidence lies over more values. Between two valleys everything belongs to the interval.

        Args:
            others: the other valleys; without any, the profile stays as it is.
        """
        found, width = self, float(sum(mass[-1] for mass in self._masses)) / math.sqrt(2.0 * math.pi)
        for one in others if self.gives_interval and width > 0.0 else ():
            sd = one.sd * math.sqrt(self.rise_per_sd)
            least = self.rise_per_sd * (max(one.lost, TIED) + 2.0 * math.log(max(sd / width, 1.0)))
            found = found._lowered(one.value, one.sd, least)
        return found if found is self else replace(found, alone=self)

    def _lowered(self, centre: float, sd: float, least: float) -> "Profile":
        """The profile, or a parabola where that is lower."""
        (left, roots_left), (right, roots_right) = self._sides
        fine, root = np.concatenate([left[:0:-1], right]), np.concatenate([roots_left[:0:-1], roots_right])
        places = np.clip(centre + PARABOLA * sd * math.sqrt(self.rise_per_sd), *self.bounds)
        places = places[~np.isin(places, self.value)]
        parabola = lambda x: least + ((x - centre) / sd) ** 2  # noqa: E731
        own = self.rise_per_sd * np.interp(places, fine, root, left=np.inf, right=np.inf) ** 2
        places = places[parabola(places) < own]
        value = np.concatenate([self.value, places])
        order = np.argsort(value)
        best = int(np.argmin(self.rise))
        old = np.minimum(self.rise, np.where(np.arange(len(self.rise)) == best, np.inf, parabola(self.value)))
        rise = np.concatenate([old, parabola(places)])[order]
        own_part = self.rise_by_data
        return replace(
            self,
            value=value[order],
            rise=rise,
            stopped=np.concatenate([self.stopped, np.zeros(len(places), bool)])[order],
            rise_by_data=None if own_part is None else np.minimum(
                np.concatenate([own_part, parabola(places)])[order], rise
            ),
            visited=(),
        )  # fmt: skip
