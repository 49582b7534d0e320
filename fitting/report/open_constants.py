"""Sentences on constants that stay open, with one sentence for all of the same status."""

from collections.abc import Mapping, Sequence, Set
from typing import Any

from fitting.inference.notes import joined

TOGETHER = {
    "at_bound": (
        "stopped at their bounds: the data, or another cause of misfit, pull them further than they may go. "
        "They have no errors. The errors of the other constants hold if the true values are these bounds."
    ),
    "one_sided": (
        "stopped at their bounds: the data, or another cause of misfit, pull them further than they may go. "
        "Their errors, of the profile likelihoods, have one side only. The errors of the other constants "
        "hold if the true values are these bounds."
    ),
    "end_of_range": (
        "are at ends of their ranges, where the law has special forms. They have no errors. The errors of "
        "the other constants hold if the true values are these ends. `pneusma diagnose` leaves them open "
        "within their ranges, so the errors that it quotes are larger."
    ),
    "at_start": "are still at the values they started from: these recordings do not show them.",
    "held": (
        "are still at the values they started from. They were held, because only a recording that takes the "
        "load off would show them."
    ),
    "absent": "",
}
"""Sentences about several parameters with the same status; empty where each has its own."""
GROUPS = {
    "loose_direction": (
        "These cannot be separated. As far as the priors allow, the fit stays as good in each of these "
        "directions: {}."
    ),
    "known_together": (
        "Of each of these groups the joint effect was measured, not each constant. They are known only "
        "together: {}."
    ),
}
"""Sentences about several groups of parameters, by kind of entry."""


def grouped_warnings(entries: Sequence[Mapping[str, Any]], held: Set[str] = frozenset()) -> list[str]:
    """Warnings about single parameters, with one sentence for all of the same status.

    Args:
        entries: entries of `GeneralCharacterisation.identifiability`.
        held: names of the parameters that were held because no recording shows them.
    """
    sentences = []
    for status in TOGETHER:
        if status == "end_of_range":  # which needs no warning
            continue
        sentences += _of_status(status, [e for e in entries if _status(e, held) == status])
    return sentences


def open_sentences(entries: Sequence[Mapping[str, Any]], held: Set[str] = frozenset()) -> list[str]:
    """A sentence for every entry, and one for all parameters of the same status; as `grouped_warnings`."""
    by_status: dict[str, list[Mapping[str, Any]]] = {}
    for entry in entries:
        by_status.setdefault(_status(entry, held), []).append(entry)
    return [text for status, same in by_status.items() for text in _of_status(status, same)]


def first_sentence(entries: Sequence[Mapping[str, Any]], held: Set[str] = frozenset()) -> str:
    """The sentence for a verdict: of the first entry, and of all others of its status that share it.

    Of several groups it is about the first one alone; `open_sentences` has the others.
    """
    return entries[0]["text"] if entries[0]["kind"] in GROUPS else open_sentences(entries, held)[0]


def _of_status(status: str, same: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences on entries of one status: one for all of them where there is one, or one for each."""
    if len(same) < 2:
        return [entry["text"] for entry in same]
    names = joined([name for entry in same for name in entry["parameters"]])
    reasons = {entry.get("reason", "") for entry in same}
    if status == "at_start" and len(reasons) == 1 and (reason := reasons.pop()).endswith(" it"):
        return [
            f"{names} are still at the values they started from: {reason.removesuffix(' it')} them. Their "
            "errors come from the priors."
        ]
    if TOGETHER.get(status):
        return [f"{names} {TOGETHER[status]}"]
    if status in GROUPS and all("group" in entry for entry in same):
        return [GROUPS[status].format("; ".join(entry["group"] for entry in same))]
    return [entry["text"] for entry in same]


def _status(entry: Mapping[str, Any], held: Set[str]) -> str:
    """Key of `TOGETHER` of an entry, or its kind."""
    if entry["kind"] == "at_start":
        return "held" if set(entry["parameters"]) <= held else "at_start"
    return "one_sided" if entry["kind"] == "at_bound" and entry.get("one_sided") else entry["kind"]
