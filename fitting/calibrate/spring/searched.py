"""The fit of a spring's best reading, searched to its end.

Noise that zeros of instruments correlate is counted. Profiles lead to lower fits until none is left. Then
other valleys of the misfit are looked for.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from fitting.calibrate.profile_likelihood import Profile
from fitting.calibrate.profiled_fits import loosest, to_the_end
from fitting.inference.lasting_noise import SURE_OF_WHITE, Lasting, Size, variances_by_name
from fitting.inference.lasting_noise.sizes import DRIFTS
from fitting.inference.progress import Stages

from .information import information
from .joint import Joint, try_others
from .profiles import profiles
from .refits import beside_zeros, decided_anew
from .stages import UNLOADING
from .valleys import Valley, fits_aside, valleys
from .zeros import zeros

FITS, ZERO, PROFILE, LAST = "fit", "fit beside zeros", "profile", "step"
"""What is counted in each stage of a characterisation."""
ZERO_ROUNDS = 2
"""Rounds of estimating the sizes of zeros and fitting beside them."""


@dataclass(frozen=True)
class Searched:
    """The best fit of a search that no profile improves, and what else the search found.

    Attributes:
        single: the fit, with the errors of the best start alone.
        profiled: profile likelihoods by parameter.
        lasting: zeros of force and resistance that are off or drift.
        others: valleys of the misfit beside that of the fit.
    """

    single: Joint
    profiled: dict[str, Profile]
    lasting: Lasting
    others: tuple[Valley, ...]


def searched_to_the_end(
    fit: Joint, profile: int | Sequence[str], identify: bool, stages: Stages
) -> Searched:
    """Zeros, profiles and valleys of the best reading's fit.

    Args:
        fit: joint fit of the best reading.
        profile, identify: as in `characterise_spring` and its result.
        stages: tells the progress of each stage.
    """
    begun = _beside_zeros(fit, stages.of(ZERO))
    single, (profiled, lasting) = _profiled_to_the_end(begun, profile, stages)
    memory_is_profiled = identify and not {*profiled}.isdisjoint(UNLOADING)
    others = valleys(single, fits_aside(single, stages.of(FITS))) if memory_is_profiled else ()
    return Searched(single, profiled, lasting, others)


def _profiled_to_the_end(
    single: Joint, profile: int | Sequence[str], stage_progress: Stages
) -> tuple[Joint, tuple[dict[str, Profile], Lasting]]:
    """A fit that no profile finds a lower chi-square for, and `_profiled` of it."""

    def again(now: Joint, name: str, lowest: Mapping[str, float]) -> tuple[Joint, bool]:
        found = try_others(now, {f"the profile of {name}": lowest}, stage_progress.of(FITS))
        if found.starts[0] is now.starts[0]:
            return found, False
        return _beside_zeros(found, stage_progress.of(ZERO)), True

    return to_the_end(single, lambda now, leave: _profiled(now, profile, stage_progress, leave), again)


def _beside_zeros(joint: Joint, progress: Callable[[str], None]) -> Joint:
    """The fit with correlated noise, where zeros of instruments probably are off or drift.

    The zeros' sizes follow from a linearised fit. The first estimate rests on the fit with white noise, which
    may be far off. So they are estimated again from the fit with correlated noise.

    A resistance whose zero drifts looks like a martensite fraction that walks, and both hide wrong constants.
    A walk that was found beside a steady zero keeps itself: the zero is then found too small, and the
    constants stay where they are. So the first fit has a zero that drifts far and cold wires that are steady.
    From there both are found in turn.
    """
    if joint.problem.zeros:
        return joint
    last = _lasting(joint)
    if last.steady >= SURE_OF_WHITE:
        return joint
    joint = beside_zeros(joint, _drifting(last.sizes), progress, steady=True)
    for _ in range(ZERO_ROUNDS):
        found = beside_zeros(joint, _lasting(joint).sizes, progress)
        if found is joint:  # the law misses the tests beside these zeros, too; the next round has the same
            break
        joint = found
    return decided_anew(joint, progress) if joint.problem.zeros else joint


def _lasting(joint: Joint) -> Lasting:
    """Zeros that last, from the residuals of a fit."""
    return zeros(joint.problem, joint.parameters, information(joint.problem, joint.parameters))


def _drifting(sizes: Mapping[str, Size]) -> dict[str, Size]:
    """The sizes with a zero of the resistance that drifts as far as any candidate does."""
    return {n: Size(max(DRIFTS), *size[1:]) if n == "resistance" else size for n, size in sizes.items()}


def _profiled(
    joint: Joint, profile: int | Sequence[str], stage_progress: Stages, leave: bool
) -> tuple[dict[str, Profile], Lasting]:
    """Profiles that know about zeros of the instruments, and those; see `to_the_end`."""
    fisher = information(joint.problem, joint.parameters)
    last = zeros(joint.problem, joint.parameters, fisher)
    wanted = _wanted(joint, profile)
    if not wanted:
        return {}, last
    variances = variances_by_name(last, fisher.names)
    return profiles(joint, wanted, variances, stage_progress.of(PROFILE, len(wanted)), leave), last


def _wanted(joint: Joint, profile: int | Sequence[str]) -> list[str]:
    """Parameters to profile: so many of the loosest, or those of a list."""
    if not isinstance(profile, int):
        return list(profile)
    return loosest(joint.parameters, list(joint.problem.parameters), profile)
