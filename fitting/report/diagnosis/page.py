"""`report.html` of a diagnosis: the verdict first, then everything that stands behind it."""

from collections.abc import Mapping
from html import escape

import numpy as np
from matplotlib.figure import Figure

from fitting.data.recordings import schema
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.verdict.conclude import HeldOut
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.diagnose.verdict.text import place_text, verdict_sentences, went
from fitting.report import html
from fitting.specimens.rows import MARK
from pneusma_jax.model_discrepancy import unit_of
from pneusma_jax.units import from_si


def page_of(conclusion: Conclusion, title: str, command: str, figures: Mapping[str, Figure]) -> str:
    """The whole page.

    Args:
        conclusion: of a diagnosis.
        title: of the campaign.
        command: that makes it again.
        figures: `recordings` and `probabilities`.
    """
    x = conclusion.explanation
    fitted = [r.name for r, f in zip(x.program.recordings, x.program.fitted, strict=True) if f]
    simulated = all(r.real is False for r in x.program.recordings)
    asked = (
        f"Does {conclusion.start.words or 'the published model'} explain {len(x.program.recordings)} "
        f"recordings of kind {x.program.kind}"
    )
    parts = [
        f"<h1>Diagnosis: {escape(title)}</h1>",
        *([html.paragraph("simulated data, not measured", "label")] if simulated else []),
        html.paragraph(f"{asked} ({len(fitted)} fitted)? If not, what does it leave out?", "subtitle"),
        html.verdict(verdict_sentences(conclusion)),
        *(html.paragraph(f"{note}.", "warning") for note in conclusion.notes),
        html.bullets([one["text"] for one in conclusion.asked]),
        html.figure(
            figures["recordings"],
            "Recordings, the base model refitted within its tolerances, and the model "
            "with what was found. Residuals in standard deviations of the noise; grey: within two; amber: "
            "the rows with most misfit.",
        ),
        html.heading("Where"),
        html.paragraph(place_text(conclusion)),
        html.heading("What"),
        *_effects(conclusion),
        html.figure(figures["probabilities"], "What the recordings say about the strongest explanation."),
        _candidates(conclusion),
        html.heading("Held-out recordings"),
        _scores(conclusion),
        html.heading("What the base model's constants absorbed"),
        _base(conclusion),
        *_remainder(conclusion),
        html.heading("Next experiment"),
        html.paragraph(
            conclusion.next_experiment["text"] if conclusion.next_experiment else "None is needed."
        ),
        html.heading("To make this page again"),
        f"<pre>{escape(command)}</pre>",
    ]
    untestable = x.stages[0].screen.untestable if x.stages else []
    if untestable:
        parts.insert(-4, html.paragraph(f"Not testable with these recordings: {', '.join(untestable)}."))
    return html.page(f"Diagnosis: {title}", parts, f"{x.tries} models were fitted.")


def _remainder(conclusion: Conclusion) -> list[str]:
    rest = conclusion.remainder
    if rest is None:
        return []
    units = [f" [{unit_of(name)}]" for name in (rest.driver, rest.quantity)]
    span = f"between {rest.knots[0]:.4g} and {rest.knots[-1]:.4g}{units[0]}"
    text = (
        f"With a smooth function of {rest.driver} {span}, added to {rest.quantity}, the misfit of recordings "
        f"that were not fitted {went(conclusion.before.reduced_chi2, conclusion.after.reduced_chi2)}. It "
        "describes and does not explain. It is in augmented.toml as "
        "unmodelled; outside that range it is unknown, and simulations with the model hold it and say so."
    )
    columns = zip(rest.knots, rest.values, rest.sd, strict=True)
    rows = [(f"{x:.4g}", f"{y:.4g}", f"{sd:.2g}") for x, y, sd in columns]
    return [
        html.heading("What remains, described"),
        html.paragraph(text),
        html.table((f"{rest.driver}{units[0]}", f"correction of {rest.quantity}{units[1]}", "sd"), rows),
    ]


