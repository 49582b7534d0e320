"""The report of a posterior: convergence, results, method."""

from typing import Any

from fitting.data.csv_text import csv_rows
from fitting.sample.campaign import CampaignPosterior
from pneusma_jax.errors import counted

from .. import render
from ..characterisation import CSV_DIGITS
from ..report import Points, Report, Section
from . import text
from .figures import pictures
from .netcdf import netcdf
from .payload import content, entry
from .tables import disagreement_table, parameter_table

NOT_CONVERGED = "Not converged: the numbers below are not to be quoted."


def report_of(result: CampaignPosterior) -> Report:
    """The report of the draws."""
    problem = result.problem
    drawn = pictures(result)
    return Report(
        title=problem.title,
        subtitle=_subtitle(result),
        verdict=text.verdict(result),
        warnings=() if result.converged else (NOT_CONVERGED,),
        real=problem.real,
        sections=[
            Section("Parameters", [parameter_table(result), drawn["corner"]]),
            Section("Model and data", [drawn["predictive"]]),
            Section("What the data added", [drawn["prior"]]),
            Section("Draws beside the Laplace approximation", [disagreement_table(result)]),
            Section("How it was sampled", [Points(text.how_it_was_sampled(result)), drawn["trace"]]),
            Section("Notices", [Points(problem.notices)]),
        ],
        window=f"{problem.title}: posterior",
        footer=f"pneusma posterior, seed {result.posterior.settings.seed}",
        content=lambda: content(result),
        files=lambda: {"summary.csv": _summary_csv(result), "posterior.nc": netcdf(result)},
    )


def _subtitle(result: CampaignPosterior) -> str:
    problem = result.problem
    fitted = list(dict.fromkeys(curve.recording for curve in problem.curves if curve.role == "fit"))
    return (
        f"Posterior of {counted(len(result.posterior.names), 'parameter')}, kind {problem.kind}, "
        f"{counted(len(fitted), 'recording')} fitted ({', '.join(fitted)})"
    )


def _summary_csv(result: CampaignPosterior) -> str:
    """One row for each parameter: draws, Laplace approximation, prior."""
    entries: list[dict[str, Any]] = [
        {"parameter": name, **render.plain(entry(result, name))} for name in result.posterior.summary
    ]
    return csv_rows(list(entries[0]), [list(row.values()) for row in entries], digits=CSV_DIGITS)
