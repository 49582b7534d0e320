"""Tables of a diagnosis: effects, candidates, errors on held-out recordings, constants of the base model."""

import numpy as np

from fitting.calibrate.open_constants import of_unfitted
from fitting.data.recordings import schema
from fitting.diagnose.evaluate.noise_used import noise_used
from fitting.diagnose.fit.base_fit import at_bound
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.fit.refit import at_an_end
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.diagnose.verdict.discrepancy import Discrepancy
from fitting.diagnose.verdict.held_out import HeldOut
from fitting.diagnose.verdict.probabilities import UNMODELLED, Found
from fitting.inference.notes import joined
from fitting.specimens.rows import of_specimen
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.model_discrepancy import unit_of
from pneusma_jax.units import constant_from_si, from_si

from ..cells import number, with_error, with_unit
from ..table import Table

NOT_FITTED = "as stated"
"""Text of a constant of a specimen of which no recording was fitted."""
NONE = "-"
"""Text of an empty cell."""
CANDIDATES = (
    "candidate", "probability", "log Bayes factor", "reduced chi2, fitted", "reduced chi2, cross-validated",
    "largest deviation (sd)", "at its bound",
)  # fmt: skip
NOISE = (
    "recordings", "column", "sd of a row", "stated sd", "fast scatter", "readings a row", "correlation",
)  # fmt: skip
NOISE_NOTE = (
    "Standard deviations are in the unit of the column. Where none is stated, it is told from neighbouring "
    "readings and what the fitted model leaves. Noise of inputs is added. The correlation is that of "
    "neighbouring rows. The fast scatter is what neighbouring readings alone say of a row, as if errors were "
    "independent. An estimate far above it may hold slow misfit: state the noise then."
)
DEPARTURE = (
    "In brackets: the departure from nominal, in standard deviations of what is known of the constant."
)
ROUNDING = 1e-9
"""Maximum distance of a knot from zero that is rounding, over the range of knots [1]."""
NOMINAL = (
    f"{DEPARTURE} A constant that returns to its nominal value when an effect is added is evidence for the "
    "effect."
)


def words_of(slug: str) -> str:
    """A name of the catalogue as words."""
    return slug.replace("_", " ")


def effect_table(conclusion: Conclusion, found: Found) -> Table:
    """Table of the parameters of an effect that was found."""
    items = {i.name: i for i in conclusion.explanation.program.unknowns.items if i.effect == found.slug}
    rows = []
    for name in in_order(found):
        item, entry = items[name], found.parameters[name]
        ends = " to ".join(number(float(item.value(end))) for end in (item.low, item.high))
        value = with_error(entry["value"], entry["sd"])
        rows.append([f"{name}: {item.text}", value, entry["unit"], ends])
    notes = [text_of_ends(conclusion, found), text_of_moving(conclusion)] if found.parameters else []
    note = " ".join(filter(None, notes))
    return Table(["parameter", "value ± standard error", "unit", "physical range"], rows, note)


def in_order(found: Found) -> list[str]:
    """Names of an effect's parameters. Numbers of a term stand together, the shortest time first.

    Terms of size 0 follow the others, since their times mean nothing.
    """
    there = found.parameters
    known = () if found.slug == UNMODELLED else CATALOGUE[found.slug].alike
    terms = [term for term in known if set(term) <= set(there)]
    terms.sort(key=lambda term: (not all(there[name]["value"] for name in term), there[term[0]]["value"]))
    of_terms = [name for term in terms for name in sorted(term)]
    return [*of_terms, *(name for name in there if name not in of_terms)]


def text_of_ends(conclusion: Conclusion, found: Found) -> str:
    """Sentences on parameters at an end of their range, and whether other errors count that; else empty."""
    program, fit = conclusion.model
    ends = [program.unknowns.items[k].name for k in at_an_end(program.unknowns, fit, found.slug)]
    if not ends or len(ends) == len(found.parameters):
        return ""
    one = len(ends) == 1
    each, it = ("is at an end of its range", "it") if one else ("are at ends of their ranges", "them")
    return (
        f"{'Parameter' if one else 'Parameters'} {joined(ends)} {each}. The other errors leave {it} open. "
        f"`pneusma characterise` holds {it} there, so its errors are smaller."
    )


def text_of_moving(conclusion: Conclusion) -> str:
    """Sentences on errors that count a form which is wrong somewhere; empty where nothing shows that."""
    beside = conclusion.moving
    if beside is None:
        return ""
    quantity, driver = (name.replace("_", " ") for name in (beside.quantity, beside.driver))
    return (
        f"The model leaves more than noise: a change of {quantity} with {driver} has a log Bayes factor of "
        f"{number(beside.bayes, '.0f')} beside it. Standard errors count how far each number moves when both "
        "are fitted together."
    )


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
    place = f"the place of {words_of(x.first.slug)}" if beside else "the first effect"
    note = (
        f"Candidates for {place}, fitted together with the model{beside}. Probability: that of being the "
        "strongest effect; that of acting at all stands above. Log Bayes factor: natural logarithm of how "
        "many times likelier the recordings are with it than without, averaged over all that its parameters "
        "may be. Largest deviation: of a constant of the base model from its nominal value."
        f"{_deflated(conclusion)}"
    )
    return Table(CANDIDATES, rows, note, [t.slug for t in step.candidates].index(x.first.slug))


