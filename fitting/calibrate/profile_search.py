"""The search for a profile's points: outwards from the fit, until chi-square has risen as for 99 %.

Each side begins where the standard error puts the end of the 90 % interval. Where the misfit is a parabola,
that one fit confirms it. Elsewhere the secant goes on, each fit begun where its neighbour ended. MINOS does
so, too (F. James and M. Roos, Comput. Phys. Commun. 10 (1975) 343).

Then the search goes on in the same way to the end of the 99 % interval or further. What lies between may be a
valley that bends, or another one: a parabola that holds up to 90 % says nothing about it. A constant that can
make itself ineffective has a plateau beyond. One as wide as the prior counts although it lies high.

A hump may hide such a plateau, or another valley. Straight lines see across it (`profile_lines`), and the
search goes on from what they see.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fitting.inference.least_squares import FitResult
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameter
from pneusma_jax.errors import InputError, nearest

from .profile_likelihood import ALIKE, FADED, NEAR, RISES, WIDTH_90, WIDTH_99, Profile
from .profile_lines import Misfit, lowest_seen, places_of
from .profile_points import GAINS, ConstrainedFit, HeldFits, Work, followers

MOST = 9
"""Fits on one side of a parameter up to the end of the 90 % interval, at most."""
BEYOND = 4
"""Fits on one side beyond that, at most."""
PASSED = 0.5
"""Relative distance by which the root of a rise may pass the last one. Beyond 99 % the density there is 6e-4
of the best one's, or less. So the profile between the two points need not be known better."""
PLATEAU = 0.02
"""Part of the density that a plateau beyond the last point may hold, if it is as wide as the prior. In one
wire of 8 a plateau of `gR_decay` lay 6 above the fit. The 99 % interval ended before it, and the truth was 9
errors off."""
GROWTH = (1.25, 4.0)
"""Least and most that a step outwards is longer than what came before."""
DOUBLED = 2.0
"""Least beyond a place that did not reach 99 %, where a profile has bent: it may be flat far out."""
INSIDE = 0.25
"""Share of a bracket at each end in which no next point is taken."""
CROSSED = 4
"""Most times that a search goes on behind a hump, for each constant."""
FIRST = 0.25
"""First step of a parameter at a bound, which has no error: a share of its prior's standard deviation."""
SAME_PLACE = 1e-3
"""Relative difference of two distances from the fit that are one place."""
HALF = float(np.sqrt(RISES[50] / RISES[90]))
"""Place of the 50 % interval's end on the way to that of 90 %, of a parabola."""


@dataclass
class _Side:
    """Points of one side of a profile, outwards; the fit itself is the first.

    Attributes:
        distance: distance from the fit, shape (points,); root: square root of the rise of chi-square,
            negative where it fell.
        rise_by_data: part of the rise that the recordings make.
        values: all parameters there.
        stopped: true where the others stopped early.
    """

    distance: list[float]
    root: list[float]
    rise_by_data: list[float]
    values: list[Mapping[str, float]]
    stopped: list[bool] = field(default_factory=lambda: [False])

    def forget(self, distance: float) -> None:
        """Drop a point at a distance, if there is one."""
        for k in np.flatnonzero(np.isclose(distance, self.distance, rtol=SAME_PLACE, atol=0.0))[::-1]:
            for series in (self.distance, self.root, self.rise_by_data, self.values, self.stopped):
                del series[k]


