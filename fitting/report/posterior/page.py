"""The page of a posterior: may it be believed, what it says, how it was made."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from fitting.sample.campaign import CampaignPosterior

from .. import html
from . import text as words

CAPTIONS = {
    "corner": "Every pair of parameters. Filled: the draws, one and two sigma. Dashed: the Laplace "
    "approximation, which the fit's standard errors stand for. Where they part, believe the draws.",
    "predictive": "Measured values with the bands that 90 % of the draws' curves, and 90 % of new "
    "measurements with their noise, fall into; below, measured less the median.",
    "prior": "What was known of each parameter before the data, and after. A posterior as wide as its prior "
    "was not learnt from these data.",
    "trace": "Mean and 5 to 95 % of the walkers of each ensemble at every step. Ensembles that lie on each "
    "other and do not drift have forgotten where they began.",
}
DISAGREEMENT_CAPTION = (
    "Mean of the draws less the fit, in the fit's standard errors; width of the draws over the fit's "
    "standard error; skewness of the draws. A Gaussian posterior has 0, 1 and 0."
)


def html_page(result: CampaignPosterior, figures: Mapping[str, Figure]) -> str:
    """The whole page.

    Args:
        result: problem and draws.
        figures: by name, as `result.plot()` gives them.
    """
    problem = result.problem
    fitted = [curve.recording for curve in problem.curves if curve.role == "fit"]
    count = len(dict.fromkeys(fitted))
    subtitle = f"Posterior of {len(result.posterior.names)} parameters, kind {problem.kind}, "
    subtitle += f"{count} recording{'s' * (count > 1)} fitted ({', '.join(dict.fromkeys(fitted))})"
    parts = [html.paragraph("simulated data, not measured", "label")] if problem.real is False else []
    parts += [html.heading(problem.title, 1), html.paragraph(subtitle, "subtitle")]
    parts += [html.verdict(result.verdict)]
    if not result.converged:
        parts += [html.paragraph("Not converged: the numbers below are not to be quoted.", "warning")]
    parts += [html.heading("Parameters"), html.table(words.HEADER, words.parameter_rows(result))]
    parts += [_figure(figures, "corner"), html.heading("Model and data"), _figure(figures, "predictive")]
    parts += [html.heading("What the data added"), _figure(figures, "prior")]
    parts += [html.heading("Where the fit's error bars hold")]
    parts += [html.table(words.DISAGREEMENT_HEADER, words.disagreement_rows(result), DISAGREEMENT_CAPTION)]
    parts += [html.heading("How it was sampled"), html.bullets(words.how_it_was_sampled(result))]
    parts += [_figure(figures, "trace")]
    if problem.notices:
        parts += [html.heading("Notices"), html.bullets(list(problem.notices))]
    footer = f"pneusma posterior, seed {result.posterior.settings.seed}"
    return html.page(f"{problem.title}: posterior", parts, footer)


def _figure(figures: Mapping[str, Figure], name: str) -> str:
    return html.figure(figures[name], CAPTIONS[name])
