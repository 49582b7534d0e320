"""Reports of inverse problems: drives for targets, drives over time, a chain in a lumen."""

from fitting.invert.passage import Passage
from fitting.invert.result import Inversion
from fitting.invert.trajectory import Trajectory

from ..report import Picture, Report, Section
from . import documents, words
from .figures import passage_figure, targets_figure

FOOTER = "pneusma invert"


def inversion_report(result: Inversion) -> Report:
    """The report of drives for targets."""
    picture = Picture("targets", "What was wanted, what the model does, and the drives.",
                      lambda: targets_figure(result))  # fmt: skip
    return Report(
        title=result.design,
        subtitle=words.subtitle(result),
        verdict=words.verdict(result),
        sections=[
            Section("Targets", [words.target_table(result), picture]),
            Section("Springs", [words.spring_table(result)]),
            Section("Other ways", [words.way_table(result)]),
        ],
        window=f"{result.design}: how to drive it",
        footer=FOOTER,
        content=lambda: documents.summary(result, []),
        files=lambda: documents.files(result),
    )


def trajectory_report(result: Trajectory) -> Report:
    """The report of drives over time, with irreversible steps first."""
    found = result.inversion
    picture = Picture("targets", "What was wanted, what the model does, and the drives, over time.",
                      lambda: targets_figure(found, result.time))  # fmt: skip
    return Report(
        title=found.design,
        subtitle=f"{words.subtitle(found)}, over time",
        verdict=words.verdict(found),
        warnings=[f"{sentence[0].upper()}{sentence[1:]}." for sentence in result.warnings()],
        sections=[
            Section("Targets", [words.target_table(found, result.time), picture]),
            Section("Springs", [words.spring_table(found)]),
            Section("How it was found", [words.agreement(result)]),
        ],
        window=f"{found.design}: how to drive it",
        footer=FOOTER,
        content=lambda: documents.trajectory_summary(result),
        files=lambda: documents.files(found, result.time),
    )


def passage_report(result: Passage) -> Report:
    """The report of a chain in a lumen."""
    picture = Picture("passage", "The body in the lumen, from two sides.", lambda: passage_figure([result]))
    return Report(
        title=result.design,
        subtitle=f"{'An actuator' if result.alone else 'A chain'} in the lumen {result.lumen.name}",
        verdict=words.passage_verdict(result),
        sections=[Section("Springs", [words.passage_table(result)]), Section("Shape", [picture])],
        window=f"{result.design}: in a lumen",
        footer=FOOTER,
        content=lambda: documents.passage_summary(result),
        files=lambda: documents.passage_files(result),
    )
