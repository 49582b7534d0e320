"""Any result on paper: `save(result, folder)`, `text(result)`. Importing this says how each type looks."""

from pathlib import Path

from fitting.calibrate.batch import Batch
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.data.publish import publish
from fitting.design.result import DesignResult
from fitting.inference.results import Presenter, Result, register_presenter
from fitting.plan.plan import Plan
from fitting.propagate import Propagation
from fitting.sample.campaign import CampaignPosterior

from . import batch
from .design import documents as design_documents
from .design import figures as design_figures
from .design import words as design_words
from .elastomer import documents as elastomer_documents
from .elastomer import figures as elastomer_figures
from .elastomer import text as elastomer_text
from .general import figures as general_figures
from .general import report as general_report
from .general import text as general_text
from .plan import documents as plan_documents
from .plan import figure as plan_figure
from .plan import text as plan_text
from .posterior import documents as posterior_documents
from .posterior import figures as posterior_figures
from .posterior import text as posterior_text
from .propagate import documents as propagate_documents
from .propagate import figures as propagate_figures
from .propagate import text as propagate_text
from .spring import figures as spring_figures
from .spring import report as spring_report
from .spring import text as spring_text


def _drawn(captioned):
    """Figures without their captions."""
    return lambda result: {name: figure for name, (figure, _) in captioned(result).items()}


PRESENTERS = {
    ElastomerCharacterisation: Presenter(
        elastomer_text.verdict,
        elastomer_text.text_report,
        elastomer_figures.figures,
        elastomer_documents.documents,
    ),
    SpringCharacterisation: Presenter(
        spring_text.verdict,
        lambda result: spring_report.report_of(result).text(),
        _drawn(spring_figures.captioned),
        lambda result: spring_report.report_of(result).documents(),
    ),
    GeneralCharacterisation: Presenter(
        general_text.verdict,
        lambda result: general_report.report_of(result).text(),
        _drawn(general_figures.captioned),
        lambda result: general_report.report_of(result).documents(),
    ),
    Batch: Presenter(batch.verdict, batch.text, batch.figures, batch.documents),
    CampaignPosterior: Presenter(
        posterior_text.verdict,
        posterior_text.text_report,
        posterior_figures.figures,
        posterior_documents.documents,
    ),
    DesignResult: Presenter(
        design_words.verdict, design_words.text, _drawn(design_figures.figures), design_documents.documents
    ),
    Propagation: Presenter(
        propagate_text.verdict,
        propagate_text.text_report,
        _drawn(propagate_figures.captioned),
        propagate_documents.documents,
    ),
    Plan: Presenter(
        plan_text.verdict,
        plan_text.report,
        lambda plan: {"expected_sd": plan_figure.plan_figure(plan)},
        plan_documents.documents,
    ),
}
"""How each type of result looks."""

for _kind, _presenter in PRESENTERS.items():
    register_presenter(_kind, _presenter)


def text(result: Result) -> str:
    """The whole result as plain text."""
    return result.report()


def save(result: Result, folder: str | Path, force: bool = False) -> list[Path]:
    """Write all files of a result; they appear together or not at all.

    Args:
        result: of any type in `PRESENTERS`.
        folder: made if it does not exist.
        force: replace files of these names that are there already.

    Raises:
        InputError: if files are in the way, or the place cannot be written.
    """
    return publish(folder, result.documents, force)
