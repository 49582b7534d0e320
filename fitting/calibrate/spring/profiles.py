"""Profile likelihoods of springs: what the rule decided stays as it was at the fit, and is decided anew where
a fit stops early."""

from collections.abc import Callable, Mapping, Sequence

from fitting.calibrate.profile_likelihood import Profile
from fitting.calibrate.profile_search import profile_likelihoods
from fitting.inference.least_squares import FitResult
from fitting.specimens.spring_trajectory import decided

from .joint import Joint
from .other_fits import chi_square_unit
from .problem import constraints_of, fit_constrained
from .residuals import values_of


def profiles(
    joint: Joint,
    names: Sequence[str],
    rises_per_sd: Mapping[str, float] | None = None,
    progress: Callable[[str], None] = lambda _: None,
    leave: bool = False,
) -> dict[str, Profile]:
    """Profile likelihoods of several parameters, by name.

    Args:
        joint: the fit, with the errors of the best start alone.
        names: names of free parameters with a standard error, or at a bound.
        rises_per_sd: rise of chi-square that counts as one standard deviation, by name.
        progress: called with the name of each that begins.
        leave: true to end with the first that falls below the fit.
    """
    data = joint.problem.data()
    data["rows"] = decided(values_of(joint.problem.parameters, joint.values), data["rows"])

    def fit(values: Mapping[str, float], held: Mapping[str, float]) -> FitResult:
        return fit_constrained(joint.problem.at(values), data, held, joint.parameters)

    def again(values: Mapping[str, float], held: Mapping[str, float]) -> FitResult:
        problem = joint.problem.at({**values, **held})
        return problem.fit(constraints=constraints_of(problem, held, joint.parameters))

    fitted = joint.parameters, joint.values, joint.result.uncertainty
    return profile_likelihoods(names, *fitted, fit, again, rises_per_sd, progress, leave)


def with_other_fits(found: Mapping[str, Profile], joint: Joint) -> dict[str, Profile]:
    """Profiles that know the other fits which are nearly as good: other turning points, other constants.

    Chi-square between fits counts in units of `chi_square_unit`.

    Args:
        found: profile of each parameter, by name.
        joint: joint fit with all its starts.
    """
    best = joint.starts[0].result
    if best.chi_square is None:
        return dict(found)
    unit = chi_square_unit(joint)
    others = [s.result for s in joint.starts[1:] if s.result.chi_square is not None]
    return {
        name: profile.joined([
            (other.values[name], max(other.chi_square - best.chi_square, 0.0) / unit) for other in others
        ])
        for name, profile in found.items()
    }  # fmt: skip
