"""Valleys of an open alloy's misfit: fits with other decisions about what the spring remembers.

Which rows renew the memory of a spring depends on the constants of the residual strain. With each set of
decisions the misfit is smooth, and has a valley of its own. A fit ends in one of them, and its profiles stay
there. So fits that begin some standard errors aside, decided from the readings alone, look for others. The
intervals of these constants are the union over all valleys that count.

Valleys are not compared by chi-square alone. A decision that is turned can lower it by a few, and let it rise
steeply on all sides. A valley counts by its evidence, the integral of exp(-chi-square / 2) over it. In
Laplace's approximation that is its depth times its volume (D. MacKay, Information Theory, Inference, and
Learning Algorithms, 2003, chapter 28).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.calibrate.profile_likelihood import OtherValley, Profile
from fitting.calibrate.profile_points import followers

from .information import Information, information
from .joint import Joint, Start
from .modes import apart
from .stages import UNLOADING

ASIDE = (-8.0, -3.0, 3.0, 8.0)
"""Standard errors from the fit at which fits begin, in each constant of the residual strain."""
COUNTED = 2.0 * float(np.log(100.0))
"""Twice the logarithm of the evidence up to which a valley counts below the fit's: 1 % of that."""
APART = 1.0
"""Least distance between two valleys [sd]. Nearer ones are one, which counts once."""


@dataclass(frozen=True)
class Valley:
    """A valley beside that of the fit.

    Attributes:
        start: the fit in it.
        lost: twice the logarithm of the fit's evidence over this valley's.
        sd: standard error of each free parameter in it, by name, SI.
    """

    start: Start
    lost: float
    sd: Mapping[str, float]


def minus_two_log_evidence(joint: Joint, end: Start) -> float:
    """Minus twice the logarithm of a fit's evidence, up to a constant of the problem; the least is the best.

    The volume is that over the constants of the residual strain, all others following. Decisions change no
    other curve. In one campaign two ends on one bent curve of the resistivity differed by a factor of 100 in
    the volume over all constants.

    Args:
        joint: the fit whose inflation of the noise holds.
        end: any fit of the same problem.
    """
    return _weighed(joint, end)[0]


def _weighed(joint: Joint, end: Start) -> tuple[float, Information]:
    """`minus_two_log_evidence` of a fit, and the information that its volume is from."""
    known = information(end.problem.inflated(joint.inflation), end.result.parameters)
    return _cost(end) / joint.inflation**2 - known.log_volume(UNLOADING), known


def valleys(joint: Joint, ends: Sequence[Start]) -> tuple[Valley, ...]:
    """Valleys beside that of the fit that count, the most evidence first.

    Args:
        joint: the fit, with the errors of its valley.
        ends: fits of the same problem that any search has found.
    """
    least, errors = minus_two_log_evidence(joint, joint.starts[0]), joint.result.uncertainty
    weighed = [(*_weighed(joint, end), end) for end in ends if np.isfinite(_cost(end))]
    found: list[Valley] = []
    for weight, fisher, end in sorted(weighed, key=lambda one: one[0]):
        known, much = [joint.values, *(one.start.result.values for one in found)], weight - least
        if much > COUNTED or any(apart(errors, one, end.result.values)[0] < APART for one in known):
            continue
        sd = dict(zip(fisher.names, map(float, fisher.sd()), strict=True))
        found.append(Valley(end, float(much), sd))
    return tuple(found)


def with_valleys(profiles: Mapping[str, Profile], found: Sequence[Valley]) -> dict[str, Profile]:
    """Profiles of the residual strain's constants over all valleys, see `Profile.beside`; others as they are.

    Args:
        profiles: profile of each parameter in the fit's valley, by name.
        found: the other valleys.
    """
    changed = dict(profiles)
    for name in {*profiles} & {*UNLOADING}:
        others = [OtherValley(one.start.result.values[name], one.sd[name], one.lost) for one in found]
        changed[name] = profiles[name].with_valleys(others)
    return changed


def fits_aside(joint: Joint, progress: Callable[[str], None] = lambda _: None) -> tuple[Start, ...]:
    """Fits that begin aside of the best one, all other constants following, without its decisions.

    Args:
        joint: joint fit of an open alloy, with the errors of its valley.
        progress: called with a word for each fit that begins.
    """
    problem, values = joint.problem.inflated(1.0).undecided(), joint.starts[0].result.values
    uncertainty, found = joint.result.uncertainty, []
    for name in UNLOADING:
        if name not in uncertainty.names:
            continue
        error, slopes = joint.parameters[name].standard_error, followers(uncertainty, name)
        for away in ASIDE:
            how = f"{name}, {away:+.0f} standard errors aside"
            progress(f"from {how}")
            moved = {n: values[n] + away * error * slope for n, slope in slopes.items()}
            begun = problem.at({**values, **moved, name: values[name] + away * error})
            found.append(Start(how, *begun.fitted_with()))
    return tuple(end for end in found if np.isfinite(_cost(end)))


def _cost(end: Start) -> float:
    return np.inf if end.result.chi_square is None else float(end.result.chi_square)
