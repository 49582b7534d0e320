"""Sentences on a posterior."""

from fitting.inference.notes import joined
from fitting.sample.campaign import CampaignPosterior
from fitting.sample.determined import estimates, flat
from fitting.sample.settings import Settings

from ..characterisation import limits
from .beside_fit import opening

HOLD = "the fit's standard errors hold"
"""End of a sentence that only a posterior may say which counts everything that the fit's errors count."""


def verdict(result: CampaignPosterior) -> list[str]:
    """Sentences on what the draws do not count, on their convergence, on ends of intervals that the data do
    not make, then on error bars of the fit."""
    uncounted = opening(result.problem.fit)
    sentences = [*uncounted, *result.posterior.verdict, *not_measured(result)]
    if not result.converged:
        sentences.append(
            "Whether the fit's standard errors (Laplace) hold is not judged: the draws are too few."
        )
        return sentences
    found = [(name, d) for name, d in result.posterior.disagreements.items() if d.notable]
    if not found:
        agrees = "The Laplace approximation agrees with the draws on every parameter"
        same = "it takes the same law and noise, so that this confirms neither"
        sentences.append(f"{agrees}: {same if uncounted else HOLD}.")
    for name, disagreement in found:
        sentences.append(f"Laplace and draws disagree on {name}: {'; '.join(disagreement.reasons)}.")
    return sentences


def not_measured(result: CampaignPosterior) -> list[str]:
    """Sentences on parameters whose draws repeat a prior or end at a bound; empty if the data bracket all."""
    found = estimates(result.problem, result.posterior)
    sentences, bounded = limits(found), flat(result.problem, found)
    if bounded:
        has = "has a flat prior" if len(bounded) == 1 else "have flat priors"
        ends = "an end there is a bound, not a measurement"
        sentences.append(f"{joined(bounded)} {has} between bounds: {ends}.")
    return sentences


def how_it_was_sampled(result: CampaignPosterior) -> list[str]:
    """Sentences on likelihood, priors and sampler."""
    p = result.posterior
    acceptance = ", ".join(f"{100.0 * a:.0f} %" for a in p.acceptance)
    return [
        *result.problem.notes,
        f"{_sampler(p.settings)} Acceptance: {acceptance}.",
        f"{p.convergence.steps} steps of each, of which {p.convergence.burn_in} are burn-in; figures and "
        f"files hold one step in {p.convergence.thin} of the rest. {p.evaluations} evaluations of the model, "
        f"seed {p.settings.seed}.",
        "R-hat is split, rank-normalised, between ensembles, the larger of location and scale; effective "
        "samples are those of all ensembles, from the integrated autocorrelation time.",
    ]


def library_of(settings: Settings) -> str:
    """Name of the sampler's library."""
    return "blackjax" if settings.sampler == "nuts" else "emcee"


def _sampler(settings: Settings) -> str:
    """Sentences on the moves of the sampler."""
    if settings.sampler == "nuts":
        return (
            f"blackjax: {settings.ensembles} independent chains of the no-U-turn sampler, which follows "
            f"gradients. Their {settings.warm_up} steps of warm-up were thrown away."
        )
    tempered = settings.sampler == "tempered"
    start = "drawn from the prior" if tempered else "with a centre of its own around the fit"
    return (
        f"emcee: {settings.ensembles} independent ensembles of {settings.walkers} walkers, each {start}. "
        "Moves are differential evolution and stretches."
    )
