"""Profile likelihoods of wires, tubes and actuators: noise and decisions stay as they were at the fit."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from fitting.calibrate.profile_likelihood import Profile
from fitting.calibrate.profile_search import profile_likelihoods

from .fit import GeneralFit, chi_square_of, fit_constrained


def profiles(
    fit: GeneralFit,
    names: Sequence[str],
    rises_per_sd: Mapping[str, float] | None = None,
    leave: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, Profile]:
    """Profile likelihoods of several parameters, by name.

    Args:
        fit: fit with standard errors.
        names: names of free parameters that have one, or stand at a bound.
        rises_per_sd: rise of chi-square that counts as one standard deviation, by name.
        leave: true to end with the first that falls below the fit.
        progress: called with the name of each that begins.

    Raises:
        InputError: if one is not free, or has no standard error.
    """
    result = fit.result
    known = (result.parameters, result.values, result.uncertainty)
    how = {"rises_per_sd": rises_per_sd, "leave": leave, "progress": progress}
    return profile_likelihoods(names, *known, partial(fit_constrained, fit), misfit=chi_square_of(fit), **how)
