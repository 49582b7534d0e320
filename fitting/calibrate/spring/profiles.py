"""Profile likelihoods of springs: what the rule decided stays as it was at the fit."""

from collections.abc import Mapping, Sequence

from fitting.calibrate.profile_likelihood import Profile, followed
from fitting.inference.least_squares import FitResult
from fitting.specimens.spring_trajectory import decided

from .joint import Joint
from .problem import fit_pinned, values_of


def profiles(joint: Joint, names: Sequence[str]) -> dict[str, Profile]:
    """Profile likelihoods of several parameters, by name.

    Args:
        joint: the fit.
        names: of free parameters with a standard error.

    Raises:
        InputError: if one is not free, or has no standard error.
    """
    data = joint.problem.data()
    data["rows"] = decided(values_of(joint.problem.parameters, joint.values), data["rows"])

    def fit(values: Mapping[str, float], pins: Mapping[str, float]) -> FitResult:
        return fit_pinned(joint.problem.at(values), data, pins)

    return followed(names, joint.parameters, joint.values, joint.result.uncertainty, fit)


def profile(joint: Joint, name: str) -> Profile:
    """Profile likelihood of one parameter; see `profiles`."""
    return profiles(joint, [name])[name]
