"""Presentation of any result: `save(result, folder)`, `text(result)`. An import of it registers all types.

Types and functions are named here and imported when a result is at hand. A command needs the report of one
type, and to import all of them takes a second.
"""

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fitting.data.publish import publish
from fitting.inference.results import Presenter, Result, register_presenter

from . import render
from .figures import shown
from .report import Report

REPORTS = {
    "fitting.calibrate.batch:Batch": "batch:report_of",
    "fitting.calibrate.elastomer.pipeline:ElastomerCharacterisation": "elastomer.report:report_of",
    "fitting.calibrate.general.pipeline:GeneralCharacterisation": "general.report:report_of",
    "fitting.calibrate.spring.pipeline:SpringCharacterisation": "spring.report:report_of",
    "fitting.control.sweep:Sweep": "control.report:report_of",
    "fitting.design.result:DesignResult": "design.report:report_of",
    "fitting.diagnose.batch:Diagnoses": "diagnosis.batch:report_of",
    "fitting.diagnose.custom_model.result:Explained": "custom_model:report_of",
    "fitting.invert.passage:Passage": "invert.report:passage_report",
    "fitting.invert.result:Inversion": "invert.report:inversion_report",
    "fitting.invert.trajectory:Trajectory": "invert.report:trajectory_report",
    "fitting.plan.plan:Plan": "plan.report:report_of",
    "fitting.propagate.result:Propagation": "propagate.report:report_of",
    "fitting.sample.campaign:CampaignPosterior": "posterior.report:report_of",
    "fitting.sample.hierarchy:Together": "posterior.hierarchy:report_of",
    "fitting.wiring.choose:Wiring": "wiring.report:report_of",
}
"""Module and name of each type of result -> module of `fitting.report` and function that makes its report."""


def presenter(report_of: Callable[[Any], Report]) -> Presenter:
    """Presenter of results from a function that makes their report."""
    return Presenter(
        verdict=lambda result: list(report_of(result).verdict),
        text=lambda result: render.text(report_of(result)),
        figures=lambda result: {p.name: shown(p.figure) for p in report_of(result).pictures()},
        documents=lambda result: render.documents(report_of(result)),
    )


def named(function: str) -> Callable[[Any], Report]:
    """Function of `REPORTS` that makes a report; its module is imported at the first call."""
    module, name = function.split(":")
    return lambda result: getattr(importlib.import_module(f"{__package__}.{module}"), name)(result)


for _kind, _function in REPORTS.items():
    register_presenter(_kind, presenter(named(_function)))


def text(result: Result) -> str:
    """The whole result as plain text."""
    return result.report()


def save(result: Result, folder: str | Path, force: bool = False) -> list[Path]:
    """Write all files of a result; in a new folder they appear together or not at all.

    Args:
        result: result of any type in `REPORTS`.
        folder: folder for the files, made if it does not exist.
        force: true to replace existing files of these names.

    Raises:
        InputError: if files exist already, or the place cannot be written.
    """
    return publish(folder, result.documents, force)
