"""The report of a plan: the recommended tests, their order, and their expected information."""

from fitting.plan.plan import Plan

from ..report import Picture, Points, Report, Section
from . import protocol, text
from .figure import plan_figure
from .tables import constant_table, test_table

CAPTION = (
    "Expected 1-sigma of each constant after each test, in units of what is known before the first one"
    " (median over possible alloys). Bold: the constants that the tests were chosen for."
)


def report_of(plan: Plan) -> Report:
    """The report of the plan."""
    return Report(
        title=f"First campaign for {plan.knowledge.table.name}",
        subtitle="A protocol chosen by expected information, before any data",
        verdict=text.verdict(plan),
        sections=[
            Section("Before you start", [Points(text.preparation(plan))]),
            Section("Tests, in this order", [test_table(plan)]),
            Section(
                "What they are expected to give",
                [
                    Picture("expected_sd", CAPTION, lambda: plan_figure(plan)),
                    constant_table(plan),
                    text.comparison(plan),
                ],
            ),
            Section("Which test tells which constant", [Points(text.tellers(plan))]),
            Section("What will stay unknown", [Points(plan.loose or ("Nothing stands out.",))]),
            Section("How this was chosen", [Points(text.reasons(plan))]),
        ],
        footer="pneusma plan",
        page_name="protocol.html",
        content=lambda: protocol.content(plan),
        files=lambda: protocol.files(plan),
    )
