"""Profile likelihoods of wires, tubes and actuators: noise and decisions stay as they were at the fit."""

from collections.abc import Sequence
from functools import partial

from fitting.calibrate.profile_likelihood import Profile, followed, loosest
from fitting.calibrate.spring.information import HARDLY, Information

from .fit import GeneralFit, fit_pinned


def profiles(fit: GeneralFit, names: Sequence[str]) -> dict[str, Profile]:
    """Profile likelihoods of several parameters, by name.

    Args:
        fit: with standard errors.
        names: of free parameters that have one.

    Raises:
        InputError: if one is not free, or has no standard error.
    """
    result = fit.result
    return followed(names, result.parameters, result.values, result.uncertainty, partial(fit_pinned, fit))


def profile(fit: GeneralFit, name: str) -> Profile:
    """Profile likelihood of one parameter; see `profiles`."""
    return profiles(fit, [name])[name]


def worth_profiling(fit: GeneralFit, told: Information, count: int) -> list[str]:
    """The loosest parameters that the recordings say something about.

    Of the others only the prior is known, and the profile is its parabola.

    Args:
        fit: with standard errors.
        told: by the recordings.
        count: at most.
    """
    shown = [name for name, sd in zip(told.names, told.alone() / told.scale, strict=True) if sd < HARDLY]
    return loosest(fit.result.parameters, shown, count)
