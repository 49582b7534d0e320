"""The report of a design study: the design, its limiting constraints, the Pareto front, the probability of
failure."""

from fitting.design.result import DesignResult

from ..report import Points, Report, Section
from . import tables, words
from .documents import files, summary
from .figures import pictures


def report_of(result: DesignResult) -> Report:
    """The report of the study."""
    drawn = pictures(result)
    of = lambda *names: [drawn[name] for name in names if name in drawn]  # noqa: E731
    front = [tables.front_table(result)] if result.front is not None else []
    chances = [tables.chance_table(result)] if result.chances else []
    return Report(
        title=f"Design study {result.study.name}",
        subtitle="",
        verdict=words.verdict(result),
        warnings=result.notes,
        sections=[
            Section("The design",
                    [tables.parameter_table(result), *of("shapes", "workspace", "sensitivities")]),
            Section("What limits it", [tables.limit_table(result), tables.step_table(result)]),
            Section("The front", [*front, *of("front")]),
            Section("How often it fails", [*chances, *of("chances")]),
            Section("Other choices", [tables.other_table(result)]),
            Section("How it was found", [Points(words.how_it_was_found(result))]),
        ],
        window=f"{result.study.name}: design study",
        footer=f"pneusma design, seed {result.study.seed}",
        content=lambda: summary(result),
        files=lambda: files(result),
    )  # fmt: skip
