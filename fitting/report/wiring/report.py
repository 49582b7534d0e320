"""The report of a choice of filters."""

from fitting.wiring.choose import Wiring

from ..report import Picture, Report, Section
from . import documents, words
from .figures import wiring_figure


def report_of(result: Wiring) -> Report:
    """The report of filters that select springs."""
    caption = "Heating of every spring over the supply's frequency, and the crosstalk of every pair."
    picture = Picture("wiring", caption, lambda: wiring_figure(result.circuit))
    return Report(
        title="One pair of wires",
        subtitle=f"Filters that select one of {len(result.circuit.resistance)} springs",
        verdict=words.verdict(result),
        sections=[Section("Filters", [words.filter_table(result), picture])],
        footer="pneusma wiring",
        content=lambda: documents.summary(result),
    )
