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
        same_status = [e for e in entries if _status(e, held) == status]
        names = [name for e in same_status for name in e["parameters"]]
        if TOGETHER[status] and len(names) > 1:
            sentences.append(f"{', '.join(names[:-1])} and {names[-1]} {TOGETHER[status]}")
        else:
            sentences += [e["text"] for e in same_status]
    return sentences


def open_sentences(entries: Sequence[Mapping[str, Any]], held: Set[str] = frozenset()) -> list[str]:
    """A sentence for every entry, and one for all parameters of the same status; as `grouped_warnings`."""
    by_status: dict[str, list[Mapping[str, Any]]] = {}
    for entry in entries:
        by_status.setdefault(_status(entry, held), []).append(entry)
    said = []
    for status, same in by_status.items():
        names = [name for entry in same for name in entry["parameters"]]
        if len(same) > 1 and TOGETHER.get(status):
            said.append(f"{joined(names)} {TOGETHER[status]}")
        else:
            said += [entry["text"] for entry in same]
    return said


def _status(entry: Mapping[str, Any], held: Set[str]) -> str:
    """Key of `TOGETHER` of an entry, or its kind."""
    if entry["kind"] == "at_start":
        return "held" if set(entry["parameters"]) <= held else "at_start"
    return "one_sided" if entry["kind"] == "at_bound" and entry.get("one_sided") else entry["kind"]
