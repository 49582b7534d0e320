"""The report of the joint posterior of several specimens: the population, and how far each is drawn to it."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fitting.sample.hierarchy import Shared, Together

from .. import figures as house
from ..cells import number, with_error, with_unit
from ..report import Picture, Points, Report, Section
from ..table import Table
from .beside_fit import opening
from .report import NOT_CONVERGED

SCHEMA = "pneusma-together/1"
MOST_PANELS = 12
"""Maximum number of constants in the figure."""
NOTE = (
    "Every specimen's constant is the mean plus the spread times a number of its own, which is Gaussian. If "
    "a constant is fitted by its logarithm, this holds for the logarithm, and its spread is in %. All "
    "recordings of all specimens are fitted together. So the prior of a constant counts once, for its mean. "
    "The spread has the positive half of a Gaussian of the prior's size."
)
CAPTION = (
    "Grey: each specimen by itself, with one standard deviation. Blue: the same in the joint posterior. "
    "Line: mean of the population."
)


def report_of(result: Together) -> Report:
    """The report of the joint posterior."""
    kind, names = result.problems[0].kind, ", ".join(result.names)
    first = house.only_first(MOST_PANELS, len(result.shared), "constants")
    return Report(
        title="Specimens together",
        subtitle=f"Joint posterior of {len(result.names)} campaigns of kind {kind}: {names}",
        verdict=verdict(result),
        warnings=() if result.converged else (NOT_CONVERGED,),
        sections=[
            Section("The population", [NOTE, population_table(result)]),
            Section(
                "Each specimen",
                [specimen_table(result), Picture("together", CAPTION + first, lambda: figure(result))],
            ),
            Section("How it was sampled", [Points(result.posterior.verdict)]),
        ],
        window="Specimens together: posterior",
        footer=f"pneusma characterise-batch --together, seed {result.posterior.settings.seed}",
        content=lambda: content(result),
    )


def verdict(result: Together) -> list[str]:
    """The few most important sentences."""
    found = result.shared
    loosest = max(found, key=lambda name: found[name].pooling)
    tightest = min(found, key=lambda name: found[name].pooling)
    sentences = [
        f"{len(result.names)} campaigns were fitted together. Specimens are drawn to the mean most in "
        f"{loosest} ({100.0 * found[loosest].pooling:.0f} % of the way)"
    ]
    if tightest != loosest:
        sentences[0] += f" and least in {tightest} ({100.0 * found[tightest].pooling:.0f} %)"
    sentences[0] += "."
    fits = zip(result.names, result.fits, strict=True)
    doubts = [f"{name}: {said}" for name, fit in fits for said in opening(fit)]
    return [*doubts, *sentences, result.posterior.verdict[0]]


def spread_text(one: Shared) -> str:
    """Median and 90 % interval of a spread: in per cent where it is relative."""
    factor, unit = (100.0, " %") if one.relative else (1.0, "")
    low, median, high = (number(factor * size) for size in one.spread)
    return f"{median}{unit} ({low} to {high})"


def population_table(result: Together) -> Table:
    """Mean, spread and pooling of every constant."""
    rows = [
        [with_unit(name, one.unit), with_error(one.mean, one.mean_sd), spread_text(one),
         f"{100.0 * one.pooling:.0f} %"]
        for name, one in result.shared.items()
    ]  # fmt: skip
    return Table(["constant", "mean", "spread (sd), 90 %", "drawn to the mean"], rows)


def specimen_table(result: Together) -> Table:
    """Every specimen's constants by itself and together."""
    rows = [
        [with_unit(name, one.unit), specimen, with_error(one.alone[k], one.alone_sd[k]),
         with_error(one.together[k], one.together_sd[k])]
        for name, one in result.shared.items()
        for k, specimen in enumerate(one.specimens)
    ]  # fmt: skip
    return Table(["constant", "specimen", "alone", "together"], rows)


def figure(result: Together) -> Figure:
    """Each constant of each specimen by itself (grey) and in the joint posterior (blue)."""
    shown = list(result.shared.items())[:MOST_PANELS]
    most = max(len(one.specimens) for _, one in shown)
    drawn, panels = house.panel_grid(len(shown), 3.2, 1.2 + 0.25 * most)
    for panel, (name, one) in zip(panels, shown, strict=True):
        places = np.arange(len(one.specimens))
        panel.axvline(one.mean, color=house.BLACK, linewidth=0.8)
        for value, sd, colour, off in (
            (one.alone, one.alone_sd, house.GREY, -0.12),
            (one.together, one.together_sd, house.BLUE, 0.12),
        ):
            panel.errorbar(value, places + off, xerr=sd, fmt="o", color=colour, markersize=4)
        panel.set_yticks(places, [house.literal(name) for name in one.specimens])
        panel.set_ylim(len(places) - 0.5, -0.5)
        panel.set_xlabel(f"{name} [{one.unit}]")
    return drawn


def content(result: Together) -> dict[str, Any]:
    """The content of `report.json`."""
    state = result.posterior.convergence
    return {
        "schema": SCHEMA,
        "verdict": verdict(result),
        "converged": result.converged,
        "campaigns": list(result.names),
        "constants": {
            name: {
                "unit": one.unit,
                "mean": one.mean,
                "mean_sd": one.mean_sd,
                "spread": one.spread[1],
                "spread90": [one.spread[0], one.spread[2]],
                "spread_is_relative": one.relative,
                "pooling": one.pooling,
                "specimens": {
                    specimen: {
                        "alone": float(one.alone[k]),
                        "alone_sd": float(one.alone_sd[k]),
                        "together": float(one.together[k]),
                        "together_sd": float(one.together_sd[k]),
                    }
                    for k, specimen in enumerate(one.specimens)
                },
            }
            for name, one in result.shared.items()
        },
        "sampling": {
            "sampler": result.posterior.settings.sampler,
            "seed": result.posterior.settings.seed,
            "steps": int(state.steps),
            "largest_r_hat": float(np.max(state.r_hat)),
            "fewest_effective": float(np.min(state.effective)),
        },
    }
