"""The report of a propagated study: spread of outputs and its causes, probabilities of failure."""

from fitting.propagate import Propagation

from ..report import Picture, Report, Section
from . import text
from .documents import content, files
from .figures import pictures
from .numbers import lost
from .tables import index_tables, limit_table, quantity_table


def report_of(result: Propagation) -> Report:
    """The report of the study."""
    problem, drawn = result.problem, pictures(result)

    def of(*begin: str) -> list[Picture]:
        return [picture for picture in drawn if picture.name.startswith(begin)]

    bounds = [text.bounds_sentence(result)] if lost(result) > 0.0 else []
    failures = [limit_table(result)] if problem.study.limits else []
    return Report(
        title=problem.study.name,
        subtitle=problem.response.title,
        verdict=text.verdict(result),
        warnings=[*problem.cautions, *text.touching(result), *problem.notices, *bounds],
        sections=[
            Section("", [problem.study.description]),
            Section("Outputs", [quantity_table(result), *of("band_", "distribution_")]),
            Section("What the spread comes from", [*index_tables(result), *of("tornado_", "indices_")]),
            Section("Failure", [*failures, *of("failure_")]),
            Section("Rows without a result", of("failed_rows")),
        ],
        window=f"{problem.study.name}: uncertainty",
        footer=f"pneusma propagate, seed {problem.study.sampling.seed}",
        content=lambda: content(result),
        files=lambda: files(result),
    )
