"""The page of a fitted elastomer: verdict first, then figures and tables, nothing to fetch."""

from collections.abc import Mapping

from matplotlib.figure import Figure

from fitting.calibrate.elastomer.next_test import CAUSES
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation

from .. import html
from . import text as words
from .tables import TextTable, drift_table, law_table, parameter_table

CAPTIONS = {
    "fit": "Measured engineering stress with every law; the one taken is drawn thick. Right: an actuator's "
    "strains, where the laws part in compression that was not tested.",
    "residuals": "What each law leaves of the curve. Noise would scatter around zero; slow waves are its "
    "shape.",
    "drift": "Shear modulus at rest over the range that was fitted. A law of the right shape gives one "
    "number.",
    "held_out": "Relative error where a law was fitted and on the stretch that follows, which it had not "
    "seen; and the error in gaps of the curve that were left out of the fit.",
}


def html_page(result: ElastomerCharacterisation, figures: Mapping[str, Figure]) -> str:
    """The whole page.

    Args:
        result: what was found.
        figures: by name, as `result.plot()` gives them.
    """
    samples = result.samples
    fitted = [curve.name for curve in samples.curves if curve.role == "fit"]
    kept = [curve.name for curve in samples.curves if curve.role == "validation"]
    subtitle = f"Elastomer, {len(fitted)} recording{'s' * (len(fitted) > 1)} fitted ({', '.join(fitted)})"
    subtitle += f", {len(kept)} kept for validation ({', '.join(kept)})" if kept else ""
    parts = [html.paragraph("simulated data, not measured", "label")] if samples.real is False else []
    parts += [html.heading(result.title, 1), html.paragraph(subtitle, "subtitle")]
    parts += [html.verdict(result.verdict)]
    parts += [html.paragraph(sentence, "warning") for sentence in words.warnings(result)]
    parts += [html.figure(figures["fit"], CAPTIONS["fit"])]
    parts += [html.heading("Constants"), _table(parameter_table(result), "± one standard error.")]
    parts += [html.bullets(words.identifiability_sentences(result.best))]
    parts += [html.heading("Which law"), _table(law_table(result.whole), _LAW_CAPTION)]
    parts += [html.figure(figures[name], CAPTIONS[name]) for name in ("held_out", "drift") if name in figures]
    parts += [_table(drift_table(result.whole), "Shear modulus at rest in kPa, ± one standard error.")]
    parts += [html.figure(figures["residuals"], CAPTIONS["residuals"])]
    parts += [html.heading("How it was fitted"), html.bullets(words.how_it_was_fitted(result))]
    parts += [html.heading("Which test next"), html.paragraph(result.next_test.text), _tests(result)]
    if samples.notices:
        parts += [html.heading("Notices"), html.bullets(list(samples.notices))]
    return html.page(f"{result.title}: characterisation", parts, f"pneusma characterise, seed {result.seed}")


_LAW_CAPTION = (
    "Best first, by error in gaps of the curve; the law taken is emphasised. Free: constants. Errors "
    "are root mean square or relative (Eq. 2.52 with absolute differences). Next: error on the stretch that "
    "follows a fitted range, geometric mean over the ranges. AICc and BIC count independent samples and are "
    "differences to the best law."
)


def _table(table: TextTable, caption: str) -> str:
    return html.table(table.header, table.rows, caption, table.chosen)


def _tests(result: ElastomerCharacterisation) -> str:
    test = result.next_test
    header = ["test", "error left (kPa)", *(f"from {cause}" for cause in CAUSES), "information (nats)"]
    now = ["as it stands", test.error_before, *(test.before[cause] for cause in CAUSES)]
    rows = [[now[0], *(f"{value / 1e3:.3g}" for value in now[1:]), ""]]
    for candidate in test.candidates:
        errors = [candidate.error_after, *(candidate.after[cause] for cause in CAUSES)]
        rows.append(
            [candidate.text, *(f"{value / 1e3:.3g}" for value in errors), f"{candidate.information:.2g}"]
        )
    caption = (
        "Expected root mean square error of the stress over an actuator's strains, after each test, "
        "and its causes."
    )
    return html.table(header, rows, caption, 1)