def profile_likelihoods(
    names: Sequence[str],
    parameters: Mapping[str, Parameter],
    values: Mapping[str, float],
    uncertainty: Uncertainty,
    fit: ConstrainedFit,
    again: ConstrainedFit | None = None,
    rises_per_sd: Mapping[str, float] | None = None,
    progress: Callable[[str], None] = lambda _: None,
    leave: bool = False,
    misfit: Misfit | None = None,
) -> dict[str, Profile]:
    """Profile likelihoods: from the best fit outwards, each point begun at its neighbour's.

    A search makes `FITS` fits for each name, or few more. A profile that needs more keeps the points that it
    has, and says so.

    Args:
        names: names of free parameters with a standard error, or at a bound.
        parameters: free parameters at the best fit, SI.
        values: the same as numbers.
        uncertainty: uncertainty of the best fit.
        fit: function that fits with some parameters held; called once with none.
        again: the same with everything decided anew, tried where `fit` stops early.
        rises_per_sd: rise of chi-square that counts as one standard deviation, 1 where nobody says more.
        progress: called with the name of each parameter that begins.
        leave: true to end with the first profile that falls below the fit: who asks begins anew there.
        misfit: chi-square as `fit` counts it, without a fit; None does not look across humps.

    Returns:
        By parameter.

    Raises:
        InputError: if one is not free, has no standard error, or the model has no answer at the fit.
    """
    for name in names:
        if name not in parameters:
            raise InputError(f"there is no free parameter {name!r}, {nearest(name, parameters)}")
        entry = parameters[name]
        if entry.standard_error is None and not (entry.at_bound and entry.prior is not None):
            raise InputError(f"{name} has no standard error, so there is nothing to profile it over")
    least = fit(values, {}) if names else None
    if least is not None and least.chi_square is None:
        raise InputError(f"the model has no answer at the fit, so {', '.join(names)} cannot be profiled")
    found: dict[str, Profile] = {}
    work = Work()
    for name in names:
        progress(name)
        work.begin()
        rise_per_sd = (rises_per_sd or {}).get(name, 1.0)
        held = HeldFits(name, fit, again, least, rise_per_sd, work)
        found[name] = _Search(parameters[name], values, uncertainty, held, misfit).profile()
        if leave and found[name].below > ALIKE:
            break
    return found


