"""Profile likelihoods of wires, tubes and actuators: noise and decisions stay as they were at the fit."""

from collections.abc import Mapping, Sequence

from fitting.characterise.profiles import Profile, followed, loosest
from fitting.characterise.spring.information import HARDLY, Information
from fitting.least_squares import FitResult

from .fit import GeneralFit, fit_pinned


def profile(fit: GeneralFit, name: str) -> Profile:
    """Profile likelihood of one parameter.

    Args:
        fit: with standard errors.
        name: of a free parameter that has one.

    Raises:
        InputError: if it is not free, or has no standard error.
    """

    def held(values: Mapping[str, float], pins: Mapping[str, float]) -> FitResult:
        return fit_pinned(fit, values, pins)

    return followed(name, fit.result.parameters, fit.result.values, fit.result.uncertainty, held)


def profiles(fit: GeneralFit, names: Sequence[str]) -> dict[str, Profile]:
    """Profiles of several parameters, by name."""
    return {name: profile(fit, name) for name in names}


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
