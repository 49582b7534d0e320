"""The files of a posterior: page, report, summary, draws for ArviZ, figures."""

import csv
import io
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fitting.sample.campaign import CampaignPosterior

from ..figures import png
from .netcdf import netcdf
from .page import html_page

SCHEMA = "pneusma-posterior/1"


def documents(result: CampaignPosterior) -> dict[str, str | bytes]:
    """Content of every file, by file name."""
    drawn = result.plot()
    return {
        "summary.csv": _summary_csv(result),
        "posterior.nc": netcdf(result),
        **{f"{name}.png": png(figure) for name, figure in drawn.items()},
        "report.html": html_page(result, drawn),
        "report.json": json.dumps(_plain(report(result)), indent=1, ensure_ascii=False, allow_nan=False)
        + "\n",
    }


def report(result: CampaignPosterior) -> dict[str, Any]:
    """The content of `report.json`; parameters in the units of files."""
    posterior, problem = result.posterior, result.problem
    state = posterior.convergence
    return {
        "schema": SCHEMA,
        "kind": problem.kind,
        "title": problem.title,
        "real": problem.real,
        "converged": posterior.converged,
        "verdict": result.verdict,
        "parameters": {name: entry(result, name) for name in posterior.summary},
        "sampler": {
            "library": "blackjax" if posterior.settings.sampler == "nuts" else "emcee",
            "method": posterior.settings.sampler,
            "why": posterior.why,
            "walkers": posterior.settings.walkers,
            "ensembles": posterior.settings.ensembles,
            "steps": state.steps,
            "burn_in": state.burn_in,
            "thin": state.thin,
            "seed": posterior.settings.seed,
            "autocorrelation_times": {
                name: float(t) for name, t in zip(posterior.names, state.tau.max(axis=0), strict=True)
            },
            "lengths_in_autocorrelation_times": state.lengths,
            "largest_r_hat": float(state.r_hat.max()),
            "fewest_effective_samples": float(state.effective.min()),
            "acceptance": list(posterior.acceptance),
            "evaluations": posterior.evaluations,
            "without_answer": posterior.failures,
            **posterior.diagnostics,
        },
        "notes": list(problem.notes),
        "notices": list(problem.notices),
    }


def entry(result: CampaignPosterior, name: str) -> dict[str, Any]:
    """One parameter: draws, Laplace approximation, prior and where they disagree."""
    posterior, problem = result.posterior, result.problem
    summary, disagreement = posterior.summary[name], posterior.disagreements[name]
    prior = problem.parameters[name].prior
    return {
        "unit": problem.unit(name),
        "mean": float(problem.shown(name, summary.mean)),
        "sd": float(problem.shown(name, summary.sd, spread=True)),
        "q05": float(problem.shown(name, summary.low)),
        "median": float(problem.shown(name, summary.median)),
        "q95": float(problem.shown(name, summary.high)),
        "skewness": summary.skewness,
        "mcse": float(problem.shown(name, summary.mcse, spread=True)),
        "r_hat": summary.r_hat,
        "effective_samples": summary.effective,
        "fit": float(problem.shown(name, posterior.laplace.value[name])),
        "laplace_sd": float(problem.shown(name, posterior.laplace.sd[name], spread=True)),
        "mean_shift_in_laplace_sd": disagreement.shift,
        "sd_over_laplace_sd": disagreement.ratio,
        "laplace_misleads": disagreement.notable if result.converged else None,
        "prior_mean": None if prior is None else float(problem.shown(name, prior.mean)),
        "prior_sd": None if prior is None else float(problem.shown(name, prior.sd, spread=True)),
    }


def _summary_csv(result: CampaignPosterior) -> str:
    stream = io.StringIO()
    entries = {name: _plain(entry(result, name)) for name in result.posterior.summary}
    columns = ["parameter", *next(iter(entries.values()))]
    writer = csv.DictWriter(stream, columns, lineterminator="\n")
    writer.writeheader()
    for name, values in entries.items():
        cells = {key: "" if value is None else value for key, value in values.items()}
        cells = {k: f"{v:.10g}" if isinstance(v, float) else v for k, v in cells.items()}
        writer.writerow({"parameter": name, **cells})
    return stream.getvalue()


def _plain(value: Any) -> Any:
    """Nested content as JSON knows it: no NumPy numbers, null for what is not finite."""
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
