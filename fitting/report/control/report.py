"""The report of closed loops: the physics that degrades control, and the benefit of modelling it."""

from fitting.control.sweep import Sweep

from ..report import Picture, Report, Section
from . import documents, words
from .figures import course_figure, rmse_figure, step_figure


def report_of(result: Sweep) -> Report:
    """The report of a sweep."""
    first = result.cases[0]
    title = first.name.replace("_", " ")
    step = f"The step with {title}: curvature, resistances, currents and fractions."
    return Report(
        title=result.design,
        subtitle="Curvature held by the springs' resistances, on a plant that the controller does not know",
        verdict=words.verdict(result),
        warnings=words.warnings(result),
        sections=[
            Section("Errors", [
                words.case_table(result),
                Picture("rmse", "Errors of the curvature, side by side.", lambda: rmse_figure(result)),
            ]),
            Section("Courses", [
                *words.about_the_step(result),
                Picture("course", "Wanted and real curvature of every case.", lambda: course_figure(result)),
                Picture("step", step, lambda: step_figure(first.without)),
            ]),
        ],
        real=False,
        window=f"{result.design}: closed loop",
        footer=f"pneusma control, seed {result.loop.seed}",
        content=lambda: documents.summary(result),
        files=lambda: documents.files(result),
    )  # fmt: skip
