"""Tables of a posterior: its parameters, and disagreements of the Laplace approximation with the draws."""

import math

from fitting.sample.campaign import CampaignPosterior
from fitting.sample.determined import estimates

from ..cells import number, with_error
from ..characterisation import remark
from ..table import Table

HEADER = (
    "parameter", "unit", "mean ± sd", "5 %", "median", "95 %", "fit ± Laplace sd", "R-hat",
    "effective samples", "",
)  # fmt: skip
DISAGREEMENT = (
    "Mean of the draws less the fit, in the fit's standard errors; width of the draws over the fit's "
    "standard error; skewness of the draws. A Gaussian posterior has 0, 1 and 0."
)
NOT_JUDGED = "not judged (not converged)"


def parameter_table(result: CampaignPosterior) -> Table:
    """One row for each sampled or tied parameter."""
    problem, rows = result.problem, []
    found = estimates(problem, result.posterior)
    for name, s in result.posterior.summary.items():
        mean, low, median, high = (float(problem.shown(name, v)) for v in (s.mean, s.low, s.median, s.high))
        sd = float(problem.shown(name, s.sd, spread=True))
        mode = float(problem.shown(name, result.posterior.laplace.value[name]))
        laplace_sd = float(problem.shown(name, result.posterior.laplace.sd[name], spread=True))
        form = _form(sd)
        rows.append([
            name, problem.unit(name), with_error(mean, sd), *(number(v, form) for v in (low, median, high)),
            with_error(mode, laplace_sd), number(s.r_hat, ".4f"), number(s.effective, ".0f"),
            remark(found[name]) if name in found else "",
        ])  # fmt: skip
    return Table(HEADER, rows)


def disagreement_table(result: CampaignPosterior) -> Table:
    """Table of the parameters for which the Laplace approximation misleads; no verdict on chains that have
    not converged."""
    rows = []
    for name, d in result.posterior.disagreements.items():
        judged = ("; ".join(d.reasons) or "agrees") if result.converged else NOT_JUDGED
        numbers = [number(d.shift, "+.2f"), number(d.ratio, ".2f"), number(d.skewness, "+.2f")]
        rows.append([name, *numbers, judged])
    header = ("parameter", "mean - fit [sd]", "sd / Laplace sd", "skewness", "verdict")
    return Table(header, rows, DISAGREEMENT)


def _form(sd: float) -> str:
    """Number of decimals that a standard deviation supports; four digits where powers of ten read better."""
    return f".{max(1 - math.floor(math.log10(sd)), 0)}f" if 1e-4 < sd < 1e5 else ".4g"