def _deflated(conclusion: Conclusion) -> str:
    """A sentence on how much less misfit counts in log Bayes factors; empty where it counts as it is."""
    inflation = number(conclusion.explanation.inflation, ".2g")
    if inflation == "1":
        return ""
    return (
        f" In every log Bayes factor of this page misfit counts 1/{inflation} of what it would otherwise. "
        "For even the best of these models leaves more than noise, or its neighbouring errors are alike."
    )


def score_table(conclusion: Conclusion) -> Table:
    """Table of errors on held-out recordings, without and with the effects found."""
    kind = conclusion.explanation.program.kind

    def row(name: str, score: HeldOut) -> list[str]:
        errors = [number(error, ".4g") for error in score.by_column(kind).values()]
        return [name, *errors, number(score.reduced_chi2)]

    names = [f"RMSE {column}" for column in conclusion.before.by_column(kind)]
    rows = [row("base model, refitted", conclusion.before)]
    if conclusion.changed:
        rows.append(row("with what was found", conclusion.after))
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
        fast = NONE if one.fast_scatter is None else number(one.fast_scatter, ".3g")
        told = str(one.readings), number(one.correlation, ".2f")
        cells = one.column, number(one.sd, ".3g"), stated, fast, *told
        shared.setdefault(cells, []).append(one.recording)
    everywhere = len({one.recording for one in used})
    rows = [
        ["all" if len(names) == everywhere > 1 else ", ".join(names), *cells]
        for cells, names in shared.items()
    ]
    return Table(NOISE, rows, NOISE_NOTE)


def base_table(conclusion: Conclusion) -> Table:
    """Table of the base model's constants: nominal, refitted alone and, where any were found, with effects.

    A constant that nothing but its bound holds is marked. One of a specimen of which no recording is fitted
    is as stated.
    """
    x, final = conclusion.explanation, conclusion.model[1]
    unknowns, specimens = x.program.unknowns, [r.specimen for r in x.program.recordings]
    fits, header = [x.base], ["constant", "nominal", "refitted"]
    if final is not x.base:
        fits.append(final)
        header[2:] = ["refitted alone", "refitted with what was found"]
    held = [at_bound(unknowns, fit) for fit in fits]
    names = [unknowns.items[k].name for k in unknowns.base]
    aside = {name for own in of_unfitted(names, x.program.recordings).values() for name in own}
    rows = []
    for k in unknowns.base:
        item = unknowns.items[k]
        shown = lambda v, item=item: number(float(constant_from_si(v, item.unit)), ".4g")  # noqa: E731
        cells = [
            f"{shown(item.value(fit.u[k]))} ({fit.u[k]:+.1f} sd{', at its bound' * (item.name in bound)})"
            for fit, bound in zip(fits, held, strict=True)
        ]
        if item.name in aside:
            cells = [NOT_FITTED] * len(fits)
        rows.append([of_specimen(item.name, specimens), shown(item.reference), *cells, item.unit])
    return Table([*header, "unit"], rows, NOMINAL if final is not x.base else DEPARTURE)


def shown_knots(rest: Discrepancy) -> np.ndarray:
    """Knots of a discrepancy in the unit of its driver, zero where they are rounding; shape (knots,)."""
    return np.where(np.abs(rest.knots) < ROUNDING * np.ptp(rest.knots), 0.0, rest.knots)


def file_unit(quantity: str, kind: str) -> str:
    """Unit of a quantity in recordings of a kind; that of SI where they have no such column."""
    column = schema.column_of(kind, quantity)
    return unit_of(quantity) if column is None else schema.quantity_and_unit(column)[1]


def discrepancy_table(conclusion: Conclusion) -> Table:
    """Table of the model discrepancy at its knots."""
    rest, kind = conclusion.remainder, conclusion.explanation.program.kind
    unit, along = file_unit(rest.quantity, kind), file_unit(rest.driver, kind)
    header = [with_unit(rest.driver, along),
              with_unit(f"correction of {rest.quantity}", unit), with_unit("sd", unit)]  # fmt: skip
    values, sd = (from_si(x, unit, difference=True) for x in (rest.values, rest.sd))
    knots = zip(from_si(shown_knots(rest), along), values, sd, strict=True)
    return Table(header, [[number(x, ".4g"), number(y, ".4g"), number(sd, ".2g")] for x, y, sd in knots])
