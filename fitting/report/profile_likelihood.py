"""Profile likelihoods in every report: a figure, sentences, numbers."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from matplotlib.figure import Figure

from fitting.calibrate.profile_likelihood import ALIKE, Profile
from fitting.calibrate.result import Estimate
from fitting.calibrate.spring.alloy_table import KELVIN
from pneusma_jax.units import from_si

from . import figures as house
from .report import Picture

CAPTION = (
    "Chi-square above its least value over one parameter when all others follow it; dashed: the "
    "parabola of its standard error. Open: the others stopped at a kink, so that it may lie lower."
)


class Profiled(Protocol):
    """Inputs from a result: profiles by parameter, SI, and estimates in the unit of files."""

    profiles: Mapping[str, Profile]
    parameters: Mapping[str, Estimate]


def pictures(result: Profiled) -> list[Picture]:
    """The figure of the profiles, if there are any."""
    return [Picture("profiles", CAPTION, lambda: figure(result))] if result.profiles else []


def figure(result: Profiled) -> Figure:
    """Chi-square over each profiled parameter, beside the parabola of its standard error."""
    with house.style():
        drawn = Figure(figsize=(3.8 * len(result.profiles), 3.2), layout="constrained")
        panels = drawn.subplots(1, len(result.profiles), squeeze=False).ravel()
        for panel, (name, profile) in zip(panels, result.profiles.items(), strict=True):
            unit = result.parameters[name].unit
            centre = profile.value[np.argmin(profile.rise)]
            fine = np.linspace(profile.value.min(), profile.value.max(), 60)
            panel.plot(_in_file(profile.value, unit), profile.rise, "o-", color=house.BLUE)
            late = profile.stopped
            panel.plot(
                _in_file(profile.value[late], unit), profile.rise[late], "o", color="white", mec=house.BLUE
            )
            panel.plot(_in_file(fine, unit), ((fine - centre) / profile.sd) ** 2, "--", color=house.GREY)
            panel.set_xlabel(f"{name} [{unit}]")
            panel.set_ylabel("rise of chi-square [1]")
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
        sentences.append(
            f"Over {_or(curved)} the misfit does not rise as the standard error says. That error spans other "
            f"fits, or takes the misfit for a parabola. The profile says {_intervals(result, curved)}."
        )
    unsure = [name for name, profile in found.items() if profile.unsure]
    if unsure:
        sentences.append(
            f"Where {_or(unsure)} is held elsewhere the others stop at kinks of the misfit. Whether the "
            f"standard error holds is not known. The profile leaves at least {_intervals(result, unsure)}."
        )
    return sentences


def _or(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def _intervals(result: Profiled, names: Sequence[str]) -> str:
    if len(names) == 1:
        return interval(result, names[0])
    return "; ".join(f"{name} {interval(result, name)}" for name in names)


def interval(result: Profiled, name: str) -> str:
    """Interval of a parameter from its profile, in its unit of files."""
    unit = result.parameters[name].unit
    low, high = (float(_in_file(end, unit)) for end in result.profiles[name].interval())
    shown = "" if unit == "1" else f" {unit}"
    if np.isfinite(low) and np.isfinite(high):
        return f"{low:.4g} to {high:.4g}{shown}"
    if np.isfinite(low):
        return f"{low:.4g}{shown} or more"
    return f"{high:.4g}{shown} or less" if np.isfinite(high) else "anything within its range"


def document(result: Profiled) -> dict[str, Any]:
    """Numbers of every profile, for `report.json`."""
    return {
        name: {"value_SI": list(p.value), "rise": list(p.rise), "interval_68_SI": list(p.interval()),
               "stopped": [bool(x) for x in p.stopped], "curved": p.curved, "below_the_fit": p.below}
        for name, p in result.profiles.items()
    }  # fmt: skip


def _in_file(value: np.ndarray | float, unit: str) -> np.ndarray | float:
    return from_si(value, unit, unit == KELVIN)
