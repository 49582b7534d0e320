"""Sentences about parameters that recordings leave open: at a bound, hardly informed, known only together."""

from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any

import numpy as np

from fitting.data.recordings import Recording
from fitting.inference.notes import joined
from fitting.inference.parameters import Parameters
from fitting.specimens.rows import MARK

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
    unfitted: Mapping[str, Sequence[str]] | None = None,
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
        unfitted: parameters of specimens of which no recording is fitted, by specimen; see `of_unfitted`.

    Returns:
        Entries with `kind`, `parameters`, a number that says how bad, and `text`. Some have a `reason` why
        nothing shows them, or a `group` for a sentence about several entries. The kinds are `absent`,
        `at_bound`, `end_of_range`, `at_start`, `not_informed`, `loose_direction`, `known_together` and
        `not_fitted`. A parameter within whose error the prediction jumps is in none of `at_start` to
        `known_together`. One that is `not_fitted` is in no other entry.
    """
    absent = absent or {}
    stopped = [name for name, fixed in zip(fisher.names, fisher.fixed, strict=True) if fixed]
    entries = [
        _end_of_range(name, parameters[name].value, name in profiled)
        if name in natural_ends
        else _bound(name, absent.get(name), name in profiled)
        for name in stopped
    ]
    aside = unfitted or {}
    own = {name for names in aside.values() for name in names}
    alone, covered = _alone(fisher, parameters, start, needed, own)
    entries += alone + _loose(fisher, covered, reach) + _together(fisher, reach)
    return entries + [_not_fitted(specimen, names) for specimen, names in aside.items()]


def of_unfitted(names: Sequence[str], recordings: Sequence[Recording]) -> dict[str, list[str]]:
    """Parameters of specimens of which no recording is fitted, by specimen.

    Args:
        names: names of free parameters; those of single specimens end in a number.
        recordings: all recordings, in the order that the specimens are numbered in.
    """
    fitted = {recording.specimen for recording in recordings if recording.role == "fit"}
    found: dict[str, list[str]] = {}
    specimens = list(dict.fromkeys(recording.specimen for recording in recordings))
    for name in names:
        _, mark, number = name.partition(MARK)
        if mark and (specimen := specimens[int(number) - 1]) not in fitted:
            found.setdefault(specimen, []).append(name)
    return found


def _not_fitted(specimen: str, names: Sequence[str]) -> dict[str, Any]:
    one = len(names) == 1
    belong, keep = ("belongs", "It keeps its stated value and tolerance") if one else (
        "belong", "They keep their stated values and tolerances"
    )  # fmt: skip
    text = (
        f"{joined(names)} {belong} to specimen {specimen}, of which no recording was fitted. {keep}, which "
        "limits how well its recordings can be predicted."
    )
    return {"kind": "not_fitted", "parameters": list(names), "text": text}


def _end_of_range(name: str, value: float, profiled: bool) -> dict[str, Any]:
    text = (
        f"{name} is at {value:g}, an end of its range, where the law has a special form. {ERROR[profiled]}. "
        "The errors of the other constants hold if its true value is this end. `pneusma diagnose` leaves it "
        "open within its range, so the errors that it quotes are larger."
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
    fisher: Information,
    parameters: Parameters,
    start: Mapping[str, float],
    needed: Callable[[str], str],
    aside: Set[str],
) -> tuple[list[dict[str, Any]], set[str]]:
    """Parameters about which the recordings say next to nothing even if all others were known.

    Those of `aside` have no entry; they are covered like the others.
    """
    entries, covered = [], set(aside)
    marginal, best = fisher.sd() / fisher.scale, fisher.sd_if_others_were_known() / fisher.scale
    for k, name in enumerate(fisher.names):
        if name in aside or not fisher.told[k] or best[k] < HARDLY:
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
        entry = {"kind": kind, "parameters": [name], "posterior_over_prior": ratio, "reason": needed(name)}
        entries.append({**entry, "text": text})
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
        entry["group"] = f"{senses} ({reach(names)}, error {100.0 * ratio:.0f} % of the priors')"
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
            entry["group"] = f"{_list(names)} ({size} {strongest:+.3f}, from {reach(names)})"
            entries.append({**entry, "text": text})
    return entries


def _list(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"
