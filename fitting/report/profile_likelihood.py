"""Profile likelihoods in every report: a figure, sentences, numbers."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from matplotlib.figure import Figure

from fitting.calibrate.profile_likelihood import ALIKE, RISES, Profile
from fitting.calibrate.profile_points import FITS
from fitting.calibrate.result import Estimate
from fitting.inference.notes import joined
from pneusma_jax.units import amount, constant_from_si, constant_to_si

from . import figures as house
from .cells import told_apart
from .report import Picture

CAPTION = (
    "Chi-square above its least value over one parameter when all others follow it. Dashed: the "
    "parabola of its standard error. Upright lines: the quoted 90 % interval. Open: the others stopped at a "
    "kink, so that it may lie lower. Points that rise much higher lie above a panel."
)
MOST_DRAWN = 12
"""Maximum number of profiles that are drawn: three rows of four. Those that are no parabolas come first."""
HIGH = 3.0
"""Standard errors up to which the parabola is drawn: chi-square rises by nine there."""


class Profiled(Protocol):
    """Inputs from a result: profiles by parameter, SI, and estimates in the unit of files."""

    profiles: Mapping[str, Profile]
    parameters: Mapping[str, Estimate]


def pictures(result: Profiled) -> list[Picture]:
    """The figure of the profiles, if there are any."""
    return [Picture("profiles", caption(result), lambda: figure(result))] if result.profiles else []


def _in_order(result: Profiled) -> list[str]:
    """Parameters with a profile, as in the report's table; those whose profile is no parabola come first."""
    names = [name for name in result.parameters if name in result.profiles]
    return sorted(names, key=lambda name: not result.parameters[name].curved)


def shown(result: Profiled) -> list[str]:
    """Profiles that are drawn: all of them, as far as there is room."""
    return _in_order(result)[:MOST_DRAWN]


def caption(result: Profiled) -> str:
    """Caption of the figure, which names the profiles that are not drawn."""
    rest = _in_order(result)[MOST_DRAWN:]
    if not rest:
        return f"{CAPTION} Every parameter that was profiled is drawn."
    return f"{CAPTION} Not drawn for want of room: {joined(rest)}."


def figure(result: Profiled) -> Figure:
    """Chi-square over profiled parameters, beside the parabola of the standard error."""
    names = shown(result)
    drawn, panels = house.panel_grid(len(names), 3.4, 2.7, (0.0, 0.3))
    for panel, name in zip(panels, names, strict=True):
        profile, unit = result.profiles[name], result.parameters[name].unit
        centre = profile.value[np.argmin(profile.rise)]
        panel.plot(_in_file(profile.value, unit), profile.rise, "o-", color=house.BLUE, label="profile")
        if np.any(late := profile.stopped):
            at = _in_file(profile.value[late], unit)
            panel.plot(at, profile.rise[late], "o", color="white", mec=house.BLUE, label="stopped at a kink")
        if np.isfinite(profile.sd):
            reach = min(max(np.ptp(profile.value), 1e-12 * abs(centre)), HIGH * profile.sd)
            fine = centre + np.linspace(-reach, reach, 121)
            fine = fine[(fine >= profile.value.min()) & (fine <= profile.value.max())]
            parabola, word = ((fine - centre) / profile.sd) ** 2, "parabola of the standard error"
            panel.plot(_in_file(fine, unit), parabola, "--", color=house.GREY, label=word)
        for end in result.parameters[name].interval.get(90, ()):
            panel.axvline(end, color=house.GREY, linewidth=0.8, label="ends of the 90 % interval")
        panel.set_xlabel(f"{name} [{unit}]")
        panel.set_ylabel("rise of chi-square [1]")
        highest = min(1.05 * float(np.max(profile.rise)), 2.0 * HIGH**2 * profile.rise_per_sd)
        panel.set_ylim(-0.02 * highest, highest)  # a far point would flatten the rest
        panel.locator_params(axis="x", nbins=5)
    house.shared_legend(drawn)
    return drawn


def warnings(result: Profiled) -> list[str]:
    """Warnings where profiles show that the fit is not at its minimum, or that standard errors mislead.

    Parameters with the same finding share a sentence.
    """
    found, sentences = result.profiles, []
    lower = [name for name, profile in found.items() if profile.below > ALIKE]
    if lower:
        below = max(found[name].below for name in lower)
        sentences.append(
            f"Where {_or(lower)} is held elsewhere the others reach a chi-square lower by {below:.2g}. "
            "The fit is not at its end: trust neither its values nor its errors."
        )
    curved = [name for name, profile in found.items() if profile.curved]
    if curved:
        where = f": {_intervals(result, curved)}" if len(curved) <= MOST_DRAWN else ", as the table has them"
        sentences.append(
            f"Over {_or(curved)} the misfit is no parabola. What is quoted is the profile likelihood's "
            f"interval (90 %){where}."
        )
    unsure = [name for name, profile in found.items() if profile.unsure]
    if unsure:
        sentences.append(
            f"Where {_or(unsure)} is held elsewhere the others stop at kinks of the misfit. Whether the "
            f"standard error holds is not known. The profile leaves at least {_intervals(result, unsure)}."
        )
    cut = [name for name, profile in found.items() if profile.cut]
    if cut:
        whose = "profile ends" if len(cut) == 1 else "profiles end"
        sentences.append(
            f"The {whose} early: {_or(cut)} needed more than the {FITS} fits that each constant has. What "
            "lies further out is unknown, so the interval may be too narrow."
        )
    return sentences


def _or(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def _intervals(result: Profiled, names: Sequence[str]) -> str:
    if len(names) == 1:
        return interval(result, names[0])
    return "; ".join(f"{name} {interval(result, name)}" for name in names)


def interval(result: Profiled, name: str) -> str:
    """The quoted 90 % interval of a parameter, in its unit of files.

    It has one side where the profile does not end on the other.
    """
    unit, quoted = result.parameters[name].unit, result.parameters[name].interval[90]
    risen = result.profiles[name].interval(RISES[90])
    low, high = (q if np.isfinite(end) else end for q, end in zip(quoted, risen, strict=True))
    if np.isfinite(low) and np.isfinite(high):
        return amount(" to ".join(told_apart(low, high)), unit)
    if np.isfinite(low):
        return f"{amount(f'{low:.4g}', unit)} or more"
    return f"{amount(f'{high:.4g}', unit)} or less" if np.isfinite(high) else "anything within its range"


def document(result: Profiled) -> dict[str, Any]:
    """Numbers of every profile, for `report.json`; intervals are those that are quoted."""
    return {
        name: {"value_SI": list(p.value), "rise": list(p.rise),
               "interval_68_SI": _in_si(result.parameters[name], 68),
               "interval_90_SI": _in_si(result.parameters[name], 90), "rise_per_sd": p.rise_per_sd,
               "stopped": [bool(x) for x in p.stopped], "curved": p.curved, "below_the_fit": p.below,
               "ended_early": p.cut}
        for name, p in result.profiles.items()
    }  # fmt: skip


def _in_si(estimate: Estimate, percent: int) -> list[float]:
    """Ends of a quoted interval, SI; empty where there is none."""
    unit, ends = estimate.unit, estimate.interval.get(percent, ())
    return [float(constant_to_si(end, unit)) for end in ends]


def _in_file(value: np.ndarray | float, unit: str) -> np.ndarray | float:
    return constant_from_si(value, unit)
