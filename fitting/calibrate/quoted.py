"""The numbers that are quoted of a fitted parameter: those of its profile likelihood where there is one.

Where the misfit is a parabola, the profile's intervals are those of the standard error. Elsewhere they are
asymmetric, and they count.
"""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from fitting.inference.parameters import Parameter
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.units import constant_from_si, from_si

from .profile_likelihood import RISES, WIDTH_90, Profile
from .result import Estimate

Levels = Mapping[int, tuple[float, float]]
"""Factors on the rise at the lower and the upper end of intervals of so many per cent."""
ALIKE = (1.0, 1.0)
"""The factors where nobody says more."""
MERELY_PRIOR = 0.7
"""Width of a quoted interval over the prior's from which the recordings have said next to nothing.

At 0.7 recordings and prior tell equally much: 1 / sqrt(2)."""


def estimates(
    fitted: Mapping[str, Parameter],
    profiles: Mapping[str, Profile],
    rises_per_sd: Mapping[str, float] | None = None,
    levels: Mapping[str, Levels] | None = None,
    jumping: Collection[str] = (),
) -> dict[str, Estimate]:
    """Quoted values and errors of all free parameters, in the unit of files.

    Args:
        fitted: free parameters at the values found, SI, with standard errors.
        profiles: profile likelihoods of some or all of them.
        rises_per_sd: rise of chi-square that counts as one standard deviation, by name; by default 1.
        levels: factors on that rise for both ends of intervals of so many per cent, by name; by default 1.
        jumping: parameters within whose standard error the prediction jumps. A profile alone gives them
            errors.
    """
    none: dict[str, Any] = {}
    rises_per_sd, levels = rises_per_sd or none, levels or none
    return {
        name: estimate(
            entry, profiles.get(name), rises_per_sd.get(name, 1.0), levels.get(name), name in jumping
        )
        for name, entry in fitted.items()
    }


def estimate(
    entry: Parameter,
    profile: Profile | None = None,
    rise_per_sd: float = 1.0,
    levels: Levels | None = None,
    jumps: bool = False,
) -> Estimate:
    """Quoted value and errors of one parameter, in the unit of files; see `estimates`."""
    known = entry.standard_error is not None and not jumps
    sd = entry.standard_error * np.sqrt(rise_per_sd) if known else np.nan
    mean = float(np.mean(np.sqrt((levels or {}).get(90, ALIKE))))
    profiled = profile is not None and profile.gives_interval
    if profiled:
        interval = {percent: profile.quoted(percent, (levels or {}).get(percent, ALIKE)) for percent in RISES}
        determined = _determined(entry, profile, interval[90])
        curved = bool(profile.curved or not np.isfinite(sd))
        if curved:
            sd = 0.5 * (interval[90][1] - interval[90][0]) / WIDTH_90
    else:
        interval, determined, curved = _of_parabola(entry, sd, levels or {}), (True, True), False
    if not (profiled and curved):
        sd *= mean
    in_file = lambda x: float(constant_from_si(x, entry.unit))  # noqa: E731
    return Estimate(
        value=in_file(entry.value),
        sd=float("nan") if not np.isfinite(sd) else float(from_si(sd, entry.unit, True)),
        unit=entry.unit,
        at_bound=entry.at_bound,
        interval={percent: (in_file(low), in_file(high)) for percent, (low, high) in interval.items()},
        curved=curved,
        determined=determined,
        of_prior=_of_prior(entry, interval),
    )


def _determined(entry: Parameter, profile: Profile, ends: tuple[float, float]) -> tuple[bool, bool]:
    """True for each end of the 90 % interval (lower, upper) that the recordings determine.

    They do not if priors or a bound make most of the rise there. The interval must also reach, on that side,
    the end that the prior alone would give, or the bound.
    """
    reach = [entry.value - ends[0], ends[1] - entry.value]
    far = np.inf if entry.prior is None else MERELY_PRIOR * WIDTH_90 * entry.prior.sd
    bounded = [ends[0] <= entry.min, ends[1] >= entry.max]
    sides = zip(profile.brackets(), reach, bounded, strict=True)
    lower, upper = (makes or not (side > far or stopped) for makes, side, stopped in sides)
    return lower, upper


def _of_parabola(entry: Parameter, sd: float, levels: Levels) -> dict[int, tuple[float, float]]:
    """Intervals of a standard error, inside the bounds; none where there is no error."""
    if not np.isfinite(sd):
        return {}
    sides = {p: np.sqrt(rise * np.array(levels.get(p, ALIKE))) * sd for p, rise in RISES.items()}
    ends = {p: (entry.value - low, entry.value + high) for p, (low, high) in sides.items()}
    return {p: (max(float(low), entry.min), min(float(high), entry.max)) for p, (low, high) in ends.items()}


def _of_prior(entry: Parameter, interval: Mapping[int, tuple[float, float]]) -> float | None:
    """Width of the 90 % interval over that of the prior."""
    if entry.prior is None or 90 not in interval or not np.isfinite(interval[90]).all():
        return None
    return float((interval[90][1] - interval[90][0]) / (2.0 * WIDTH_90 * entry.prior.sd))


def of_prior_alone(quantity: Quantity) -> Estimate:
    """A constant that no recording shows, with the error of its prior; in the unit of files.

    Its intervals end where the prior does: a constant that cannot be negative has no negative end.
    """
    sd, unit = float(np.hypot(quantity.prior.sd, quantity.value - quantity.prior.mean)), quantity.unit
    value = float(constant_from_si(quantity.value, unit))
    error = float(from_si(sd, unit, True))
    ends = (quantity.prior.min, quantity.prior.max)
    least, most = (float(constant_from_si(end, unit)) for end in ends)
    halves = {p: float(np.sqrt(rise)) * error for p, rise in RISES.items()}
    interval = {p: (max(value - half, least), min(value + half, most)) for p, half in halves.items()}
    return Estimate(value, error, unit, False, interval, determined=(False, False), of_prior=1.0)


def merely_prior(estimate: Estimate) -> bool:
    """True if the quoted interval is hardly narrower than the prior's."""
    return estimate.of_prior is not None and estimate.of_prior > MERELY_PRIOR
