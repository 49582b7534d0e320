"""The report of a fitted elastomer: the selected law, its constants, range of validity, and the next test."""

from fitting.calibrate.elastomer.next_test import CAUSES
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation

from .. import characterisation
from ..report import Points, Report, Section
from . import text
from .figures import pictures
from .files import files
from .payload import content
from .tables import drift_table, law_table, next_test_table, parameter_table


def report_of(result: ElastomerCharacterisation) -> Report:
    """The report of the result."""
    samples = result.samples
    drawn = pictures(result)
    over_ranges = [drawn[name] for name in ("held_out", "drift") if name in drawn]
    return Report(
        title=result.title,
        subtitle=_subtitle(result),
        verdict=text.verdict(result),
        warnings=text.warnings(result),
        real=samples.real,
        sections=[
            Section("Fit", [drawn["fit"]]),
            Section(
                "Parameters",
                [parameter_table(result), Points(text.identifiability_sentences(result.best))],
            ),
            Section(
                "Laws", [law_table(result.whole), *over_ranges, drift_table(result.whole), drawn["residuals"]]
            ),
            Section("How it was fitted", [Points(text.how_it_was_fitted(result))]),
            Section("Next test", [result.next_test.text, next_test_table(result.next_test, CAUSES)]),
            Section("Notices", [Points(samples.notices)]),
        ],
        window=f"{result.title}: characterisation",
        footer=characterisation.footer(result.seed),
        content=lambda: content(result),
        files=lambda: files(result),
    )


def _subtitle(result: ElastomerCharacterisation) -> str:
    curves = result.samples.curves
    fitted = [curve.name for curve in curves if curve.role == "fit"]
    held_out = [curve.name for curve in curves if curve.role == "validation"]
    return characterisation.subtitle("Elastomer", "recording", fitted, held_out)
