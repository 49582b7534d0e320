"""How results of commands look. Only the report of the result at hand is imported: all of them take a second.

`fitting.report.results` is the same for programs, which may meet any result.
"""

import importlib
from pathlib import Path
from typing import Any

from fitting.data.publish import publish

REPORTS = {
    "ElastomerCharacterisation": "elastomer.report:report_of",
    "SpringCharacterisation": "spring.report:report_of",
    "GeneralCharacterisation": "general.report:report_of",
    "Batch": "batch:report_of",
    "CampaignPosterior": "posterior.report:report_of",
    "Together": "posterior.hierarchy:report_of",
    "Plan": "plan.report:report_of",
    "Explained": "custom_model:report_of",
    "DesignResult": "design.report:report_of",
    "Propagation": "propagate.report:report_of",
    "Inversion": "invert.report:inversion_report",
    "Trajectory": "invert.report:trajectory_report",
    "Passage": "invert.report:passage_report",
    "Sweep": "control.report:report_of",
    "Wiring": "wiring.report:report_of",
    "Diagnoses": "diagnosis.batch:report_of",
}
"""Type of a result -> module of `fitting.report` and function that makes its report."""


def report_of(result: Any) -> Any:
    """Report of a result of any type in `REPORTS`."""
    name = next(kind.__name__ for kind in type(result).__mro__ if kind.__name__ in REPORTS)
    module, function = REPORTS[name].split(":")
    return getattr(importlib.import_module(f"fitting.report.{module}"), function)(result)


def text(result: Any) -> str:
    """The whole result as plain text."""
    from fitting.report import render

    return render.text(report_of(result))


def save(result: Any, folder: str | Path, force: bool = False) -> list[Path]:
    """Write all files of a result; they appear together or not at all.

    Args:
        result: result of any type in `REPORTS`.
        folder: folder for the files, made if it does not exist.
        force: true to replace existing files of these names.

    Raises:
        InputError: if files exist already, or the place cannot be written.
    """
    from fitting.report import render

    return publish(folder, lambda: render.documents(report_of(result)), force)
