"""Fits with profiles: which parameters are profiled, and how a fit goes on from the lowest point of one."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fitting.inference.parameters import Parameters

from .profile_likelihood import ALIKE, Profile

RENEWALS = 4
"""Maximum number of times that a fit goes on where a profile found a lower chi-square. All but the last end
with the first profile that finds one, so that it costs less than a whole set."""


def with_intervals(found: Mapping[str, Profile]) -> frozenset[str]:
    """Names of the parameters whose profile gives an interval."""
    return frozenset(name for name, profile in found.items() if profile.gives_interval)


def lowest_point(found: Mapping[str, Profile]) -> tuple[str, Mapping[str, float]] | None:
    """Parameter whose profile fell furthest below the fit, and all parameters there; None where none did."""
    deepest = max(found.values(), key=lambda p: p.below, default=None)
    return (deepest.name, deepest.lowest) if deepest and deepest.below > ALIKE else None


def to_the_end(
    fit: Any,
    profiled: Callable[[Any, bool], tuple],
    continued: Callable[[Any, str, Mapping[str, float]], tuple[Any, bool]],
) -> tuple[Any, tuple]:
    """A fit and its profiles; the fit goes on where a profile finds a lower chi-square than the fit has.

    Args:
        fit: the fit to begin with.
        profiled: function from a fit and a truth value to a tuple that begins with its profiles by name. With
            true it may end at the first that falls below the fit.
        continued: function that continues a fit from the lowest point of a profile, given by name and
            parameters. It returns the new fit, and true if it is better.
    """
    for _ in range(RENEWALS):
        found = profiled(fit, True)
        lowest = lowest_point(found[0])
        if not lowest:
            return fit, found
        fit, better = continued(fit, *lowest)
        if not better:
            break
    return fit, profiled(fit, False)


def loosest(parameters: Parameters, names: Sequence[str], count: int) -> list[str]:
    """Parameters, of those named, that the recordings leave most open, measured by their priors or ranges.

    One that stopped at a bound has no error and comes last.
    """
    share = {}
    for name in names:
        entry = parameters[name]
        if entry.standard_error is not None:
            share[name] = entry.standard_error / entry.prior_sd
        elif entry.at_bound and entry.prior is not None:
            share[name] = 0.0
    return sorted(share, key=share.get, reverse=True)[:count]
