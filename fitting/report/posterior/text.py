"""A posterior in words and rows of text, for the terminal, the page and tables."""

import math

from fitting.inference.parameters import format_estimate
from fitting.sample.campaign import CampaignPosterior

HEADER = (
    "parameter", "unit", "mean ± sd", "5 %", "median", "95 %", "fit ± Laplace sd", "R-hat",
    "effective samples",
)  # fmt: skip
DISAGREEMENT_HEADER = ("parameter", "mean - fit [sd]", "sd / Laplace sd", "skewness", "verdict")

NOT_JUDGED = "not judged (not converged)"


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


def parameter_rows(result: CampaignPosterior) -> list[list[str]]:
    """Cells below `HEADER`, one row for each sampled or tied parameter."""
    problem, rows = result.problem, []
    for name, s in result.posterior.summary.items():
        mean, low, median, high = (float(problem.shown(name, v)) for v in (s.mean, s.low, s.median, s.high))
        sd = float(problem.shown(name, s.sd, spread=True))
        mode = float(problem.shown(name, result.posterior.laplace.value[name]))
        laplace_sd = float(problem.shown(name, result.posterior.laplace.sd[name], spread=True))
        estimate = format_estimate(mode, laplace_sd if laplace_sd > 0.0 else None)
        digits = _digits(sd)
        rows.append([
            name, problem.unit(name), _plus_minus(format_estimate(mean, sd)),
            *(f"{v:.{digits}f}" if digits is not None else f"{v:.4g}" for v in (low, median, high)),
            _plus_minus(estimate), _number(s.r_hat, ".4f"), _number(s.effective, ".0f"),
        ])  # fmt: skip
    return rows


def disagreement_rows(result: CampaignPosterior) -> list[list[str]]:
    """Cells below `DISAGREEMENT_HEADER`; no verdict on chains that have not converged."""
    judged = result.converged
    return [
        [
            name, _number(d.shift, "+.2f"), _number(d.ratio, ".2f"), _number(d.skewness, "+.2f"),
            ("; ".join(d.reasons) or "agrees") if judged else NOT_JUDGED,
        ]
        for name, d in result.posterior.disagreements.items()
    ]  # fmt: skip


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


def text_report(result: CampaignPosterior) -> str:
    """The whole result as plain text."""
    lines = [f"{result.problem.title}: posterior", ""]
    if result.problem.real is False:
        lines.insert(1, "(simulated data, not measured)")
    lines += [*result.verdict, ""]
    lines += _aligned([list(HEADER), *parameter_rows(result)])
    lines += ["", "Laplace approximation against the draws"]
    lines += _aligned([list(DISAGREEMENT_HEADER), *disagreement_rows(result)])
    lines += ["", *how_it_was_sampled(result)]
    return "\n".join(lines)


def _aligned(rows: list[list[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _plus_minus(text: str) -> str:
    return text.replace("+/-", "±")


def _number(value: float, form: str) -> str:
    return "" if math.isnan(value) else format(value, form)


def _digits(sd: float) -> int | None:
    """Decimals that a standard deviation supports; None where powers of ten read better."""
    if not 1e-4 < sd < 1e5:
        return None
    return max(1 - math.floor(math.log10(sd)), 0)
