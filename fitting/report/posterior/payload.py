"""The content of `report.json` of a posterior."""

from typing import Any

from fitting.sample.campaign import CampaignPosterior
from fitting.sample.determined import estimate_of

from ..characterisation import estimate_json
from . import text
from .beside_fit import opening

SCHEMA = "pneusma-posterior/1"
KNOWN = ("recordings_bound", "width_over_prior", "merely_prior")
"""Entries on what the recordings say of a sampled parameter, as in the report of a characterisation."""


def content(result: CampaignPosterior) -> dict[str, Any]:
    """The content of `report.json`; parameters in the units of files."""
    posterior, problem = result.posterior, result.problem
    state = posterior.convergence
    return {
        "schema": SCHEMA,
        "kind": problem.kind,
        "title": problem.title,
        "real": problem.real,
        "converged": posterior.converged,
        "verdict": text.verdict(result),
        "parameters": {name: entry(result, name) for name in posterior.summary},
        "sampler": {
            "library": text.library_of(posterior.settings),
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
        "notices": [*opening(problem.fit), *problem.notices],
    }


def entry(result: CampaignPosterior, name: str) -> dict[str, Any]:
    """One parameter: draws, Laplace approximation, prior and their disagreements."""
    posterior, problem = result.posterior, result.problem
    summary, disagreement = posterior.summary[name], posterior.disagreements[name]
    prior = problem.parameters[name].prior
    known = dict.fromkeys(KNOWN)
    if name in posterior.names:
        found = estimate_json(estimate_of(problem, posterior, name))
        known = {key: found[key] for key in KNOWN}
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
        **known,
    }
