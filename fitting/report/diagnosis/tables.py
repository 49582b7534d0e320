"""Tables of a diagnosis: effects, candidates, errors on held-out recordings, constants of the base model."""

import numpy as np

from fitting.diagnose.evaluate.noise_used import noise_used
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.diagnose.verdict.held_out import HeldOut
from fitting.diagnose.verdict.probabilities import Found
from fitting.inference.notes import joined
from fitting.specimens.rows import MARK
from pneusma_jax.model_discrepancy import unit_of
from pneusma_jax.units import from_si

from ..cells import number, with_unit
from ..table import Table

NONE = "-"
"""Text of an empty cell."""
CANDIDATES = (
    "candidate", "probability", "log Bayes factor", "chi2, fitted", "chi2, cross-validated",
    "largest deviation (sd)", "at its bound",
)  # fmt: skip
NOISE = ("recordings", "column", "sd of a row", "stated sd", "readings a row", "correlation")
NOISE_NOTE = (
    "Standard deviations are in the unit of the column. Where none is stated, it is told from neighbouring "
    "readings and what the fitted model leaves. Noise of inputs is added. The correlation is that of "
    "neighbouring rows."
)
NOMINAL = "A constant that returns to its nominal value when an effect is added is evidence for the effect."


def words_of(slug: str) -> str:
    """A name of the catalogue as words."""
    return slug.replace("_", " ")


def effect_table(conclusion: Conclusion, found: Found) -> Table:
    """Table of the parameters of an effect that was found."""
    items = {i.name: i for i in conclusion.explanation.program.unknowns.items if i.effect == found.slug}
    rows = []
    for name, entry in found.parameters.items():
        item = items[name]
        ends = " to ".join(number(float(item.value(end))) for end in (item.low, item.high))
        sd = number(entry["sd"], ".2g")
        rows.append([item.text, number(entry["value"], ".4g"), sd, entry["unit"], ends])
    return Table(["parameter", "value", "standard error", "unit", "physical range"], rows)


def candidate_table(conclusion: Conclusion) -> Table:
    """Table of every fitted candidate for the first effect; no rows where none was fitted."""
    x, step = conclusion.explanation, conclusion.explanation.leading
    if step is None or not step.candidates:
        return Table(CANDIDATES, [])
    rows = [
        [
            words_of(t.slug), number(conclusion.candidates[t.slug][0], ".3f"), number(t.bayes, ".0f"),
            number(reduced(x.program, t.fit, x.program.fitted)),
            NONE if np.isnan(t.left_out) else number(t.left_out), number(t.largest_deviation_sd, ".1f"),
            ", ".join(n.partition(".")[2] for n in t.fit.at_bound) or NONE,
        ]
        for t in step.candidates
    ]  # fmt: skip
    beside = f" and {joined([words_of(slug) for slug in step.base.slugs])}" if step.base.slugs else ""
    note = (
        f"Candidates for the first effect, fitted together with the model{beside}. Log Bayes factor: natural "
        "logarithm of how many times likelier the recordings are with it than without, averaged over all "
        "that its parameters may be. Largest deviation: of a constant of the base model from its nominal "
        "value."
    )
    return Table(CANDIDATES, rows, note, [t.slug for t in step.candidates].index(x.first.slug))


def score_table(conclusion: Conclusion) -> Table:
    """Table of errors on held-out recordings, without and with the effects found."""
    kind = conclusion.explanation.program.kind

    def row(name: str, score: HeldOut) -> list[str]:
        errors = [number(error, ".4g") for error in score.by_column(kind).values()]
        return [name, *errors, number(score.reduced_chi2)]

    names = [f"RMSE {column}" for column in conclusion.before.by_column(kind)]
    rows = [row("base model, refitted", conclusion.before), row("with what was found", conclusion.after)]
    if len(conclusion.members) > 1:
        shares = ", ".join(f"{slug} {weight:.2f}" for slug, weight in conclusion.members.items())
        rows.append(row(f"mean of explanations ({shares})", conclusion.mean))
    note = f"On {', '.join(conclusion.before.on)} ({conclusion.before.how})."
    return Table(["model", *names, "reduced chi2"], rows, note)


def noise_table(conclusion: Conclusion) -> Table:
    """Table of the noise that every output is judged by; recordings with the same noise share a row."""
    shared: dict[tuple[str, ...], list[str]] = {}
    used = noise_used(conclusion.explanation.program)
    for one in used:
        stated = NONE if one.stated is None else number(one.stated, ".3g")
        cells = one.column, number(one.sd, ".3g"), stated, str(one.readings), number(one.correlation, ".2f")
        shared.setdefault(cells, []).append(one.recording)
    everywhere = len({one.recording for one in used})
    rows = [
        ["all" if len(names) == everywhere > 1 else ", ".join(names), *cells]
        for cells, names in shared.items()
    ]
    return Table(NOISE, rows, NOISE_NOTE)


def base_table(conclusion: Conclusion) -> Table:
    """Table of the base model's constants: nominal, refitted alone, refitted with the effects found."""
    x, final = conclusion.explanation, conclusion.model[1]
    rows, specimens = [], list(dict.fromkeys(r.specimen for r in x.program.recordings))
    for k in x.program.unknowns.base:
        item = x.program.unknowns.items[k]
        shown = lambda v, item=item: number(float(from_si(v, item.unit, item.unit == "K")), ".4g")  # noqa: E731
        stem, _, owner = item.name.partition(MARK)
        name = f"{stem} of {specimens[int(owner) - 1]}" if owner else stem
        alone, now = (f"{shown(item.value(u[k]))} ({u[k]:+.1f} sd)" for u in (x.base.u, final.u))
        rows.append([name, shown(item.reference), alone, now, item.unit])
    header = ["constant", "nominal", "refitted alone", "refitted with what was found", "unit"]
    return Table(header, rows, NOMINAL)


def discrepancy_table(conclusion: Conclusion) -> Table:
    """Table of the model discrepancy at its knots."""
    rest = conclusion.remainder
    header = [with_unit(rest.driver, unit_of(rest.driver)),
              with_unit(f"correction of {rest.quantity}", unit_of(rest.quantity)), "sd"]  # fmt: skip
    knots = zip(rest.knots, rest.values, rest.sd, strict=True)
    return Table(header, [[number(x, ".4g"), number(y, ".4g"), number(sd, ".2g")] for x, y, sd in knots])