def _effects(conclusion: Conclusion) -> list[str]:
    parts = []
    for f in conclusion.found:
        parts.append(html.heading(f.slug.replace("_", " "), 3))
        close = f" The recordings do not tell it from {', '.join(f.confusable)}." if f.confusable else ""
        parts.append(
            html.paragraph(
                f"{f.text} Probability {f.probability:.2f}, log Bayes factor {f.bayes:.0f}.{close}"
            )
        )
        if f.parameters:
            specs = {i.name: i for i in conclusion.explanation.program.unknowns.items if i.effect == f.slug}
            rows = [
                (specs[n].text, f"{p['value']:.4g}", f"{p['sd']:.2g}", p["unit"],
                 f"{float(specs[n].value(specs[n].low)):.3g} to {float(specs[n].value(specs[n].high)):.3g}")
                for n, p in f.parameters.items()
            ]  # fmt: skip
            parts.append(html.table(("parameter", "value", "standard error", "unit", "physical range"), rows))
    return parts or [html.paragraph("Nothing needs to be added to the base model.")]


def _candidates(conclusion: Conclusion) -> str:
    x, stage = conclusion.explanation, conclusion.explanation.leading
    if stage is None or not stage.trials:
        return html.paragraph("No candidate came near explaining anything.")
    rows = [
        (t.slug.replace("_", " "), f"{conclusion.candidates[t.slug][0]:.3f}", f"{t.bayes:.0f}",
         f"{reduced(x.program, t.fit, x.program.fitted):.3g}",
         "-" if np.isnan(t.left_out) else f"{t.left_out:.3g}", f"{t.returned:.1f}",
         ", ".join(n.partition(".")[2] for n in t.fit.at_bound) or "-")
        for t in stage.trials
    ]  # fmt: skip
    header = (
        "candidate",
        "probability",
        "log Bayes factor",
        "chi2, fitted",
        "chi2, left out",
        "base (sd)",
        "at a bound",
    )
    beside = f" and {' and '.join(stage.base.slugs).replace('_', ' ')}" if stage.base.slugs else ""
    caption = f"Candidates for the first effect, fitted together with the model{beside}."
    chosen = [t.slug for t in stage.trials].index(x.first.slug)
    return html.table(header, rows, caption, chosen)


def _scores(conclusion: Conclusion) -> str:
    kind = conclusion.explanation.program.kind
    columns = {schema.quantity_and_unit(c)[0]: c for c in schema.KINDS[kind].columns.outputs}

    def cells(name: str, score: HeldOut) -> tuple[str, ...]:
        errors = [
            f"{from_si(v, schema.quantity_and_unit(columns[q])[1]):.4g}"
            for q, v in score.rmse.items()
            if q in columns
        ]
        return (name, *errors, f"{score.reduced_chi2:.3g}")

    names = [f"RMSE {columns[q]}" for q in conclusion.before.rmse if q in columns]
    rows = [cells("base model, refitted", conclusion.before), cells("with what was found", conclusion.after)]
    if len(conclusion.members) > 1:
        shares = ", ".join(f"{slug} {w:.2f}" for slug, w in conclusion.members.items())
        rows.append(cells(f"mean of explanations ({shares})", conclusion.mean))
    on = ", ".join(conclusion.before.on)
    table = html.table(("model", *names, "reduced chi2"), rows, f"On {on} ({conclusion.before.how}).")
    return table + _race(conclusion)


def _race(conclusion: Conclusion) -> str:
    """What was found against a correction without a name, on fitted recordings left out in turn."""
    generic, x = conclusion.generic, conclusion.explanation
    if generic is None or not x.final.slugs:
        return ""
    base, named = x.left_out
    return html.paragraph(
        f"Fitted recordings, each predicted without it: reduced chi-square {base:.3g} by "
        f"the base model, {named:.3g} with what was found, {generic.left_out:.3g} with a nameless smooth "
        f"function of {generic.driver.replace('_', ' ')} added to {generic.quantity.replace('_', ' ')}."
    )


def _base(conclusion: Conclusion) -> str:
    x, final = conclusion.explanation, conclusion.model[1]
    rows, specimens = [], list(dict.fromkeys(r.specimen for r in x.program.recordings))
    for k in x.program.unknowns.base:
        item = x.program.unknowns.items[k]
        shown = lambda v, item=item: f"{float(from_si(v, item.unit, item.unit == 'K')):.4g}"  # noqa: E731
        stem, _, number = item.name.partition(MARK)
        name = f"{stem} of {specimens[int(number) - 1]}" if number else stem
        alone, now = (f"{shown(item.value(u[k]))} ({u[k]:+.1f} sd)" for u in (x.base.u, final.u))
        rows.append((name, shown(item.reference), alone, now, item.unit))
    if not rows:
        return html.paragraph("The recordings state every constant as exact.")
    header = ("constant", "nominal", "refitted alone", "refitted with what was found", "unit")
    return html.table(
        header, rows, "A constant that comes home when an effect is added speaks for the effect."
    )
