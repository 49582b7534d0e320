"""Presentation of any result: `save(result, folder)`, `text(result)`. Importing this module registers all
types."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fitting.calibrate.batch import Batch
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.control.sweep import Sweep
from fitting.data.publish import publish
from fitting.design.result import DesignResult
from fitting.diagnose.batch import Diagnoses
from fitting.diagnose.custom_model import Explained
from fitting.inference.results import Presenter, Result, register_presenter
from fitting.invert.passage import Passage
from fitting.invert.run import Inversion
from fitting.invert.trajectory import Trajectory
from fitting.plan.plan import Plan
from fitting.propagate import Propagation
from fitting.sample.campaign import CampaignPosterior
from fitting.sample.hierarchy import Together
from fitting.wiring.choose import Wiring

from . import render
from .batch import report_of as batch_report
from .control.report import report_of as control_report
from .custom_model import report_of as custom_model_report
from .design.report import report_of as design_report
from .diagnosis.batch import report_of as diagnoses_report
from .elastomer.report import report_of as elastomer_report
from .general.report import report_of as general_report
from .invert.report import inversion_report, passage_report, trajectory_report
from .plan.report import report_of as plan_report
from .posterior.hierarchy import report_of as together_report
from .posterior.report import report_of as posterior_report
from .propagate.report import report_of as propagate_report
from .report import Report
from .spring.report import report_of as spring_report
from .wiring.report import report_of as wiring_report

REPORTS: dict[type, Callable[[Any], Report]] = {
    ElastomerCharacterisation: elastomer_report,
    SpringCharacterisation: spring_report,
    GeneralCharacterisation: general_report,
    Batch: batch_report,
    CampaignPosterior: posterior_report,
    Together: together_report,
    Plan: plan_report,
    Explained: custom_model_report,
    DesignResult: design_report,
    Propagation: propagate_report,
    Inversion: inversion_report,
    Trajectory: trajectory_report,
    Passage: passage_report,
    Sweep: control_report,
    Wiring: wiring_report,
    Diagnoses: diagnoses_report,
}
"""Function that makes the report of each type of result."""


def presenter(report_of: Callable[[Any], Report]) -> Presenter:
    """Presenter of results from a function that makes their report."""
    return Presenter(
        verdict=lambda result: list(report_of(result).verdict),
        text=lambda result: render.text(report_of(result)),
        figures=lambda result: {p.name: p.figure for p in report_of(result).pictures()},
        documents=lambda result: render.documents(report_of(result)),
    )


for _kind, _report_of in REPORTS.items():
    register_presenter(_kind, presenter(_report_of))


def text(result: Result) -> str:
    """The whole result as plain text."""
    return result.report()


def save(result: Result, folder: str | Path, force: bool = False) -> list[Path]:
    """Write all files of a result; they appear together or not at all.

    Args:
        result: result of any type in `REPORTS`.
        folder: folder for the files, made if it does not exist.
        force: true to replace existing files of these names.

    Raises:
        InputError: if files exist already, or the place cannot be written.
    """
    return publish(folder, result.documents, force)