@dataclass(frozen=True)
class _Search:
    """One parameter's profile over a fit.

    Attributes:
        entry: the parameter at the best fit, SI.
        held: fits with it held.
        values, uncertainty, misfit: as of `profile_likelihoods`.
    """

    entry: Parameter
    values: Mapping[str, float]
    uncertainty: Uncertainty
    held: HeldFits
    misfit: Misfit | None = None

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self.held.name

    @property
    def unit(self) -> float:
        """Root of the rise of chi-square that counts as one standard deviation."""
        return float(np.sqrt(self.held.rise_per_sd))

    def profile(self) -> Profile:
        """Both sides as one profile."""
        sides = {side: self._side(side) for side in (-1.0, 1.0)}
        self._cross_humps(sides)
        if any(self._bent(found) for found in sides.values()):
            for side, found in sides.items():
                self._halve(found, side)
        points = [(self.entry.value, 0.0, False, 0.0, self.values)]
        for side, found in sides.items():
            for k in range(1, len(found.distance)):
                rise = np.sign(found.root[k]) * found.root[k] ** 2
                value = self.entry.value + side * found.distance[k]
                points.append((value, rise, found.stopped[k], found.rise_by_data[k], found.values[k]))
        points.sort(key=lambda point: point[0])
        value, rise, stopped, rise_by_data = (np.array([p[k] for p in points]) for k in range(4))
        below, error = max(-float(rise.min()), 0.0), self.entry.standard_error
        return Profile(
            name=self.name,
            value=value,
            rise=rise + below,
            stopped=stopped,
            sd=float("nan") if error is None else float(error),
            below=below,
            lowest=points[int(np.argmin(rise))][4] if below > 0.0 else {},
            rise_by_data=None if np.isnan(rise_by_data).any() else rise_by_data + below,
            bounds=(self.entry.min, self.entry.max),
            rise_per_sd=self.held.rise_per_sd,
            visited=tuple(p[4] for p in points),
            cut=self.held.work.cut,
        )

    def _side(self, side: float) -> _Side:
        """Points of one side, until the end of the 90 % interval is passed or the bound is reached."""
        entry, limit = self.entry, self.unit * WIDTH_90
        room = self._room(side)
        found = _Side([0.0], [0.0], [0.0], [self.values])
        expected = limit * entry.standard_error if entry.standard_error else FIRST * entry.prior.sd
        wanted = expected
        for _ in range(MOST):
            wanted = min(wanted, room)
            if not wanted > 0.0 or _known(found, wanted) or self.held.work.over():
                break
            if not self._add(found, side, wanted):
                wanted = 0.5 * (wanted + max((d for d in found.distance if d < wanted), default=0.0))
                continue
            if min(found.root) < -np.sqrt(ALIKE):
                return found  # a better fit: whoever asked begins anew there
            wanted = self._next(found, limit, room)
            if wanted is None:
                break
        if len(found.root) > 1:
            self._further(found, side, room)
        return found

    def _room(self, side: float) -> float:
        """Distance of the bound on one side."""
        return self.entry.max - self.entry.value if side > 0.0 else self.entry.value - self.entry.min

    def _cross_humps(self, sides: Mapping[float, _Side]) -> None:
        """Go on from places at which a straight line is lower than the profile that was found."""
        for _ in range(CROSSED if self.misfit is not None else 0):
            if self.held.work.over() or any(min(found.root) < -np.sqrt(ALIKE) for found in sides.values()):
                return
            seen = lowest_seen(self.name, self._lines(sides), self._known_chi_squares(sides), self.misfit)
            if seen is None:
                return
            away = seen[self.name] - self.entry.value
            side = float(np.sign(away))
            if not self._add(sides[side], side, abs(away), seen):
                return
            self._further(sides[side], side, self._room(side))

    def _lines(self, sides: Mapping[float, _Side]) -> list[Mapping[str, float]]:
        """The fit, and the outermost low point of each side on which the profile is no parabola."""
        limit, lines = self.unit * self._height, [self.values]
        for found in sides.values():
            if self._bent(found):
                lines.append(found.values[max(k for k, root in enumerate(found.root) if root < limit)])
        return lines

    def _known_chi_squares(self, sides: Mapping[float, _Side]) -> dict[float, float]:
        """Chi-square that a line must be lower than to be followed, by place of the constant."""
        places, known, most = places_of(self.entry), {}, self.held.rise_per_sd * self._height**2
        for side, found in sides.items():
            away = side * (places - self.entry.value)
            known |= {float(x): found.root[-1] ** 2 for x in places[away > found.distance[-1]]}
            points = list(zip(found.distance, found.root, strict=True))[1:]
            known |= {self.entry.value + side * d: root * abs(root) for d, root in points}
        least = self.held.least.chi_square - GAINS * self.held.rise_per_sd
        return {place: least + min(rise, most) for place, rise in known.items()}

    @property
    def _height(self) -> float:
        """Root of the rise from which a plateau as wide as the prior counts no more [standard deviations]."""
        error = self.entry.standard_error
        if not error:
            return WIDTH_99
        wide = self.entry.prior_sd
        if not np.isfinite(wide):
            return WIDTH_99
        share = max(wide / (error * self.unit), 1.0) / PLATEAU
        return float(np.clip(np.sqrt(2.0 * np.log(share)), WIDTH_99, FADED))

    def _further(self, found: _Side, side: float, room: float) -> None:
        """Points beyond the 90 % interval, until what lies further out counts no more."""
        limit = self.unit * self._height
        for k in range(BEYOND):
            wanted = self._next(found, limit, room, PASSED, GROWTH[0] if k == 0 else DOUBLED)
            wanted = None if wanted is None else min(wanted, room)
            if wanted is None or _known(found, wanted) or self.held.work.over():
                return
            if not self._add(found, side, wanted):
                return
            if min(found.root) < -np.sqrt(ALIKE):
                return

    def _bent(self, found: _Side) -> bool:
        """True if the 90 % interval ends elsewhere than the standard error says."""
        error = self.entry.standard_error
        if error is None:
            return True
        limit = self.unit * WIDTH_90
        near = [k for k in range(1, len(found.root)) if found.root[k] < (1.0 + NEAR) * limit]
        return any(abs(found.root[k] * error / found.distance[k] - 1.0) > NEAR for k in near) or (
            len(found.root) > 1 and not near
        )

    def _halve(self, found: _Side, side: float) -> None:
        """One more point where the 50 % interval may end, if there is none near that."""
        limit = self.unit * WIDTH_90
        end = float(np.interp(limit, _lowest_outwards(found.root), found.distance))
        near = any(0.2 * end < d < 0.7 * end for d in found.distance)
        if end > 0.0 and min(found.root) >= 0.0 and not near and not self.held.work.over():
            self._add(found, side, HALF * end)

    def _next(
        self, found: _Side, limit: float, room: float, over: float = NEAR, least: float = GROWTH[0]
    ) -> float | None:
        """Next place to fit on a side; None if its end is known: a root is near the limit, or `over` it."""
        root = _lowest_outwards(found.root)
        if np.any((root > (1.0 - NEAR) * limit) & (root < (1.0 + over) * limit)):
            return None
        inside = [k for k in range(len(root)) if root[k] < limit]
        low, last = found.distance[inside[-1]], float(root[inside[-1]])
        if len(inside) == len(root):  # not far enough yet
            if low >= room * (1.0 - 1e-9):
                return None
            return low * float(np.clip(limit / max(last, 1e-3), least, GROWTH[1]))
        high, over = found.distance[inside[-1] + 1], float(root[inside[-1] + 1])
        secant = low + (high - low) * (limit - last) / (over - last)
        inside = INSIDE * (high - low)  # a jump between the two would keep a secant at one of them
        return float(np.clip(secant, low + inside, high - inside))

    def _add(
        self, found: _Side, side: float, distance: float, seen: Mapping[str, float] | None = None
    ) -> bool:
        """Fit with the parameter held there, from what a line has `seen` or from neighbours.

        Returns:
            False where the model has no answer.
        """
        value = self.entry.value + side * distance
        nearest_ = int(np.argmin(np.abs(np.array(found.distance) - distance)))
        at = found.values[nearest_]
        starts = [self._ahead(found, nearest_, value), at] if seen is None else [seen]
        result = self.held.at(value, starts, at)
        if result is None:
            return False
        lower = None
        if seen is not None:
            found.forget(distance)
        elif result.success and found.distance[nearest_] > distance:
            lower = self._inside(found, distance, value, result)
        k = self._insert(found, distance, lower or result)
        if lower is not None and not self.held.work.over():  # the outer neighbour may be out of it, too
            outer, before = found.distance[k + 1], found.root[k + 1]
            there = self.entry.value + side * outer
            again = self.held.at(there, [self._ahead(found, k, there)], found.values[k])
            if again is not None and self.held.rise(again) < before * abs(before):
                found.forget(outer)
                self._insert(found, outer, again)
        return True

    def _insert(self, found: _Side, distance: float, result: FitResult) -> int:
        """Add a point at about this distance; returns its index."""
        k, rise = int(np.searchsorted(found.distance, distance)), self.held.rise(result)
        value = result.values.get(self.name, self.entry.value)
        found.distance.insert(k, abs(value - self.entry.value) or distance)
        found.root.insert(k, float(np.sign(rise) * np.sqrt(abs(rise))))
        found.rise_by_data.insert(k, self.held.rise_by_data(result))
        found.values.insert(k, result.values)
        found.stopped.insert(k, not result.success)
        return k

    def _inside(self, found: _Side, distance: float, value: float, result: FitResult) -> FitResult | None:
        """A lower fit that begins at the inner neighbour, of a point that began at the outer one; or None.

        A point above the straight line of roots may lie in another valley, in which its outer neighbour was
        caught. All points inwards would follow it, and the profile would jump beside the fit.
        """
        inner = int(np.flatnonzero(np.array(found.distance) < distance)[-1])
        between, at = slice(inner, inner + 2), found.values[inner]
        line = float(np.interp(distance, found.distance[between], found.root[between]))
        if self.held.rise(result) <= ((1.0 + NEAR) * line) ** 2 or self.held.work.over():
            return None
        other = self.held.at(value, [self._ahead(found, inner, value), at], at)
        return other if other is not None and other.chi_square < result.chi_square else None

    def _ahead(self, found: _Side, k: int, value: float) -> dict[str, float]:
        """Estimate of the other parameters at a place: on the line of the last two points, or by the
        covariance of the fit."""
        at, moved = found.values[k], value - found.values[k][self.name]
        if k > 0:
            before = found.values[k - 1]
            step = (at[self.name] - before[self.name]) or np.inf
            slopes = {n: (at[n] - before[n]) / step for n in at}
        else:
            slopes = followers(self.uncertainty, self.name)
        return {**at, **{n: at[n] + moved * slope for n, slope in slopes.items()}, self.name: value}


def _known(found: _Side, wanted: float) -> bool:
    """True if a fit has been made at that distance."""
    return any(np.isclose(wanted, d, rtol=SAME_PLACE, atol=0.0) for d in found.distance)


def _lowest_outwards(root: Sequence[float]) -> np.ndarray:
    """Roots of a side as intervals see them: what lies further out and lower counts, see `Profile`."""
    return np.minimum.accumulate(np.array(root)[::-1])[::-1]
