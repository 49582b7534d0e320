"""A posterior in words."""

from fitting.sample.campaign import CampaignPosterior


def verdict(result: CampaignPosterior) -> list[str]:
    """Whether the chains may be believed, then where the fit's error bars may not."""
    sentences = list(result.posterior.verdict)
    if not result.converged:
        sentences.append(
            "Whether the fit's standard errors (Laplace) hold is not judged: the draws are too few."
        )
        return sentences
    found = [(name, d) for name, d in result.posterior.disagreements.items() if d.notable]
    if not found:
        sentences.append(
            "The Laplace approximation agrees with the draws on every parameter: the fit's standard errors "
            "hold."
        )
    for name, disagreement in found:
        sentences.append(f"Laplace and draws disagree on {name}: {'; '.join(disagreement.reasons)}.")
    return sentences


def how_it_was_sampled(result: CampaignPosterior) -> list[str]:
    """Likelihood, priors and sampler in sentences."""
    p = result.posterior
    acceptance = ", ".join(f"{100.0 * a:.0f} %" for a in p.acceptance)
    return [
        *result.problem.notes,
        f"emcee: {p.settings.ensembles} independent ensembles of {p.settings.walkers} walkers, each with a "
        f"centre of its own around the fit; differential evolution and stretch moves; accepted {acceptance}.",
        f"{p.convergence.steps} steps of each, of which {p.convergence.burn_in} are burn-in; figures and "
        f"files hold one step in {p.convergence.thin} of the rest. {p.evaluations} evaluations of the model, "
        f"seed {p.settings.seed}.",
        "R-hat is split, rank-normalised, between ensembles, the larger of location and scale; effective "
        "samples are those of all ensembles, from the integrated autocorrelation time.",
    ]
