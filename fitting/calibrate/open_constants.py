"""Sentences about parameters that recordings leave open: at a bound, hardly informed, known only together."""

from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any

import numpy as np

from fitting.inference.parameters import Parameters

from .information import Information

HARDLY = 0.7
"""Minimum ratio of posterior to prior 1-sigma at which recordings have said next to nothing."""
SHARE = 0.4
"""Minimum share of the largest entry of a direction for a parameter to be named in its sentence."""
STAYED = 0.02
"""Maximum distance from its start, in prior 1-sigmas, at which a parameter has not moved."""
TOGETHER = 0.97
"""Minimum correlation of parameters that are known only together."""

ERROR = {False: "It has no error", True: "Its error, of the profile likelihood, has one side only"}
"""Words on the error of a parameter at a bound, without and with a profile likelihood of its own."""


def open_constants(
    fisher: Information,
    parameters: Parameters,
    start: Mapping[str, float],
    absent: Mapping[str, str] | None = None,
    natural_ends: Set[str] = frozenset(),
    profiled: Set[str] = frozenset(),
    needed: Callable[[str], str] = lambda _: "these recordings do not show it",
    reach: Callable[[Sequence[str]], str] = lambda _: "these recordings",
) -> list[dict[str, Any]]:
    """Parameters that recordings leave open, in words.

    Args:
        fisher: Fisher information of the recordings.
        parameters: free parameters at the values found.
        start: values before the fit, SI.
        absent: parameters whose bound means that there is nothing, with a sentence each.
        natural_ends: names of parameters whose ranges end at forms of their own, such as a linear one.
        profiled: names of parameters whose profile likelihood gives an error. At a bound it has one side;
            any other parameter at a bound has none.
        needed: function that says why the recordings do not show a parameter.
        reach: function that names the recordings about some parameters, and how far they go.

    Returns:
        Entries with `kind`, `parameters`, a number that says how bad, and `text`. The kinds are `absent`,
        `at_bound`, `end_of_range`, `at_start`, `not_informed`, `loose_direction` and `known_together`. A
        parameter within whose error the prediction jumps is in none of the last four.
    """
    absent = absent or {}
    stopped = [name for name, fixed in zip(fisher.names, fisher.fixed, strict=True) if fixed]
    entries = [
        _end_of_range(name, parameters[name].value, name in profiled)
        if name in natural_ends
        else _bound(name, absent.get(name), name in profiled)
        for name in stopped
    ]
    alone, covered = _alone(fisher, parameters, start, needed)
    return entries + alone + _loose(fisher, covered, reach) + _together(fisher, reach)


def _end_of_range(name: str, value: float, profiled: bool) -> dict[str, Any]:
    text = (
        f"{name} is at {value:g}, an end of its range, where the law has a special form. {ERROR[profiled]}. "
        "The errors of the other constants hold if its true value is this end."
    )
    return {"kind": "end_of_range", "parameters": [name], "text": text}


def _bound(name: str, absent: str | None, profiled: bool) -> dict[str, Any]:
    one_sided = {"one_sided": profiled}
    if absent:
        return {"kind": "absent", "parameters": [name], "text": f"{absent} {ERROR[profiled]}."} | one_sided
    text = (
        f"{name} stopped at its bound: the data, or another cause of misfit, pull it further than it may go. "
        f"{ERROR[profiled]}. The errors of the other constants hold if its true value is this bound."
    )
    return {"kind": "at_bound", "parameters": [name], "text": text} | one_sided


def _alone(
    fisher: Information, parameters: Parameters, start: Mapping[str, float], needed: Callable[[str], str]
) -> tuple[list[dict[str, Any]], set[str]]:
    """Parameters about which the recordings say next to nothing even if all others were known."""
    entries, covered = [], set()
    marginal, best = fisher.sd() / fisher.scale, fisher.sd_if_others_were_known() / fisher.scale
    for k, name in enumerate(fisher.names):
        if not fisher.told[k] or best[k] < HARDLY:
            continue
        covered.add(name)
        stayed = abs(parameters[name].value - start[name]) < STAYED * fisher.scale[k]
        where = "is still at the value it started from" if stayed else "is hardly informed"
        text = (
            f"{name} {where}: {needed(name)}. Its error of {100.0 * marginal[k]:.0f} % of the prior's comes "
            "from the prior."
        )
        kind = "at_start" if stayed else "not_informed"
        ratio = float(marginal[k])
        entries.append({"kind": kind, "parameters": [name], "posterior_over_prior": ratio, "text": text})
    return entries, covered


def _loose(
    fisher: Information, covered: set[str], reach: Callable[[Sequence[str]], str]
) -> list[dict[str, Any]]:
    """Combinations of two or more parameters along which the recordings say less than the priors."""
    told = [name for name, one in zip(fisher.names, fisher.told, strict=True) if one]
    kept = [name for name in told if name not in covered]
    width, axes = np.linalg.eigh(fisher.by_data(kept))
    entries = []
    for value, axis in zip(width, axes.T, strict=True):
        ratio = 1.0 / np.sqrt(1.0 + max(value, 0.0))
        if ratio < HARDLY:
            break
        main = [i for i in np.argsort(-np.abs(axis)) if abs(axis[i]) >= SHARE * np.abs(axis).max()]
        names = [kept[i] for i in main]
        if len(names) < 2:
            continue
        senses = " while ".join(
            f"{name} {'rises' if axis[i] > 0 else 'falls'}" for name, i in zip(names, main, strict=True)
        )
        text = (
            f"{_list(names)} cannot be separated by {reach(names)}. Where {senses}, by as much as the priors "
            f"allow, the fit stays as good (error along it {100.0 * ratio:.0f} % of the priors')."
        )
        entry = {"kind": "loose_direction", "parameters": names, "posterior_over_prior": float(ratio)}
        entries.append({**entry, "text": text})
    return entries


def _together(fisher: Information, reach: Callable[[Sequence[str]], str]) -> list[dict[str, Any]]:
    """Groups of parameters that correlations above `TOGETHER` connect."""
    covariance = fisher.covariance()
    spread = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    correlation = covariance / np.outer(spread, spread)
    correlation[~fisher.told] = correlation[:, ~fisher.told] = 0.0
    left, entries = set(range(len(spread))), []
    while left:
        group, grown = {min(left)}, True
        while grown:
            more = {j for j in left - group if any(abs(correlation[i, j]) > TOGETHER for i in group)}
            grown, group = bool(more), group | more
        left -= group
        if len(group) > 1:
            names = [fisher.names[k] for k in sorted(group)]
            strongest = max((correlation[i, j] for i in group for j in group if i != j), key=abs)
            size = "correlation" if len(group) == 2 else "correlations up to"
            text = (
                f"{_list(names)} are known only together ({size} {strongest:+.3f}) from {reach(names)}. "
                "Their joint effect was measured, not each of them."
            )
            entry = {"kind": "known_together", "parameters": names, "correlation": float(strongest)}
            entries.append({**entry, "text": text})
    return entries


def _list(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"
